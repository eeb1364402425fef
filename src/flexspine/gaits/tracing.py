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
from flexspine.gaits.landmarks import Landmark, Segment, landmarks, refusal, tear
from flexspine.gaits.newton import Slice, solve

# Natural units along the branch.
FIRST_STEP = 0.01
LONGEST_STEP = 0.05
SHORTEST_STEP = 1e-7

# Cosine of the largest turn of the tangent within a step.
STRAIGHT = 0.95

# Corrections needed at a step of good length.
FEW, MANY = 2, 4

# Natural units; a branch that comes back this close to its start is closed.
CLOSED_CURVE = 0.5 * LONGEST_STEP

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
        if not self.low <= point.value <= self.high:
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
            yield tracing

    def _step(self, tracing: Tracing) -> Tracing:
        family, here, step = self.family, tracing.points[-1], tracing.step
        guess = here.point + step * here.tangent
        attempt = family.correct(guess, Slice(here.tangent, guess))
        if not attempt.solved:
            return self._shorter(tracing, attempt.reason or "")
        try:
            point = family.visit(attempt, here.tangent)
        except ParameterError as failure:
            return self._shorter(tracing, failure.message)
        if isinstance(point, Refuted):
            mark = refusal(family, here, point)
            return _extended(tracing, family, mark.at, marks=(mark,), end=self._told(mark))
        if point.tangent @ here.tangent < STRAIGHT:
            return self._shorter(tracing, "the branch turns too sharply")
        if not self.low <= point.value <= self.high:
            return self._reach_bound(tracing, point)
        end = None
        if _closes(tracing.points, point):
            end = "closed: it comes back to where it began"
        elif len(tracing.points) >= self.most_points:
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

    def _shorter(self, tracing: Tracing, reason: str) -> Tracing:
        """Try again with half the step, or give up and say why."""
        step = tracing.step / 2
        if step >= SHORTEST_STEP:
            return replace(tracing, step=step)
        here = tracing.points[-1]
        beyond = self.family.problem.evaluate(here.point + tracing.step * here.tangent)
        mark = tear(here, beyond.trajectory)
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


def _closes(points: tuple[BranchPoint, ...], point: BranchPoint) -> bool:
    start = points[0]
    near = float(np.linalg.norm(point.point - start.point)) < CLOSED_CURVE
    return len(points) > CLOSING and near and float(point.tangent @ start.tangent) > STRAIGHT


def land(family: Family, segment: Segment, value: float) -> BranchPoint | None:
    """The point of a segment at which ``over`` has a value, if there is one."""
    first, last, problem = segment.first, segment.last, family.problem
    share = (value - first.value) / (last.value - first.value)
    guess = segment.curved(share * segment.length)
    if family.over in problem.unknowns:
        aim = np.zeros(len(guess))
        at = problem.unknowns.index(family.over)
        aim[at], guess[at] = 1.0, problem.coordinate(family.over, value)
        attempt = family.correct(guess, Slice(aim, guess))
    else:
        attempt = solve(problem.fixing(family.over, value), guess)
    if not attempt.solved:
        return None
    point = family.visit(attempt, segment.direction)
    return point if isinstance(point, BranchPoint) else None
