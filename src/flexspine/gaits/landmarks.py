"""Where something happens on a branch: located between two of its points, and labelled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np

from flexspine.gaits.family import (
    BRANCHING,
    DOUBLING,
    FOLD,
    NEIMARK_SACKER,
    UNIT,
    BranchPoint,
    Family,
    Refuted,
)
from flexspine.gaits.gait import Gait, contact_times
from flexspine.gaits.newton import Slice
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import GRAZED
from flexspine.hybrid.trajectory import Trajectory

# Natural units along the branch; what happens is located to this. A change of contacts is known to
# 1e-6 only: next to it half a stride is half done within no time, and there is no solving for it.
LOCATED = 1e-9

# Relative, of brentq; so fine that LOCATED decides.
FINEST = 1e-12

# Where an interval is cut in turn: at the very place that is looked for there may be no solution.
SHARES = (0.5, 0.35, 0.65)

# How far from the unit circle a multiplier may be found that is said to cross it; a test function
# also vanishes where two real multipliers are reciprocal.
ON_CIRCLE = 1e-4

SYMMETRY_BREAKING, CONTACTS = "symmetry breaking", "contact order"
SECOND_TOUCHDOWN, REFUTED = "second touchdown", "not a gait"
GRAZING, NO_FLIGHT = "grazing", "no flight at the apex"

# Natural units; how far beyond a tear to look. Up to the second, what differs is torn and no more.
BEYOND, NEAR = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3), 1e-5

# s; over the shortest step of a branch no event moves by as much, unless the motion is torn.
TORN = 1e-3

# Of its energy; a gait that loses and gains no more keeps it.
KEPT = 1e-12

# s; a touchdown this soon after the apex is at the apex.
AT_APEX = 1e-6


@dataclass(frozen=True)
class Landmark:
    """Something that happens on a `Branch`.

    ``kind`` is ``fold``, ``branch point``, ``symmetry breaking``, ``period doubling``,
    ``Neimark-Sacker``, ``multiplier +1``, ``contact order``, ``second touchdown``, ``grazing``,
    ``no flight at the apex`` or ``not a gait``; ``detail`` says it in words. ``at`` is the last
    point of the branch up to it, in natural units a gait to within 1e-9 of the place (1e-6 for
    ``contact order``).
    """

    kind: str
    detail: str
    at: BranchPoint

    @property
    def value(self) -> float:
        """Where, in the quantity that the branch is followed in (SI)."""
        return self.at.value


class Segment:
    """The piece of a branch between two of its points, reached by slices across the chord."""

    def __init__(self, family: Family, first: BranchPoint, last: BranchPoint) -> None:
        self.family, self.first, self.last = family, first, last
        chord = last.point - first.point
        self.length = float(np.linalg.norm(chord))
        self.direction = chord / self.length

    def at(self, distance: float) -> BranchPoint | None:
        """The gait on the slice at a distance along the chord, if there is one."""
        if distance <= 0:
            return self.first
        if distance >= self.length:
            return self.last
        anchor = self.first.point + distance * self.direction
        attempt = self.family.correct(self.curved(distance), Slice(self.direction, anchor))
        if not attempt.solved:
            return None
        point = self.family.visit(attempt, self.direction)
        return point if isinstance(point, BranchPoint) else None

    def curved(self, distance: float) -> Array:
        """A cubic through both points along their tangents."""
        s, length = distance / self.length, self.length
        a, b = self.first, self.last
        slopes = [length * p.tangent / max(float(p.tangent @ self.direction), 0.1) for p in (a, b)]
        chord = b.point - a.point
        bulge = (1 - s) * (slopes[0] - chord) - s * (slopes[1] - chord)
        curve: Array = a.point + s * chord + s * (1 - s) * bulge
        return curve

    def root(self, test: str) -> BranchPoint | None:
        """Where a test function vanishes that has different signs at both ends."""
        found: dict[float, BranchPoint] = {0.0: self.first, self.length: self.last}

        def value(distance: float) -> float:
            if distance not in found:
                point = self.at(distance)
                if point is None:
                    raise LookupError
                found[distance] = point
            return found[distance].tests[test]

        from scipy.optimize import brentq  # half a second, which workers of sweeps need not wait

        try:
            where = brentq(value, 0.0, self.length, xtol=LOCATED, rtol=FINEST)
        except LookupError:
            return None  # no gait in between: what changes sign there is torn, not zero
        return found[where]

    def bisect(self, still: Callable[[BranchPoint], bool]) -> tuple[BranchPoint, BranchPoint]:
        """The points on both sides of where ``still`` ceases to hold."""
        low, high = 0.0, self.length
        before, after = self.first, self.last
        while high - low > LOCATED:
            inner = ((low + share * (high - low)) for share in SHARES)
            found = ((middle, point) for middle in inner if (point := self.at(middle)) is not None)
            middle, point = next(found, (low, None))
            if point is None:
                break
            if still(point):
                low, before = middle, point
            else:
                high, after = middle, point
        return before, after


def landmarks(family: Family, first: BranchPoint, last: BranchPoint) -> list[Landmark]:
    """Everything that happens between two neighbouring points, in order along the branch."""
    segment = Segment(family, first, last)
    found = [
        landmark
        for test in (FOLD, BRANCHING, UNIT, DOUBLING, NEIMARK_SACKER)
        if first.tests[test] * last.tests[test] < 0
        and (landmark := _vanishing(segment, test)) is not None
    ]
    if first.gait.contacts != last.gait.contacts:
        before, after = segment.bisect(lambda point: point.gait.contacts == first.gait.contacts)
        found.append(Landmark(CONTACTS, _change(before.gait, after.gait), before))
    return sorted(found, key=lambda mark: float(segment.direction @ mark.at.point))


def _change(before: Gait, after: Gait) -> str:
    if before.phases != after.phases:
        return f"{'-'.join(before.phases)} becomes {'-'.join(after.phases)}"
    for side in after.touchdown_angles:
        landings = [_landings(gait, side) for gait in (before, after)]
        if more := landings[1] - landings[0]:
            begins = "begins" if more > 0 else "ceases"
            return f"the {side} leg {begins} to touch the ground without bearing load"
    return "the order of simultaneous contacts changes"


def _landings(gait: Gait, side: str) -> int:
    return sum(f"{side} touchdown" in names for names in gait.contacts)


def _vanishing(segment: Segment, test: str) -> Landmark | None:
    point = segment.root(test)
    if point is None:
        return None
    over = segment.family.over
    if test == FOLD:
        way = "largest" if segment.first.tests[FOLD] > 0 else "smallest"
        return Landmark(FOLD, f"{over} is {way} here", point)
    if test == BRANCHING:
        if segment.family.problem.symmetric:
            return Landmark(SYMMETRY_BREAKING, "a branch of asymmetric gaits crosses", point)
        return Landmark(BRANCHING, "another branch crosses", point)
    multipliers = point.stability.level_multipliers
    if test == NEIMARK_SACKER:
        crossing = multipliers[np.abs(multipliers.imag) > ON_CIRCLE]
        off = np.abs(np.abs(crossing) - 1)
        if not off.size or off.min() > ON_CIRCLE:
            return None
        angle = abs(np.angle(crossing[int(np.argmin(off))]))
        return Landmark(test, f"a pair of multipliers at +-{angle:.4f} rad", point)
    where = 1.0 if test == UNIT else -1.0
    if np.abs(multipliers - where).min() > ON_CIRCLE:
        return None
    if test == UNIT and _keeps_energy(point.gait) and not segment.family.conservative:
        return None  # conserved energy makes it
    return Landmark(test, f"a multiplier at {where:+.0f}", point)


def _keeps_energy(gait: Gait) -> bool:
    """Whether dampers take and actuators do nothing."""
    start, end = gait.trajectory.start.states, gait.trajectory.end.states
    first = gait.model.state_names.index("dissipated_energy")  # works come after it
    return float(np.abs(end[first:] - start[first:]).max()) <= KEPT * gait.energy


def refusal(family: Family, good: BranchPoint, bad: Refuted) -> Landmark:
    """Locate where solutions cease to be gaits, between a gait and a solution that is none.

    A leg that only just clears the ground makes a gait doubtful; the landmark is before that.
    """
    torn = bad.gait
    direction = bad.point - good.point
    length = float(np.linalg.norm(direction))
    direction /= length
    low, high = 0.0, length
    while high - low > LOCATED:
        middle = (low + high) / 2
        anchor = good.point + direction * (middle - low)
        attempt = family.correct(anchor, Slice(direction, anchor))
        if not attempt.solved:
            high = middle
            continue
        point = family.visit(attempt, direction)
        if isinstance(point, Refuted) or point.gait.doubt is not None:
            high = middle
            # A run that grazes ends there, so what lies beyond is told by one that does not.
            grazes = point.gait.trajectory.outcome.kind is GRAZED
            if isinstance(point, Refuted) and not grazes:
                torn = point.gait
        else:
            good, low = point, middle
    mark = tear_beyond(family, good, direction) or tear(good, torn.trajectory)
    return mark or Landmark(REFUTED, torn.flaw or torn.doubt or "", good)


def tear_beyond(family: Family, here: BranchPoint, direction: Array) -> Landmark | None:
    """What tears the motion a little further on, far enough not to graze."""
    for step in BEYOND:
        trajectory = family.problem.evaluate(here.point + step * direction).trajectory
        if trajectory.outcome.kind is GRAZED:
            continue
        mark = tear(here, trajectory)
        if mark is not None or step >= NEAR:
            return mark
    return None


def tear(here: BranchPoint, beyond: Trajectory) -> Landmark | None:
    """What tears the motion at the end of a branch, told by a run from just beyond it."""
    events, others = contact_times(here.gait.trajectory), contact_times(beyond)
    if events and events[0][1] < AT_APEX:
        leg = events[0][0].split()[0]
        detail = f"the {leg} leg lands at the apex, so the flight there ends"
        return Landmark(NO_FLIGHT, detail, here)
    padded = [*events, ("", inf)]
    for number, ((name, time), (other, when)) in enumerate(zip(padded, others, strict=False)):
        if name == other and abs(time - when) < TORN:
            continue
        leg, _, what = other.partition(" ")
        if what != "touchdown" or when >= time:
            return None
        detail = f"the {leg} leg grazes the ground {when:.4f} s after the apex and beyond "
        if other in [landed for landed, _ in events[:number]]:
            return Landmark(SECOND_TOUCHDOWN, f"{detail}touches down a second time", here)
        return Landmark(GRAZING, f"{detail}lands there", here)
    return None
