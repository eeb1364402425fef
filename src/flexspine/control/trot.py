"""Trot: the robot starts standing and walks on diagonal pairs of legs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from math import inf

from flexspine.control.clocked import Clocked
from flexspine.control.computed_torque import ComputedTorque
from flexspine.control.cpg import Cpg, rhythm
from flexspine.control.cpg_driven import CpgDriven
from flexspine.control.joint_springs import SpringDriven
from flexspine.control.laws import JointSprings, Law, LeastResidual, SevenOutputs, Tracking
from flexspine.control.leg_pairs import diagonal_pairs
from flexspine.control.sampled import Sampled
from flexspine.control.walk_plan import Pace
from flexspine.control.walking import LONGEST
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome
from flexspine.models.bound_robot import BoundRobot, Push
from flexspine.models.leg_geometry import legs_of
from flexspine.models.model import TOLERANCES, check_between
from flexspine.models.robot import Robot
from flexspine.models.robot_run import RobotRun
from flexspine.models.simulation import DEFAULT_TOLERANCE, check_count

LAWS: dict[str, type[Law]] = {
    law.name: law for law in (Tracking, LeastResidual, SevenOutputs, JointSprings)
}
OSCILLATORS = "cpg"
CONTROLLERS = (*LAWS, OSCILLATORS)

# Hz, of controllers that have to be sampled. That of the study's robot; springs that are held for
# as long shake the light shanks.
USUAL_RATES = {LeastResidual.name: 400.0, SevenOutputs.name: 400.0, OSCILLATORS: 1000.0}

# Of its cycle that a leg stands under oscillators; feet then overlap a little.
DUTY = 0.55


Driven = ComputedTorque | Sampled | SpringDriven | CpgDriven


@dataclass(frozen=True)
class Trot:
    """What is asked of a trot of some ``seconds``, in SI units.

    ``controller`` is ``tracking`` (computed torque), ``qp`` (the same as nearly as contacts and
    limits allow), ``com`` (centre of mass, pitch and swing legs; the spine moves), ``pd`` (springs
    and dampers at the joints) or ``cpg`` (the same, drawn after coupled oscillators that know
    nothing of the ground). ``rate`` in Hz is how often torques are chosen, None: all the time,
    where the law allows it. ``limit`` (N m) bounds them. ``stiffness`` and ``damping`` are those of
    the law, None: its own; in 1/s^2 and 1/s, of ``pd`` and ``cpg`` in N m/rad and N m s/rad.
    ``push`` is an impulse in N s along x on the body at ``push_time`` (s), by default half-way.
    """

    seconds: float = 20.0
    controller: str = "tracking"
    gait: Pace = field(default_factory=Pace)
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
    """Let a planar robot trot from standing.

    ``tolerance`` is the integrator's, between 1e-17 and 1e-3. A run that falls is no error: look at
    ``outcome``. ``progress`` is told the share that is done, 0 to 1. Raises `ParameterError` and
    `UnknownNameError` for what cannot be asked for, and for a robot that has no legs to trot on.

    >>> from flexspine import Trot, load_robot, summarize_walk, trot
    >>> run = trot(load_robot("sc618"), Trot(seconds=3))
    >>> run
    <RobotRun of sc618: 3 s, completed>
    >>> f"{summarize_walk(run).speed:.2f} m/s"
    '0.30 m/s'
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
        "rate": drive.rate if isinstance(drive, Clocked) else None,
        **{f"gait.{each.name}": getattr(asked.gait, each.name) for each in fields(Pace)},
        **{
            each.name: getattr(asked, each.name)
            for each in fields(Trot)
            if each.name not in ("controller", "rate", "gait")
        },
        "stiffness": drive.law.stiffness,
        "damping": drive.law.damping,
    }
    settings = {name: None if value == inf else value for name, value in settings.items()}
    if isinstance(start, Outcome):
        raise ParameterError(f"the robot cannot stand: {start.message}", start.advice)
    trajectory = integrate(bound, start, end_time=asked.seconds, record=True)
    return RobotRun(bound, trajectory, tolerance, settings)


def driven(robot: Robot, asked: Trot) -> Driven:
    """The drive that is asked for. Raises `ParameterError` and `UnknownNameError`."""
    if asked.controller not in CONTROLLERS:
        raise UnknownNameError("controller", asked.controller, CONTROLLERS)
    _check(asked)
    _check_robot(robot, asked.gait)
    gains = {
        name: getattr(asked, name)
        for name in ("stiffness", "damping")
        if getattr(asked, name) is not None
    }
    rate = USUAL_RATES.get(asked.controller) if asked.rate is None else asked.rate
    limit = inf if asked.limit is None else asked.limit
    if rate is None and asked.limit is not None:
        raise ParameterError(
            f"torques are limited to {asked.limit:g} N m, but not sampled",
            "limits work with a sample rate only; give one, such as 400 Hz",
        )
    made: Driven
    if asked.controller == OSCILLATORS:
        assert rate is not None
        springs, cpg = JointSprings(**gains), _oscillators(robot, asked.gait)
        made = CpgDriven(robot, rate=rate, limit=limit, law=springs, pattern=cpg)
    elif rate is not None:
        law = LAWS[asked.controller](**gains)
        made = Sampled(robot, gait=asked.gait, law=law, rate=rate, limit=limit)
    elif asked.controller == JointSprings.name:
        made = SpringDriven(robot, asked.gait, law=JointSprings(**gains))
    else:
        made = ComputedTorque(robot, asked.gait, law=Tracking(**gains))
        if robot.linkage.size - len(robot.motors) < 4:
            raise ParameterError(
                "tracking all joints is overdetermined on two feet, as no joint is without a motor",
                "take the controller qp, com, pd or cpg",
            )
    return made


def _oscillators(robot: Robot, gait: Pace) -> Cpg:
    """Oscillators that trot as the gait says."""
    cycle = gait.stance / DUTY
    return Cpg(
        replace(
            rhythm("trot", legs_of(robot)),
            frequency=1 / cycle,
            duty=DUTY,
            stride=gait.speed * gait.stance,
            height=gait.height,
            clearance=gait.clearance,
            stop=gait.stop,
        )
    )


def _check(asked: Trot) -> None:
    gait = asked.gait
    check_between("seconds", asked.seconds, 0, inf)
    check_between("gait.speed", gait.speed, -10, 10)
    for name in ("height", "stance", "clearance", "landing"):
        check_between(f"gait.{name}", getattr(gait, name), 0, 10)
    check_count("gait.ramp", gait.ramp)
    if not gait.stop > 0:
        raise ParameterError(f"gait.stop = {gait.stop} is not usable", "give seconds above zero")
    for name in ("rate", "limit", "stiffness", "damping"):
        if getattr(asked, name) is not None:
            check_between(name, getattr(asked, name), 0, 1e6)
    check_between("push", asked.push, -1e3, 1e3)
    if asked.push_time is not None:
        check_between("push_time", asked.push_time, 0, asked.seconds)


def _check_robot(robot: Robot, gait: Pace) -> None:
    """Raise `ParameterError` for a robot that is not made for this."""
    legs = legs_of(robot)
    diagonal_pairs(legs)
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


def _push(robot: Robot, asked: Trot) -> Push | None:
    if not asked.push:
        return None
    trunk = next(leg.trunk for leg in robot.legs.values())
    time = asked.seconds / 2 if asked.push_time is None else asked.push_time
    return Push(time, (asked.push, 0.0), trunk)
