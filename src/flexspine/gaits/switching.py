"""Step from one branch onto another that crosses it."""

from __future__ import annotations

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.family import BRANCHING, DOUBLING, BranchPoint, Family
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.landmarks import SYMMETRY_BREAKING, Landmark
from flexspine.gaits.newton import Slice
from flexspine.gaits.problem import Problem
from flexspine.gaits.return_map import linearize
from flexspine.hybrid.compile import Array
from flexspine.hybrid.integrate import integrate

# Natural units; how far from the crossing the other branch is looked for, in turn.
DISTANCES = (0.01, 0.003, 0.03, 0.001)

# Of the distance; a solution further than this from where it was looked for is another one.
NEAR = 3.0

# Natural units; an orbit that misses its start by more after half its strides needs them all.
DOUBLED = 1e-6


def switch_branch(family: Family, landmark: Landmark) -> list[Gait]:
    """Return a gait on either side of ``landmark`` on the branch that crosses there.

    ``family`` is that of the `Branch` with the landmark, which is a ``symmetry breaking``, a
    ``branch point`` or a ``period doubling``; the gaits of the last one repeat after twice as many
    strides. Fewer than two where the other branch does not go on. Raises `ParameterError` for
    another kind of landmark.
    """
    if landmark.kind not in (SYMMETRY_BREAKING, BRANCHING, DOUBLING):
        raise ParameterError(
            f"no branch crosses at a {landmark.kind}",
            f"take a {SYMMETRY_BREAKING}, a {BRANCHING} or a {DOUBLING}",
        )
    old, crossing = family.problem, landmark.at
    problem = Problem(
        crossing.gait.model,
        old.fixed,
        free=old.free,
        symmetric=False,
        strides=old.strides * (2 if landmark.kind == DOUBLING else 1),
        tolerance=old.tolerance,
    )
    general = Family(problem, family.over)
    point = problem.point(crossing.gait.model)
    across = _across(general, family, crossing)
    found = []
    for sign in (1, -1):
        for distance in DISTANCES:
            guess = point + sign * distance * across
            attempt = general.correct(guess, Slice(across, guess))
            near = np.linalg.norm(attempt.point - guess) < NEAR * distance
            if attempt.solved and near:
                gait = general.gait(attempt.point)
                if gait.flaw is None and _is_new(gait, landmark, old.strides):
                    found.append(gait)
                    break
    return found


def _is_new(gait: Gait, landmark: Landmark, strides: int) -> bool:
    """Whether a gait is off the branch that the landmark is on."""
    if landmark.kind == SYMMETRY_BREAKING:
        return not gait.symmetric
    if landmark.kind == DOUBLING:
        return examine(gait.model, strides=strides).residual > DOUBLED
    return True  # it lies across the branch, by the slice on which it was found


def _across(general: Family, family: Family, crossing: BranchPoint) -> Array:
    """The direction of the other branch: in the kernel, and across the old branch."""
    model, problem = crossing.gait.model, general.problem
    period = integrate(model.bind(problem.tolerance), model.apex_state(), crossings=problem.strides)
    matrix = general.general_matrix(linearize(period, general.parameters))
    along = family.general_direction(crossing.tangent, model.parameter_vector)
    along = along / np.linalg.norm(along)
    kernel = np.linalg.svd(matrix)[2][-2:]
    across = kernel - np.outer(kernel @ along, along)
    other: Array = across[int(np.argmax(np.linalg.norm(across, axis=1)))]
    return other / np.linalg.norm(other)
