"""Walking on pairs of legs: which feet stand and which swing, and where they are to land.

While one pair of legs stands, the other swings and comes down; when both its feet are on the
ground the pairs change. Feet that have landed stay where they did, which keeps errors of the
distance between them from adding up. Speed is changed evenly over the first steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf

import sympy as sp

from flexspine.control.leg_pairs import Pairs, diagonal_pairs
from flexspine.control.references import BODY, FootPath
from flexspine.models.articulated import anchor
from flexspine.models.drive import Moment
from flexspine.models.leg_geometry import Leg, legs_of
from flexspine.models.robot import Robot

STEP, SWING_END = sp.symbols("step swing_end", real=True)

# s; a time that has passed. One that never comes would be large, and the integrator takes errors
# relative to the largest of all guards and states.
PASSED = -1.0


@dataclass(frozen=True)
class Pace:
    """How a planar robot is to walk, in SI units.

    ``speed`` is that of the trunk (m/s), ``height`` that of the hips (m), ``stance`` how long a
    pair of legs stands (s), ``clearance`` how high feet are lifted (m), ``landing`` how fast they
    come down (m/s), ``ramp`` the number of steps until the speed is reached, and until the robot
    steps in place again from ``stop`` (s) on.
    """

    speed: float = 0.3
    height: float = 0.33
    stance: float = 0.4
    clearance: float = 0.04
    landing: float = 0.05
    ramp: int = 4
    stop: float = inf

    def speed_after(self, time: float, speed: float, steps: int) -> float:
        """Return the speed (m/s) to have some steps after one at ``time`` (s) with ``speed``."""
        aim = self.speed if time < self.stop else 0.0
        most = steps * abs(self.speed) / self.ramp
        return speed + min(max(aim - speed, -most), most)

    @property
    def highest(self) -> float:
        """What no foot is lifted above, in m; ``s^2 (1 - s)`` is 4/27 at most."""
        return self.clearance + self.landing * self.stance * 4 / 27


@dataclass(frozen=True)
class WalkPlan:
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
        gait, (x, speed) = self.gait, BODY.at(held, time)
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
