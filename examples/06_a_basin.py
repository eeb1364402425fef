"""
A basin
=======

From how far away do starts come to a stable gait? Those about the bound of the rigid robot
Scout II differ in pitch and pitch rate at the apex. The picture shows for each how many strides
it makes and, below, how far from the gait it is after the last.
"""

from tempfile import TemporaryDirectory

from flexspine import basin_plan, examine, load_model, plot_basin, read_basins, sweep

gait = examine(load_model("scout2"))
plan = basin_plan({"scout2": gait}, points=24, strides=60)

# %%
# A sweep keeps its rows in a directory, and goes on from there if it is interrupted; here they
# are not needed for long. It would take ``processes=2`` to use two cores.
with TemporaryDirectory() as folder:
    done = sweep(plan, folder)
    (basin,) = read_basins(folder)
counts = basin.row()
print(f"{done.rows} starts, {done.strides} strides")
for name in ("fell_in_the_first_stride", "lasted", "settled", "not_settled"):
    print(f"{name.replace('_', ' ')}: {counts[name] / counts['starts']:.1%}")

# %%
# Passive animals keep their energy, so that a start with more or less of it could never come to
# this gait; the apex speed makes up for what the pitch rate adds. To last is not yet to come to
# the gait: some starts settle on another. ``flexspine basin --out basin`` tries 100 times 100
# starts about each of four gaits, for 100 strides.
plot_basin([basin]).savefig("a_basin.png")
