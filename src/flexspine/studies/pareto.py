"""Pareto fronts of gaits, certified, and what one has over another."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.stability import Stability, floquet_multipliers
from flexspine.models.model import Model
from flexspine.studies.objectives import COST, OBJECTIVES, PEAK_GRF, RADIUS

# Relative; what is worse by no more is as good, as optimisers know it no better.
EQUAL = 1e-6

# Of the initial energy; what may be missing from the balance of a certified gait.
BALANCED = 1e-10

# Relative; a gain below that is none to speak of.
NOTHING = 1e-3


@dataclass(frozen=True)
class FrontPoint:
    """A gait of a front, simulated anew from nothing but its model."""

    gait: Gait
    stability: Stability

    @cached_property
    def values(self) -> dict[str, float]:
        """Every objective by name, minimised or not."""
        return {
            PEAK_GRF: max(self.gait.peak_grf.values()),
            COST: self.gait.summary.cost_of_transport or 0.0,
            RADIUS: self.stability.level_spectral_radius,
        }


def certify(model: Model, tolerance: float) -> FrontPoint | str:
    """Simulate a gait anew; if that does not bear it out, tell why."""
    gait = examine(model, tolerance=tolerance)
    if gait.doubt is not None:
        return gait.doubt
    drift = gait.summary.energy["relative_drift"]
    if drift is None or drift > BALANCED:
        return f"its energy does not balance, by {drift} of itself"
    return FrontPoint(gait, floquet_multipliers(gait))


@dataclass(frozen=True)
class Front:
    """The gaits of one kind of spine of which none is better in both objectives than another.

    ``points`` are in order of the second objective. ``refused`` tells of gaits that were found but
    not borne out.
    """

    spine: str
    minimise: tuple[str, str]
    points: tuple[FrontPoint, ...]
    refused: tuple[str, ...] = ()

    @classmethod
    def of(cls, spine: str, minimise: tuple[str, str], found: Iterable[FrontPoint | str]) -> Front:
        """The front of some gaits."""
        known = list(found)
        points: list[FrontPoint] = []
        first, second = minimise
        sound = [point for point in known if isinstance(point, FrontPoint)]
        for point in sorted(sound, key=lambda each: (each.values[second], each.values[first])):
            if not points or point.values[first] < points[-1].values[first] * (1 - EQUAL):
                points.append(point)
        refused = tuple(text for text in known if isinstance(text, str))
        return cls(spine, minimise, tuple(points), refused)

    def least(self, goal: str, limit: float) -> FrontPoint | None:
        """The point with least ``goal`` while the other objective is within a limit."""
        inside = [p for p in self.points if p.values[self.other(goal)] <= limit * (1 + EQUAL)]
        return min(inside, key=lambda point: point.values[goal], default=None)

    def other(self, name: str) -> str:
        """The other one of the two objectives."""
        first, second = self.minimise
        return second if name == first else first

    def reach(self, name: str) -> tuple[float, float]:
        """Least and largest value of an objective on the front."""
        found = [point.values[name] for point in self.points]
        return min(found), max(found)


def gains(front: Front, better: Front, goal: str) -> list[float]:
    """By which share a better front lowers ``goal``, for every point of the first one.

    The other objective is no larger than at that point.
    """
    found = []
    for point in front.points:
        least = better.least(goal, point.values[front.other(goal)])
        if least is not None and point.values[goal] > 0:
            found.append(1 - least.values[goal] / point.values[goal])
    return found


def told(constant: Front, by_phase: Front) -> str:
    """What stiffness by phase buys, in a sentence."""
    if not (constant.points and by_phase.points):
        kind = constant if constant.points else by_phase
        return f"Only {kind.spine} stiffness has gaits here, so there is nothing to compare."
    parts = [_bought(constant, by_phase, goal) for goal in constant.minimise]
    first, second = (OBJECTIVES[name] for name in constant.minimise)
    (low, _), (high, _) = (front.reach(first.name) for front in (by_phase, constant))
    if low < high * (1 - NOTHING):
        price = second.told(by_phase.points[-1].values[second.name])
        parts.append(
            f"it reaches down to {first.told(low)} (at {second.label} {price}), "
            f"constant stiffness to {first.told(high)}"
        )
    if RADIUS not in constant.minimise:
        spread = ["{:.3g} to {:.3g}".format(*f.reach(RADIUS)) for f in (by_phase, constant)]
        stable = sum(point.stability.stable for point in by_phase.points)
        parts.append(
            f"its gaits have spectral radii of {spread[0]} ({stable or 'none'} of them stable), "
            f"those of constant stiffness {spread[1]}"
        )
    return f"Stiffness by phase: {'; '.join(parts)}."


def _bought(constant: Front, by_phase: Front, goal: str) -> str:
    found = gains(constant, by_phase, goal)
    label, bound = OBJECTIVES[goal].label, OBJECTIVES[constant.other(goal)].label
    if max(found, default=0.0) < NOTHING:
        return f"at no higher {bound} it buys nothing in {label}"
    none = sum(share < NOTHING for share in found)
    told = f"at no higher {bound} it lowers the least {label} by up to {100 * max(found):.1f} %"
    return f"{told} (by nothing at {none} of {len(found)} gaits)" if none else told
