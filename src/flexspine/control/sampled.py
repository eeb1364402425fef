"""Control by a computer: torques are chosen at a rate, limited, and held until the next time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import sympy as sp

from flexspine.control.computed_torque import SINGULAR
from flexspine.control.laws import Law, Tracking
from flexspine.control.walking import Walker
from flexspine.hybrid.compile import Array, BoundSystem
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.linkage_motion import LinkageMotion
from flexspine.models.articulated import CLOCK, BoundRobot
from flexspine.models.drive import Moment, Turning

NEXT_SAMPLE = sp.Symbol("next_sample", real=True)

# rad/s; no joint of a robot that is under control turns as fast.
FASTEST = 1e3

OUT_OF_CONTROL = OutcomeKind(
    "out_of_control",
    "torques that are held for so long shake the joints ever more; sample more often, or lower "
    "the stiffness and damping of the law",
)


@dataclass(frozen=True)
class Sampled(Walker):
    """Walk by a law that is asked ``rate`` times a second; ``limit`` bounds torques, in N m."""

    law: Law = field(default_factory=Tracking)
    rate: float = 400.0
    limit: float = np.inf

    def held(self) -> tuple[sp.Symbol, ...]:
        """The plan's numbers, the torques, and when they change next."""
        return (*super().held(), *self._torques.values(), NEXT_SAMPLE)

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        """Torques are held."""
        return Turning(self._torques, self.references.definitions, self.reference_angles)

    def guards(self) -> tuple[Guard, ...]:
        """Those of walking, and the clock of the computer."""
        sample = Guard("sample", NEXT_SAMPLE - CLOCK, decide=_sampled, timed=True)
        return (*super().guards(), sample)

    def torques_at(self, bound: BoundRobot, point: HybridState) -> Array:
        """The torques that are held."""
        moment = bound.moment(point)
        return np.array([moment.held[self._torques[joint]] for joint in self.motors])

    def ready(self, start: Moment) -> Moment:
        """Choose the first torques."""
        return self.sample(start)

    def sample(self, moment: Moment) -> Moment:
        """Choose new torques. Raises `numpy.linalg.LinAlgError` where there are none."""
        chosen = self.law.torques(self.situation(moment, self.limit)).clip(-self.limit, self.limit)
        torques = dict(zip(self._torques.values(), chosen.tolist(), strict=True))
        # Counted, so that no rounding errors add up.
        count = round(moment.time * self.rate) + 1
        held = {**moment.held, **torques, NEXT_SAMPLE: count / self.rate}
        return replace(moment, held=held)

    @cached_property
    def _torques(self) -> dict[str, sp.Symbol]:
        return {joint: sp.Symbol(f"held_torque_{joint}", real=True) for joint in self.motors}


def _sampled(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    """The computer chooses new torques."""
    assert isinstance(bound, BoundRobot)
    drive, moment = bound.drive, bound.moment(point)
    assert isinstance(drive, Sampled)
    fastest = float(np.abs(moment.rates[:-2]).max())
    if not fastest < FASTEST:
        text = f"a joint turns at {fastest:.3g} rad/s at t = {moment.time:.6g} s"
        return Outcome(OUT_OF_CONTROL, text)
    try:
        chosen = drive.sample(moment)
    except np.linalg.LinAlgError as failure:
        return Outcome(SINGULAR, f"{failure} at t = {moment.time:.6g} s")
    return bound.carry_on(chosen, point.states)
