"""A passive planar robot pinned by one foot, which is the origin: no ground, no motors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import NamedTuple

import numpy as np
import sympy as sp

from flexspine.errors import ParameterError, StateError
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array, compile_system
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import TIMED_OUT
from flexspine.hybrid.system import HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState, Trajectory
from flexspine.mechanics.linkage import Linkage
from flexspine.mechanics.linkage_motion import LinkageMotion, Standing
from flexspine.models.articulated import DISSIPATED
from flexspine.models.leg_geometry import legs_of
from flexspine.models.robot import Robot

# As small as the integrator takes it: what is compared with it is to show its own errors.
TOLERANCE = 1e-15

# rad; how far thighs lean back and shanks forward of straight down, seen from the hip, of the first
# leg and every other one, and of those between: legs that start alike would move alike.
LEANS = (0.55, 0.35), (0.45, 0.45)

# rad; between the links of a robot whose legs are not known, one way and the other in turn.
BEND = 0.3

PINNED = "pinned"


class Energies(NamedTuple):
    """Over time, in J: of motion, of weight (zero at the foot) and springs, taken by dampers."""

    kinetic: Array
    potential: Array
    dissipated: Array

    @property
    def sum(self) -> Array:
        """What stays the same."""
        total: Array = self.kinetic + self.potential + self.dissipated
        return total


@dataclass(frozen=True)
class PinnedRun:
    """A passive robot that turned about one of its feet."""

    linkage: Linkage
    foot: str
    trajectory: Trajectory

    def angles(self, times: Array) -> Array:
        """Absolute angles of all links at ``times`` (s), shape (times, links)."""
        return self._states(times)[:, : len(self.linkage.links)]

    def coordinates(self, times: Array) -> Array:
        """The linkage's ``q`` at ``times`` (s), shape (times, N)."""
        q: Array = self._states(times)[:, : self.linkage.size] @ self.linkage.to_relative.T
        return q

    def energies(self, times: Array) -> Energies:
        """Where the energy is at ``times`` (s)."""
        n, states = self.linkage.size, self._states(times)
        q, rates = (states[:, part] @ self.linkage.to_relative.T for part in np.s_[:n, n : 2 * n])
        kinetic = self.linkage.kinetic_energy(q, rates)
        return Energies(kinetic, self.linkage.potential_energy(q), states[:, -1])

    def _states(self, times: Array) -> Array:
        (arc,) = self.trajectory.arcs
        return arc(times)


def crouch(robot: Robot) -> Array:
    """Absolute angles of all links, in rad, of a posture from which a passive robot falls.

    The trunk is level and all knees are bent; where legs cannot be made out, links are bent against
    their parents one way and the other in turn.
    """
    linkage = robot.linkage
    try:
        legs = legs_of(robot)
    except ParameterError:
        bends = [BEND if number % 2 == 0 else -BEND for number in range(len(linkage.links))]
        return linkage.angles(np.array([*bends, 0.0, 0.0]))
    angles = np.zeros(len(linkage.links))
    for number, leg in enumerate(legs.values()):
        lean = LEANS[number % len(LEANS)]
        back, turned = 1 if leg.knee_back else -1, pi if leg.upwards else 0.0
        thigh, shank = -pi / 2 - back * lean[0], -pi / 2 + back * lean[1]
        angles[linkage.place[leg.thigh]] = thigh + turned
        angles[linkage.place[leg.shank]] = shank + turned
    return angles


def swing(robot: Robot, foot: str, angles: Array, seconds: float) -> PinnedRun:
    """Let a passive robot go from rest at absolute ``angles`` (rad), held by one foot.

    Raises `StateError` if it cannot be integrated.
    """
    linkage, n = robot.linkage, robot.linkage.size
    system, values = _pinned_system(linkage, foot)
    bound = BoundSystem(compile_system(system, TOLERANCE), values)
    here = np.concatenate([angles, np.zeros(2)])
    here[-2:] = -linkage.foot(linkage.to_relative @ here, foot)
    start = HybridState(0.0, PINNED, np.concatenate([here, np.zeros(n + 1)]), np.zeros(0))
    trajectory = integrate(bound, start, end_time=seconds, record=True)
    if not trajectory.outcome.completed:
        outcome = trajectory.outcome
        raise StateError(f"pinned by '{foot}': {outcome.message}", outcome.advice)
    return PinnedRun(linkage, foot, trajectory)


@lru_cache(maxsize=8)
def _pinned_system(linkage: Linkage, foot: str) -> tuple[HybridSystem, Array]:
    """The equations of a pinned linkage, and its numbers."""
    motion = LinkageMotion(linkage)
    pin = Standing(foot, (sp.S.Zero, sp.S.Zero))
    definitions, accelerations, _ = motion.stance([pin], {})
    field = {
        **dict(zip(motion.coordinates, motion.rates, strict=True)),
        **dict(zip(motion.rates, accelerations, strict=True)),
        DISSIPATED: motion.damper_power(),
    }
    mode = Mode(PINNED, definitions, field, guards=())
    system = HybridSystem(
        name=PINNED,
        states=tuple(field),
        held=(),
        parameters=tuple(motion.values),
        modes=(PINNED,),
        mode=lambda _name: mode,
        section=Section((), {}, {}, {}, TIMED_OUT),
        large=True,
    )
    return system, np.array(list(motion.values.values()))
