"""Damped Newton iteration on the equations of a gait."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexspine.gaits.problem import Evaluation, Linear, Problem
from flexspine.hybrid.compile import Array

# Natural units; half a stride later this has grown to 1e-11 at most in the wildest gaits.
SOLVED = 2e-13

# Rounding can keep the residual above SOLVED; below this it is still a solution.
GOOD_ENOUGH = 1e-11

# The largest change of an unknown in one iteration; a radian is half the way to nonsense.
LONGEST_STEP = 0.3

# A full step that gained this much has a Jacobian good for one more.
FAST = 1e-3

HALVINGS = 5

# Over this many iterations the residual has to shrink by this factor, or the attempt is given up.
PATIENCE, PROGRESS = 4, 0.8


@dataclass(frozen=True)
class Slice:
    """More linear equations: ``direction . (point - anchor) = 0``, of one direction or of rows."""

    direction: Array
    anchor: Array

    def __call__(self, point: Array) -> Array:
        """How far a point is off in each direction, in natural units."""
        return np.atleast_1d(self.direction @ (point - self.anchor))


@dataclass(frozen=True)
class Attempt:
    """Where the iteration ended.

    ``reason`` is None for a solution, else why there is none: ``stalled``, ``left_bounds`` or the
    name of the outcome of the run. ``linear`` are the latest derivatives computed.
    """

    point: Array
    evaluation: Evaluation
    iterations: int
    reason: str | None
    linear: Linear | None

    @property
    def solved(self) -> bool:
        """Whether it is a solution."""
        return self.reason is None


def solve(
    problem: Problem,
    start: Array,
    *,
    cut: Slice | None = None,
    bounds: tuple[Array, Array] | None = None,
    iterations: int = 40,
    longest_step: float = LONGEST_STEP,
) -> Attempt:
    """Solve a problem from a start, in natural units.

    Takes least-squares steps, so an equation too many that follows from the others does no harm;
    ``cut`` adds some that pick a point of a family.
    """
    here = _evaluate(problem, start, cut)
    linear: Linear | None = None
    fast, norms = False, [here.norm]

    def attempt(count: int, reason: str | None, at: _Trial) -> Attempt:
        return Attempt(at.point, at.evaluation, count, reason, linear)

    for count in range(iterations):
        if here.evaluation.residual is None:
            return attempt(count, here.evaluation.outcome.name, here)
        if here.norm <= SOLVED:
            return attempt(count, None, here)
        reused = linear is not None and fast
        if linear is None or not fast:
            linear = problem.linearize(here.evaluation)
        if not np.isfinite(linear.matrix).all():  # deviations grew beyond what a double holds
            return attempt(count, "stalled", here)
        step = _step(linear.matrix, here, cut)
        longest = float(np.max(np.abs(step)))
        if longest > longest_step:
            step = step * (longest_step / longest)
        trials = _along(problem, here, step, cut)
        if trials[-1].norm < here.norm:
            fast = len(trials) == 1 and trials[-1].norm < FAST * here.norm
            here = trials[-1]
            norms.append(here.norm)
            if len(norms) > PATIENCE and here.norm > PROGRESS * norms[-1 - PATIENCE] > GOOD_ENOUGH:
                return attempt(count, "stalled", here)
            if bounds is not None and np.any((here.point < bounds[0]) | (here.point > bounds[1])):
                return attempt(count, "left_bounds", here)
        elif here.norm <= GOOD_ENOUGH:
            return attempt(count, None, here)
        elif reused:
            fast = False
        else:
            failed = trials[-1].evaluation
            return attempt(
                count, failed.outcome.name if failed.residual is None else "stalled", here
            )
    return attempt(iterations, None if here.norm <= GOOD_ENOUGH else "stalled", here)


class _Trial(NamedTuple):
    """An evaluated point and its largest residual."""

    point: Array
    evaluation: Evaluation
    norm: float


def _evaluate(problem: Problem, point: Array, cut: Slice | None) -> _Trial:
    evaluation = problem.evaluate(point)
    norm = evaluation.norm
    if cut is not None:
        norm = max(norm, float(np.max(np.abs(cut(point)))))
    return _Trial(point, evaluation, norm)


def _along(problem: Problem, here: _Trial, step: Array, cut: Slice | None) -> list[_Trial]:
    """Try the step, its half and so on until one is better; the last one is the best."""
    trials: list[_Trial] = []
    for halving in range(HALVINGS + 1):
        trials.append(_evaluate(problem, here.point + step / 2**halving, cut))
        if trials[-1].norm < here.norm:
            break
    return trials


def _step(jacobian: Array, here: _Trial, cut: Slice | None) -> Array:
    residual = here.evaluation.residual
    assert residual is not None
    if cut is not None:
        rows = np.vstack([jacobian, cut.direction])
        return _least_squares(rows, np.append(residual, cut(here.point)))
    return _least_squares(jacobian, residual)


def _least_squares(jacobian: Array, residual: Array) -> Array:
    if jacobian.shape[0] == jacobian.shape[1]:
        try:
            return np.asarray(np.linalg.solve(jacobian, -residual))
        except np.linalg.LinAlgError:
            pass  # the shortest of many steps then
    return np.asarray(np.linalg.lstsq(jacobian, -residual, rcond=None)[0], dtype=float)
