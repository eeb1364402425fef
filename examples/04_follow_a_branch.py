"""
Follow a branch
===============

What becomes of a gait as the spine gets softer or stiffer? The published gait is followed over
spine stiffness at the same energy, apex height and speed, through a fold at which it turns round,
to where it ends. The picture shows peak force, spectral radius and all that happens on the way.
"""

import matplotlib.pyplot as plt

from flexspine import examine, load_model, trace_branch

gait = examine(load_model("kamimura2015-flexible"))
branch = trace_branch(gait, "spine.stiffness", bounds=(20, 2000))
for mark in branch.landmarks:
    print(f"k_t = {mark.value:5.1f} N m/rad: {mark.kind}")

# %%
# The family ends where the fore leg lands at the apex already, and where it would touch down
# twice; the fold between is its softest spine. From there to the first end each spine has two of
# its gaits. None is stable: the radius stays above 1, though least at a moderate stiffness.
best = min(branch.points, key=lambda point: point.stability.level_spectral_radius)
print(f"least unstable: k_t = {best.value:.0f}, radius {best.stability.level_spectral_radius:.3f}")

# %%
# ``flexspine branch --over spine.stiffness --from 20 --to 2000 --out branch`` does the same, keeps
# every step, and adds a table and the touchdown angles.
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
measures = {
    "peak force (N per leg pair)": lambda point: point.gait.peak_grf["fore"],
    "spectral radius; stable below 1": lambda point: point.stability.level_spectral_radius,
}
figure, panels = plt.subplots(2, 1, figsize=(8.5, 6), sharex=True, layout="constrained")
for axes, (label, measure) in zip(panels, measures.items(), strict=True):
    axes.plot([p.value for p in branch.points], [measure(p) for p in branch.points], color="0.3")
    for number, kind in enumerate(dict.fromkeys(mark.kind for mark in branch.landmarks)):
        at = [mark.at for mark in branch.landmarks if mark.kind == kind]
        look = {"marker": "sDoPv^X*"[number % 8], "markersize": 9, "fillstyle": "none"}
        axes.plot([p.value for p in at], [measure(p) for p in at], linestyle="", label=kind, **look)
    axes.set_ylabel(label)
panels[0].set_title("A branch of gaits at 290 J, apex height 0.32 m and 4.5 m/s")
panels[1].axhline(1, color="0.6", linestyle="--")
panels[1].set_xlabel("spine stiffness $k_t$, on the relative angle (N m/rad)")
figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
figure.savefig("follow_a_branch.png")
