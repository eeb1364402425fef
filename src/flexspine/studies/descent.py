"""Downhill among gaits: one objective made least while others keep a limit.

Gaits form a smooth set in the space of their unknowns. SciPy's SLSQP works in local coordinates on
it, one chart after the other; every point that it looks at is a gait. Source of the method:
Kraft 1988, A software package for sequential quadratic programming, DFVLR-FB 88-28.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from flexspine.gaits.chart import Chart, lead
from flexspine.gaits.problem import Linear, Problem
from flexspine.hybrid.compile import Array
from flexspine.studies.objectives import OBJECTIVES
from flexspine.studies.probes import LEAST, ROOMY, Astray, Stride

# Natural units; how far a chart reaches, and when further ones are given up.
WIDEST, NARROWEST = 0.25, 2e-3

# Relative; a chart that gains less is the last one.
GAIN = 1e-5

MOST_CHARTS = 40

# Of SLSQP: iterations on a chart, and what it stops at, relative to the objective.
ITERATIONS, PRECISION = 15, 1e-7

# Natural units; rounding and curvature both leave differences over this with five digits.
DIFFERENCE = 1e-6

# Natural units; a descent ends no more precisely than this.
LANDING = 1e-6

# By how much a limit may be missed, relative, and a range, in natural units.
MET = 1e-7


@dataclass(frozen=True)
class Task:
    """What to make least: ``goal``, while ``limits`` hold and quantities stay in their ``ranges``.

    Limits are the largest values of objectives by name, ranges low and high by name, SI.
    """

    goal: str
    limits: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]

    @property
    def objectives(self) -> tuple[str, ...]:
        """The goal and what has a limit."""
        return (self.goal, *self.limits)


class Place:
    """A gait on the way down, with what it amounts to. Raises `Astray`."""

    def __init__(self, problem: Problem, task: Task, point: Array) -> None:
        self.problem, self.task, self.point = problem, task, point
        self.stride = Stride(problem, point)

    @cached_property
    def parts(self) -> list[Array]:
        """The parts of all objectives, goal first."""
        return self.parts_of(self.stride)

    def parts_of(self, stride: Stride) -> list[Array]:
        """The same of any stride."""
        return [OBJECTIVES[name].parts(stride) for name in self.task.objectives]

    @cached_property
    def linear(self) -> Linear:
        """Derivatives of the equations. Raises `Astray` where they are beyond all bounds."""
        linear = self.problem.linearize(self.stride.evaluation)
        if not np.isfinite(linear.matrix).all():
            raise Astray("no derivatives")
        return linear

    def value(self, name: str) -> float:
        """The value of an objective of the task."""
        return OBJECTIVES[name].value(self.stride)

    @cached_property
    def room(self) -> Array:
        """How far quantities are above and below the ends of their ranges, in natural units."""
        problem, found = self.problem, []
        for name, ends in self.task.ranges.items():
            if name in problem.unknowns:
                here = self.point[problem.unknowns.index(name)]
                low, high = (problem.coordinate(name, end) for end in ends)
            else:
                scale = problem.scale_of(name)
                here = problem.measure(self.stride.trajectory, name) / scale
                low, high = (end / scale for end in ends)
            found += [here - low, high - here]
        return np.array(found)

    def opening(self, tangent: Array) -> Array:
        """How that room grows along directions (u, d)."""
        problem, found = self.problem, []
        for name in self.task.ranges:
            if name in problem.unknowns:
                slope = tangent[problem.unknowns.index(name)]
            else:
                slope = self.linear.slopes[name] @ tangent
            found += [slope, -slope]
        return np.array(found)

    @cached_property
    def spare(self) -> Array:
        """How far it is from being no gait of its kind, in units of plenty."""
        found: Array = (self.stride.margins - LEAST) / ROOMY
        return found

    @cached_property
    def missed(self) -> float:
        """By how much it misses what it is bound to; at most `MET` where it does not."""
        over = [
            (self.value(name) - limit) / (abs(limit) or 1.0)
            for name, limit in self.task.limits.items()
        ]
        return float(max([*over, *-self.room, *-self.spare]))


def descend(problem: Problem, start: Array, task: Task) -> Place | None:
    """Go downhill from a gait in all ranges; None if there is none within the limits."""
    try:
        here = Place(problem, task, start)
        for name, limit in task.limits.items():
            if here.value(name) > limit:
                others = {other: most for other, most in task.limits.items() if other != name}
                way = replace(task, goal=name, limits=others)
                here = Place(problem, task, _down(Place(problem, way, here.point), limit).point)
        return _landed(_down(here)) if here.missed <= MET else None
    except Astray:
        return None


def _down(here: Place, enough: float = -np.inf) -> Place:
    """Go down chart by chart, until there is no more to gain or it is ``enough``."""
    goal, width = here.task.goal, WIDEST
    for _ in range(MOST_CHARTS):
        found, lost = _Local(here, width).best(enough)
        gained = here.value(goal) - found.value(goal) > GAIN * abs(here.value(goal))
        here = found
        width = width / 4 if lost else min(WIDEST, 2 * width)
        if here.value(goal) <= enough or not (gained or lost) or width < NARROWEST:
            break
    return here


def _landed(place: Place) -> Place:
    """Put on the ends of ranges, and on zero, what differs by the optimiser's precision."""
    problem, ends = place.problem, dict[str, float]()
    for name, (low, high) in place.task.ranges.items():
        if name in problem.unknowns:
            here = place.point[problem.unknowns.index(name)]
            for end in (low, 0.0, high) if low < 0 < high else (low, high):
                if abs(problem.coordinate(name, end) - here) < LANDING:
                    ends[name] = end
    return Place(problem, place.task, lead(problem, place.point, ends)[-1])


class _Enough(Exception):  # noqa: N818 - no error
    """What was wanted is reached."""


class _Local:
    """A task about a place as SLSQP takes it.

    Variables are the coordinates on a chart (d,) and then, for each objective, its terms, which are
    to be as large as all their parts. Objectives count in units of their values at the place.
    """

    def __init__(self, place: Place, width: float) -> None:
        self.start, self.task, self.width = place, place.task, width
        self.chart = Chart(place.problem, place.point, place.linear)
        self.d = self.chart.basis.shape[1]
        self.scales = [abs(place.value(name)) or 1.0 for name in self.task.objectives]
        self.sizes = [len(parts) for parts in place.parts]
        self.seen = {np.zeros(self.d).tobytes(): place}
        self.tangent_at, self.tangent = place, self.chart.basis
        self.slopes: dict[bytes, Array] = {}

    def best(self, enough: float) -> tuple[Place, bool]:
        """The best gait met on the way down, and whether the way got lost."""
        self.enough, lost = enough, False
        terms = [
            parts.max(axis=1) / scale
            for parts, scale in zip(self.start.parts, self.scales, strict=True)
        ]
        ends = [(-self.width, self.width)] * self.d + [(None, None)] * sum(self.sizes)
        rise = np.zeros(len(ends))
        rise[self.d : self.d + self.sizes[0]] = 1.0
        try:
            minimize(
                lambda v: float(rise @ v),
                np.concatenate([np.zeros(self.d), *terms]),
                jac=lambda _v: rise,
                bounds=ends,
                constraints={"type": "ineq", "fun": self._kept, "jac": self._keeping},
                method="SLSQP",
                options={"maxiter": ITERATIONS, "ftol": PRECISION},
            )
        except Astray:
            lost = True
        except _Enough:
            pass
        good = [place for place in self.seen.values() if place.missed <= MET] or [self.start]
        return min(good, key=lambda place: place.value(self.task.goal)), lost

    def _place(self, variables: Array) -> Place:
        """The gait at some coordinates."""
        at = variables[: self.d]
        key = at.tobytes()
        if key not in self.seen:
            attempt = self.chart.solve(at, self.tangent_at.point, self.tangent)
            if not attempt.solved:
                raise Astray(attempt.reason)
            place = self.seen[key] = Place(self.start.problem, self.task, attempt.point)
            if place.value(self.task.goal) <= self.enough and place.missed <= MET:
                raise _Enough
        return self.seen[key]

    def _kept(self, variables: Array) -> Array:
        """What has to stay above zero."""
        place = self._place(variables)
        terms = np.split(variables[self.d :], np.cumsum(self.sizes)[:-1])
        rows = [
            (term[:, None] - parts / scale).ravel()
            for term, parts, scale in zip(terms, place.parts, self.scales, strict=True)
        ]
        rows += [
            np.array([limit / scale - term.sum()])
            for limit, scale, term in zip(
                self.task.limits.values(), self.scales[1:], terms[1:], strict=True
            )
        ]
        return np.concatenate([*rows, place.room, place.spare])

    def _keeping(self, variables: Array) -> Array:
        """Its derivatives."""
        place = self._place(variables)
        key = variables[: self.d].tobytes()
        if key not in self.slopes:
            self.slopes[key] = self._differentiate(place)
        return self.slopes[key]

    def _differentiate(self, place: Place) -> Array:
        tangent = self.chart.tangent(place.linear)
        self.tangent_at, self.tangent = place, tangent
        parts, spare = self._differences(place, tangent)
        count = sum(self.sizes)
        rows, first = [], 0
        for size, slopes, scale in zip(self.sizes, parts, self.scales, strict=True):
            of_terms = np.zeros((size, slopes.shape[1], count))
            of_terms[range(size), :, range(first, first + size)] = 1.0
            block = np.concatenate([-slopes / scale, of_terms], axis=2)
            rows.append(block.reshape(-1, self.d + count))
            first += size
        first = self.sizes[0]
        for size in self.sizes[1:]:
            row = np.zeros((1, self.d + count))
            row[0, self.d + first : self.d + first + size] = -1.0
            rows.append(row)
            first += size
        for slopes in (place.opening(tangent), spare):
            rows.append(np.hstack([slopes, np.zeros((len(slopes), count))]))
        return np.vstack(rows)

    def _differences(self, place: Place, tangent: Array) -> tuple[list[Array], Array]:
        """Derivatives of parts, and of what is to spare, by the coordinates, which come last."""
        parts, spare = [], []
        for direction in tangent.T:
            beside = place.point + DIFFERENCE * direction
            ahead = Stride(place.problem, beside, place.stride.probes)
            pairs = zip(place.parts_of(ahead), place.parts, strict=True)
            parts.append([(there - here) / DIFFERENCE for there, here in pairs])
            spare.append((ahead.margins - place.stride.margins) / (DIFFERENCE * ROOMY))
        stacked = [np.stack(each, axis=-1) for each in zip(*parts, strict=True)]
        return stacked, np.stack(spare, axis=-1)
