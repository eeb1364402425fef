"""Joints that springs and dampers draw to where they are to be, all the time."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from flexspine.control.joint_speed import speed_guard
from flexspine.control.laws import JointSprings
from flexspine.control.walking import WalkingDrive
from flexspine.hybrid.compile import Array
from flexspine.mechanics.linkage_motion import LinkageMotion
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Moment, Turning

STIFFNESS, DAMPING = sp.symbols("joint_stiffness joint_damping", real=True)


@dataclass(frozen=True)
class SpringDriven(WalkingDrive):
    """Walk on joints that give way; the spine bends as forces make it."""

    law: JointSprings = field(default_factory=JointSprings)

    def values(self) -> dict[sp.Symbol, float]:
        """The springs and dampers, and what the legs measure."""
        own = {STIFFNESS: self.law.stiffness, DAMPING: self.law.damping}
        return super().values() | own

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        """The torques of the springs and dampers."""
        torques = {
            joint: STIFFNESS * (angle - motion.bend(joint))
            + DAMPING * (rate - motion.bend_rate(joint))
            for joint, (angle, rate, _) in self.references.joints.items()
        }
        return Turning(
            torques,
            self.references.definitions,
            self.observed_references,
            (speed_guard(motion),),
        )

    def torques_at(self, bound: BoundRobot, moment: Moment, states: Array) -> Array:
        """The same in numbers."""
        return self.law.torques(self.situation(moment))
