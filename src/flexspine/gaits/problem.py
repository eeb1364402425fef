"""The equations whose solutions are gaits, with exact derivatives, in natural units.

Unknowns are coordinates of the apex, touchdown angles and whatever parameters are set free. A
general gait repeats after its strides; a symmetric one meets a symmetric point half a stride after
its apex, which takes half the work and fewer unknowns. Quantities that are fixed either leave the
unknowns or add an equation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexspine.gaits.parameter_scale import ParameterScale
from flexspine.gaits.problem_check import check_problem
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array, compile_system
from flexspine.hybrid.functions import balance, section_quantities
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.sensitivity import Deviation, propagate
from flexspine.hybrid.trajectory import HybridState, Trajectory
from flexspine.models.legs import ANGLES, SIDES
from flexspine.models.model import Model
from flexspine.parameters import values

# s; no stride of a gait takes longer.
LONGEST_STRIDE = 3.0

# Taylor steps; a stride takes some 30.
MOST_STEPS = 2000


@dataclass(frozen=True)
class Evaluation:
    """The equations at one point: ``residual`` (e,), or what kept the run from coming so far."""

    residual: Array | None
    trajectory: Trajectory
    bound: BoundSystem

    @property
    def norm(self) -> float:
        """The largest residual, infinite if there is none."""
        return float("inf") if self.residual is None else float(np.max(np.abs(self.residual)))

    @property
    def outcome(self) -> Outcome:
        """How the run ended."""
        return self.trajectory.outcome


class Linear(NamedTuple):
    """Derivatives in natural units: of the equations (e, u), and of quantities, by name (u,)."""

    matrix: Array
    slopes: dict[str, Array]


class Problem:
    """Gaits of ``model`` with some quantities fixed.

    ``fixed`` maps names to values: section coordinates, ``touchdown.fore`` and ``touchdown.hind``,
    ``energy`` (J), ``mean_speed`` (m/s). ``free`` are parameters that become unknowns. ``unknowns``
    are in the order of every vector here; a vector is in units of ``scales``. Raises
    `UnknownNameError`, and `ParameterError` for a symmetric problem of an animal that has no
    symmetry.
    """

    def __init__(
        self,
        model: Model,
        fixed: Mapping[str, float],
        *,
        free: tuple[str, ...] = (),
        symmetric: bool = False,
        strides: int = 1,
        tolerance: float,
    ) -> None:
        self.model, self.fixed, self.free = model.keeping(free), dict(fixed), free
        self.symmetric, self.strides, self.tolerance = symmetric, strides, tolerance
        self.system = self.model.system
        self.compiled = compile_system(self.system, tolerance)
        check_problem(self)
        spanned = self._spanned()
        self.unknowns = tuple(name for name in (*spanned, *ANGLES, *free) if name not in self.fixed)
        self._quantities = [name for name in ("energy", "mean_speed") if name in self.fixed]
        self._scale_of = {**dict.fromkeys(free, 1.0), **model.scales}
        self.scales = np.array([self._scale_of[name] for name in self.unknowns])
        given = values(model.parameters)
        self._counted = {name: self._count(name, given[name]) for name in free}
        self._lay_out(spanned)
        coordinates = self.system.section.coordinates
        self._section = [self.system.places[s] for s in coordinates.values()]
        if not symmetric:
            self._residual_scales = np.array([model.scales[name] for name in coordinates])
        self._energy = list(self.system.section.quantities).index("energy")
        self._x = model.state_names.index("com_x")

    def _count(self, name: str, given: float) -> ParameterScale:
        """How a free parameter is counted."""
        if name in self.model.may_vanish or given <= 0:
            return ParameterScale(self._scale_of[name], vanishes=True)
        return ParameterScale(given, vanishes=False)

    def _spanned(self) -> dict[str, dict[Any, int]]:
        """Coordinates of the start: by name, the states each one moves."""
        if self.symmetric and self.system.reversal:
            return {n: dict(moves) for n, moves in self.system.reversal.coordinates.items()}
        return {n: {s: 1} for n, s in self.system.section.coordinates.items()}

    def _lay_out(self, spanned: Mapping[str, Mapping[Any, int]]) -> None:
        """Note what each unknown moves, and what stands where nothing moves it."""
        model, system = self.model, self.system
        n, q = len(system.states), len(self.unknowns)
        self._base_states = np.zeros(n)
        self._base_parameters = model.parameter_vector.copy()
        state_moves, parameter_moves = np.zeros((n, q)), np.zeros((len(system.parameters), q))
        for name, moves in spanned.items():
            rows = [system.places[symbol] for symbol in moves]
            if name in self.unknowns:
                state_moves[rows, self.unknowns.index(name)] = list(moves.values())
            else:
                self._base_states[rows] = np.array(list(moves.values())) * self.fixed[name]
        for name in (*ANGLES, *self.free):
            row = model.parameter_names.index(name)
            if name in self.unknowns:
                parameter_moves[row, self.unknowns.index(name)] = 1.0
                self._base_parameters[row] = 0.0
            else:
                self._base_parameters[row] = self.fixed[name]
        self._state_moves = state_moves * self.scales
        self._parameter_moves = parameter_moves * self.scales
        self._places = {
            name: (model.parameter_names.index(name), self.unknowns.index(name))
            for name in self.free
        }
        self._held = np.zeros(len(system.held))

    def moves(self, parameters: Array) -> tuple[Array, Array]:
        """What each unknown moves, SI per natural unit: states (n, u) and parameters (p, u).

        What free parameters move depends on where they are.
        """
        moves = self._parameter_moves.copy()
        for name, (row, column) in self._places.items():
            moves[row, column] = self._counted[name].slope(float(parameters[row]))
        return self._state_moves, moves

    def unit_of(self, name: str, value: float) -> float:
        """What a natural unit of an unknown is at a value of it, SI."""
        return self._counted[name].slope(value) if name in self._counted else self.scale_of(name)

    def coordinate(self, name: str, value: float) -> float:
        """The entry of a vector that stands for a value of an unknown, SI."""
        if name in self._counted:
            return self._counted[name].coordinate(value)
        return value / self.scale_of(name)

    @property
    def surplus(self) -> int:
        """How many more unknowns than independent equations there are.

        A conserved energy makes one of the equations of repetition follow from the others.
        """
        section = self.system.section
        if self.symmetric and self.system.reversal:
            count = len(self.system.reversal.balance["DF"])
        else:
            count = len(section.coordinates) - len(section.conserved)
        return len(self.unknowns) - count - len(self._quantities)

    def fixing(self, name: str, value: float) -> Problem:
        """The same problem with one more quantity fixed."""
        return Problem(
            self.model,
            {**self.fixed, name: value},
            free=self.free,
            symmetric=self.symmetric,
            strides=self.strides,
            tolerance=self.tolerance,
        )

    def point(self, model: Model) -> Array:
        """Return the vector that describes a model's apex, touchdown angles and parameters."""
        return np.array([self.coordinate(name, model.numbers[name]) for name in self.unknowns])

    def values(self, point: Array) -> dict[str, float]:
        """Return apex, touchdown angles and free parameters of a point, by name."""
        states, parameters = self.expand(point)
        names = self.system.section.coordinates
        table = dict(zip(names, states[self._section].tolist(), strict=True))
        for name in (*ANGLES, *self.free):
            table[name] = float(parameters[self.model.parameter_names.index(name)])
        return table

    def at(self, point: Array) -> Model:
        """Return the model with the values of a point. Raises `ParameterError` out of bounds."""
        table = self.values(point)
        return self.model.with_values(
            {name: table[name] for name in self.free},
            apex={name: table[name] for name in self.system.section.coordinates},
            touchdown={side: table[f"touchdown.{side}"] for side in SIDES},
            origin="found by gait search",
        )

    def expand(self, point: Array) -> tuple[Array, Array]:
        """Return the states and the parameters that a point stands for."""
        parameters = self._base_parameters + self._parameter_moves @ point
        for name, (row, column) in self._places.items():
            parameters[row] = self._counted[name].value(float(point[column]))
        return self._base_states + self._state_moves @ point, parameters

    def evaluate(self, point: Array, *, record: bool = False) -> Evaluation:
        """Run from a point and evaluate the equations; ``record`` keeps dense output."""
        states, parameters = self.expand(point)
        bound = BoundSystem(self.compiled, parameters)
        reversal = self.system.reversal
        trajectory = integrate(
            bound,
            HybridState(0.0, self.system.section.mode, states, self._held),
            crossings=1 if self.symmetric else self.strides,
            section=reversal.middle if self.symmetric and reversal else None,
            section_timeout=LONGEST_STRIDE,
            max_steps=MOST_STEPS,
            record=record,
        )
        if not trajectory.outcome.completed:
            return Evaluation(None, trajectory, bound)
        return Evaluation(self._residual(trajectory), trajectory, bound)

    def _residual(self, trajectory: Trajectory) -> Array:
        start, end = trajectory.start, trajectory.end
        if self.symmetric:
            functions = balance(self.system, end.mode)
            parameters = trajectory.bound.parameters
            answer = functions(end.states, end.held, parameters).values
            parts = (answer / self._balance_scales(end.mode)).tolist()
        else:
            change = end.states[self._section] - start.states[self._section]
            parts = (change / self._residual_scales).tolist()
        for name in self._quantities:
            parts.append((self.measure(trajectory, name) - self.fixed[name]) / self.scale_of(name))
        return np.array(parts)

    def _balance_scales(self, mode: str) -> Array:
        reversal = self.system.reversal
        assert reversal is not None
        return np.array([self.scale_of(name) for name in reversal.balance[mode]])

    def measure(self, trajectory: Trajectory, name: str) -> float:
        """Return the ``energy`` (J) or the ``mean_speed`` (m/s) of a run from apex on."""
        start, end = trajectory.start, trajectory.end
        if name == "mean_speed":
            return float(end.states[self._x] - start.states[self._x]) / trajectory.duration
        quantities = section_quantities(self.system)
        answer = quantities(start.states, start.held, trajectory.bound.parameters)
        return float(answer.values[self._energy])

    def scale_of(self, name: str) -> float:
        """Return the natural scale of a quantity or unknown, SI."""
        return float(self._scale_of[name])

    def linearize(self, evaluation: Evaluation) -> Linear:
        """Differentiate the equations and the quantities at an evaluated point."""
        trajectory = evaluation.trajectory
        start, end, parameters = trajectory.start, trajectory.end, trajectory.bound.parameters
        state_moves, parameter_moves = self.moves(parameters)
        still = np.zeros((len(self.system.held), len(self.unknowns)))
        moved = propagate(trajectory, Deviation(state_moves, still, parameter_moves))
        if self.symmetric:
            at_end = balance(self.system, end.mode)(end.states, end.held, parameters)
            rows = (
                at_end.by_states @ moved.states
                + at_end.by_held @ moved.held
                + at_end.by_parameters @ parameter_moves
            ) / self._balance_scales(end.mode)[:, None]
        else:
            change = moved.states[self._section] - state_moves[self._section]
            rows = change / self._residual_scales[:, None]
        at_start = section_quantities(self.system)(start.states, start.held, parameters)
        energy = at_start.by_states[self._energy] @ state_moves
        energy += at_start.by_parameters[self._energy] @ parameter_moves
        speed = self.measure(trajectory, "mean_speed")
        faster = (moved.states[self._x] - speed * moved.time) / trajectory.duration
        slopes = {
            "energy": energy / self.scale_of("energy"),
            "mean_speed": faster / self.scale_of("mean_speed"),
        }
        matrix = np.vstack([rows, *(slopes[name] for name in self._quantities)])
        return Linear(matrix, slopes)
