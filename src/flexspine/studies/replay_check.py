"""The trot of the planar robot beside the same torques in MuJoCo, in the plane.

Our feet are points on rigid ground; MuJoCo's are spheres on ground that gives. A sphere rolls while
its shank turns, which carries the robot ahead of where points would, and what gives lets feet sink.
Smaller feet on stiffer ground come closer to ours, until what is left are MuJoCo's time steps and
what feet do in the instants of landing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from flexspine.control.trot import Trot, trot
from flexspine.engines.installed import mujoco_module
from flexspine.engines.replay import PlanarMotion, Replay, replay
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.robot import Robot
from flexspine.models.robot_run import RobotRun, robot_dataset

# s; how long it walks, and how far apart it is sampled.
SECONDS, INTERVAL = 2.0, 2e-3


@dataclass(frozen=True)
class SoftGround:
    """Feet and ground in MuJoCo: radius (m), stiffness (N/m), damping (N s/m), time step (s)."""

    radius: float
    stiffness: float
    damping: float
    step: float


# From the feet and the ground of the description's own order to nearly points on nearly rigid
# ground; damping keeps the shock of landing alike, and steps follow the stiffness.
GROUNDS = (
    SoftGround(0.035, 5e4, 1e3, 2.5e-4),
    SoftGround(0.001, 5e4, 1e3, 2.5e-4),
    SoftGround(0.001, 5e5, 3e3, 1e-4),
    SoftGround(0.001, 5e6, 1e4, 2.5e-5),
)

# rad, m, share: how close the last of them has to come (root mean squares over the motion, and the
# mean normal force on each foot).
ALLOWED_ANGLE, ALLOWED_HEIGHT, ALLOWED_NORMAL = 1e-3, 5e-4, 0.02


@dataclass(frozen=True)
class ReplayCase:
    """A replay on one ground beside the motion itself.

    Differences are root mean squares over the motion: ``angle`` of all hinges and ``spine`` (rad),
    ``height`` and ``ahead`` of the CoM (m; ``gained`` is the latter at the end), ``normal`` (N).
    ``correction`` is that of the torque of springs and dampers (N m).
    """

    ground: SoftGround
    replay: Replay
    com: Array
    normal_wanted: Array

    @cached_property
    def _off(self) -> Array:
        off: Array = self.replay.com - self.com[: len(self.replay.times)]
        return off

    @property
    def angle(self) -> float:
        """Of all hinges, in rad."""
        return _rms(self.replay.angle - self.replay.wanted)

    @property
    def spine(self) -> float | None:
        """Of the spine, in rad."""
        place = self.replay.spine
        return None if place is None else _rms((self.replay.angle - self.replay.wanted)[:, place])

    @property
    def height(self) -> float:
        """Of the CoM, in m."""
        return _rms(self._off[:, 1])

    @property
    def gained(self) -> float:
        """How far ahead the CoM is at the end, in m."""
        return float(self._off[-1, 0])

    @property
    def normal(self) -> float:
        """Of the normal forces on the feet, in N."""
        return _rms(self.replay.normal - self.normal_wanted[: len(self.replay.times)])

    @property
    def mean_normal(self) -> float:
        """The largest relative difference of the mean normal force on a foot."""
        wanted = self.normal_wanted[: len(self.replay.times)].mean(axis=0)
        return float(np.abs(self.replay.normal.mean(axis=0) / wanted - 1).max())

    @property
    def correction(self) -> float:
        """The torque of springs and dampers, in N m."""
        return _rms(self.replay.correction)


@dataclass(frozen=True)
class ReplayCheck:
    """A trot of the planar robot, ``run``, and its replays, each on a ground closer to ours.

    ``motion`` is what was replayed, a case of ``cases`` what came of it on one ground.
    """

    run: RobotRun
    motion: PlanarMotion
    cases: tuple[ReplayCase, ...]

    @property
    def agrees(self) -> bool:
        """Whether the last ground comes close enough, and each is closer in angle than the last."""
        last, angles = self.cases[-1], [case.angle for case in self.cases]
        return (
            all(case.replay.outcome.completed for case in self.cases)
            and all(after < before for before, after in pairwise(angles))
            and last.angle < ALLOWED_ANGLE
            and last.height < ALLOWED_HEIGHT
            and last.mean_normal < ALLOWED_NORMAL
        )


def check_replay(
    robot: Robot,
    *,
    seconds: float = SECONDS,
    grounds: tuple[SoftGround, ...] = GROUNDS,
    progress: Callable[[str], None] | None = None,
) -> ReplayCheck:
    """Let a planar robot trot by computed torque, and replay it in MuJoCo on every ground.

    The trot lasts ``seconds`` (s); ``grounds`` come ever closer to rigid ground under feet that are
    points. ``progress`` is told what is done next. Raises `MachineError` without a MuJoCo that will
    do, and `ParameterError` for a robot that cannot trot or is not described in space.
    """
    mujoco_module()
    tell = progress or (lambda _what: None)
    tell("trotting in the plane")
    run = trot(robot, Trot(seconds=seconds))
    if not run.outcome.completed:
        raise ParameterError(
            f"there is no trot to replay: {run.outcome.message}", run.outcome.advice
        )
    times: Array = INTERVAL * np.arange(round(seconds / INTERVAL) + 1, dtype=float)
    times = times[times <= run.trajectory.duration]
    dataset = robot_dataset(run, times=times)
    motion = PlanarMotion(times, *_coordinates(run, times), dataset["torque"].values)
    stands = dataset["stands"].values > 0
    normal = np.where(stands, dataset["grf"].values[..., 1], 0.0)
    feet = [list(robot.feet).index(leg.foot) for leg in robot.legs.values()]
    cases = []
    for ground in grounds:
        tell(f"in MuJoCo, feet of {1e3 * ground.radius:g} mm on {ground.stiffness:g} N/m")
        there = robot.with_values(
            {
                "space.foot_radius": ground.radius,
                "space.ground_stiffness": ground.stiffness,
                "space.ground_damping": ground.damping,
            }
        )
        found = replay(there, motion, step=ground.step)
        com = dataset["com"].values
        cases.append(ReplayCase(ground, found, com, normal[:, feet]))
    return ReplayCheck(run, motion, tuple(cases))


def _coordinates(run: RobotRun, times: Array) -> tuple[Array, Array]:
    """``q`` and its rates at times, shape (times, N)."""
    turn, n = run.robot.linkage.to_relative, run.robot.linkage.size
    states = np.zeros((len(times), 2 * n))
    for arc, part in run.trajectory.pieces(times):
        states[part] = arc(times[part])[:, : 2 * n]
    return states[:, :n] @ turn.T, states[:, n:] @ turn.T


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
