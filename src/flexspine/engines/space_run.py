"""A robot in space runs: joints drawn after the feet of a central pattern generator.

A computer reads the joints' angles some hundred times a second, chooses torques and holds them, as
`flexspine.control.cpg_driven` does in the plane, with the abduction of the hips drawn to zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, isfinite
from typing import Any

import numpy as np

from flexspine.control.cpg import Cpg
from flexspine.control.gains import Walk
from flexspine.control.leg_function import LegFunction
from flexspine.engines.contact import ContactLaw
from flexspine.engines.mjcf import STEP, Start
from flexspine.engines.space_engine import SpaceEngine
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import COMPLETED, DIVERGED, Outcome
from flexspine.models.articulated import FELL
from flexspine.models.model import check_between
from flexspine.models.robot import Robot
from flexspine.models.space import LegJoints, SpaceRobot
from flexspine.parameters import check_seed

# rad/s; joints of a robot never turn faster, numbers that have gone wrong do.
FASTEST = 1e4

# Of a count of time steps: what division leaves over a whole number.
ROUNDING = 1e-9

# s; between two looks of whoever wants to know how far it is.
TOLD = 0.1


@dataclass(frozen=True)
class SpaceRun:
    """A run in space; `space_dataset` gives every quantity of it over time.

    ``space`` is the robot and ``walk`` what it was to do, ``settings`` what else was asked for.
    ``laws`` tell by foot how it meets the ground. ``samples`` by name are taken whenever torques
    are chosen; their shapes begin with the times. ``outcome`` tells how the run ended.
    """

    space: SpaceRobot
    walk: Walk
    outcome: Outcome
    settings: dict[str, Any]
    laws: dict[str, ContactLaw]
    samples: dict[str, Array]

    def __repr__(self) -> str:
        told = f"{self.duration:.4g} s, {self.outcome.name}"
        return f"<SpaceRun of {self.robot.name}, {self.walk.name}: {told}>"

    @property
    def robot(self) -> Robot:
        """What ran."""
        return self.space.robot

    @property
    def duration(self) -> float:
        """How long it ran, in s."""
        times = self.samples["time"]
        return float(times[-1]) if len(times) else 0.0


@dataclass(frozen=True)
class Servo:
    """What joints are to do over time, and the springs and dampers that make them do it.

    ``angles`` and ``rates`` have shape (times, motors); the others (motors,).
    """

    angles: Array
    rates: Array
    stiffness: Array
    damping: Array
    limit: float

    def torques(self, sample: int, angles: Array, rates: Array) -> Array:
        """The torques at a sample, from what joints are found to do, in N m."""
        pull = self.stiffness * (self.angles[sample] - angles)
        pull = pull + self.damping * (self.rates[sample] - rates)
        torques: Array = np.clip(pull, -self.limit, self.limit)
        return torques


@dataclass(frozen=True)
class CpgCourse:
    """The feet of a walk's oscillators, and the joints that put them there."""

    space: SpaceRobot
    walk: Walk

    @cached_property
    def _cpg(self) -> Cpg:
        return Cpg(self.walk.pattern(self.space.legs))

    @cached_property
    def _function(self) -> LegFunction:
        return LegFunction(self.space.robot, self.space.legs)

    def start(self) -> Start:
        """The robot at rest on all its feet."""
        place, _ = self._cpg.feet(self._cpg.begin())
        return Start.of(self.space, self._function.posture(place + self._function.hips))

    def servo(self, count: int) -> Servo:
        """What joints are to do at so many samples. Raises `ParameterError` if they cannot."""
        servo, motors = self.walk.gains.servo, self.space.motors
        angles, rates = np.zeros((2, count, len(motors)))
        beat = self._cpg.begin()
        for sample in range(count):
            place, velocity = self._cpg.feet(beat)
            links = self._function.links(place + self._function.hips, velocity)
            for name, (angle, rate) in self.space.bent(links).items():
                at = motors.index(name)
                angles[sample, at], rates[sample, at] = angle, rate
            beat = self._cpg.advance(beat, sample / servo.rate, 1 / servo.rate)
        if not np.isfinite(angles).all():
            raise ParameterError(
                "feet of this gait are out of reach", "lower gait.height, or take shorter steps"
            )
        out = np.isin(motors, [LegJoints.of(leg).out for leg in self.space.legs])
        return Servo(
            angles,
            rates,
            np.where(out, servo.out_stiffness, servo.stiffness),
            np.where(out, servo.out_damping, servo.damping),
            servo.limit,
        )


def run_in_space(
    robot: Robot,
    walk: Walk,
    seconds: float = 15.0,
    *,
    plane: bool = False,
    sensing: float = 0.0,
    seed: int = 0,
    step: float = STEP,
    progress: Callable[[float], None] | None = None,
) -> SpaceRun:
    """Let a robot walk in MuJoCo for some ``seconds``, from standing.

    ``sensing`` (rad) is how far angles of joints are read off at most, drawn evenly from ``seed``;
    ``step`` (s) is MuJoCo's, shortened to divide the time between two samples. ``plane`` keeps the
    robot to the plane. A run that falls is no error: look at ``outcome``. ``progress`` is told the
    share that is done, 0 to 1. Raises `ParameterError`, and `MachineError` without a MuJoCo that
    will do.
    """
    check_between("seconds", seconds, 0.01, 3600)
    if sensing != 0:
        check_between("sensing", sensing, 0, 1)
    check_seed(seed)
    check_between("step", step, 1e-6, 1e-2)
    space = SpaceRobot(robot, plane)
    course = CpgCourse(space, walk)
    rate = walk.gains.servo.rate
    each = ceil(1 / (rate * step) - ROUNDING)
    engine = SpaceEngine(space, step=1 / (rate * each))
    engine.set_down(course.start())
    count = max(1, round(seconds * rate))
    servo = course.servo(count + 1)
    noise = np.random.default_rng(seed)
    told = max(1, round(TOLD * rate))

    def read() -> Array:
        angles: Array = engine.angles[engine.driven]
        if sensing:
            angles = angles + noise.uniform(-sensing, sensing, len(angles))
        return angles

    def tell(sample: int) -> None:
        if progress is not None and sample % told == 0:
            progress(sample / count)

    with engine.unheard():
        ended, records = _walk(engine, servo, rate, each, read, tell)
    outcome = ended or Outcome(COMPLETED, f"walked for {seconds:g} s")
    names = records[0].keys()
    samples = {name: np.array([record[name] for record in records]) for name in names}
    settings = {
        "gait": walk.name,
        "rhythm": walk.rhythm,
        "seconds": seconds,
        "plane": plane,
        "sensing": sensing,
        "seed": seed,
        "step": engine.step,
    }
    return SpaceRun(space, walk, outcome, settings, engine.laws, samples)


def _walk(
    engine: SpaceEngine,
    servo: Servo,
    rate: float,
    each: int,
    read: Callable[[], Array],
    tell: Callable[[int], None],
) -> tuple[Outcome | None, list[dict[str, Any]]]:
    """Choose torques at all samples of a servo, ``each`` time steps apart, at ``rate`` (Hz).

    Returns how the run ended before the last of them, if it did, and what was seen at each.
    """
    last = len(servo.angles) - 1
    records: list[dict[str, Any]] = []
    sums, worst = np.zeros(3), np.zeros((2, len(engine.space.balls)))
    for sample in range(last + 1):
        torques = servo.torques(sample, read(), engine.rates[engine.driven])
        engine.data.ctrl[:] = torques
        engine.forward()
        records.append(_sample(engine, sample / rate, torques, servo, sample, sums, worst))
        ended = _ended(engine, sample / rate)
        if ended is not None:
            return ended, records
        if sample < last:
            worst = _go(engine, each, sums)
        tell(sample)
    return None, records


def _go(engine: SpaceEngine, count: int, sums: Array) -> Array:
    """Go on by some steps; adds up what motors and ground gave and dampers took, in J.

    Returns the largest normal force on each foot and how deep it was in the ground, (2, feet).
    """
    data, step = engine.data, engine.step
    worst = np.zeros((2, len(engine.space.balls)))
    for _ in range(count):
        before = data.qvel.copy()
        engine.advance()
        # Velocities half-way make the sum of works equal the change of kinetic energy.
        middle = (before + data.qvel) / 2 * step
        sums[0] += data.qfrc_actuator @ middle
        sums[1] += data.qfrc_constraint @ middle
        sums[2] += data.qfrc_damper @ middle
        np.maximum(worst[0], engine.normals, out=worst[0])
        np.maximum(worst[1], engine.depths, out=worst[1])
    return worst


def _sample(
    engine: SpaceEngine,
    time: float,
    torques: Array,
    servo: Servo,
    sample: int,
    sums: Array,
    worst: Array,
) -> dict[str, Any]:
    work, ground, dampers = sums
    return engine.look() | {
        "time": time,
        "torque": torques,
        "reference": servo.angles[sample],
        "reference_rate": servo.rates[sample],
        "motor_work": float(work),
        "contact_loss": float(-ground),
        "damper_loss": float(-dampers),
        "peak_normal": worst[0],
        "depth": np.maximum(worst[1], engine.depths),
    }


def _ended(engine: SpaceEngine, time: float) -> Outcome | None:
    """How a run ended, if it did."""
    data = engine.data
    if not isfinite(data.qacc.sum() + data.qvel.sum()) or np.abs(data.qvel).max() > FASTEST:
        return Outcome(DIVERGED, f"numbers grew without bounds at t = {time:.3f} s")
    if engine.lowest < 0:
        return Outcome(FELL, f"the trunk or a knee came to the ground at t = {time:.3f} s")
    return None
