"""Run a bounder from an apex, or from any state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from flexspine.errors import ParameterError, StateError
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.events import ZERO
from flexspine.hybrid.integrate import MAX_STEPS, integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.system import Arming
from flexspine.hybrid.trajectory import HybridState, Trajectory
from flexspine.models.actuation import BARE
from flexspine.models.bounder import beneath
from flexspine.models.model import Model, check_between
from flexspine.models.underfoot import OnGround, clearances
from flexspine.parameters import check_whole, shortened

# Taylor truncation error per step; strides then repeat to some 1e-13.
DEFAULT_TOLERANCE = 1e-12

# What can be counted; larger ones do not fit everywhere.
MOST = 2**53


@dataclass(frozen=True)
class Run:
    """A simulated run of a model; `to_dataset` gives every quantity of it over time.

    ``trajectory`` has its arcs, events and crossings of the section; ``tolerance`` is the
    integrator's.
    """

    model: Model
    trajectory: Trajectory
    tolerance: float

    def __repr__(self) -> str:
        told = f"{self.trajectory.duration:.4g} s, {self.outcome.name}"
        return f"<{type(self).__name__} of {self.model.name}: {told}>"

    @property
    def outcome(self) -> Outcome:
        """How the run ended."""
        return self.trajectory.outcome

    @property
    def remarks(self) -> dict[str, str]:
        """What else there is to say of it, by name, for a dataset."""
        return {}

    @property
    def phases(self) -> tuple[str, ...]:
        """The contact phases in order: DF (no leg stands), FS (fore), HS (hind), DS (both)."""
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
        """The section coordinates of all apexes by name, SI; the start included if it is one."""
        return [self.section_state(point) for point in self.section_points]

    def section_state(self, point: HybridState) -> dict[str, float]:
        """Return the section coordinates of a point, by name, SI."""
        system = self.model.system
        return {
            name: float(point.states[system.places[symbol]])
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
    ``toes`` (toe position x in m) on the ground; SI and radians. ``tolerance`` is the integrator's,
    between 1e-17 and 1e-3; ``max_steps`` bounds the Taylor steps of one stride. A run that falls or
    gets stuck is no error: look at ``outcome``. Raises `UnknownNameError`, `ParameterError`, and
    `StateError` for a start in the ground or with a leg that would pull.

    >>> from flexspine import load_model, simulate
    >>> run = simulate(load_model("kamimura2015-flexible"))
    >>> run
    <Run of kamimura2015-flexible: 0.2527 s, completed>
    >>> run.phases
    ('DF', 'FS', 'DF', 'HS', 'DF')
    """
    if strides is not None and duration is not None:
        raise ParameterError("both strides and duration are given", "give one of them")
    if toes and state is None:
        raise ParameterError("toes are given without a state", "give the state they belong to")
    wanted = check_count("strides", 1 if strides is None else strides)
    end = inf if duration is None else check_between("duration", duration, 0, inf)
    start = model.apex_state() if state is None else model.state(state, toes)
    bound = model.bind(tolerance)
    _refuse_impossible(bound, start)
    if isinstance(bound, OnGround):
        for point, clear in clearances(bound, start, beneath(model.kind.body(BARE))):
            if not clear > 0:
                raise _grounded(f"{point} on the ground", clear)
    trajectory = integrate(
        bound,
        start,
        end_time=end,
        crossings=wanted if duration is None else None,
        max_steps=check_count("max_steps", max_steps),
        record=True,
    )
    return Run(model, trajectory, tolerance)


def check_count(name: str, value: int) -> int:
    """Return a whole number from 1 to `MOST`. Raises `ParameterError` for anything else."""
    count = check_whole(name, value, 1)
    if count > MOST:
        raise ParameterError(
            f"{name} = {shortened(value)} is not usable", f"give no more than {MOST}"
        )
    return count


def _refuse_impossible(bound: BoundSystem, start: HybridState) -> None:
    """Raise `StateError` for a body in the ground, or a leg that would have to pull."""
    mode = bound.mode(start.mode)
    guards = mode.evaluate(start.states, start.held)
    for jump in mode.code.jumps:
        guard, value = jump.guard, guards[jump.value]
        if guard.ends is not None and not value > 0:
            raise _grounded(guard.name, value)
        if guard.jumps and guard.arming is Arming.LEVEL and value < -ZERO:
            raise StateError(
                f"the start is past the {guard.name}, the leg would pull",
                "put its toe nearer to the hip, or leave it out of toes",
            )


def _grounded(what: str, clear: float) -> StateError:
    return StateError(
        f"the start has the {what} ({clear:.4g} m)", "raise the apex height or lower the pitch"
    )
