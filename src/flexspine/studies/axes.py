"""Axes of a sweep: what varies, and where a grid or a sample puts its points."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexspine.errors import InputError, ParameterError
from flexspine.gaits.gait import examine
from flexspine.hybrid.compile import Array
from flexspine.models.many import make_cases, start_energies
from flexspine.models.model import Model
from flexspine.models.simulation import check_count
from flexspine.parameters import is_finite, shortened
from flexspine.studies.walkers import Walker

# What is known of a gait only.
OF_GAITS = ("energy", "mean_speed")

GRID, RANDOM, SOBOL = "grid", "random", "sobol"
METHODS = (GRID, RANDOM, SOBOL)

# Points a model, 4 thousand million; a Sobol sequence of so many binary digits has no more.
SOBOL_BITS = 32
MOST_POINTS = 2**SOBOL_BITS

FORMS = (
    "write a list of values, {low = ..., high = ...}, {around = SHARE} or {within = AMOUNT}, "
    'and steps = COUNT for a grid; or speed = {keeps = "energy"}'
)


@dataclass(frozen=True)
class Axis:
    """What varies in a sweep, and over which values.

    ``name`` is that of a parameter (dotted), an apex coordinate, a touchdown angle, or of
    ``energy`` and ``mean_speed``. ``values`` are listed, or there is a range with ``steps`` points
    on a grid: from ``low`` to ``high``, or about a model's own value, ``around`` it by a share or
    ``within`` an amount (SI, radians). An axis that ``keeps`` the energy follows from the others:
    it is the apex speed at which a start has the energy of the model's own, 0 where it has more at
    rest.
    """

    name: str
    values: tuple[float, ...] = ()
    low: float | None = None
    high: float | None = None
    around: float | None = None
    within: float | None = None
    steps: int | None = None
    keeps: str | None = None

    @classmethod
    def read(cls, name: str, content: Any) -> Axis:
        """Make an axis of what a file says of it. Raises `InputError`."""
        if isinstance(content, (list, tuple)):
            if not content or not all(map(is_finite, content)):
                raise InputError(f"axis '{name}' is not a list of numbers", FORMS)
            return cls(name, tuple(map(float, content)))
        if (name, content) == ("speed", {"keeps": "energy"}):
            return cls(name, keeps="energy")
        keys = set(content) if isinstance(content, Mapping) else set()
        if keys - {"steps"} not in ({"low", "high"}, {"around"}, {"within"}):
            raise InputError(f"axis '{name}' is not understood", FORMS)
        bounds = {key: content[key] for key in keys - {"steps"}}
        for key, value in bounds.items():
            if not is_finite(value):
                raise InputError(f"axis '{name}': {key} = {shortened(value)} is no number", FORMS)
        steps = content.get("steps")
        if steps is not None:
            steps = check_count(f"axis '{name}': steps", steps)
        numbers: dict[str, Any] = {key: float(value) for key, value in bounds.items()}
        axis = cls(name, steps=steps, **numbers)
        for key in ("around", "within"):
            if numbers.get(key, 0.0) < 0:
                raise InputError(f"axis '{name}': {key} = {numbers[key]:g} is negative", FORMS)
        if steps == 1:
            raise InputError(f"axis '{name}': one step makes no range", "give 2, or a list")
        low, high = axis.range(1.0)
        if not low <= high:
            raise InputError(f"axis '{name}' goes from {low:g} down to {high:g}", "swap them")
        return axis

    def record(self) -> Any:
        """Return what a file would say of it."""
        if self.values:
            return list(map(float, self.values))
        bounds = {n: getattr(self, n) for n in ("low", "high", "around", "within")}
        record = {n: float(value) for n, value in bounds.items() if value is not None}
        others = {"steps": self.steps, "keeps": self.keeps}
        return record | {n: value for n, value in others.items() if value is not None}

    def range(self, own: float) -> tuple[float, float]:
        """Return the lowest and the highest value for a model whose own is ``own``."""
        if self.values:
            return min(self.values), max(self.values)
        if self.low is not None and self.high is not None:
            return self.low, self.high
        if self.keeps:
            return own, own
        room = self.within if self.around is None else self.around * abs(own)
        assert room is not None
        return own - room, own + room

    def own(self, model: Model | Walker) -> float:
        """Return the value of a model that the axis is about, NaN if it is about none."""
        about = self.around is not None or self.within is not None
        return own_value(model, self.name) if about else float("nan")

    def grid(self, own: float) -> Array:
        """Return its values on a grid, for a model whose own is ``own``."""
        if self.values:
            return np.array(self.values)
        assert self.steps is not None
        low, high = self.range(own)
        return np.linspace(low, high, self.steps)

    def sample(self, own: float, share: Array) -> Array:
        """Return its values at shares (k,) from 0 to 1 of it, shape (k,)."""
        if self.values:
            places = np.minimum((share * len(self.values)).astype(int), len(self.values) - 1)
            chosen: Array = np.array(self.values)[places]
            return chosen
        low, high = self.range(own)
        return low + (high - low) * share


def own_value(model: Model | Walker, name: str) -> float:
    """A model's own value of what an axis varies; NaN if it has no such thing.

    Raises `ParameterError` for the mean speed or the energy of a model that starts on no gait.
    """
    if name not in OF_GAITS or isinstance(model, Walker):
        return {**model.numbers}.get(name, float("nan"))
    gait = examine(model)
    if gait.flaw is not None:
        raise ParameterError(
            f"'{model.name}' has no {name} of its own, as it starts on no gait",
            f"give {name} as {{low = ..., high = ...}}",
        )
    return gait.quantities[name]


def grid_points(
    model: Model | Walker, axes: tuple[Axis, ...], first: int, count: int
) -> dict[str, Array]:
    """Points of a grid by number; the last axis changes fastest."""
    free = free_axes(axes)
    lines = [axis.grid(axis.own(model)) for axis in free]
    places = np.unravel_index(np.arange(first, first + count), [len(line) for line in lines])
    points = {a.name: line[place] for a, line, place in zip(free, lines, places, strict=True)}
    return _completed(model, axes, points)


def sampled_points(
    model: Model | Walker,
    axes: tuple[Axis, ...],
    method: str,
    seed: tuple[int, ...],
    first: int,
    count: int,
) -> dict[str, Array]:
    """Points of a sample by number; they do not depend on which others are asked for."""
    free = free_axes(axes)
    sequence = np.random.SeedSequence(seed)
    if method == SOBOL:
        from scipy.stats import qmc

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of lengths that are no powers of two
            engine = qmc.Sobol(len(free), bits=SOBOL_BITS, rng=np.random.default_rng(sequence))
            shares = (engine.fast_forward(first) if first else engine).random(count)
    else:
        bits = np.random.PCG64(sequence)
        bits.advance(first * len(free))
        shares = np.random.Generator(bits).random((count, len(free)))
    points = {axis.name: axis.sample(axis.own(model), shares[:, i]) for i, axis in enumerate(free)}
    return _completed(model, axes, points)


def free_axes(axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """The axes that do not follow from others."""
    return tuple(axis for axis in axes if not axis.keeps)


def _completed(
    model: Model | Walker, axes: tuple[Axis, ...], points: dict[str, Array]
) -> dict[str, Array]:
    """Add what follows from other axes, and keep the order."""
    made = {}
    if isinstance(model, Model):
        made = {axis.name: _speeds(model, points) for axis in axes if axis.keeps}
    return {axis.name: {**points, **made}[axis.name] for axis in axes}


def _speeds(model: Model, points: dict[str, Array]) -> Array:
    """Apex speeds at which starts have the energy of the model's own start."""
    given = {name: column for name, column in points.items() if name in model.numbers}
    own = start_energies(make_cases(model, {}))
    at_rest, at_one = (start_energies(make_cases(model, {**given, "speed": v})) for v in (0.0, 1.0))
    # The CoM is a state, so that its speed enters by its square alone.
    squares = (own - at_rest) / (at_one - at_rest)
    speeds: Array = np.copysign(np.sqrt(np.maximum(squares, 0.0)), model.apex["speed"])
    return speeds


def grid_size(axes: tuple[Axis, ...]) -> int:
    """How many points a grid has. Raises `ParameterError`."""
    size = 1
    for axis in free_axes(axes):
        if not axis.values and axis.steps is None:
            raise ParameterError(f"axis '{axis.name}' has no steps", "give steps = COUNT")
        size *= len(axis.values) or axis.steps or 1
    return check_points(size)


def check_points(count: int) -> int:
    """Return how many points there are. Raises `ParameterError` if they are too many."""
    if count > MOST_POINTS:
        raise ParameterError("there are too many points", f"have no more than {MOST_POINTS}")
    return count
