"""A drive with a computer: it chooses torques at a rate, and holds them until the next time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from flexspine.control.joint_speed import speed_guard
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.linkage_motion import LinkageMotion
from flexspine.models.articulated import CLOCK
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Drive, Moment, Turning

NEXT_SAMPLE = sp.Symbol("next_sample", real=True)

NO_TORQUES = OutcomeKind(
    "no_torques",
    "no torques do what the law wants; take another posture, shorter steps, or higher limits",
)


@dataclass(frozen=True)
class Clocked(Drive):
    """Torques that are chosen ``rate`` times a second; ``limit`` bounds them, in N m."""

    rate: float = 400.0
    limit: float = np.inf

    def held(self) -> tuple[sp.Symbol, ...]:
        """The torques, and when they change next."""
        return (*super().held(), *self.held_torques.values(), NEXT_SAMPLE)

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        """Torques are held."""
        definitions, observables = self.observed()
        return Turning(self.held_torques, definitions, observables, (speed_guard(motion),))

    def observed(self) -> tuple[Mapping[sp.Symbol, sp.Expr], Mapping[str, sp.Expr]]:
        """What else is worth observing, in terms of definitions."""
        return {}, {}

    def guards(self) -> tuple[Guard, ...]:
        """The clock of the computer."""
        sample = Guard("sample", NEXT_SAMPLE - CLOCK, decide=_sampled, timed=True)
        return (*super().guards(), sample)

    def torques_at(self, bound: BoundRobot, moment: Moment, states: Array) -> Array:
        """The torques that are held."""
        return np.array([moment.held[symbol] for symbol in self.held_torques.values()])

    def ready(self, start: Moment) -> Moment:
        """Choose the first torques."""
        return self.sample(start)

    def sample(self, moment: Moment) -> Moment:
        """Choose new torques. Raises `numpy.linalg.LinAlgError` where there are none."""
        chosen, remembered = self.choose(moment)
        torques = chosen.clip(-self.limit, self.limit).tolist()
        # Counted, so that no rounding errors add up.
        count = round(moment.time * self.rate) + 1
        held = {**moment.held, **remembered, NEXT_SAMPLE: count / self.rate}
        return replace(
            moment, held=held | dict(zip(self.held_torques.values(), torques, strict=True))
        )

    def choose(self, moment: Moment) -> tuple[Array, Mapping[sp.Symbol, float]]:
        """The torques (m,), and what to remember."""
        return np.zeros(len(self.held_torques)), {}

    @cached_property
    def held_torques(self) -> dict[str, sp.Symbol]:
        """The symbols of the torques, by joint."""
        return {joint: sp.Symbol(f"held_torque_{joint}", real=True) for joint in self.robot.motors}


def _sampled(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    """The computer chooses new torques."""
    assert isinstance(bound, BoundRobot)
    drive, moment = bound.drive, bound.moment(point)
    assert isinstance(drive, Clocked)
    try:
        chosen = drive.sample(moment)
    except np.linalg.LinAlgError as failure:
        return Outcome(NO_TORQUES, f"{failure} at t = {moment.time:.6g} s")
    return bound.carry_on(chosen, point.states)
