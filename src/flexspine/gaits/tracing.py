"""One direction of a branch, traced step by step.

Pseudo-arclength: predict along the tangent, correct on the slice across it. Source: Keller 1977,
Numerical solution of bifurcation and nonlinear eigenvalue problems; step control as in AUTO.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.family import FOLD, BranchPoint, Family, Refuted
from flexspine.gaits.gait import Gait
from flexspine.gaits.landmarks import Landmark, Segment, landmarks, refusal, tear_beyond
from flexspine.gaits.newton import Slice, solve
from flexspine.hybrid.compile import Array

# Natural units along the branch.
FIRST_STEP = 0.01
LONGEST_STEP = 0.05
SHORTEST_STEP = 1e-7

# Cosine of the largest turn of the tangent within a step.
STRAIGHT = 0.95

# Corrections needed at a step of good length.
FEW, MANY = 2, 4

# A branch is closed if its start lies this near a piece of it, per length of the piece.
NARROW = 0.2

# Relative; a start this close to a bound is on it.
SLACK = 1e-9

CLOSED_BRANCH = "closed: it comes back to where it began"

# No closed branch is as short as this many points.
CLOSING = 8


@dataclass(frozen=True)
class Tracing:
    """One direction of a branch in progress: its points, what happened, the next step, its end."""

    points: tuple[BranchPoint, ...]
    marks: tuple[Landmark, ...] = ()
    step: float = FIRST_STEP
    end: str | None = None


class Tracer:
    """Makes one step along a branch after the other."""

    def __init__(
        self, family: Family, bounds: tuple[float, float], longest_step: float, most_points: int
    ) -> None:
        low, high = bounds
        if not low < high:
            raise ParameterError(f"bounds {low:g} to {high:g} are empty", "give low before high")
        if not longest_step > 0:
            raise ParameterError(
                f"longest_step = {longest_step:g} is not usable", "give a number above zero"
            )
        self.family, self.low, self.high = family, low, high
        self.longest_step, self.most_points = longest_step, most_points

    def start(self, gait: Gait) -> BranchPoint:
        """The first point, its tangent towards larger values. Raises `ParameterError`."""
        family = self.family
        attempt = solve(family.problem, family.problem.point(gait.model))
        if not attempt.solved:
            raise ParameterError("the branch cannot start here", "start it from a gait")
        point = family.visit(attempt, np.zeros(len(attempt.point)))
        if isinstance(point, Refuted):
            raise ParameterError(
                f"the branch cannot start here: it {point.gait.flaw}", "start it from a gait"
            )
        slack = SLACK * max(abs(self.low), abs(self.high))
        if not self.low - slack <= point.value <= self.high + slack:
            raise ParameterError(
                f"{family.over} = {point.value:g} of the gait is not within {self.low:g} to "
                f"{self.high:g}",
                "start from a gait within the bounds",
            )
        return point if point.tests[FOLD] >= 0 else point.turned()

    def go(self, tracing: Tracing) -> Iterator[Tracing]:
        """Yield the tracing after every step, until it has an end."""
        while tracing.end is None:
            tracing = self._step(tracing)
            if tracing.end is not None:
                tracing = _without_doubt(tracing)
            yield tracing

    def _step(self, tracing: Tracing) -> Tracing:
        family, here, step = self.family, tracing.points[-1], tracing.step
        ahead = self.low if here.tests[FOLD] < 0 else self.high
        if here.value == ahead:
            return replace(tracing, end=f"reached {family.over} = {ahead:g}")
        guess = here.point + step * here.tangent
        attempt = family.correct(guess, Slice(here.tangent, guess))
        if not attempt.solved:
            return self._shorter(tracing, attempt.reason or "")
        try:
            point = family.visit(attempt, here.tangent)
        except ParameterError as failure:
            return self._stop_short(tracing, attempt.point, failure.message)
        if isinstance(point, Refuted):
            mark = refusal(family, here, point)
            return _extended(tracing, family, mark.at, marks=(mark,), end=self._told(mark))
        if point.tangent @ here.tangent < STRAIGHT:
            return self._shorter(tracing, "the branch turns too sharply")
        if not self.low <= point.value <= self.high:
            return self._reach_bound(tracing, point)
        if _closes(tracing.points, point):
            # The start once more, so that what happens on the last piece is not missed.
            return _extended(tracing, family, tracing.points[0], end=CLOSED_BRANCH)
        end = None
        if len(tracing.points) >= self.most_points:
            end = f"left after {self.most_points} points"
        factor = 1.5 if attempt.iterations <= FEW else 0.7 if attempt.iterations > MANY else 1.0
        longer = min(self.longest_step, step * factor)
        return _extended(tracing, family, point, step=longer, end=end)

    def _reach_bound(self, tracing: Tracing, beyond: BranchPoint) -> Tracing:
        """Land on the bound that was overstepped."""
        here = tracing.points[-1]
        bound = self.low if beyond.value < self.low else self.high
        end = f"reached {self.family.over} = {bound:g}"
        if here.value == bound:
            return replace(tracing, end=end)
        edge = land(self.family, Segment(self.family, here, beyond), bound)
        if edge is None:
            return self._shorter(tracing, "the bound could not be reached")
        return _extended(tracing, self.family, edge, end=end)

    def _stop_short(self, tracing: Tracing, beyond: Array, reason: str) -> Tracing:
        """Land on a bound that was overstepped to where a parameter is not usable."""
        family, here = self.family, tracing.points[-1]
        value = family.problem.values(beyond).get(family.over, here.value)
        if self.low <= value <= self.high:
            return self._shorter(tracing, reason)
        bound = self.low if value < self.low else self.high
        share = (bound - here.value) / (value - here.value)
        guess = here.point + share * (beyond - here.point)
        edge = _landed(family, guess, here.tangent, bound)
        if edge is None:
            return self._shorter(tracing, "the bound could not be reached")
        return _extended(tracing, family, edge, end=f"reached {family.over} = {bound:g}")

    def _shorter(self, tracing: Tracing, reason: str) -> Tracing:
        """Try again with half the step, or give up and say why."""
        step = tracing.step / 2
        if step >= SHORTEST_STEP:
            return replace(tracing, step=step)
        here = tracing.points[-1]
        mark = tear_beyond(self.family, here, here.tangent)
        if mark is None:
            end = f"no gait found beyond {self.family.over} = {here.value:.6g} ({reason})"
            return replace(tracing, end=end)
        return replace(tracing, marks=(*tracing.marks, mark), end=self._told(mark))

    def _told(self, mark: Landmark) -> str:
        return f"{mark.kind} at {self.family.over} = {mark.value:.6g}: {mark.detail}"


def _extended(
    tracing: Tracing,
    family: Family,
    point: BranchPoint,
    *,
    marks: tuple[Landmark, ...] = (),
    step: float | None = None,
    end: str | None = None,
) -> Tracing:
    """Add a point and what happens on the way to it."""
    here = tracing.points[-1]
    if point is here:
        return replace(tracing, marks=(*tracing.marks, *marks), end=end)
    return Tracing(
        points=(*tracing.points, point),
        marks=(*tracing.marks, *landmarks(family, here, point), *marks),
        step=tracing.step if step is None else step,
        end=end,
    )


def _without_doubt(tracing: Tracing) -> Tracing:
    """Leave out last points that recording does not confirm, as a leg grazes the ground there."""
    points = tracing.points
    while len(points) > 1 and points[-1].gait.doubt is not None:
        points = points[:-1]
    return replace(tracing, points=points)


def _closes(points: tuple[BranchPoint, ...], point: BranchPoint) -> bool:
    """Whether the start lies on the way from the last point to a new one."""
    start, here = points[0], points[-1]
    if len(points) < CLOSING or float(point.tangent @ start.tangent) < STRAIGHT:
        return False
    chord = point.point - here.point
    length = float(np.linalg.norm(chord))
    along = float((start.point - here.point) @ chord) / length
    aside = np.linalg.norm(start.point - here.point - along * chord / length)
    return 0 <= along <= length and float(aside) < NARROW * length


def land(family: Family, segment: Segment, value: float) -> BranchPoint | None:
    """The point of a segment at which ``over`` has a value, if there is one."""
    share = (value - segment.first.value) / (segment.last.value - segment.first.value)
    return _landed(family, segment.curved(share * segment.length), segment.direction, value)


def _landed(family: Family, guess: Array, towards: Array, value: float) -> BranchPoint | None:
    """The point next to a guess at which ``over`` has a value, if there is one."""
    problem = family.problem
    if family.over in problem.unknowns:
        at = problem.unknowns.index(family.over)
        aim, anchor = np.zeros(len(guess)), guess.copy()
        aim[at], anchor[at] = 1.0, problem.coordinate(family.over, value)
        attempt = family.correct(anchor, Slice(aim, anchor))
    else:
        attempt = solve(problem.fixing(family.over, value), guess)
    if not attempt.solved:
        return None
    point = family.visit(attempt, towards)
    return point if isinstance(point, BranchPoint) else None
