"""How fast joints may turn before a run is given up."""

from __future__ import annotations

import sympy as sp

from flexspine.hybrid.outcome import OutcomeKind
from flexspine.hybrid.system import Guard
from flexspine.mechanics.linkage_motion import LinkageMotion

# rad/s; no motor of a legged robot turns as fast.
FASTEST = 200.0

OUT_OF_CONTROL = OutcomeKind(
    "out_of_control",
    "joints turn faster than any motor; push less, walk more slowly, allow more friction, or, if "
    "torques are sampled, sample more often or lower the law's stiffness and damping",
)


def speed_guard(motion: LinkageMotion) -> Guard:
    """The end of a run in which links turn too fast; its expression is 1 at rest."""
    squares = sp.Add(*(rate**2 for rate in motion.rates[:-2]))
    return Guard("joints too fast", 1 - squares / FASTEST**2, ends=OUT_OF_CONTROL)
