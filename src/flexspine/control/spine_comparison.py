"""A flexible and a locked spine side by side, walking the same way under the same control."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexspine.control.trot import Trot, trot
from flexspine.control.walk_measures import WalkSummary, summarize_walk
from flexspine.errors import ParameterError
from flexspine.models.locking import locked
from flexspine.models.robot import Robot
from flexspine.models.robot_run import RobotRun, robot_dataset

# Laws under which the spine can move.
COMPARED = ("com", "pd")

# s; how far from events two runs are compared.
APART = 1e-6

# Of the spine's stiffness; how much it is changed to see what tracking makes of it.
SOFTER = 0.5


@dataclass(frozen=True)
class SpineComparison:
    """A flexible and a locked spine side by side.

    ``runs`` and their ``summaries`` are by controller (``com``, ``pd``) and body (``flexible``,
    ``locked``). ``motion_change`` (rad) and ``torque_change`` (N m) are what half the stiffness of
    the spine changes at most in the joints' angles and in the torques under computed torque.
    """

    runs: dict[tuple[str, str], RobotRun]
    summaries: dict[tuple[str, str], WalkSummary]
    motion_change: float
    torque_change: float

    @property
    def verdict(self) -> str:
        """Why computed torque is not among the controllers, with the numbers."""
        return (
            "Under computed torque of all joints the comparison is empty: two feet on the ground "
            "and eight joints that follow their references also fix the angle of the spine, so "
            f"half its stiffness changes no joint by more than {self.motion_change:.1e} rad, only "
            f"torques, by up to {self.torque_change:.2g} N m."
        )


def compare_spines(
    robot: Robot, asked: Trot, progress: Callable[[float], None] | None = None
) -> SpineComparison:
    """Let a robot trot with its spine and with the spine locked straight.

    Both are controlled by ``com`` and by ``pd``, under which the spine can move; all else is as
    ``asked``. ``progress`` is told the share that is done, 0 to 1. Raises `ParameterError` for a
    robot without a spine, a joint without motor between two parts of its trunk.
    """
    joint = spine_of(robot)
    bodies = {"flexible": robot, "locked": locked(robot, joint)}
    cases = [(controller, body) for controller in COMPARED for body in bodies]
    whole = len(cases) + 2
    runs: dict[tuple[str, str], RobotRun] = {}

    def go(number: int, body: Robot, wanted: Trot) -> RobotRun:
        def tell(share: float) -> None:
            if progress is not None:
                progress((number + share) / whole)

        return trot(body, wanted, progress=tell)

    for number, (controller, body) in enumerate(cases):
        wanted = replace(asked, controller=controller, stiffness=None, damping=None)
        runs[controller, body] = go(number, bodies[body], wanted)
    # Two seconds of it tell as much as twenty.
    tracked = Trot(seconds=min(asked.seconds, 2.0), gait=asked.gait)
    softer = robot.numbers[f"{joint}.stiffness"] * SOFTER
    pair = [
        go(len(cases) + number, body, tracked)
        for number, body in enumerate((robot, robot.with_values({f"{joint}.stiffness": softer})))
    ]
    motion, torque = _change(*pair)
    summaries = {case: summarize_walk(run) for case, run in runs.items()}
    return SpineComparison(runs, summaries, motion, torque)


def spine_of(robot: Robot) -> str:
    """The joint without motor between two parts of the trunk. Raises `ParameterError`."""
    trunks = {leg.trunk for leg in robot.legs.values()}
    for joint, (link, motor) in robot.joints.items():
        if not motor and link in trunks and robot.parents[link] in trunks:
            return joint
    raise ParameterError(
        f"robot '{robot.name}' has no spine to compare with a locked one",
        "describe a joint without motor between two parts of its trunk",
    )


def _change(one: RobotRun, other: RobotRun) -> tuple[float, float]:
    """The largest differences of joint angles and of torques between two runs."""
    times = np.linspace(0, min(one.trajectory.duration, other.trajectory.duration), 1001)
    # Torques jump at events, which rounding may put before or after a time.
    met = np.array([event.time for run in (one, other) for event in run.events])
    times = times[np.abs(times[:, None] - met).min(axis=1, initial=np.inf) > APART]
    first, second = (robot_dataset(run, times=times) for run in (one, other))
    return (
        float(np.abs(first["angle"].values - second["angle"].values).max()),
        float(np.abs(first["torque"].values - second["torque"].values).max()),
    )
