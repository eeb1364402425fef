"""
A damped gait
=============

Can a bounder be stable by itself? A damper in the spine takes energy at every stride; legs give
it back that get longer by some millimetres between their greatest compression and lift-off. The
picture follows gaits without and with both over spine stiffness, and two animals that start too
high.
"""

import matplotlib.pyplot as plt

from flexspine import examine, load_model, simulate, trace_branch

published = examine(load_model("kamimura2015-flexible"))
passive = trace_branch(published, "spine.stiffness", bounds=(140, 260))
thrust = ["legs.extension"]  # what is set free takes the value that the gait needs
damping = trace_branch(published, "spine.damping", bounds=(0, 1), free=thrust)
start = damping.at(1)[0].gait  # N m s/rad
damped = trace_branch(start, "spine.stiffness", bounds=(140, 260), free=thrust)
best = min(damped.points, key=lambda point: point.stability.spectral_radius)
stable = [point.value for point in damped.points if point.stability.stable]
print(f"with the damper stable from some {min(stable):.0f} to {max(stable):.0f} N m/rad")
print(f"most stable at {best.value:.0f} N m/rad: radius {best.stability.spectral_radius:.3f}")
print(f"legs get longer by {1e3 * best.gait.model.numbers['legs.extension']:.2f} mm")
print(f"cost of transport {best.gait.summary.cost_of_transport:.4f}")

# %%
# Both animals have that spine and start 3 mm too high. Nothing senses it, and nothing is steered.
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
figure, (over, course) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
lines = {
    "passive": (passive, passive.at(best.value)[0].gait, "#0072B2"),
    "damper and thrust": (damped, best.gait, "#009E73"),
}
for name, (branch, gait, color) in lines.items():
    radii = [point.stability.level_spectral_radius for point in branch.points]
    over.plot([point.value for point in branch.points], radii, color=color, label=name)
    apex, units = gait.model.apex, gait.model.scales
    higher = gait.model.with_values(apex={"height": apex["height"] + 0.003})
    run = simulate(higher, strides=150)
    print(f"{name}: {run.outcome}")
    off = [max(abs(now[n] - apex[n]) / units[n] for n in apex) for now in run.apexes]
    course.semilogy(off, color=color, label=name)

# %%
# A passive animal keeps the energy it is given, so that even a stable one could not come back.
# Stability has its price, which is work, and is rare: of this branch only these few spines have
# it. ``flexspine study`` follows damped gaits at three speeds.
over.axhline(1, color="0.6", linestyle="--", label="stable below")
over.set(xlabel="spine stiffness $k_t$, on the relative angle (N m/rad)", ylabel="spectral radius")
over.set_title("Gaits at 4.5 m/s; the damper has $c_t$ = 1 N m s/rad")
over.legend(frameon=False)
course.set(xlabel="strides", ylabel="deviation from the gait (natural units)")
course.set_title(f"Starts 3 mm too high, $k_t$ = {best.value:.0f} N m/rad")
course.legend(frameon=False)
figure.savefig("a_damped_gait.png")
