"""Computed torque under constraints: joints follow their references exactly.

``e'' + K_d e' + K_p e = 0`` for all motors, ``e`` being what an angle is off its reference. The
law takes the feet for granted that are to stand and do; with two of them, of different hips, they
and the joints fix the angle of the spine as well: inertias and the spine's spring then enter forces
and torques, but not the motion.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from flexspine.control.joint_speed import speed_guard
from flexspine.control.laws import Tracking
from flexspine.control.references import References
from flexspine.control.walking import WalkingDrive
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import OutcomeKind
from flexspine.hybrid.system import Guard
from flexspine.mechanics.linkage_motion import LinkageMotion, Standing
from flexspine.mechanics.linkage_tracking import follow
from flexspine.models.articulated import BY, anchor, stands_in
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Moment, Turning
from flexspine.models.footing import Footing

STIFFNESS, DAMPING = sp.symbols("K_p K_d", real=True)

# m^2; the area between two feet and a joint without motor. Torques grow as it shrinks.
CLOSEST = 1e-3

SINGULAR = OutcomeKind(
    "singular",
    "two feet on the ground and a joint without motor are in line, where tracking needs torques "
    "without bounds; take another posture or shorter steps",
)


@dataclass(frozen=True)
class ComputedTorque(WalkingDrive):
    """Walk with joints that follow their references without delay."""

    law: Tracking = field(default_factory=Tracking)

    def values(self) -> dict[sp.Symbol, float]:
        """The law's stiffness and damping, and what the legs measure."""
        own = {STIFFNESS: self.law.stiffness, DAMPING: self.law.damping}
        return super().values() | own

    def label(self, moment: Moment) -> str:
        """The feet that the law counts on, where they are not those that stick."""
        footing, counted = moment.footing, self.to_stand(moment.held)
        known = counted == footing.feet == footing.sticking
        return "" if known else Footing.sticking_on(counted).name

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        """The torques, and the motion where the law knows it."""
        counted = stands_in(self, mode.partition(BY)[2] or mode)
        assert counted is not None
        wanted = wanted_accelerations(self.references, motion)
        found = follow(motion, [Standing(foot, anchor(foot)) for foot in counted], wanted)
        known, guards = BY not in mode, [speed_guard(motion)]
        if found.closeness is not None:
            apart = found.closeness**2 - CLOSEST**2
            guards.append(Guard("feet and spine in line", apart, ends=SINGULAR))
        return Turning(
            torques=found.torques,
            definitions={**self.references.definitions, **found.definitions},
            observables=self.observed_references,
            guards=tuple(guards),
            accelerations=found.accelerations if known else None,
            forces=found.forces if known else {},
        )

    def torques_at(self, bound: BoundRobot, moment: Moment, states: Array) -> Array:
        """The torques, from where the law knows them."""
        point = bound.point(moment, states)
        counted = Footing.sticking_on(self.to_stand(moment.held)).name
        found = bound.observe(counted, point.states[None], point.held)
        return np.array([found[f"torque_{joint}"][0] for joint in self.robot.motors])


def wanted_accelerations(references: References, motion: LinkageMotion) -> dict[str, sp.Expr]:
    """What joints are to do, and what brings them back to it."""
    return {
        joint: acceleration
        + DAMPING * (rate - motion.bend_rate(joint))
        + STIFFNESS * (angle - motion.bend(joint))
        for joint, (angle, rate, acceleration) in references.joints.items()
    }
