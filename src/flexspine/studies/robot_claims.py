"""The claims about the articulated robot, judged by its own runs: 10, 11 and 12."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from flexspine.control.distribution import force_family
from flexspine.control.laws import Tracking
from flexspine.control.leg_function import standing
from flexspine.control.trot import Trot, trot
from flexspine.control.walk_measures import summarize_walk
from flexspine.errors import MachineError
from flexspine.models.leg_geometry import legs_of
from flexspine.models.robot import Robot
from flexspine.models.robot_file import load_robot
from flexspine.models.robot_run import RobotRun, robot_dataset
from flexspine.studies.pinned_check import COMPARED, check_pinned
from flexspine.studies.verdict import DEPENDS, FAILS, HOLDS, UNDECIDED, Verdict

ROBOT = "sc618"

# N s and s; a push that leaves errors large enough to be followed.
PUSH, PUSH_TIME, SECONDS = 1.0, 2.15, 4.0

# rad; as far as errors may be off their exponentials.
EXPONENTIAL = 1e-10

# s; phases that are shorter tell nothing.
SHORTEST = 0.01

# m, m; how a robot stands to share its weight: hips at this height, feet of a hip this far apart.
HEIGHT, SPREAD = 0.33, 0.05

# N; less is rounding.
SHIFTED = 1e-6


def robot_verdicts() -> list[Verdict]:
    """Judge claims 10 to 12 by the robot of the source."""
    robot = load_robot(ROBOT)
    return [_equations(robot), _tracking(robot), _shifting(robot)]


def _equations(robot: Robot) -> Verdict:
    claim = "the derived equations equal an independent engine's"
    command = "flexspine verify pinned"
    try:
        check = check_pinned(robot)
    except MachineError as failure:
        return Verdict(10, claim, UNDECIDED, str(failure), command=command)
    told, numbers = [], {}
    for case in check.cases:
        order = "not to be told" if case.order is None else f"{case.order:.2f}"
        told.append(
            f"{case.name} {case.compared[-1]:.1e} rad at MuJoCo's smallest step, "
            f"{case.steps[-1]:.3g} s, shrinking with order {order}"
        )
        numbers[case.name] = {
            "difference": float(case.compared[-1]), "step": case.steps[-1], "order": case.order,
        }  # fmt: skip
    finding = (
        f"pinned by {check.foot} and let go, all links differ from MuJoCo's up to {COMPARED:g} s "
        f"by {'; '.join(told)}; mass matrix, forces and Jacobians equal Pinocchio's in the tests"
    )
    return Verdict(10, claim, HOLDS if check.agrees else FAILS, finding, numbers, command=command)


def _tracking(robot: Robot) -> Verdict:
    claim = "the tracking error decays exponentially"
    pushed = Trot(seconds=SECONDS, push=PUSH, push_time=PUSH_TIME)
    off, largest, phases = _off_exponential(trot(robot, pushed), Tracking())
    held = summarize_walk(trot(robot, Trot(seconds=SECONDS, rate=400.0)))
    exponential = off <= EXPONENTIAL
    finding = (
        f"under continuous feedback errors, {largest:.1e} rad after a push of {PUSH:g} N s, are "
        f"within {off:.1e} rad of the solution of e'' + 40 e' + 400 e = 0 in each of {phases} "
        "stance phases, and every impact starts them anew; with torques held for 2.5 ms they do "
        f"not decay but stay under {held.error:.1e} rad"
    )
    numbers = {"off": off, "largest": largest, "phases": phases, "held": held.error}
    verdict = DEPENDS if exponential else FAILS
    return Verdict(11, claim, verdict, finding, numbers, command="flexspine trot --push 1")


def _off_exponential(run: RobotRun, law: Tracking) -> tuple[float, float, int]:
    """How far errors are off their exponentials, how large they get, in rad, in how many phases."""
    off, largest, phases = 0.0, 0.0, 0
    for start, end in pairwise(event.time for event in run.events):
        if end - start < SHORTEST:
            continue
        times = np.linspace(start, end, 102)[:-1]
        found = robot_dataset(run, times=times)
        motors = found["motor"].values
        error = found["angle"].sel(joint=motors).values - found["reference"].values
        rates = found["angle_rate"].sel(joint=motors).values - found["reference_rate"].values
        decay, since = law.damping / 2, (times - start)[:, None]
        assert decay**2 == law.stiffness  # critically damped
        expected = (error[0] + (rates[0] + decay * error[0]) * since) * np.exp(-decay * since)
        off = max(off, float(np.abs(error - expected).max()))
        largest, phases = max(largest, float(np.abs(error).max())), phases + 1
    return off, largest, phases


def _shifting(robot: Robot) -> Verdict:
    claim = "torques can shift ground forces at zero acceleration"
    legs = legs_of(robot)
    hips = sorted({leg.hip for leg in legs.values()})
    ahead: dict[str, float] = {}
    groups = []
    for hip in hips:
        names = [name for name, leg in legs.items() if leg.hip == hip]
        ahead |= dict(zip(names, (SPREAD, -SPREAD), strict=True))
        groups.append([legs[name].foot for name in names])
    q, hind, fore = standing(robot, HEIGHT, ahead), groups[0], groups[1]
    told, numbers, shifts = [], {}, []
    for feet in ([hind[0], fore[1]], [*hind, fore[0]], [*hind, *fore]):
        family = force_family(robot.linkage, q, feet)
        reach = family.normal_range(0, robot.friction)
        assert reach is not None
        shifts.append(reach[1] - reach[0] > SHIFTED)
        kind = "one way only" if not family.dimension else f"a family of {family.dimension}"
        told.append(
            f"on {len(feet)} feet {kind}: {feet[0]} carries {reach[0]:.1f} N"
            + (f" to {reach[1]:.1f} N" if shifts[-1] else "")
        )
        numbers[" + ".join(feet)] = {"dimension": family.dimension, "normal": list(reach)}
    finding = (
        f"standing still with its hips at {HEIGHT:g} m, {'; '.join(told)} (no foot pulls or slips)"
    )
    verdict = HOLDS if all(shifts) else DEPENDS if any(shifts) else FAILS
    return Verdict(12, claim, verdict, finding, numbers, command="flexspine forces")
