"""
Trot in space
=============

How does the same robot trot in three dimensions? MuJoCo (``pip install 'flexspine[engine]'``) runs
it from the same description, with a third motor for each leg and ground that gives. Coupled
oscillators draw its joints; nothing senses the ground. The picture shows the last four strides.
"""

from flexspine import (
    Walker,
    load_robot,
    load_walk,
    plot_robot,
    run_in_space,
    space_dataset,
    summarize_space,
)

robot = load_robot("sc618")
walker = Walker("sc618", robot, load_walk("trot", robot.name))
runs = {
    "flexible": run_in_space(walker.robot, walker.walk, seconds=3),
    "locked": run_in_space(walker.with_locked_spine().robot, walker.walk, seconds=3),
}
print(f"asked for {walker.numbers['gait.speed']:.3f} m/s")
for name, run in runs.items():
    walk = summarize_space(run)
    print(f"{name}: {run.outcome}, {walk.speed:.3f} m/s, largest force {walk.peak_normal:.0f} N")
    print(f"  cost of transport {walk.cost_of_transport:.3f},", end=" ")
    print(f"{walk.contact_loss:.1f} J lost to the ground in a stride")

# %%
# The locked spine loses more to the ground here. One walk each proves nothing, as landings are
# a matter of chance: ``flexspine spines --out spines`` lets the robot walk 72 times, with noise.
plot_robot(space_dataset(runs["flexible"])).savefig("trot_in_space.png")
