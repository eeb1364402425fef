"""
First stride
============

How does a quadruped with a flexible spine bound? A preset holds a body, the apex at which it
starts and the angles at which its legs land; one call runs it from one apex to the next. The
picture shows nine postures of that stride: the spine bends, the fore legs stand (FS), then the
hind legs (HS), with flight between (DF). Arrows are the forces of the ground.
"""

from flexspine import load_model, simulate, strip, summarize, to_dataset

model = load_model("kamimura2015-flexible")
run = simulate(model)
summary = summarize(run)
print("phases:", " ".join(run.phases))
print(f"period {summary.period:.6f} s, stride {summary.stride_length:.4f} m")
print(f"peak force {summary.peak_grf['fore']:.1f} N on a pair of legs")

# %%
# This stride is a gait: it ends at the apex at which it began, but for rounding.
first, last = run.apexes
print(f"misses its start by {max(abs(last[name] - first[name]) for name in first):.0e} (SI units)")

# %%
# A stride that returns is not yet one that lasts. Rounding errors grow by a third from stride to
# stride, and after about a hundred strides the animal falls: the gait is exact, and unstable.
long = simulate(model, strides=200)
print(f"{len(long.apexes) - 1} of 200 strides: {long.outcome}")

# %%
# Every quantity over time is in the data set, with its unit, and pictures are made of that.
# ``flexspine bound --out run`` does all this in one command and adds an animation.
data = to_dataset(run)
strip(data).savefig("first_stride.png")
