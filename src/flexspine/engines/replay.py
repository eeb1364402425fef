"""A motion of a planar robot replayed in MuJoCo by the robot in space, kept to the plane.

Motors get the torques of the motion, and springs and dampers take away what joints are off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexspine.engines.mjcf import Start
from flexspine.engines.space_engine import SpaceEngine
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import COMPLETED, Outcome
from flexspine.models.articulated import FELL
from flexspine.models.robot import Robot
from flexspine.models.space import SpaceRobot

# N m/rad, N m s/rad; of the springs and dampers, beside torques that alone would nearly do.
STIFFNESS, DAMPING = 400.0, 4.0


@dataclass(frozen=True)
class PlanarMotion:
    """A motion of a planar robot: times (s), ``q`` (k, N), rates, torques of motors (k, m)."""

    times: Array
    q: Array
    rates: Array
    torques: Array


@dataclass(frozen=True)
class Replay:
    """What came of it, at the motion's times.

    ``com`` (k, 2) in the plane, ``angle`` (k, joints) of the hinges, ``normal`` (k, feet) the mean
    since the time before, ``correction`` (k,) the largest torque of springs and dampers, ``wanted``
    the angles of the motion. ``spine`` is the place of a hinge without motor among the joints.
    """

    outcome: Outcome
    times: Array
    com: Array
    angle: Array
    wanted: Array
    normal: Array
    correction: Array
    spine: int | None


def replay(robot: Robot, motion: PlanarMotion, *, step: float) -> Replay:
    """Replay a motion with MuJoCo's time ``step`` (s), which divides the time between samples.

    Raises `MachineError` without a MuJoCo that will do, and `ParameterError` for a robot that is
    not described in space.
    """
    space = SpaceRobot(robot, plane=True)
    each = max(1, round((motion.times[1] - motion.times[0]) / step))
    engine = SpaceEngine(space, step=float(motion.times[1] - motion.times[0]) / each)
    names, driven = [hinge.name for hinge in space.hinges], engine.driven
    wanted, rates = (
        np.stack([table[name] for name in names], axis=1)
        for table in (space.angles(motion.q), space.rates(motion.rates))
    )
    torques = motion.torques @ space.by_motor.T
    engine.set_down(Start.of(space, motion.q[0]))
    outcome = Outcome(COMPLETED, f"replayed {motion.times[-1]:g} s")
    rows = [_row(engine, np.zeros(len(space.balls)), 0.0)]
    with engine.unheard():
        for sample in range(len(motion.times) - 1):
            normal, most = np.zeros(len(space.balls)), 0.0
            for part in range(each):
                share = part / each
                aim, speed, push = (
                    table[sample] + share * (table[sample + 1] - table[sample])
                    for table in (wanted[:, driven], rates[:, driven], torques)
                )
                pull = STIFFNESS * (aim - engine.angles[driven])
                pull += DAMPING * (speed - engine.rates[driven])
                engine.data.ctrl[:] = push + pull
                engine.advance()
                normal += engine.normals / each
                most = max(most, float(np.abs(pull).max()))
            engine.forward()
            rows.append(_row(engine, normal, most))
            if engine.lowest < 0:
                outcome = Outcome(FELL, f"it fell at t = {motion.times[sample + 1]:.3f} s")
                break
    com, angle, normals, most_pull = (np.array(column) for column in zip(*rows, strict=True))
    count = len(rows)
    return Replay(
        outcome, motion.times[:count], com, angle, wanted[:count], normals, most_pull,
        next((i for i, hinge in enumerate(space.hinges) if not hinge.motor), None),
    )  # fmt: skip


def _row(engine: SpaceEngine, normal: Array, most: float) -> tuple[Array, Array, Array, float]:
    com = engine.data.subtree_com[engine.model.body(engine.space.trunk[0]).id]
    return com[[0, 2]].copy(), engine.angles, normal, most
