"""A one-parameter family of gaits: its points with tangent, multipliers and test functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.newton import Attempt, Slice, solve
from flexspine.gaits.problem import Problem
from flexspine.gaits.return_map import ReturnMap, linearize, section_rows
from flexspine.gaits.stability import Stability, floquet_multipliers
from flexspine.hybrid.compile import Array
from flexspine.hybrid.functions import section_quantities
from flexspine.models.legs import ANGLES

# Iterations of a corrector; one that needs more has started too far away.
CORRECTOR_ITERATIONS = 8

FOLD, BRANCHING = "fold", "branch point"
DOUBLING, NEIMARK_SACKER, UNIT = "period doubling", "Neimark-Sacker", "multiplier +1"


@dataclass(frozen=True)
class BranchPoint:
    """A gait of a branch, with its stability.

    ``value`` is that of the quantity the branch is followed in (SI); ``point`` and ``tangent``
    (u,) are the unknowns and the direction of the branch, in natural units. ``tests`` vanish where
    something happens: a ``fold``, a ``branch point``, or a multiplier on the unit circle.
    """

    gait: Gait
    stability: Stability
    value: float
    point: Array
    tangent: Array
    tests: Mapping[str, float] = field(default_factory=dict)

    def turned(self) -> BranchPoint:
        """Return the same point, seen from the other direction."""
        flipped = {name: -self.tests[name] for name in (FOLD, BRANCHING)}
        return replace(self, tangent=-self.tangent, tests={**self.tests, **flipped})


@dataclass(frozen=True)
class Refuted:
    """A solution of the equations at which the orbit does not close, or is no gait."""

    gait: Gait
    point: Array


class Family:
    """The gaits that solve a problem with one unknown too many, followed in ``over``."""

    def __init__(self, problem: Problem, over: str) -> None:
        self.problem, self.over = problem, over
        system, model = problem.system, problem.model
        coordinates = system.section.coordinates
        self._inputs = (*coordinates, *ANGLES, *problem.free)
        self._scales = np.array([problem.scale_of(name) for name in self._inputs])
        self._columns = [i for i, name in enumerate(self._inputs) if name not in problem.fixed]
        self._rows = len(coordinates)
        self.parameters = tuple(
            system.parameters[model.parameter_names.index(name)]
            for name in (*ANGLES, *problem.free)
        )
        self._dropped: int | None = None

    @property
    def conservative(self) -> bool:
        """Whether all its gaits keep their energy, whatever its parameters."""
        return bool(self.problem.system.section.conserved)

    def tangent(self, matrix: Array, towards: Array) -> Array:
        """The unit tangent of the family, on the side of ``towards``."""
        tangent: Array = np.linalg.svd(matrix)[2][-1]
        return tangent if tangent @ towards >= 0 else -tangent

    def correct(self, guess: Array, cut: Slice) -> Attempt:
        """Solve on a slice across the family."""
        return solve(
            self.problem, guess, cut=cut, iterations=CORRECTOR_ITERATIONS, longest_step=0.1
        )

    def visit(self, attempt: Attempt, towards: Array) -> BranchPoint | Refuted:
        """Make a point of a solution, its tangent on the side of ``towards``."""
        linear = self.problem.linearize(attempt.evaluation)
        tangent = self.tangent(linear.matrix, towards)
        gait = self.gait(attempt.point)
        if gait.flaw is not None:
            return Refuted(gait, attempt.point)
        returned = linearize(gait.trajectory, self.parameters)
        stability = floquet_multipliers(gait, returned)
        slopes = linear.slopes
        slope = (
            slopes[self.over] @ tangent
            if self.over in slopes
            else tangent[self.problem.unknowns.index(self.over)]
        )
        tests = {FOLD: float(slope), BRANCHING: self._branching(returned, tangent)}
        tests |= _circle(stability)
        return BranchPoint(gait, stability, self.value(gait), attempt.point, tangent, tests)

    def gait(self, point: Array) -> Gait:
        """The gait at a point, with or without flaw."""
        problem = self.problem
        return examine(problem.at(point), strides=problem.strides, tolerance=problem.tolerance)

    def value(self, gait: Gait) -> float:
        """The value of ``over``, SI."""
        return {**gait.model.numbers, **gait.quantities}[self.over]

    def general_matrix(self, returned: ReturnMap) -> Array:
        """The equations of a general gait at a gait of the family, symmetric or not.

        Natural units; unknowns are section coordinates, touchdown angles and free parameters.
        Where energy is conserved one row follows from the others and is left out.
        """
        problem, system = self.problem, self.problem.system
        rows, start = section_rows(system), returned.trajectory.start
        parameters = returned.trajectory.bound.parameters
        images = returned.states[rows] - np.eye(self._rows, len(self._inputs))
        units = self._units(parameters)
        scaled = images * units / self._scales[: self._rows, None]
        quantities = section_quantities(system)(start.states, start.held, parameters)
        at = [system.places[p] for p in self.parameters]
        energy = np.concatenate([quantities.by_states[0][rows], quantities.by_parameters[0][at]])
        if self.conservative:
            if self._dropped is None:
                weights = energy[: self._rows] * self._scales[: self._rows]
                self._dropped = int(np.argmax(np.abs(weights)))
            scaled = np.delete(scaled, self._dropped, axis=0)
        speed = problem.measure(returned.trajectory, "mean_speed")
        x = problem.model.state_names.index("com_x")
        faster = (returned.states[x] - speed * returned.time) / returned.trajectory.duration
        extra = {"energy": energy, "mean_speed": faster}
        for name, row in extra.items():
            if name in problem.fixed:
                scaled = np.vstack([scaled, row * units / problem.scale_of(name)])
        matrix: Array = scaled[:, self._columns]
        return matrix

    def _units(self, parameters: Array) -> Array:
        """What a natural unit of each input is, SI."""
        units, problem = self._scales.copy(), self.problem
        for name in problem.free:
            value = parameters[problem.model.parameter_names.index(name)]
            units[self._inputs.index(name)] = problem.unit_of(name, float(value))
        return units

    def general_direction(self, direction: Array, at_parameters: Array) -> Array:
        """A direction of this family's unknowns among those of the general equations."""
        problem = self.problem
        states, parameters = problem.moves(at_parameters)
        rows = section_rows(problem.system)
        at = [problem.system.places[p] for p in self.parameters]
        whole: Array = np.concatenate([states[rows] @ direction, parameters[at] @ direction])
        general: Array = (whole / self._units(at_parameters))[self._columns]
        return general

    def _branching(self, returned: ReturnMap, tangent: Array) -> float:
        """Changes sign where another family crosses this one."""
        matrix = self.general_matrix(returned)
        along = self.general_direction(tangent, returned.trajectory.bound.parameters)
        bordered = np.vstack([matrix, along / np.linalg.norm(along)])
        return float(np.linalg.det(bordered))


def _circle(stability: Stability) -> dict[str, float]:
    """What vanishes when a multiplier meets the unit circle, on the energy level."""
    multipliers = stability.level_multipliers
    pairs = [a * b - 1 for a, b in combinations(multipliers, 2)]
    return {
        UNIT: float(np.real(np.prod(multipliers - 1))),
        DOUBLING: float(np.real(np.prod(multipliers + 1))),
        NEIMARK_SACKER: float(np.real(np.prod(pairs))),
    }
