"""Local coordinates on the set of all gaits that solve a problem with unknowns to spare."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexspine.gaits.newton import Attempt, Slice, solve
from flexspine.gaits.problem import Linear, Problem
from flexspine.hybrid.compile import Array

# A prediction after which Newton takes more was too bold.
ITERATIONS = 10

# Of what is left to go; a gait that cannot be led that far stays.
SHORTEST_SHARE = 1 / 64


class Chart:
    """The gaits about one of them, by their coordinates (d,) in its tangent space.

    ``basis`` (u, d) spans that space, in natural units; d is the problem's ``surplus``. Unlike
    some of the unknowns, coordinates in a tangent space go on through folds.
    """

    def __init__(self, problem: Problem, centre: Array, linear: Linear) -> None:
        self.problem, self.centre = problem, centre
        self.basis: Array = np.linalg.svd(linear.matrix)[2][-problem.surplus :].T

    def coordinates(self, point: Array) -> Array:
        """Where a gait is on the chart."""
        found: Array = self.basis.T @ (point - self.centre)
        return found

    def tangent(self, linear: Linear) -> Array:
        """How a gait moves with its coordinates, shape (u, d)."""
        still = np.zeros((len(linear.matrix), self.problem.surplus))
        moves: Array = np.linalg.lstsq(
            np.vstack([linear.matrix, self.basis.T]),
            np.vstack([still, np.eye(self.problem.surplus)]),
            rcond=None,
        )[0]
        return moves

    def solve(self, at: Array, near: Array, tangent: Array) -> Attempt:
        """Look for the gait with some coordinates from one nearby and its tangent."""
        guess = near + tangent @ (at - self.coordinates(near))
        cut = Slice(self.basis.T, self.centre + self.basis @ at)
        return solve(self.problem, guess, cut=cut, iterations=ITERATIONS)


def lead(problem: Problem, point: Array, wanted: Mapping[str, float]) -> list[Array]:
    """Lead a gait to wanted values of some unknowns (SI), all others yielding.

    Returns the gaits on the way; the last one has these values, or is as near as it gets.
    """
    places = [problem.unknowns.index(name) for name in wanted]
    rows = np.eye(len(problem.unknowns))[places]
    ends = np.array([problem.coordinate(name, value) for name, value in wanted.items()])
    way, share = [point], 1.0
    while share > SHORTEST_SHARE and np.any(way[-1][places] != ends):
        aim = way[-1].copy()
        aim[places] = ends if share == 1.0 else aim[places] + share * (ends - aim[places])
        attempt = solve(problem, aim, cut=Slice(rows, aim), iterations=ITERATIONS)
        if not attempt.solved:
            share /= 2
            continue
        found = attempt.point.copy()
        found[places] = aim[places]  # to the last digit
        way.append(found)
        share = min(1.0, 2 * share)
    return way
