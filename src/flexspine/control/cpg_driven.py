"""Joints that springs draw after the feet of a central pattern generator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import sympy as sp

from flexspine.control.clocked import Clocked
from flexspine.control.cpg import Beat, Cpg
from flexspine.control.laws import JointSprings
from flexspine.control.leg_function import LegFunction
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.drive import Moment
from flexspine.models.leg_geometry import Leg, legs_of

AMPLITUDE, AMPLITUDE_RATE = sp.symbols("cpg_amplitude cpg_amplitude_rate", real=True)


@dataclass(frozen=True)
class CpgDriven(Clocked):
    """Step by the rhythm of oscillators, without sense of the ground."""

    pattern: Cpg = field(kw_only=True)
    law: JointSprings = field(default_factory=JointSprings)

    @cached_property
    def legs(self) -> dict[str, Leg]:
        """The robot's legs."""
        return legs_of(self.robot)

    def held(self) -> tuple[sp.Symbol, ...]:
        """The torques, the beat, and where joints are to be."""
        return (*super().held(), *self._beat_symbols, *self._angles.values())

    def observed(self) -> tuple[Mapping[sp.Symbol, sp.Expr], Mapping[str, sp.Expr]]:
        """Where joints are to be."""
        return {}, {f"reference_{joint}": symbol for joint, symbol in self._angles.items()}

    def to_stand(self, held: Mapping[sp.Symbol, float]) -> tuple[str, ...]:
        """The feet of the legs that are in their stance."""
        stands = self.pattern.in_stance(self._beat(held)).tolist()
        return tuple(leg.foot for leg, down in zip(self.legs.values(), stands, strict=True) if down)

    def steps(self, held: Mapping[sp.Symbol, float]) -> int:
        """How many half cycles the first leg has done."""
        return int(self._beat(held).phases[0] // np.pi)

    def choose(self, moment: Moment) -> tuple[Array, Mapping[sp.Symbol, float]]:
        """Draw joints to where the beat has them, and let it go on."""
        beat = self._beat(moment.held)
        angles, rates = self.joints(beat)
        motors = self.robot.linkage.actuation.T
        torques = self.law.pull(angles - motors @ moment.q, rates - motors @ moment.rates)
        following = self.pattern.advance(beat, moment.time, 1 / self.rate)
        numbers = [*following.phases.tolist(), following.amplitude, following.amplitude_rate]
        remembered = dict(zip(self._beat_symbols, numbers, strict=True))
        return torques, remembered | dict(zip(self._angles.values(), angles.tolist(), strict=True))

    def joints(self, beat: Beat) -> tuple[Array, Array]:
        """Angles of the motors' joints and their rates at a beat, shape (m,)."""
        place, velocity = self.pattern.feet(beat)
        return self._function.joints(place + self._function.hips, velocity)

    def begin(self, bound: BoundRobot) -> HybridState | Outcome:
        """The robot at rest on all its feet, which are below the hips."""
        beat = self.pattern.begin()
        numbers = [*beat.phases.tolist(), 0.0, 0.0]
        held = dict.fromkeys(self.held(), 0.0) | dict(zip(self._beat_symbols, numbers, strict=True))
        place, _ = self.pattern.feet(beat)
        q = self._function.posture(place + self._function.hips)
        return bound.begin(q, np.zeros_like(q), held)

    def _beat(self, held: Mapping[sp.Symbol, float]) -> Beat:
        *phases, amplitude, rate = (held[symbol] for symbol in self._beat_symbols)
        return Beat(np.array(phases), amplitude, rate)

    @cached_property
    def _beat_symbols(self) -> tuple[sp.Symbol, ...]:
        phases = (sp.Symbol(f"cpg_phase_{leg}", real=True) for leg in self.legs)
        return (*phases, AMPLITUDE, AMPLITUDE_RATE)

    @cached_property
    def _angles(self) -> dict[str, sp.Symbol]:
        return {
            joint: sp.Symbol(f"held_reference_{joint}", real=True) for joint in self.robot.motors
        }

    @cached_property
    def _function(self) -> LegFunction:
        return LegFunction(self.robot, self.legs)
