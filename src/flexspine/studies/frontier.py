"""The search for a Pareto front, piece by piece: from many starts, limit by limit.

One objective is made least while the other keeps a limit, for limit after limit (the epsilon
constraint method: Haimes, Lasdon, Wismer 1971). Pieces of a round do not depend on each other, so
whoever does them, in whatever order, the front is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from flexspine.studies.descent import Task, descend
from flexspine.studies.design import Design
from flexspine.studies.objectives import OBJECTIVES
from flexspine.studies.rounds import Rounds

# Relative; an objective that differs by less is the same.
SAME = 1e-6

# Times that neighbours along the front hand on what they have found.
HANDINGS = 3

# Of the best gaits within a limit, how many to start from.
BEST = 2

Point = tuple[float, ...]


class Found(NamedTuple):
    """A gait as a point of its design's problem, and the values of the two objectives."""

    point: Point
    values: tuple[float, float]


class Piece(NamedTuple):
    """One descent: from a point, to the least of an objective, within a limit of the other."""

    start: Point
    goal: int
    limit: float | None


def draw_gaits(work: tuple[Design, list[float], tuple[int, ...], int]) -> list[list[float]]:
    """Gaits of a design to start from."""
    design, shares, seed, most = work
    return [point.tolist() for point in design.drawn(shares, seed, most)]


def do_piece(work: tuple[Design, tuple[str, str], Piece]) -> list[list[float]] | None:
    """Go down from a start; None if that leads nowhere, else point and values."""
    design, minimise, piece = work
    limits = {} if piece.limit is None else {minimise[1 - piece.goal]: piece.limit}
    task = Task(minimise[piece.goal], limits, design.ranges)
    place = descend(design.problem, np.array(piece.start), task)
    if place is None:
        return None
    return [place.point.tolist(), [OBJECTIVES[name].value(place.stride) for name in minimise]]


def restrict(work: tuple[Design, Design, Point]) -> list[float] | None:
    """Lead a gait to where all vanishes that varies in its design but not in another one."""
    wide, narrow, point = work
    extra = dict.fromkeys((n for n in wide.parameters if n not in narrow.parameters), 0.0)
    end = wide.restrict(np.array(point), extra)
    return None if end is None else narrow.problem.point(wide.problem.at(end)).tolist()


@dataclass
class Frontier:
    """The search for one front.

    ``starts`` are the gaits that it began with, ``known`` is everything found so far.
    """

    name: str
    design: Design
    minimise: tuple[str, str]
    rounds: Rounds
    starts: list[Point] = field(default_factory=list)
    known: list[Found] = field(default_factory=list)
    _tried: set[Piece] = field(default_factory=set)

    def begin(self, draws: int, seed: int, most: int) -> None:
        """Start from the given gait, and from those of random designs, spread over all ranges.

        No more than ``most`` gaits of one design are followed up.
        """
        own = self.design.bring_in(self.design.gait)
        cube = qmc.LatinHypercube(len(self.design.ranges), rng=np.random.default_rng(seed))
        shares = cube.random(draws).tolist()
        works = [(self.design, shares[i], (seed, i), most) for i in range(draws)]
        drawn = self.rounds.do(f"{self.name}: gaits to start from", draw_gaits, works)
        self.starts = [] if own is None else [tuple(own.tolist())]
        self.starts += [tuple(point) for points in drawn for point in points]

    def ends(self, starts: Sequence[Point]) -> None:
        """Look for the least of each objective alone."""
        self._descend("least of each", [Piece(s, goal, None) for s in starts for goal in (0, 1)])

    @property
    def extremes(self) -> list[Found]:
        """The gaits of least first and of least second objective, if any are known."""
        return [min(self.known, key=_by(goal)) for goal in (0, 1) if self.known]

    @property
    def span(self) -> tuple[float, float]:
        """Least second objective, and the one at which the first is least."""
        first, second = self.extremes
        return second.values[1], first.values[1]

    def learn(self, other: Frontier, known: Sequence[Found]) -> list[Point]:
        """Take over gaits of a design in which less varies; returns them as points of this one."""
        points: list[Point] = []
        for found in known:
            model = other.design.problem.at(np.array(found.point))
            points.append(tuple(self.design.problem.point(model).tolist()))
            self.known.append(Found(points[-1], found.values))
        return points

    def restricted(self, design: Design, known: Sequence[Found]) -> list[Point]:
        """Gaits of a design in which less varies, next to these."""
        distinct: list[Found] = []
        for found in known:
            if not any(_alike(found, other) for other in distinct):
                distinct.append(found)
        works = [(self.design, design, found.point) for found in distinct]
        ends = self.rounds.do(f"{self.name}: neighbours with less that varies", restrict, works)
        return [tuple(end) for end in ends if end is not None]

    def within(
        self, limits: Sequence[float], hints: Sequence[Point] = (), *, goal: int = 0
    ) -> None:
        """Look for the least of one objective for each limit of the other, limits in order.

        ``hints`` are more points to start from; as those that all began with, each has a go at
        one limit, and what it finds is handed on.
        """
        what = "limit by limit"
        pieces = [
            Piece(start, goal, limit) for limit in limits for start in self._near(limit, goal)
        ]
        pieces += [
            Piece(start, goal, limits[number % len(limits)])
            for some in (self.starts, hints)
            for number, start in enumerate(some)
        ]
        self._descend(what, pieces)
        for _ in range(HANDINGS):
            best = [self.best(limit, goal) for limit in limits]
            handed = [
                Piece(neighbour.point, goal, limit)
                for at, limit in enumerate(limits)
                for neighbour in best[max(at - 1, 0) : at + 2]
                if neighbour is not None and neighbour != best[at]
            ]
            handed += [Piece(end.point, each, None) for each, end in enumerate(self.extremes)]
            self._descend(what, handed)

    def bests(self, limits: Sequence[float], goal: int = 0) -> list[Found]:
        """The best known for each limit, each once."""
        found = (self.best(limit, goal) for limit in limits)
        return list(dict.fromkeys(each for each in found if each))

    def best(self, limit: float, goal: int = 0) -> Found | None:
        """The least of one objective known within a limit of the other."""
        good = [found for found in self.known if found.values[1 - goal] <= limit * (1 + SAME)]
        return min(good, key=_by(goal), default=None)

    def _near(self, limit: float, goal: int) -> Iterator[Point]:
        """Gaits to start from towards a limit: the best within, and the next beyond."""
        chosen: list[Found] = []
        for found in sorted(self.known, key=_by(goal)):
            inside = found.values[1 - goal] <= limit * (1 + SAME)
            if inside and len(chosen) < BEST and not any(_alike(found, one) for one in chosen):
                chosen.append(found)
        yield from (found.point for found in chosen)
        least = min((found.values[goal] for found in chosen), default=np.inf)
        beyond = [f for f in self.known if f.values[1 - goal] > limit and f.values[goal] < least]
        if beyond:
            yield min(beyond, key=_by(1 - goal)).point

    def _descend(self, what: str, pieces: Sequence[Piece]) -> None:
        new = [piece for piece in dict.fromkeys(pieces) if piece not in self._tried]
        self._tried.update(new)
        works = [(self.design, self.minimise, piece) for piece in new]
        for result in self.rounds.do(f"{self.name}: {what}", do_piece, works):
            if result is not None:
                self.known.append(Found(tuple(result[0]), tuple(result[1])))


def _alike(one: Found, other: Found) -> bool:
    """Whether two gaits come to the same."""
    pairs = zip(one.values, other.values, strict=True)
    return all(abs(a - b) <= SAME * abs(b) for a, b in pairs)


def _by(goal: int) -> Callable[[Found], tuple[float, float]]:
    """How gaits are sorted by one objective and then by the other."""
    return lambda found: (found.values[goal], found.values[1 - goal])
