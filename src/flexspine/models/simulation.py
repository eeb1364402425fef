"""Run a bounder from an apex, or from any state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite

from flexspine.errors import ParameterError, StateError
from flexspine.hybrid.integrate import MAX_STEPS, integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.trajectory import HybridState, Trajectory
from flexspine.models.model import Model

# Taylor truncation error per step; strides then repeat to some 1e-13.
DEFAULT_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Run:
    """A simulated run of a model: what was run, and what came of it."""

    model: Model
    trajectory: Trajectory
    tolerance: float

    @property
    def outcome(self) -> Outcome:
        """How the run ended."""
        return self.trajectory.outcome

    @property
    def phases(self) -> tuple[str, ...]:
        """The phases in order: DF, FS, HS, DS."""
        return self.trajectory.modes

    @property
    def section_points(self) -> tuple[HybridState, ...]:
        """The apexes, the start included if the run began at one."""
        trajectory = self.trajectory
        climbing = trajectory.start.states[self.model.state_names.index("com_y_rate")]
        at_apex = trajectory.start.mode == "DF" and climbing == 0
        return ((trajectory.start,) if at_apex else ()) + trajectory.crossings

    @property
    def apexes(self) -> list[dict[str, float]]:
        """Section states by name, the start included if the run began at an apex."""
        return [self.section_state(point) for point in self.section_points]

    def section_state(self, point: HybridState) -> dict[str, float]:
        """The section coordinates of a point, by name."""
        system = self.model.system
        return {
            name: float(point.states[system.states.index(symbol)])
            for name, symbol in system.section.coordinates.items()
        }


def simulate(
    model: Model,
    *,
    strides: int | None = None,
    duration: float | None = None,
    state: Mapping[str, float] | None = None,
    toes: Mapping[str, float] | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    max_steps: int = MAX_STEPS,
) -> Run:
    """Simulate ``strides`` strides (default 1) or ``duration`` seconds.

    Starts at the model's apex, or at ``state`` by state name (absent ones zero) with the legs in
    ``toes`` (toe position x in m) on the ground. ``tolerance`` is the integrator's, between 1e-16
    and 1e-3; ``max_steps`` bounds the work of one stride. A run that falls or gets stuck is no
    error: look at ``outcome``. Raises `ParameterError` and `StateError`.
    """
    if strides is not None and duration is not None:
        raise ParameterError("both strides and duration are given", "give one of them")
    if strides is not None and strides < 1:
        raise ParameterError(f"strides = {strides} is not usable", "give a whole number from 1 on")
    if duration is not None and not (isfinite(duration) and duration > 0):
        raise ParameterError(f"duration = {duration} is not usable", "give seconds above zero")
    if not 1e-16 <= tolerance <= 1e-3:
        raise ParameterError(f"tolerance = {tolerance} is not usable", "give 1e-16 to 1e-3")
    if max_steps < 1:
        raise ParameterError(f"max_steps = {max_steps} is not usable", "give a number from 1 on")
    start = model.apex_state() if state is None else model.state(state, toes)
    bound = model.bind(tolerance)
    mode = bound.mode(start.mode)
    guards = mode.evaluate(start.states, start.held)
    for jump in mode.code.jumps:
        if jump.guard.ends is not None and not guards[jump.value] > 0:
            raise StateError(
                f"the start has the {jump.guard.name} ({guards[jump.value]:.4g} m)",
                "raise the apex height or lower the pitch",
            )
    trajectory = integrate(
        bound,
        start,
        end_time=inf if duration is None else duration,
        crossings=(strides or 1) if duration is None else None,
        max_steps=max_steps,
        record=True,
    )
    return Run(model, trajectory, tolerance)
