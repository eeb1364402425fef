"""Robots in postures, and runs of them that need no gait."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from flexspine import Robot
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.trajectory import Trajectory
from flexspine.mechanics.linkage_motion import LinkageMotion
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Drive, Moment, Turning

Array = NDArray[np.float64]

TOLERANCE = 1e-15


@dataclass(frozen=True)
class Steady(Drive):
    """Torques in N m that never change, by joint."""

    torques: Mapping[str, float] = field(default_factory=dict)

    def _symbols(self) -> dict[str, sp.Symbol]:
        return {joint: sp.Symbol(f"steady_{joint}", real=True) for joint in self.robot.motors}

    def values(self) -> dict[sp.Symbol, float]:
        return {s: self.torques.get(joint, 0.0) for joint, s in self._symbols().items()}

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        return Turning(self._symbols())

    def torques_at(self, bound: BoundRobot, moment: Moment, states: Array) -> Array:
        return np.array(list(self.values().values()))


def crouch(robot: Robot) -> Array:
    """The ten-link robot on bent legs, its lowest toe on the ground."""
    q = np.zeros(12)
    turns = {"knee_1": -0.9, "hip_1": -1.02, "hip_2": -3.04, "knee_2": 0.9, "hip_3": -2.12,
             "knee_3": 0.9, "hip_4": -2.02, "knee_4": 0.9}  # fmt: skip
    q[0] = 1.92
    for name, turn in turns.items():
        q[robot.linkage.place[name]] = turn
    q[-1] -= min(robot.linkage.foot(q, foot)[1] for foot in robot.feet)
    return q


def fallen_from(
    drive: Drive, q: Array, rates: Array, seconds: float, **options: Any
) -> tuple[BoundRobot, Trajectory]:
    """A run from these coordinates; feet on the ground are at rest."""
    bound = BoundRobot(drive, TOLERANCE, **options)
    start = bound.begin(q, rates, {})
    assert not isinstance(start, Outcome)
    return bound, integrate(bound, start, end_time=seconds, record=True)


def dropped(drive: Drive, seconds: float, **options: Any) -> tuple[BoundRobot, Trajectory]:
    """A run of the crouching robot, from 5 cm above the ground at 1 m/s."""
    return fallen_from(drive, *above_ground(drive.robot), seconds, **options)


def above_ground(robot: Robot) -> tuple[Array, Array]:
    """The crouch 5 cm above the ground at 1 m/s: coordinates and rates."""
    q, rates = crouch(robot), np.zeros(12)
    q[-1] += 0.05
    rates[-2] = 1.0
    return q, rates
