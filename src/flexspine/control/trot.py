"""Trot: the robot starts standing and walks on diagonal pairs of legs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from math import inf

from flexspine.control.computed_torque import ComputedTorque, Gains
from flexspine.control.joint_springs import SpringDriven
from flexspine.control.laws import JointSprings, Law, LeastResidual, SevenOutputs, Tracking
from flexspine.control.sampled import Sampled
from flexspine.control.walking import LONGEST, Gait, Walker
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.models.articulated import BoundRobot, Push
from flexspine.models.model import TOLERANCES, check_between
from flexspine.models.robot import Robot
from flexspine.models.robot_run import RobotRun
from flexspine.models.simulation import DEFAULT_TOLERANCE, check_count

CONTROLLERS: dict[str, type[Law]] = {
    law.name: law for law in (Tracking, LeastResidual, SevenOutputs, JointSprings)
}

# Hz; that of the study's robot, for laws that have to be sampled.
USUAL_RATE = 400.0

# Controllers that also work without a clock.
CONTINUOUS = ("tracking", "pd")


@dataclass(frozen=True)
class Trot:
    """What is asked of a trot, in SI units.

    ``controller`` is one of `CONTROLLERS`: ``tracking`` (computed torque), ``qp`` (the same as
    nearly as contacts and limits allow), ``com`` (centre of mass, pitch and swing legs; the spine
    moves) or ``pd`` (springs and dampers at the joints). ``rate`` in Hz is how often torques are
    chosen, None: all the time, where the law allows it. ``limit`` bounds them. ``push`` is an
    impulse in N s along x on the body at ``push_time``.
    """

    seconds: float = 20.0
    controller: str = "tracking"
    gait: Gait = field(default_factory=Gait)
    rate: float | None = None
    limit: float | None = None
    stiffness: float | None = None
    damping: float | None = None
    push: float = 0.0
    push_time: float | None = None


def trot(
    robot: Robot,
    wanted: Trot | None = None,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[float], None] | None = None,
) -> RobotRun:
    """Let a robot trot from standing.

    A run that falls is no error: look at ``outcome``. ``progress`` is told the share that is done,
    0 to 1. Raises `ParameterError` and
    `UnknownNameError` for what cannot be asked for, and for a robot that has no legs to trot on.
    """
    asked = Trot() if wanted is None else wanted
    drive = driven(robot, asked)
    push = _push(robot, asked)
    bound = BoundRobot(
        drive,
        check_between("tolerance", tolerance, *TOLERANCES),
        push=push,
        watch=None if progress is None else lambda time: progress(time / asked.seconds),
    )
    start = drive.begin(bound)
    settings = {
        "controller": asked.controller,
        "rate": drive.rate if isinstance(drive, Sampled) else None,
        **{f"gait.{each.name}": getattr(asked.gait, each.name) for each in fields(Gait)},
        **{
            each.name: getattr(asked, each.name)
            for each in fields(Trot)
            if each.name not in ("controller", "rate", "gait")
        },
    }
    if isinstance(start, Outcome):
        raise ParameterError(f"the robot cannot stand: {start.message}", start.advice)
    trajectory = integrate(bound, start, end_time=asked.seconds, record=True)
    return RobotRun(bound, trajectory, tolerance, settings)


def driven(robot: Robot, asked: Trot) -> Walker:
    """The drive that is asked for. Raises `ParameterError` and `UnknownNameError`."""
    if asked.controller not in CONTROLLERS:
        raise UnknownNameError("controller", asked.controller, CONTROLLERS)
    _check(asked)
    gains = {
        name: getattr(asked, name)
        for name in ("stiffness", "damping")
        if getattr(asked, name) is not None
    }
    rate = asked.rate
    if rate is None and asked.controller not in CONTINUOUS:
        rate = USUAL_RATE
    if rate is not None:
        law = CONTROLLERS[asked.controller](**gains)
        limit = inf if asked.limit is None else asked.limit
        made: Walker = Sampled(robot, gait=asked.gait, law=law, rate=rate, limit=limit)
    elif asked.limit is not None:
        raise ParameterError(
            f"torques are limited to {asked.limit:g} N m, but not sampled",
            "limits work with a sample rate only; give one, such as 400 Hz",
        )
    elif asked.controller == "pd":
        made = SpringDriven(robot, asked.gait, springs=JointSprings(**gains))
    else:
        made = ComputedTorque(robot, asked.gait, gains=Gains(**gains))
    _check_standing(made)
    return made


def _check(asked: Trot) -> None:
    gait = asked.gait
    check_between("seconds", asked.seconds, 0, inf)
    check_between("gait.speed", gait.speed, -10, 10)
    for name in ("height", "stance", "clearance", "landing"):
        check_between(f"gait.{name}", getattr(gait, name), 0, 10)
    check_count("gait.ramp", gait.ramp)
    for name in ("rate", "limit", "stiffness", "damping"):
        if getattr(asked, name) is not None:
            check_between(name, getattr(asked, name), 0, 1e6)
    check_between("push", asked.push, -1e3, 1e3)
    if asked.push_time is not None:
        check_between("push_time", asked.push_time, 0, asked.seconds)


def _check_standing(made: Walker) -> None:
    """Raise `ParameterError` for a robot that is not made for this."""
    legs = made.walk.legs
    _ = made.walk.pairs
    gait = made.gait
    reach = LONGEST * min(leg.reach for leg in legs.values())
    if gait.height >= reach:
        raise ParameterError(
            f"gait.height = {gait.height:g} m is beyond the legs' reach of {reach:g} m",
            "lower the hips",
        )
    room = gait.height - gait.highest
    folded = max(abs(leg.thigh_length - leg.shank_length) for leg in legs.values())
    if room <= folded:
        raise ParameterError(
            f"gait.height = {gait.height:g} m leaves {room:g} m between hips and lifted feet, but "
            f"a folded leg takes {folded:g} m",
            "raise the hips, or lower gait.clearance, gait.landing or gait.stance",
        )
    if isinstance(made, ComputedTorque) and made.robot.linkage.size - len(made.motors) < 4:
        raise ParameterError(
            "tracking all joints is overdetermined on two feet, as no joint is without a motor",
            "take the controller qp, com or pd",
        )


def _push(robot: Robot, asked: Trot) -> Push | None:
    if not asked.push:
        return None
    trunk = next(leg.trunk for leg in robot.legs.values())
    time = asked.seconds / 2 if asked.push_time is None else asked.push_time
    return Push(time, (asked.push, 0.0), trunk)
