"""
Find a gait
===========

Which gaits does one body have at a given energy, apex height and speed? A search starts from
random apexes and touchdown angles and lets Newton's method close the stride. The picture has a
row for each gait found: forces on the fore and the hind legs over a stride, from apex to apex.
"""

import matplotlib.pyplot as plt

from flexspine import find_gaits, floquet_multipliers, load_model, to_dataset

model = load_model("kamimura2015-flexible", {"spine.stiffness": 240})
wanted = {"energy": 290, "height": 0.32, "mean_speed": 4.25}  # J, m, m/s
search = find_gaits(model, wanted, starts=40, seed=0)
print(search.advice)

# %%
# Every gait is run once more before it is believed. The spectral radius is by how much a deviation
# grows in a stride: none of them is stable. Phases are flight (DF) and stance of the fore legs
# (FS), of the hind legs (HS) and of both (DS).
gaits = sorted(search, key=lambda gait: gait.peak_grf["fore"])
told = []
for gait in gaits:
    radius = floquet_multipliers(gait).level_spectral_radius
    told.append(f"peak {gait.peak_grf['fore']:.0f} N, spectral radius {radius:.2f}")
    print(f"{told[-1]}: {gait.family}")
print(f"none misses its start by more than {max(gait.residual for gait in gaits):.0e}")

# %%
# The published study is about those that land on the fore legs first, with the spine sagging at
# the apex and flight between the stances; here are two, of 660 and 777 N. A search finds what
# its starts lead to and cannot prove that there is nothing else. ``flexspine gait`` takes 100
# starts of symmetric gaits and as many of others, in place of 40.
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
figure, panels = plt.subplots(
    len(gaits), 1, figsize=(8.5, 1 + 0.75 * len(gaits)), sharex=True, sharey=True,
    squeeze=False, layout="constrained",
)  # fmt: skip
for axes, gait, text in zip(panels.flat, gaits, told, strict=True):
    data = to_dataset(gait.run)
    for side, color in {"fore": "#0072B2", "hind": "#D55E00"}.items():
        axes.fill_between(data.time, data[f"{side}_grf"], color=color, lw=0, label=f"{side} legs")
    axes.axvline(gait.period, color="0.6", linewidth=1)
    names = gait.family.replace(", ", "\n")
    axes.text(1.02, 0.5, f"{names}\n{text}", transform=axes.transAxes, va="center", fontsize=8)
panels[-1, 0].set_xlabel("time (s); grey lines: the next apex")
figure.supylabel("ground reaction force (N per leg pair)")
figure.suptitle("Gaits at 290 J, apex height 0.32 m and 4.25 m/s; $k_t$ = 240 N m/rad")
figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower right", ncols=2)
figure.savefig("find_a_gait.png")
