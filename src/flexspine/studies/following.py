"""Gaits carried over to other values, along the branches that connect them."""

from __future__ import annotations

from flexspine.gaits.continuation import trace_branch
from flexspine.gaits.gait import Gait

# Natural units; branches are drawn from their points, so that these have to lie close.
STEP = 0.1

# Relative; a gait this close to a value has it.
SAME = 1e-9


class LostGaitError(Exception):
    """There is no gait where one was looked for; the text tells why."""


def carried(gait: Gait, over: str, value: float) -> Gait:
    """The gait of the same family at another value of ``over``. Raises `LostGaitError`."""
    here = {**gait.model.numbers, **gait.quantities}[over]
    if abs(here - value) <= SAME * abs(value):
        return gait
    found = trace_branch(gait, over, bounds=(min(here, value), max(here, value)), longest_step=STEP)
    points = found.at(value)
    if not points:
        raise LostGaitError("; ".join(found.ends))
    return points[0].gait
