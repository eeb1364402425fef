"""What gaits are optimised for, as sums of largest parts, so that each part is smooth.

A peak force is the larger of two, a cost the sum of what actuators give without what they take
back: an optimum mostly lies where two parts are equal, or one vanishes, and derivatives of the
whole jump. An optimiser that knows the parts does not mind.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.gait import Gait
from flexspine.gaits.return_map import linearize
from flexspine.gaits.stability import linear_stability
from flexspine.hybrid.compile import Array
from flexspine.models.bounder import works
from flexspine.models.legs import SIDES
from flexspine.parameters import values
from flexspine.studies.probes import Astray, Stride

PEAK_GRF, COST, RADIUS = "peak_grf", "cost_of_transport", "spectral_radius"

# When the work of an actuator jumps; that of hips flows.
_JUMPS = {
    **{f"{side}_leg_work": (f"{side} greatest compression",) for side in SIDES},
    "spine_work": tuple(f"{side} {what}" for side in SIDES for what in ("touchdown", "lift-off")),
}


def _peaks(stride: Stride) -> Array:
    return stride.peaks[None]


def _costs(stride: Stride) -> Array:
    model, trajectory = stride.problem.model, stride.trajectory
    places, distance = model.system.places, trajectory.end.states[0] - trajectory.start.states[0]
    given: list[float] = []
    for name, symbol in works(model.features).items():
        if name not in _JUMPS:
            given.append(stride.profile.rise(name))
            continue
        jumps = dict.fromkeys(_JUMPS[name], 0.0)
        before = float(trajectory.start.states[places[symbol]])
        for event in trajectory.events:
            after = float(event.after.states[places[symbol]])
            for what in event.names:
                if what in jumps:
                    jumps[what] += after - before
                    before = after
        given += jumps.values()
    weight = model.mass * values(model.parameters)["gravity"]
    parts = np.array(given) / (weight * abs(float(distance)))
    return np.column_stack([parts, np.zeros(len(parts))])


def _moduli(stride: Stride) -> Array:
    problem, trajectory = stride.problem, stride.trajectory
    try:
        model = problem.at(stride.point)
    except ParameterError as failure:  # a step beyond a bound, which is no gait of any animal
        raise Astray(failure.message) from None
    gait = Gait(model, problem.strides, trajectory, problem.tolerance)
    return np.abs(linear_stability(gait, linearize(trajectory)).level_multipliers)[None]


@dataclass(frozen=True)
class Objective:
    """What is to be least: the sum over terms of the largest of their ``parts`` (terms, members).

    ``label``, and ``form`` with its unit, are for people.
    """

    name: str
    label: str
    form: str
    parts: Callable[[Stride], Array]

    def value(self, stride: Stride) -> float:
        """Its value for a stride."""
        return float(self.parts(stride).max(axis=1, initial=-np.inf).sum())

    def told(self, value: float) -> str:
        """A value as people read it."""
        return self.form.format(value)


OBJECTIVES = {
    each.name: each
    for each in (
        Objective(PEAK_GRF, "peak GRF", "{:.4g} N per leg pair", _peaks),
        Objective(COST, "cost of transport", "{:.3g}", _costs),
        Objective(RADIUS, "spectral radius", "{:.3g}", _moduli),
    )
}
