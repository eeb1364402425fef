"""Guards that touch zero without crossing it.

Root isolation cannot tell such a touch from a miss: both crossings coincide within rounding
error. A recorded arc is searched for it afterwards.
"""

from __future__ import annotations

import numpy as np

from flexspine.hybrid.bound import BoundMode
from flexspine.hybrid.compile import Array
from flexspine.hybrid.trajectory import Arc

# Guard units; a dip this deep is crossed at about the grazing rate when the guard's second
# derivative is that of a body in free fall.
GRAZING_DEPTH = 5e-10

# A minimum estimated above this between two steps is no candidate, below it the exact one is found.
ESTIMATE_MARGIN = 1e-3


def touches_without_crossing(arc: Arc, mode: BoundMode) -> tuple[str, float] | None:
    """Return the first guard that comes within GRAZING_DEPTH of zero and turns, and when (s)."""
    times = arc.times
    table = mode.evaluate_many(arc(times), arc.held)
    found: list[tuple[float, str]] = []
    for jump in mode.code.jumps:
        if not jump.guard.jumps:
            continue
        values, rates = table[jump.value], table[jump.rate]
        # A guard that is at zero when the arc begins has fired there or was let go there.
        turns = (
            (rates[:-1] < 0) & (rates[1:] > 0) & (values[:-1] > GRAZING_DEPTH) & (values[1:] > 0)
        )
        for k in np.flatnonzero(turns):
            # The tangents at both ends bound a convex dip from below.
            step = times[k + 1] - times[k]
            floor = max(values[k] + rates[k] * step, values[k + 1] - rates[k + 1] * step)
            if floor > ESTIMATE_MARGIN:
                continue
            time, value = _lowest(arc, mode, jump.value, jump.rate, times[k], times[k + 1])
            if value <= GRAZING_DEPTH:
                found.append((time, jump.guard.name))
    if not found:
        return None
    time, name = min(found)
    return name, time


def _lowest(
    arc: Arc, mode: BoundMode, value: int, rate: int, left: float, right: float
) -> tuple[float, float]:
    """Bisect for the guard's minimum, where its rate turns positive."""

    def at(time: float) -> Array:
        return mode.evaluate(arc(np.array([time]))[0], arc.held)

    while (middle := (left + right) / 2) not in (left, right):
        if at(middle)[rate] < 0:
            left = middle
        else:
            right = middle
    return left, float(at(left)[value])
