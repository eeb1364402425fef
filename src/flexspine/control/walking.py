"""Walking on pairs of legs: which feet stand and which swing, and where they are to land.

While one pair of legs stands, the other swings and comes down; when both its feet are on the
ground the pairs change. Feet that have landed stay where they did, which keeps errors of the
distance between them from adding up. Speed is changed evenly over the first steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

import numpy as np
import sympy as sp

from flexspine.control.laws import Situation
from flexspine.control.leg_function import standing
from flexspine.control.references import (
    BODY,
    FootPath,
    ReferenceFunction,
    References,
    leg_number,
    leg_numbers,
    references,
)
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array, BoundSystem
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.articulated import CLOCK, anchor
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Drive, Moment
from flexspine.models.leg_geometry import Leg, legs_of
from flexspine.models.robot import Robot

STEP, SWING_END = sp.symbols("step swing_end", real=True)

# Of the stretched leg; beyond this angles change without bounds.
LONGEST = 0.999

# s; a time that has passed. One that never comes would be large, and the integrator takes errors
# relative to the largest of all guards and states.
PASSED = -1.0

OUT_OF_REACH = OutcomeKind(
    "out_of_reach",
    "a foot is to be where its leg cannot reach; lower the hips, or walk with shorter steps",
)


@dataclass(frozen=True)
class Pace:
    """How to walk, in SI units.

    ``height`` is that of the hips, ``stance`` how long a pair of legs stands, ``clearance`` how
    high feet are lifted, ``landing`` how fast they come down, ``ramp`` the number of steps until
    the ``speed`` is reached, and until the robot steps in place again from ``stop`` (s) on.
    """

    speed: float = 0.3
    height: float = 0.33
    stance: float = 0.4
    clearance: float = 0.04
    landing: float = 0.05
    ramp: int = 4
    stop: float = inf

    def speed_after(self, time: float, speed: float, steps: int) -> float:
        """The speed that is wanted some steps after one at ``time`` (s) with ``speed``."""
        aim = self.speed if time < self.stop else 0.0
        most = steps * abs(self.speed) / self.ramp
        return speed + min(max(aim - speed, -most), most)

    @property
    def highest(self) -> float:
        """What no foot is lifted above; ``s^2 (1 - s)`` is 4/27 at most."""
        return self.clearance + self.landing * self.stance * 4 / 27


Pairs = tuple[tuple[str, ...], tuple[str, ...]]


def hip_pairs(legs: Mapping[str, Leg]) -> Pairs:
    """The hind pair and the fore pair. Raises `ParameterError` unless there are two of two."""
    hips = sorted({leg.hip for leg in legs.values()})
    at = [[name for name, leg in legs.items() if leg.hip == hip] for hip in hips]
    if [len(names) for names in at] != [2, 2]:
        raise ParameterError(
            f"legs per hip: {', '.join(str(len(names)) for names in at)}",
            "a quadruped gait needs two legs at each of two hips",
        )
    hind, fore = at
    return tuple(hind), tuple(fore)


def diagonal_pairs(legs: Mapping[str, Leg]) -> Pairs:
    """The pairs of a trot: a hind leg and the fore leg of the other side.

    Raises `ParameterError` unless two legs are at each of two hips.
    """
    hind, fore = hip_pairs(legs)
    return (hind[0], fore[1]), (hind[1], fore[0])


@dataclass(frozen=True)
class Walk:
    """The plan of a walk for one robot."""

    robot: Robot
    gait: Pace

    @cached_property
    def legs(self) -> dict[str, Leg]:
        """Its legs."""
        return legs_of(self.robot)

    @cached_property
    def pairs(self) -> Pairs:
        """The legs that stand together, those of the first step first."""
        return diagonal_pairs(self.legs)

    def standing(self, held: Mapping[sp.Symbol, float]) -> tuple[str, ...]:
        """The legs that are to stand."""
        return self.pairs[int(held[STEP]) % 2]

    def swinging(self, held: Mapping[sp.Symbol, float]) -> tuple[str, ...]:
        """The legs that are to swing."""
        return self.pairs[1 - int(held[STEP]) % 2]

    def begin(self) -> dict[sp.Symbol, float]:
        """Stand with all feet below the hips, about to lift the first pair."""
        held = {BODY.x: 0.0, BODY.speed: 0.0, BODY.gain: 0.0, BODY.start: 0.0}
        held |= {BODY.height: self.gait.height, STEP: -1.0, SWING_END: PASSED}
        for name, leg in self.legs.items():
            held |= _stand(name, leg.hip)
        return self._next_step(held, 0.0)

    def after_landing(self, moment: Moment, landed: tuple[str, ...]) -> dict[sp.Symbol, float]:
        """Keep feet where they landed. They are pressed on, or they would bounce."""
        held, time = dict(moment.held), moment.time
        swings = self.swinging(held)
        for name in swings:
            foot, path = self.legs[name].foot, FootPath.of(name)
            early = held[path.lift] and time - held[path.start] < held[path.span] / 2
            if foot in landed and not early:
                held |= self._sink(name, held[anchor(foot)[0]], time)
        return held

    def after_settling(self, moment: Moment) -> dict[sp.Symbol, float] | None:
        """Change pairs if all feet that swung are on the ground."""
        held, swings = dict(moment.held), self.swinging(moment.held)
        feet = moment.footing.feet
        if not all(_sinks(name, held) and self.legs[name].foot in feet for name in swings):
            return None
        for name in swings:
            held |= _stand(name, held[anchor(self.legs[name].foot)[0]])
        return self._next_step(held, moment.time)

    def swing_over(self, held: Mapping[sp.Symbol, float], time: float) -> dict[sp.Symbol, float]:
        """Let feet that ought to have landed sink until they do."""
        new = dict(held)
        for name in self.swinging(held):
            if not _sinks(name, held):
                path = FootPath.of(name)
                new |= self._sink(name, held[path.x] + held[path.stride], time)
        return new | {SWING_END: PASSED}

    def _sink(self, leg: str, x: float, time: float) -> dict[sp.Symbol, float]:
        """The path of a foot that comes straight down."""
        path = FootPath.of(leg)
        return _stand(leg, x) | {path.sink: self.gait.landing, path.start: time}

    def _next_step(self, held: dict[sp.Symbol, float], time: float) -> dict[sp.Symbol, float]:
        """Change pairs."""
        gait, since = self.gait, time - held[BODY.start]
        x = held[BODY.x] + held[BODY.speed] * since + held[BODY.gain] * since**2 / 2
        speed = held[BODY.speed] + held[BODY.gain] * since
        step = held[STEP] + 1
        aims = [gait.speed_after(time, speed, steps) for steps in (1, 2)]
        gain = (aims[0] - speed) / gait.stance
        new = {**held, STEP: step, SWING_END: time + gait.stance, BODY.start: time}
        new |= {BODY.x: x, BODY.speed: speed, BODY.gain: gain}
        ahead = (speed + aims[0]) / 2 * gait.stance  # until it lands
        ahead += sum(aims) / 4 * gait.stance  # and half of what comes then
        for name in self.swinging(new):
            path = FootPath.of(name)
            new |= {
                path.stride: x + self.legs[name].hip + ahead - held[path.x],
                path.lift: gait.clearance,
                path.landing: gait.landing,
                path.sink: 0.0,
                path.start: time,
                path.span: gait.stance,
            }
        return new


def _stand(leg: str, x: float) -> dict[sp.Symbol, float]:
    """The path of a foot that stays where it is."""
    path = FootPath.of(leg)
    still = dict.fromkeys((path.stride, path.lift, path.landing, path.sink, path.start), 0.0)
    return {path.x: x, **still, path.span: 1.0}


def _sinks(leg: str, held: Mapping[sp.Symbol, float]) -> bool:
    """Whether a foot is to come straight down."""
    return held[FootPath.of(leg).sink] != 0


@dataclass(frozen=True)
class Walker(Drive):
    """A drive that walks; how torques follow from what joints are to do is left to its kinds."""

    gait: Pace = field(default_factory=Pace)

    @cached_property
    def walk(self) -> Walk:
        """The plan."""
        return Walk(self.robot, self.gait)

    @cached_property
    def references(self) -> References:
        """What joints are to do."""
        feet = {name: FootPath.of(name).motion() for name in self.walk.legs}
        return references(self.robot, self.walk.legs, BODY.motion(), feet)

    @cached_property
    def motors(self) -> list[str]:
        """The joints with a motor, in order."""
        return [joint for joint, (_, motor) in self.robot.joints.items() if motor]

    @cached_property
    def _measures(self) -> dict[sp.Symbol, float]:
        return leg_numbers(self.walk.legs)

    @cached_property
    def _reference_function(self) -> ReferenceFunction:
        inputs = [CLOCK, *self.walk.begin(), *self._measures]
        return ReferenceFunction(self.references, self.motors, inputs)

    def references_at(self, moment: Moment) -> tuple[Array, dict[str, Array]]:
        """Angle, rate and acceleration of the motors' joints, shape (3, m), and of links (3,)."""
        known = {**moment.held, **self._measures, CLOCK: moment.time}
        return self._reference_function(known)

    @cached_property
    def _trunk(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(leg.trunk for leg in self.walk.legs.values()))

    @cached_property
    def _com_at_start(self) -> Array:
        """Of the body at its place zero."""
        return np.asarray(self.robot.linkage.com(self.posture(self.walk.begin())), dtype=float)

    @property
    def usual(self) -> tuple[tuple[str, ...], ...]:
        """The feet of either pair."""
        return tuple(self._feet(pair) for pair in self.walk.pairs)

    def _feet(self, legs: tuple[str, ...]) -> tuple[str, ...]:
        """The feet of some legs, in the robot's order."""
        feet = {self.walk.legs[name].foot for name in legs}
        return tuple(foot for foot in self.robot.feet if foot in feet)

    def situation(self, moment: Moment, limit: float = inf) -> Situation:
        """What a law needs to know; ``limit`` bounds torques, in N m."""
        joints, links = self.references_at(moment)
        swinging = [self.walk.legs[name] for name in self.walk.swinging(moment.held)]
        held, since = moment.held, moment.time - moment.held[BODY.start]
        course = np.zeros((3, 2))
        course[0] = self._com_at_start
        course[0, 0] += held[BODY.x] + held[BODY.speed] * since + held[BODY.gain] * since**2 / 2
        course[1:, 0] = held[BODY.speed] + held[BODY.gain] * since, held[BODY.gain]
        return Situation(
            linkage=self.robot.linkage,
            q=moment.q,
            rates=moment.rates,
            feet=(counted := self.to_stand(moment.held)),
            regular=counted == moment.footing.feet == moment.footing.sticking,
            joints=joints,
            links={link: links[link] for leg in swinging for link in (leg.thigh, leg.shank)},
            com=course,
            trunk=self._trunk,
            friction=self.robot.friction,
            limit=limit,
        )

    @cached_property
    def observed_references(self) -> dict[str, sp.Expr]:
        """Where joints are to be and how fast, by the names that these are observed under."""
        joints = self.references.joints.items()
        return {f"reference_{joint}": angle for joint, (angle, _, _) in joints} | {
            f"reference_rate_{joint}": rate for joint, (_, rate, _) in joints
        }

    def held(self) -> tuple[sp.Symbol, ...]:
        """The plan's numbers."""
        return tuple(self.walk.begin())

    def values(self) -> dict[sp.Symbol, float]:
        """What the legs measure."""
        return self._measures

    def guards(self) -> tuple[Guard, ...]:
        """The end of a swing; and no leg is longer than it is."""
        found = [Guard("swing over", SWING_END - CLOCK, decide=_swing_over, timed=True)]
        for name in self.walk.legs:
            whole = leg_number("thigh", name) + leg_number("shank", name)
            slack = LONGEST * whole - self.references.stretch[name]
            found.append(Guard(f"{name} out of reach", slack, ends=OUT_OF_REACH))
        return tuple(found)

    def after_landing(self, moment: Moment, landed: tuple[str, ...]) -> Moment:
        """Keep feet where they landed."""
        return replace(moment, held=self.walk.after_landing(moment, landed))

    def after_settling(self, moment: Moment) -> Moment:
        """Change pairs if it is time to."""
        held = self.walk.after_settling(moment)
        return moment if held is None else replace(moment, held=held)

    def to_stand(self, held: Mapping[sp.Symbol, float]) -> tuple[str, ...]:
        """The feet that are to stand. One that bounces or slides for a moment still counts."""
        return self._feet(self.walk.standing(held))

    def steps(self, held: Mapping[sp.Symbol, float]) -> int:
        """How many pairs have landed."""
        return int(held[STEP])

    def posture(self, held: Mapping[sp.Symbol, float]) -> Array:
        """``q`` as it is to be at the beginning."""
        ahead = {name: held[FootPath.of(name).x] - leg.hip for name, leg in self.walk.legs.items()}
        return standing(self.robot, self.gait.height, ahead)

    def begin(self, bound: BoundRobot) -> HybridState | Outcome:
        """The robot at rest on all its feet, about to take the first step."""
        held = dict.fromkeys(self.held(), 0.0) | self.walk.begin()
        q = self.posture(held)
        start = self.ready(bound.stand(q, np.zeros_like(q), held))
        return bound.carry_on(start, bound.at_rest(q))


def _swing_over(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    """Feet that ought to have landed sink until they do."""
    assert isinstance(bound, BoundRobot)
    assert isinstance(bound.drive, Walker)
    moment = bound.moment(point)
    held = bound.drive.walk.swing_over(moment.held, moment.time)
    return bound.carry_on(replace(moment, held=held), point.states)
