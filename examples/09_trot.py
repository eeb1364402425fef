"""
Trot
====

Does the spine matter to a robot that trots under computed torque? Ten links, eight motors and a
torsional spine trot from standing on diagonal pairs of legs, once with the robot's own spine and
once with one half as stiff. The picture shows a hip, its torque, and how far the joints of both
runs are apart.
"""

import matplotlib.pyplot as plt

from flexspine import Trot, load_robot, robot_dataset, summarize_walk, trot

data = {}
for stiffness in (240, 120):  # N m/rad
    robot = load_robot("sc618", {"spine.stiffness": stiffness})
    run = trot(robot, Trot(seconds=3))
    walk = summarize_walk(run)
    data[stiffness] = robot_dataset(run)
    print(f"k_t = {stiffness} N m/rad: {run.outcome}, {walk.speed:.3f} m/s,", end=" ")
    print(f"torques up to {walk.torque:.1f} N m")

# %%
# The motion is the same, to rounding: two feet on the ground and eight joints that follow their
# references fix the angle of the spine too. Its spring shows in torques alone.
apart = abs(data[240].angle - data[120].angle).max("joint")
torques = abs(data[240].torque - data[120].torque)
print(f"joints differ by {float(apart.max()):.0e} rad, torques by {float(torques.max()):.2f} N m")

# %%
# To compare spines under this controller is to compare nothing. ``flexspine trot --compare`` takes
# two under which the spine moves; ``flexspine trot --out trot`` draws all that there is to a trot.
plt.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
figure, panels = plt.subplots(3, 1, figsize=(8.5, 6), sharex=True, layout="constrained")
for (stiffness, run), look in zip(data.items(), ({"lw": 3}, {"ls": "--"}), strict=True):
    label = f"$k_t$ = {stiffness} N m/rad"
    hip = run.sel(joint="hip_1", motor="hip_1")
    panels[0].plot(run.time, hip.angle, label=label, **look)
    panels[1].plot(run.time, hip.torque, label=label, **look)
panels[2].semilogy(run.time, apart.where(apart > 0), color="0.3")
panels[0].set(ylabel="angle of a hip (rad)", title="sc618 trots from standing to 0.3 m/s")
figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", frameon=False)
panels[1].set(ylabel="its torque (N m)")
panels[2].set(ylabel="largest difference\nof all joints (rad)", xlabel="time (s)", ylim=(1e-17, 1))
figure.savefig("trot.png")
