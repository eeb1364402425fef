"""Bounders that are steered: once or twice a stride, at apexes, some of their parameters change.

What is steered (touchdown angles, thrust) becomes a held variable of the hybrid system, so that a
run of a thousand strides is one run, with exact events, recorded like any other.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.gaits.return_map import section_rows
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array, compile_system
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.system import HybridSystem, Mode
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.bounder import STOOD
from flexspine.models.model import TOLERANCES, Model, check_between
from flexspine.models.simulation import DEFAULT_TOLERANCE, Run, check_count
from flexspine.models.underfoot import TOES, OnGround, lose
from flexspine.parameters import check_seed, is_number, shortened

# Natural units; nothing survives a hundredth of it.
LOUDEST = 10.0

# What no touchdown angle is steered beyond, in rad from the vertical.
STEEPEST_LEG = 1.4

# How far anything else is steered away from what it was, in natural units: a quarter of a leg.
FARTHEST = 0.25


@dataclass(frozen=True)
class Noise:
    """What measuring and acting are off by, drawn anew at every apex.

    ``sensing`` is the standard deviation of Gaussian noise on the apex coordinates, in their
    natural units. ``acting`` is relative to what was to be done: the half-width of even noise if
    ``uniform``, the standard deviation of Gaussian noise otherwise. Raises `ParameterError`.
    """

    sensing: float = 0.0
    acting: float = 0.0
    uniform: bool = False

    def __post_init__(self) -> None:
        for name, size in (("sensing", self.sensing), ("acting", self.acting)):
            if not (is_number(size) and 0 <= size <= LOUDEST):
                raise ParameterError(
                    f"{name} noise = {shortened(size)} is not usable",
                    f"give a number from 0 to {LOUDEST:g}",
                )


class Steering(ABC):
    """What a controller does at apexes; controllers are kinds of it, such as `Stabilizer`.

    ``inputs`` are the parameters it sets, by dotted name: touchdown angles, thrust.
    """

    inputs: tuple[str, ...]

    @property
    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """All that decides what it does, as JSON holds it."""

    @abstractmethod
    def check(self, model: Model) -> None:
        """Raise `ParameterError` if this steering is not for such a model."""

    @abstractmethod
    def at_apex(self, apex: Array) -> Array:
        """Return the inputs (u,) for section coordinates (d,) at an apex after both stances.

        SI and radians. Where the ground is not flat the height is that above the ground below the
        CoM.
        """

    def between(self, apex: Array, before: Array) -> Array:
        """Return the inputs at an apex between the stances; ``before`` are those at work now."""
        return before


@dataclass(frozen=True)
class Fixed(Steering):
    """Inputs that never change."""

    inputs: tuple[str, ...]
    values: Array

    @property
    def settings(self) -> dict[str, Any]:
        """The inputs and their values."""
        return dict(zip(self.inputs, self.values.tolist(), strict=True))

    def check(self, model: Model) -> None:
        """Any will do."""

    def at_apex(self, apex: Array) -> Array:
        """The same as ever."""
        return self.values


@lru_cache(maxsize=64)
def steered_system(system: HybridSystem, inputs: tuple[sp.Symbol, ...]) -> HybridSystem:
    """The same system, in which some parameters are set at every apex."""
    built: dict[str, Mode] = {}

    def mode(name: str) -> Mode:
        if name not in built:
            found = system.mode(name)
            guards = tuple(
                replace(guard, decide=_between) if guard.name in system.section.guards else guard
                for guard in found.guards
            )
            built[name] = replace(found, guards=guards)
        return built[name]

    return replace(
        system,
        held=(*system.held, *inputs),
        parameters=tuple(p for p in system.parameters if p not in inputs),
        mode=mode,
        section=replace(system.section, act=_at_apex),
        reversal=None,
    )


class SteeredBounder(OnGround):
    """A steered system with its numbers. Raises `UnknownNameError` for inputs it does not have."""

    def __init__(
        self, model: Model, steering: Steering, tolerance: float, noise: Noise, seed: int
    ) -> None:
        names = model.parameter_names
        for name in steering.inputs:
            if name not in names:
                raise UnknownNameError("parameter", name, names)
        model = model.keeping(steering.inputs)
        symbols = tuple(model.system.parameters[names.index(name)] for name in steering.inputs)
        system = steered_system(model.system, symbols)
        own = dict(zip(model.system.parameters, model.parameter_vector.tolist(), strict=True))
        numbers = np.array([own[symbol] for symbol in system.parameters])
        steering.check(model)
        super().__init__(compile_system(system, tolerance), numbers, model.ground)
        self.model, self.steering, self.noise = model, steering, noise
        self._random = np.random.default_rng(seed)
        self._rows = section_rows(system)
        self._height = list(system.section.coordinates).index("height")
        self._inputs = [system.places[symbol] for symbol in symbols]
        angles = np.array([name.startswith("touchdown.") for name in steering.inputs])
        usual = np.array([model.numbers[name] for name in steering.inputs])
        reach = FARTHEST * np.array([model.unit_of(name) for name in steering.inputs])
        self._least = np.where(angles, -STEEPEST_LEG, usual - reach)
        self._most = np.where(angles, STEEPEST_LEG, usual + reach)
        self._stood = [system.places[flag] for flag in STOOD]
        self._scales = np.array([model.scales[name] for name in system.section.coordinates])

    def start(self) -> HybridState:
        """The model's apex, steered."""
        apex = self.model.apex_state()
        held = np.zeros(len(self.system.held))
        held[: len(apex.held)] = apex.held
        return self.steer(HybridState(apex.time, apex.mode, apex.states, held), between=False)

    def steer(self, point: HybridState, *, between: bool) -> HybridState:
        """Set the inputs at an apex."""
        x = float(point.states[0])
        apex = point.states[self._rows]
        if self.ground is not None:
            apex[self._height] -= self.ground.height(x)
        if self.noise.sensing:
            off = self._random.standard_normal(len(apex))
            apex = apex + self.noise.sensing * off * self._scales
        before = point.held[self._inputs]
        wanted = self.steering.between(apex, before) if between else self.steering.at_apex(apex)
        if np.shape(wanted) != np.shape(self._inputs):
            found, due = np.shape(wanted), np.shape(self._inputs)
            raise ParameterError(
                f"steering gives an array of shape {found}, not {due}",
                f"return an array of one for each of {', '.join(self.steering.inputs)}",
            )
        held = point.held.copy()
        held[self._inputs] = self._done(wanted, before) if between else self._done(wanted)
        if self.ground is not None:
            lose(held, self.system.places, x, TOES.values())
        return point._replace(held=held)

    def _done(self, wanted: Array, before: Array | None = None) -> Array:
        """What becomes of what is wanted. What stays as it was is not drawn anew."""
        done = wanted.copy()
        if self.noise.acting:
            size = len(wanted)
            draw = self._random.uniform(-1, 1, size) if self.noise.uniform else None
            off = self._random.standard_normal(size) if draw is None else draw
            done = wanted * (1 + self.noise.acting * off)
        done = np.clip(done, self._least, self._most)
        return done if before is None else np.where(wanted == before, before, done)

    def inputs_of(self, point: HybridState) -> dict[str, float]:
        """What is steered at a point, by name."""
        now = point.held[self._inputs].tolist()
        return dict(zip(self.steering.inputs, now, strict=True))

    def alone(self, point: HybridState) -> bool:
        """Whether one leg only has stood since the latest apex after both."""
        return bool(point.held[self._stood].sum() == 1)


def _at_apex(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    assert isinstance(bound, SteeredBounder)
    return bound.steer(point, between=False)


def _between(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    assert isinstance(bound, SteeredBounder)
    return bound.steer(point, between=True) if bound.alone(point) else None


@dataclass(frozen=True, repr=False)
class SteeredRun(Run):
    """A `Run` under a controller, ``steering``; ``model`` is where it began.

    ``noise`` and its ``seed`` are those that the run was made with.
    """

    steering: Steering = field(kw_only=True)
    noise: Noise = field(kw_only=True)
    seed: int = field(kw_only=True)

    @property
    def remarks(self) -> dict[str, str]:
        """What was steered, unless it never changed, and with which noise."""
        told = (
            {} if isinstance(self.steering, Fixed) else {"steered": ", ".join(self.steering.inputs)}
        )
        if self.noise.acting:
            kind = "uniform up to" if self.noise.uniform else "Gaussian of"
            told["noise on what is steered"] = f"{kind} {100 * self.noise.acting:g} %"
        if self.noise.sensing:
            told["noise on the apex"] = f"{self.noise.sensing:g}"
        return told

    @property
    def inputs(self) -> list[dict[str, float]]:
        """What was steered, from each apex of ``apexes`` on, by name."""
        bound = self.trajectory.bound
        assert isinstance(bound, SteeredBounder)
        return [bound.inputs_of(point) for point in self.section_points]


def steer(
    model: Model,
    steering: Steering,
    *,
    strides: int = 1,
    noise: Noise | None = None,
    seed: int = 0,
    tolerance: float = DEFAULT_TOLERANCE,
    record: bool = False,
) -> SteeredRun:
    """Simulate ``strides`` strides from the model's apex under a controller.

    ``steering`` is one, such as `stabilize` designs. Without ``record`` only the apexes are kept,
    not the motion between them. ``noise`` is none by default; the same seed repeats the same.
    ``tolerance`` is the integrator's, between 1e-17 and 1e-3. A run that falls is no error: look at
    ``outcome``. Raises `ParameterError` and `UnknownNameError`.
    """
    wanted = check_count("strides", strides)
    seed = check_seed(seed)
    noise = noise or Noise()
    tolerance = check_between("tolerance", tolerance, *TOLERANCES)
    bound = SteeredBounder(model, steering, tolerance, noise, seed)
    trajectory = integrate(bound, bound.start(), crossings=wanted, record=record)
    return SteeredRun(bound.model, trajectory, tolerance, steering=steering, noise=noise, seed=seed)
