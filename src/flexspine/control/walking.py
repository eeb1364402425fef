"""Drives that walk by a plan, under whatever law turns the motors."""

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
from flexspine.control.walk_plan import STEP, SWING_END, Pace, WalkPlan
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.articulated import CLOCK
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Drive, Moment

# Of the stretched leg; beyond this angles change without bounds.
LONGEST = 0.999

OUT_OF_REACH = OutcomeKind(
    "out_of_reach",
    "a foot is to be where its leg cannot reach; lower the hips, or walk with shorter steps",
)


@dataclass(frozen=True)
class WalkingDrive(Drive):
    """A drive that walks; how torques follow from what joints are to do is left to its kinds."""

    gait: Pace = field(default_factory=Pace)

    @cached_property
    def walk(self) -> WalkPlan:
        """The plan."""
        return WalkPlan(self.robot, self.gait)

    @cached_property
    def references(self) -> References:
        """What joints are to do."""
        feet = {name: FootPath.of(name).motion() for name in self.walk.legs}
        return references(self.robot, self.walk.legs, BODY.motion(), feet)

    @cached_property
    def _measures(self) -> dict[sp.Symbol, float]:
        return leg_numbers(self.walk.legs)

    @cached_property
    def _reference_function(self) -> ReferenceFunction:
        inputs = [CLOCK, *self.walk.begin(), *self._measures]
        return ReferenceFunction(self.references, self.robot.motors, inputs)

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
        x, speed = BODY.at(moment.held, moment.time)
        course = np.array([[x, 0.0], [speed, 0.0], [moment.held[BODY.gain], 0.0]])
        course[0] += self._com_at_start
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
        return bound.begin(q, np.zeros_like(q), held)


def _swing_over(bound: BoundSystem, point: HybridState) -> HybridState | Outcome | None:
    """Feet that ought to have landed sink until they do."""
    assert isinstance(bound, BoundRobot)
    assert isinstance(bound.drive, WalkingDrive)
    moment = bound.moment(point)
    held = bound.drive.walk.swing_over(moment.held, moment.time)
    return bound.carry_on(replace(moment, held=held), point.states)
