"""Gaits carried over to other values, along the branches that connect them."""

from __future__ import annotations

from dataclasses import dataclass

from flexspine.gaits.continuation import Branch, trace_branch
from flexspine.gaits.family import FOLD
from flexspine.gaits.gait import Gait
from flexspine.gaits.stability import Stability, floquet_multipliers
from flexspine.hybrid.compile import Array

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


@dataclass(frozen=True)
class Line:
    """Gaits of one family over values of one quantity: a branch, or one gait at one value.

    ``reached`` are the lowest and the highest value at which there is a gait.
    """

    gait: Gait
    value: float
    branch: Branch | None
    reached: tuple[float, float]

    @classmethod
    def through(cls, gait: Gait, over: str, values: Array, symmetric: bool | None) -> Line:
        """Follow a gait from the value next to its own to all others. Raises `LostGaitError`."""
        low, high = float(values.min()), float(values.max())
        here = {**gait.model.numbers, **gait.quantities}[over]
        nearest = min(max(here, low), high)
        gait = carried(gait, over, nearest)
        if low == high:
            return cls(gait, nearest, None, (nearest, nearest))
        branch = trace_branch(
            gait, over, bounds=(low, high), symmetric=symmetric, longest_step=STEP
        )
        known = [point.value for point in branch.points] + [m.value for m in branch.landmarks]
        return cls(gait, nearest, branch, (min(known), max(known)))

    def at(self, value: float) -> tuple[Gait, Stability] | None:
        """The gait at a value, if there is one, and its stability."""
        if self.branch is None:
            return self.gait, floquet_multipliers(self.gait)
        points = self.branch.at(value)
        return (points[0].gait, points[0].stability) if points else None

    @property
    def end(self) -> str:
        """Why it leads no further."""
        if self.branch is None:
            return ""
        turns = [
            f"it turns at {self.branch.over} = {mark.value:.6g}"
            for mark in self.branch.landmarks
            if mark.kind == FOLD
        ]
        return "; ".join(dict.fromkeys([*turns, *self.branch.ends]))
