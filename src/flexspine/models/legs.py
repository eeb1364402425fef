"""Massless spring legs: parameters, force, touchdown and lift-off.

A leg pair acts as one leg. In flight it keeps its rest length and its touchdown angle from the
vertical, foot ahead of the hip positive. In stance the toe is a frictionless pin on the ground.
Source: Kamimura et al. 2015, Artif Life Robotics 20:270-275; dampers and actuators are additions.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import sympy as sp

from flexspine.hybrid.system import Arming, Guard
from flexspine.mechanics.lagrangian import AppliedForce, Lagrangian, time_derivative
from flexspine.models.actuation import Features, extension, hip_lever, stiffening
from flexspine.models.underfoot import TOES
from flexspine.parameters import ParameterSet, quantity

SIDES = ("fore", "hind")

# The touchdown angles, as they are named among parameters.
ANGLES = tuple(f"touchdown.{side}" for side in SIDES)

# Both legs in flight, fore stance, hind stance, both in stance.
PHASES = ("DF", "FS", "HS", "DS")
STANCE_PHASES = {"fore": ("FS", "DS"), "hind": ("HS", "DS")}

Symbols = dict[str, sp.Symbol]


def phase_of(standing: Collection[str]) -> str:
    """Return the phase in which these legs stand."""
    return next(
        phase
        for phase in PHASES
        if all((phase in STANCE_PHASES[side]) == (side in standing) for side in SIDES)
    )


class Leg(ParameterSet):
    """One pair of legs that act together."""

    stiffness: float = quantity("N/m", "leg stiffness, per pair of legs", at_least=1, upper=1e9)
    damping: float = quantity(
        "N s/m", "leg damping, per pair of legs", at_least=0, upper=1e6, default=0.0
    )
    rest_length: float = quantity("m", "unloaded leg length", above=0, upper=100)
    stiffening: float = stiffening()
    extension: float = extension()
    hip_lever: float = hip_lever()


class Legs(ParameterSet):
    """Actuators of both pairs of legs, added to what each pair has of its own."""

    stiffening: float = stiffening()
    extension: float = extension()
    hip_lever: float = hip_lever()


# The same of both legs.
STIFFENING, EXTENSION, LEVER = sp.symbols("zeta xi d", real=True)
LEGS_PARAMETERS = {
    "legs.stiffening": STIFFENING,
    "legs.extension": EXTENSION,
    "legs.hip_lever": LEVER,
}


@dataclass(frozen=True)
class LegSymbols:
    """The letters of one leg: parameters, touchdown angle, and what it remembers.

    ``toe`` and ``toe_height`` are where it stands or stood last (m), ``stanced`` whether it stood
    since the apex, ``left`` its angle from the vertical at its latest lift-off (rad), ``pushes``
    whether its thrust has set in. The works of thrust and hip flow, in J.
    """

    side: str
    k: sp.Symbol
    c: sp.Symbol
    length: sp.Symbol
    gamma: sp.Symbol
    toe: sp.Symbol
    toe_height: sp.Symbol
    stanced: sp.Symbol
    left: sp.Symbol
    stiffening: sp.Symbol
    extension: sp.Symbol
    lever: sp.Symbol
    pushes: sp.Symbol
    thrust_work: sp.Symbol
    hip_work: sp.Symbol

    @classmethod
    def of(cls, side: str) -> LegSymbols:
        """Return the letters for ``fore`` or ``hind``, with the side's initial as subscript."""
        s = side[0]
        return cls(
            side,
            *(
                sp.Symbol(f"{letter}_{s}", real=True)
                for letter in (
                    "k",
                    "c",
                    "l",
                    "gamma",
                    "s",
                    "z",
                    "n",
                    "beta",
                    "zeta",
                    "xi",
                    "d",
                    "p",
                    "W_l",
                    "W_h",
                )
            ),
        )

    @property
    def all_stiffening(self) -> sp.Expr:
        """What it has of its own, and what all legs have."""
        return STIFFENING + self.stiffening

    @property
    def all_extension(self) -> sp.Expr:
        """What it has of its own, and what all legs have."""
        return EXTENSION + self.extension

    @property
    def all_lever(self) -> sp.Expr:
        """What it has of its own, and what all legs have."""
        return LEVER + self.lever

    @property
    def parameters(self) -> Symbols:
        """Dotted parameter name to letter."""
        return {
            f"{self.side}.leg.stiffness": self.k,
            f"{self.side}.leg.damping": self.c,
            f"{self.side}.leg.rest_length": self.length,
            f"{self.side}.leg.stiffening": self.stiffening,
            f"{self.side}.leg.extension": self.extension,
            f"{self.side}.leg.hip_lever": self.lever,
        }


class StanceLeg:
    """The expressions of a leg whose toe is pinned.

    With the vector from toe to hip ``(u, Y)`` and its length ``l``, the leg force is
    ``F = k (l0 - l) - c l'``; what is computed is the strain-like ``sigma = F / (k l)``, which
    needs one root only, vanishes with the force and gives the force vector ``k sigma (u, Y)``. A
    hip torque ``d F`` adds ``k sigma d / l (Y, -u)`` and turns the body the other way. ``pitch`` is
    that of what carries the hip: angle and rate. On flat ground ``Y`` is the height of the hip.
    """

    def __init__(
        self,
        leg: LegSymbols,
        hip: tuple[sp.Symbol, sp.Symbol],
        hip_velocity: tuple[sp.Expr, sp.Expr],
        pitch: tuple[sp.Symbol, sp.Symbol],
        features: Features,
    ) -> None:
        s = leg.side[0]
        u, inverse, stretching, sigma, stiffness, length = (
            sp.Symbol(f"{letter}_{s}", real=True) for letter in ("u", "r", "w", "sigma", "K", "L")
        )
        self.leg, self.hip, self._features = leg, hip, features
        self.u, self.inverse, self.sigma, self.stretching = u, inverse, sigma, stretching
        self.definitions: dict[sp.Symbol, sp.Expr] = {
            u: hip[0] - leg.toe,
        }
        self.rise = hip[1]
        if features.uneven:
            self.rise = sp.Symbol(f"v_{s}", real=True)
            self.definitions[self.rise] = hip[1] - leg.toe_height
        rise = self.rise
        self.definitions[inverse] = (u**2 + rise**2) ** sp.Rational(-1, 2)
        self._stiffness, self._length = leg.k, leg.length
        if features.thrust:
            self._stiffness, self._length = stiffness, length
            self.definitions[stiffness] = leg.k * (1 + leg.all_stiffening * leg.pushes)
            self.definitions[length] = leg.length + leg.all_extension * leg.pushes
        strain = self._length * inverse - 1
        if features.damped_legs or features.thrust:
            self.definitions[stretching] = (u * hip_velocity[0] + rise * hip_velocity[1]) * inverse
        if features.damped_legs:
            strain -= leg.c / self._stiffness * stretching * inverse
        self.definitions[sigma] = strain
        pushes = sp.symbols(f"F_{s}x F_{s}y", real=True)
        along: tuple[sp.Expr, sp.Expr] = (u, rise)
        if features.hips:
            turn = leg.all_lever * inverse
            along = (u + turn * rise, rise - turn * u)
        for push, way in zip(pushes, along, strict=True):
            self.definitions[push] = self._stiffness * sigma * way
        # The force of the leg on its hip; the ground reaction force has the same components.
        self.force = AppliedForce(pushes, hip)
        self.hip_power: sp.Expr = sp.S.Zero
        self.applied: tuple[AppliedForce, ...] = (self.force,)
        if features.hips:
            torque = leg.all_lever * self._stiffness * sigma / inverse
            swing = (u * hip_velocity[1] - rise * hip_velocity[0]) * inverse**2
            self.hip_power = torque * (pitch[1] - swing)
            self.applied += (AppliedForce((torque,), (pitch[0],)),)

    @property
    def energy(self) -> sp.Expr:
        """Elastic energy, in J."""
        return self._energy(self._stiffness, self._length)

    def _energy(self, stiffness: sp.Expr, length: sp.Expr) -> sp.Expr:
        return stiffness * (length - 1 / self.inverse) ** 2 / 2

    @property
    def power_lost(self) -> sp.Expr:
        """Power that goes into the damper, in W."""
        return self.leg.c * self.stretching**2 if self._features.damped_legs else sp.S.Zero

    def liftoff(self, target: str, dissipated: sp.Symbol) -> Guard:
        """The leg leaves the ground when its force falls to zero; it never pulls.

        A damper reaches zero force while the spring is still compressed, and a leg that gets
        shorter may be released stretched. The leg is massless, so that energy is lost at the
        instant of release.
        """
        leg = self.leg
        resets = {leg.left: sp.atan(-self.u / self.rise)}
        if self._features.uneven:
            resets |= TOES[leg.side].lost(self.hip[0] + leg.length * sp.sin(leg.gamma))
        if self._features.damped_legs or self._features.thrust:
            resets[dissipated] = dissipated + self.energy
        if self._features.thrust:
            resets[leg.pushes] = sp.S.Zero
        return Guard(f"{leg.side} lift-off", self.sigma, target, resets, arming=Arming.LEVEL)

    def thrust(self) -> Guard:
        """At its greatest compression the leg begins to push, once a stance."""
        leg = self.leg
        pushing = leg.k * (1 + leg.all_stiffening), leg.length + leg.all_extension
        work = self._energy(*pushing) - self._energy(leg.k, leg.length)
        return Guard(
            f"{leg.side} greatest compression",
            leg.pushes - (1 - leg.pushes) * self.stretching,
            resets={leg.pushes: sp.S.One, leg.thrust_work: leg.thrust_work + work},
        )

    def observables(self) -> dict[str, sp.Expr]:
        """Toe, length, angle and ground reaction force."""
        side, leg = self.leg.side, self.leg
        force = self._stiffness * self.sigma / self.inverse
        table = {
            f"{side}_toe_x": leg.toe,
            f"{side}_toe_y": leg.toe_height if self._features.uneven else sp.S.Zero,
            f"{side}_leg_length": 1 / self.inverse,
            f"{side}_leg_angle": sp.atan2(-self.u, self.rise),
            f"{side}_grf_x": self.force.components[0],
            f"{side}_grf_y": self.force.components[1],
            f"{side}_grf": force,
        }
        if self._features.hips:
            table[f"{side}_grf"] = force * sp.sqrt(1 + (leg.all_lever * self.inverse) ** 2)
            table[f"{side}_hip_torque"] = leg.all_lever * force
        return table


class SwingLeg:
    """The expressions of a leg in the air."""

    def __init__(
        self, leg: LegSymbols, hip: tuple[sp.Symbol, sp.Symbol], features: Features
    ) -> None:
        self.leg, self._features = leg, features
        self.toe = (
            hip[0] + leg.length * sp.sin(leg.gamma),
            hip[1] - leg.length * sp.cos(leg.gamma),
        )

    def touchdown(self, target: str) -> Guard:
        """The toe falls to the ground; on flat ground the hip falls through ``l0 cos(gamma)``.

        Falling to it needs having been above it, which is all that arming asks for. A leg that
        lands while it lengthens would pull; it is released at the same instant, and still counts
        as having stood.
        """
        leg, (x, y) = self.leg, self.toe
        resets = {leg.toe: x, leg.stanced: sp.S.One}
        if self._features.uneven:
            resets[leg.toe_height] = y
            y = y - TOES[leg.side].height(x)
        return Guard(f"{leg.side} touchdown", y, target, resets)

    def looking(self) -> tuple[Guard, ...]:
        """The toe comes to the end of a piece of ground."""
        return TOES[self.leg.side].edges(self.toe[0]) if self._features.uneven else ()

    def observables(self) -> dict[str, sp.Expr]:
        """As in stance; the toe is where the leg held out for touchdown has it."""
        side, leg = self.leg.side, self.leg
        return {
            f"{side}_toe_x": self.toe[0],
            f"{side}_toe_y": self.toe[1],
            f"{side}_leg_length": leg.length,
            f"{side}_leg_angle": leg.gamma,
            f"{side}_grf_x": sp.S.Zero,
            f"{side}_grf_y": sp.S.Zero,
            f"{side}_grf": sp.S.Zero,
        }


def hip_velocity(body: Lagrangian, hip: tuple[sp.Symbol, sp.Symbol]) -> tuple[sp.Expr, sp.Expr]:
    """The velocity of a hip, by the chain rule."""
    return time_derivative(body, hip[0]), time_derivative(body, hip[1])
