"""The floor: heyoka's batch integrator on smooth flows as long as a stride, without events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from benchmarks import hand_field
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.trajectory import Trajectory

Array = NDArray[np.float64]

# Where the feet stand while both legs stay in stance, in m.
TOES = (0.4, -0.1)
TIGHT = 1e-15


class Part(NamedTuple):
    """A flow: name and field with the values of its parameters, and how long it lasts in s."""

    name: str
    field: list[tuple[Any, Any]]
    numbers: Array
    duration: float


def by_hand(duration: float) -> list[Part]:
    """Both legs in stance, the field simplified by hand."""
    numbers = np.array(hand_field.hand_values(TOES))
    return [Part("by hand", hand_field.hand_field(), numbers, duration)]


def own(bound: BoundSystem, duration: float) -> list[Part]:
    """Both legs in stance, the model's own field."""
    held = np.zeros(len(bound.system.held))
    held[:2] = TOES
    return [_part(bound, "DS", held, duration)]


def mode_by_mode(run: Trajectory) -> list[Part]:
    """The model's own fields in the modes of a recorded run, each for as long as there."""
    return [_part(run.bound, arc.mode, arc.held, arc.end - arc.start) for arc in run.arcs]


def _part(bound: BoundSystem, name: str, held: Array, duration: float) -> Part:
    integrator = bound.mode(name).enter(0.0, np.zeros(len(bound.system.states)), held)
    return Part(name, integrator.sys, integrator.pars.copy(), duration)


def flow(parts: list[Part], starts: Array, width: int, tolerance: float) -> Callable[[], Array]:
    """Work that flows from every start through the parts and returns the ends.

    ``starts`` (n, k) with k a multiple of ``width``.
    """
    rows, count = starts.shape
    integrators: dict[str, Any] = {}
    for part in parts:
        if part.name not in integrators:
            integrators[part.name] = hy.taylor_adaptive_batch(
                part.field, np.zeros((rows, width)), tol=tolerance
            )
    steps = []
    for part in parts:
        integrator = integrators[part.name]
        used = part.numbers[: len(integrator.pars), None]
        steps.append((integrator, np.repeat(used, width, axis=1), part.duration))

    def work() -> Array:
        ends = np.empty_like(starts)
        for first in range(0, count, width):
            here = starts[:, first : first + width]
            for integrator, numbers, duration in steps:
                integrator.set_time(0.0)
                integrator.state[:] = here
                integrator.pars[:] = numbers
                integrator.propagate_until(duration)
                here = integrator.state
            ends[:, first : first + width] = here
        return ends

    return work


def reference(parts: list[Part], starts: Array) -> Array:
    """Where the flow ends at a tolerance far below any that is compared."""
    return flow(parts, starts, 1, TIGHT)()
