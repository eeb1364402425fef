"""The return map of a hybrid system's section, with its exact derivative."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.compile import Array
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.sensitivity import Deviation, propagate
from flexspine.hybrid.system import HybridSystem
from flexspine.hybrid.trajectory import Trajectory
from flexspine.models.model import Model
from flexspine.models.simulation import DEFAULT_TOLERANCE, check_count


@dataclass(frozen=True)
class ReturnMap:
    """A trajectory from section to section, and how its end depends on its start.

    Columns are the section's coordinates (d) and then the chosen parameters (k). ``states``
    (n, d + k) are the derivatives of all states on the section, ``time`` (d + k,) those of the
    time it took (s). ``crossing_rates`` tells how fast each guard was crossed, in its unit per
    second: near zero is near grazing, where there is no derivative.
    """

    trajectory: Trajectory
    states: Array
    time: Array
    crossing_rates: tuple[float, ...]

    def __repr__(self) -> str:
        return f"<ReturnMap, derivative of shape {self.states.shape}: {self.trajectory!r}>"

    @property
    def start(self) -> Array:
        """The section coordinates at the start, shape (d,)."""
        return self.trajectory.start.states[self._at]

    @property
    def image(self) -> Array:
        """The section coordinates at the end, shape (d,)."""
        return self.trajectory.end.states[self._at]

    @property
    def by_state(self) -> Array:
        """Derivative of the image by the start, shape (d, d)."""
        return self.states[self._at, : len(self._at)]

    @property
    def by_parameters(self) -> Array:
        """Derivative of the image by the parameters, shape (d, k)."""
        return self.states[self._at, len(self._at) :]

    @property
    def _at(self) -> list[int]:
        return section_rows(self.trajectory.bound.system)


def section_rows(system: HybridSystem) -> list[int]:
    """Where the section's coordinates stand among the states."""
    return [system.places[symbol] for symbol in system.section.coordinates.values()]


def linearize(trajectory: Trajectory, parameters: Sequence[sp.Symbol] = ()) -> ReturnMap:
    """Differentiate the return that a trajectory from section to section has made."""
    system = trajectory.bound.system
    at = section_rows(system)
    d, k = len(at), len(parameters)
    states = np.zeros((len(system.states), d + k))
    states[at, range(d)] = 1.0
    moved = np.zeros((len(system.parameters), d + k))
    moved[[system.places[p] for p in parameters], range(d, d + k)] = 1.0
    start = Deviation(states, np.zeros((len(system.held), d + k)), moved)
    end = propagate(trajectory, start)
    return ReturnMap(trajectory, end.states, end.time, end.rates)


def stride_map(
    model: Model,
    *,
    strides: int = 1,
    parameters: Sequence[str] = (),
    tolerance: float = DEFAULT_TOLERANCE,
) -> ReturnMap:
    """Run from the model's apex to the next and differentiate, gait or not.

    ``strides`` apexes further, if it is not the next. ``parameters`` by dotted name,
    ``touchdown.fore`` and ``touchdown.hind`` among them; columns are apex coordinates in the order
    of ``model.apex`` and then these. SI and radians. ``tolerance`` is the integrator's. Exact, by
    variational equations and saltation (Leine & Nijmeijer 2004). Raises `UnknownNameError`, and
    `ParameterError` for a run that does not come back.

    >>> from flexspine import load_model, stride_map
    >>> linear = stride_map(load_model("slip"), parameters=["touchdown.fore"])
    >>> linear.by_state.shape, linear.by_parameters.shape
    ((4, 4), (4, 1))
    """
    model.on_flat_ground("the derivative of a stride")
    names = model.parameter_names
    check_count("strides", strides)
    for name in parameters:
        if name not in names:
            raise UnknownNameError("parameter", name, names)
    model = model.keeping(parameters)
    trajectory = integrate(model.bind(tolerance), model.apex_state(), crossings=strides)
    if not trajectory.outcome.completed:
        raise ParameterError(
            f"there is no stride to differentiate ({trajectory.outcome})", trajectory.outcome.advice
        )
    return linearize(trajectory, [model.system.parameters[names.index(n)] for n in parameters])
