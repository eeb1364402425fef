"""Feedback at apexes that makes a gait stable, designed on the exact derivative of its stride.

With deviations ``x`` of the apex and ``u`` of what is steered, ``x' = A x + B u``. Angles cannot
change the energy of a passive animal: its multiplier 1 stays, and gains are found on the energy
level. All numbers are in natural units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexspine.control.steering import Steering
from flexspine.errors import FlexspineError, ParameterError, UnknownNameError
from flexspine.gaits.gait import Gait
from flexspine.gaits.return_map import linearize, section_rows
from flexspine.hybrid.compile import Array
from flexspine.hybrid.functions import section_quantities
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.system import Section
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.bounder import STOOD
from flexspine.models.legs import ANGLES
from flexspine.models.model import Model, check_between

METHODS = ("lqr", "deadbeat")

# Of what a deviation costs, in natural units; what steering costs for as much of it.
EFFORT = 0.1
EFFORTS = 1e-9, 1e9

# Riccati equations are iterated until gains change by less; they converge geometrically.
SETTLED, MOST_ROUNDS = 1e-13, 10_000

# Relative; below this an input moves nothing, and gains would have no bounds.
WEAK = 1e-9


class Part(NamedTuple):
    """From one apex to the next at which something is done, in natural units.

    ``matrix`` (d, d) and ``inputs`` (d, u) map deviations; ``apex`` (d,) is where it begins, SI.
    ``level`` (c, d) spans what may be steered: all, or the energy level.
    """

    matrix: Array
    inputs: Array
    apex: Array
    level: Array


@dataclass(frozen=True)
class Stabilizer(Steering):
    """Linear feedback around a gait, ``u = u0 - K (x - x0)``, as `stabilize` designs it.

    ``inputs`` are what is steered, by dotted name, ``method`` is how gains were found. ``gains``
    has a matrix (u, d) in natural units for the apex after both stances and, if it acts twice a
    stride, one for the apex between them; ``parts`` are the derivatives of the stride from each of
    these to the next.
    """

    gait: Gait
    inputs: tuple[str, ...]
    method: str
    parts: tuple[Part, ...]
    gains: tuple[Array, ...]

    @property
    def settings(self) -> dict[str, Any]:
        """What it steers, around what, and its gains."""
        return {
            "inputs": list(self.inputs),
            "usual": self.usual.tolist(),
            "apexes": [part.apex.tolist() for part in self.parts],
            "gains": [gain.tolist() for gain in self.gains],
        }

    def check(self, model: Model) -> None:
        """Raise `ParameterError` for a model of another kind than the gait's."""
        if model.kind is not self.gait.model.kind:
            raise ParameterError(
                f"feedback for '{self.gait.model.kind.name}' cannot steer '{model.kind.name}'",
                "design it on a gait of this model",
            )

    @property
    def twice(self) -> bool:
        """Whether it acts between the stances too."""
        return len(self.parts) == 2

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers of the stride under feedback, largest first, shape (d,)."""
        whole = np.eye(len(self.parts[0].matrix))
        for part, gain in zip(self.parts, self.gains, strict=True):
            whole = (part.matrix - part.inputs @ gain) @ whole
        found = np.linalg.eigvals(whole).astype(complex)
        return found[np.argsort(-np.abs(found), kind="stable")]

    @cached_property
    def level_spectral_radius(self) -> float:
        """The largest magnitude of a multiplier but that of a conserved energy, which is 1."""
        sizes = np.abs(self.multipliers)
        if len(self.parts[0].level) == len(sizes):
            return float(sizes[0])
        return float(np.sort(np.delete(sizes, np.argmin(np.abs(self.multipliers - 1))))[-1])

    def at_apex(self, apex: Array) -> Array:
        """Return the gait's inputs, corrected."""
        return self._corrected(0, apex)

    def between(self, apex: Array, before: Array) -> Array:
        """Return the gait's inputs, corrected anew if it acts twice."""
        return self._corrected(1, apex) if self.twice else before

    @cached_property
    def _scales(self) -> tuple[Array, Array]:
        """Natural units of the apex and of the inputs, SI."""
        return _scales(self.gait.model, self.inputs)

    @cached_property
    def usual(self) -> Array:
        """The inputs of the gait, shape (u,), SI."""
        return np.array([self.gait.model.numbers[name] for name in self.inputs])

    def _corrected(self, number: int, apex: Array) -> Array:
        states, inputs = self._scales
        off = (apex - self.parts[number].apex) / states
        found: Array = self.usual - self.gains[number] @ off * inputs
        return found


def stabilize(
    gait: Gait,
    inputs: tuple[str, ...] = ANGLES,
    *,
    method: str = "lqr",
    twice: bool = False,
    effort: float = EFFORT,
) -> Stabilizer:
    """Design feedback from the apex (``twice``: from both flight apexes) to ``inputs``.

    ``inputs`` are parameters by dotted name: touchdown angles, thrust such as ``legs.extension``.
    ``method`` is ``lqr`` (a linear quadratic regulator), which weighs deviations against ``effort``
    times what steering takes, in natural units, or ``deadbeat``, which is done in as few strides as
    can be. Raises `UnknownNameError`, `ParameterError` for what cannot be asked for, and
    `FlexspineError` for a gait that cannot be stabilised so.

    >>> from flexspine import examine, load_model, stabilize
    >>> gait = examine(load_model("kamimura2015-flexible"))
    >>> feedback = stabilize(gait, twice=True)
    >>> f"{feedback.level_spectral_radius:.2f}"
    '0.64'
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS)
    if isinstance(inputs, str):
        raise ParameterError(f"inputs = '{inputs}' is one name", "give a tuple of names")
    check_between("effort", effort, *EFFORTS)
    if gait.strides != 1:
        raise ParameterError(
            f"the gait repeats after {gait.strides} strides only", "give one of a single stride"
        )
    names = gait.model.parameter_names
    for name in inputs:
        if name not in names:
            raise UnknownNameError("parameter", name, names)
    if not inputs:
        raise ParameterError("there is nothing to steer", f"steer {', '.join(ANGLES)}")
    for name in inputs:
        if inputs.count(name) > 1:
            raise ParameterError(f"'{name}' is to be steered twice", "name it once")
    if method == "deadbeat" and twice:
        raise ParameterError("deadbeat feedback acts once a stride", "take lqr to act twice")
    parts = _parts(gait, inputs, twice)
    gains = _lqr(parts, effort) if method == "lqr" else (_deadbeat(parts[0]),)
    found = Stabilizer(gait, inputs, method, parts, gains)
    if not found.level_spectral_radius < 1:
        raise _unstable()
    return found


def _unstable() -> FlexspineError:
    return FlexspineError(
        "no feedback to these inputs makes the gait stable", "steer more, such as legs.extension"
    )


def _scales(model: Model, inputs: tuple[str, ...]) -> tuple[Array, Array]:
    states = np.array([model.scales[name] for name in model.system.section.coordinates])
    return states, np.array([model.unit_of(name) for name in inputs])


def _parts(gait: Gait, inputs: tuple[str, ...], twice: bool) -> tuple[Part, ...]:
    """The stride's derivative, in one piece or cut at the apex between the stances."""
    model = gait.model.keeping(inputs)
    system, names = model.system, model.parameter_names
    symbols = [system.parameters[names.index(name)] for name in inputs]
    bound, start = model.bind(gait.tolerance), model.apex_state()
    sections = [_between(gait), system.section] if twice else [system.section]
    states, steered = _scales(model, inputs)
    d, parts = len(states), []
    for section in sections:
        trajectory = integrate(bound, start, crossings=1, section=section)
        if not trajectory.outcome.completed:
            raise FlexspineError(
                f"the gait has no apex between its stances ({trajectory.outcome})",
                "act once a stride",
            )
        found = linearize(trajectory, symbols)
        at = section_rows(system)
        jacobian = found.states[at] / states[:, None]
        parts.append(
            Part(
                matrix=jacobian[:, :d] * states,
                inputs=jacobian[:, d:] * steered,
                apex=start.states[at],
                level=_level(model, inputs, start, bound.parameters, states),
            )
        )
        start = trajectory.end
    return tuple(parts)


def _between(gait: Gait) -> Section:
    """The apex between the stances of a gait."""
    system = gait.model.system
    first = gait.phases[1]
    stood = dict(zip(STOOD, (1.0, 0.0) if first == "FS" else (0.0, 1.0), strict=True))
    return replace(system.section, requires=stood, resets={})


def _level(
    model: Model, inputs: tuple[str, ...], point: HybridState, parameters: Array, scales: Array
) -> Array:
    """Directions that keep a conserved energy if only angles are steered; all of them otherwise."""
    system = model.system
    if not system.section.conserved or any(name not in ANGLES for name in inputs):
        return np.eye(len(scales))
    values = section_quantities(system)(point.states, point.held, parameters)
    row = values.by_states[list(system.section.quantities).index("energy")][section_rows(system)]
    level: Array = np.linalg.svd((row * scales)[None])[2][1:]
    return level


def _reduced(part: Part, following: Part) -> tuple[Array, Array]:
    """The part's maps from its level to the next one's."""
    return following.level @ part.matrix @ part.level.T, following.level @ part.inputs


def _lqr(parts: tuple[Part, ...], effort: float) -> tuple[Array, ...]:
    """Gains that minimise the sum of squared deviations and of effort, by Riccati's recursion."""
    following = (*parts[1:], parts[0])
    maps = [_reduced(part, after) for part, after in zip(parts, following, strict=True)]
    costs = [np.eye(len(part.level)) for part in parts]
    gains = [np.zeros((part.inputs.shape[1], len(part.level))) for part in parts]
    for _ in range(MOST_ROUNDS):
        change = 0.0
        for i in reversed(range(len(parts))):
            (a, b), cost = maps[i], costs[(i + 1) % len(parts)]
            weight = effort * np.eye(b.shape[1]) + b.T @ cost @ b
            gain = np.asarray(np.linalg.solve(weight, b.T @ cost @ a), dtype=float)
            change = max(change, float(np.nan_to_num(np.abs(gain - gains[i]), nan=np.inf).max()))
            gains[i] = gain
            costs[i] = np.eye(len(parts[i].level)) + a.T @ cost @ (a - b @ gain)
        if not np.isfinite(change):
            break
        if change < SETTLED * max(1.0, *(float(np.abs(gain).max()) for gain in gains)):
            return tuple(gain @ part.level for gain, part in zip(gains, parts, strict=True))
    raise _unstable()


def _deadbeat(part: Part) -> Array:
    """The gain that makes the stride's map nilpotent, in Luenberger's form.

    From ``b_1, A b_1, ..., b_2, ...``, as long as they are independent, follow rows ``q_i`` such
    that ``q_i A^m_i`` is all that is left of the map to be taken away.
    """
    a, b = _reduced(part, part)
    n, u = b.shape
    lengths = _indices(a, b)
    chains = [np.linalg.matrix_power(a, k) @ b[:, i] for i in range(u) for k in range(lengths[i])]
    if len(chains) < n or np.linalg.cond(np.column_stack(chains)) > 1 / WEAK:
        raise FlexspineError(
            "these inputs do not reach every deviation", "steer more, such as legs.extension"
        )
    inverse = np.linalg.inv(np.column_stack(chains))
    used = [i for i in range(u) if lengths[i]]
    lasts = np.cumsum([lengths[i] for i in used]) - 1
    rows = np.array(
        [
            inverse[last] @ np.linalg.matrix_power(a, lengths[i] - 1)
            for i, last in zip(used, lasts, strict=True)
        ]
    )
    gain = np.zeros((u, n))
    gain[used] = np.linalg.solve(rows @ b[:, used], rows @ a)
    return gain @ part.level


def _indices(a: Array, b: Array) -> list[int]:
    """How many of ``b_i, A b_i, ...`` are independent of all before, taken in turn."""
    n, u = b.shape
    lengths, kept = [0] * u, np.zeros((n, 0))
    open_ = set(range(u))
    for power in range(n):
        for i in sorted(open_):
            column = np.linalg.matrix_power(a, power) @ b[:, i]
            rest = column - kept @ (np.linalg.pinv(kept) @ column) if kept.size else column
            if np.linalg.norm(rest) <= WEAK * np.linalg.norm(column) or kept.shape[1] == n:
                open_.discard(i)
                continue
            kept = np.column_stack([kept, column])
            lengths[i] += 1
    return lengths
