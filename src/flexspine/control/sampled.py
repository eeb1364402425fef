"""Control by a computer: torques are chosen at a rate, limited, and held until the next time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from flexspine.control.computed_torque import SINGULAR
from flexspine.control.laws import Law, Situation, Tracking
from flexspine.control.references import BODY
from flexspine.control.walking import Walker
from flexspine.hybrid.compile import Array, BoundSystem
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.system import Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.linkage_motion import LinkageMotion
from flexspine.models.articulated import CLOCK, BoundRobot
from flexspine.models.drive import Moment, Turning

NEXT_SAMPLE = sp.Symbol("next_sample", real=True)


@dataclass(frozen=True)
class Sampled(Walker):
    """Walk by a law that is asked ``rate`` times a second; ``limit`` bounds torques, in N m."""

    law: Law = Tracking()
    rate: float = 400.0
    limit: float = np.inf

    def held(self) -> tuple[sp.Symbol, ...]:
        """The plan's numbers, the torques, and when they change next."""
        return (*super().held(), *self._torques.values(), NEXT_SAMPLE)

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        """Torques are held."""
        observables = {f"reference_{j}": angle for j, (angle, _, _) in self.references.joints.items()}
        return Turning(self._torques, self.references.definitions, observables)

    def guards(self, motion: LinkageMotion, mode: str) -> tuple[Guard, ...]:
        """Those of walking, and the clock of the computer."""
        sample = Guard("sample", NEXT_SAMPLE - CLOCK, decide=_sampled, timed=True)
        return (*super().guards(motion, mode), sample)

    def torques_at(self, bound: BoundRobot, point: HybridState) -> Array:
        """The torques that are held."""
        moment = bound.moment(point)
        return np.array([moment.held[self._torques[joint]] for joint in self.motors])

    def ready(self, start: Moment) -> Moment:
        """Choose the first torques."""
        return self.sample(start)

    def sample(self, moment: Moment) -> Moment:
        """Choose new torques. Raises `numpy.linalg.LinAlgError` where there are none."""
        chosen = self.law.torques(self._situation(moment)).clip(-self.limit, self.limit)
        torques = dict(zip(self._torques.values(), chosen.tolist(), strict=True))
        # Counted, so that no rounding errors add up.
        count = round(moment.time * self.rate) + 1
        held = {**moment.held, **torques, NEXT_SAMPLE: count / self.rate}
        return replace(moment, held=held)

    @cached_property
    def _torques(self) -> dict[str, sp.Symbol]:
        return {joint: sp.Symbol(f"held_torque_{joint}", real=True) for joint in self.motors}

    @cached_property
    def _trunk(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(leg.trunk for leg in self.walk.legs.values()))

    @cached_property
    def _com_at_start(self) -> Array:
        """Of the body at its place zero."""
        return np.asarray(self.robot.linkage.com(self.posture(self.walk.begin())), dtype=float)

    def _situation(self, moment: Moment) -> Situation:
        joints, links = self.references_at(moment)
        swinging = [self.walk.legs[name] for name in self.walk.swinging(moment.held)]
        held, since = moment.held, moment.time - moment.held[BODY.start]
        course = np.zeros((3, 2))
        course[0] = self._com_at_start
        course[0, 0] += held[BODY.x] + held[BODY.speed] * since + held[BODY.gain] * since**2 / 2
        course[1:, 0] = held[BODY.speed] + held[BODY.gain] * since, held[BODY.gain]
        return Situation(
            linkage=self.robot.linkage,
            q=moment.q,
            rates=moment.rates,
            feet=self.counted(moment),
            joints=joints,
            links={link: links[link] for leg in swinging for link in (leg.thigh, leg.shank)},
            com=course,
            trunk=self._trunk,
            friction=self.robot.friction,
            limit=self.limit,
        )


def _sampled(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    """The computer chooses new torques."""
    assert isinstance(bound, BoundRobot)
    drive, moment = bound.drive, bound.moment(point)
    assert isinstance(drive, Sampled)
    try:
        chosen = drive.sample(moment)
    except np.linalg.LinAlgError as failure:
        return Outcome(SINGULAR, f"{failure} at t = {moment.time:.6g} s")
    return bound.carry_on(chosen, point.states)
