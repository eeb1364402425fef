"""
Choose a spine
==============

Which spine stiffness is best? The published gait is followed over mean speed, with one stiffness
after the other, at the same energy and apex height. The picture maps peak force and stability
over both.
"""

from tempfile import TemporaryDirectory

import numpy as np

from flexspine import examine, load_model, map_plan, plot_map, read_map, sweep

gait = examine(load_model("kamimura2015-flexible"))
plan = map_plan(gait, stiffnesses=(200, 280), speeds=(4.3, 4.54), lines=5, points=13)
with TemporaryDirectory() as folder:
    sweep(plan, folder)
    found = read_map(folder)
print(f"{found.found} gaits, {found.stable} of them stable")

# %%
# Stiffnesses are of a spring on the relative angle of both halves; forces are those on a pair of
# legs, whichever pair bears more. By speed, the least force and the least spectral radius:
for at in range(0, len(found.speeds), 2):
    peaks, radii = found.peak_grf[:, at], found.radius[:, at]
    softly, steadily = (found.stiffnesses[np.argmin(values)] for values in (peaks, radii))
    print(f"{found.speeds[at]:.2f} m/s: {peaks.min():.0f} N with k_t = {softly:.0f},", end=" ")
    print(f"radius {radii.min():.2f} with k_t = {steadily:.0f} N m/rad")

# %%
# The stiffest spine bears the least force at every speed; which one is the least unstable changes
# with speed, and none is stable. There is no best spine before one says what for, and how fast.
# ``flexspine map --out map`` follows 29 stiffnesses from 180 to 320 N m/rad over 2.4 to 4.7 m/s.
plot_map(found).savefig("choose_a_spine.png")
