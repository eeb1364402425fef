"""Joints from places of feet, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot

import numpy as np
import sympy as sp

from flexspine.control.references import ReferenceFunction, leg_numbers, references
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.leg_geometry import Leg, legs_of
from flexspine.models.robot import Robot


class LegFunction:
    """The joints of a robot with a level trunk, from where its feet are.

    Places and velocities of feet have shape (legs, 2), in the order of the legs, x forward, y up,
    from the middle between the hips, whose own places are ``hips``.
    """

    def __init__(self, robot: Robot, legs: Mapping[str, Leg]) -> None:
        self._robot, self._legs = robot, legs
        self.hips = np.array([[leg.hip, 0.0] for leg in legs.values()])
        still = sp.zeros(2, 1)
        feet, inputs = {}, []
        for leg in legs:
            place, velocity = (
                sp.Matrix([sp.Symbol(f"foot_{axis}{kind}_{leg}", real=True) for axis in "xy"])
                for kind in ("", "_rate")
            )
            feet[leg] = (place, velocity, still)
            inputs += [*place, *velocity]
        self._inputs, self._measures = inputs, leg_numbers(legs)
        found = references(robot, legs, (still, still, still), feet)
        self._function = ReferenceFunction(found, robot.motors, [*self._measures, *inputs])

    def joints(self, place: Array, velocity: Array) -> tuple[Array, Array]:
        """Angles of the motors' joints and their rates, shape (m,)."""
        table, _ = self._function(self._known(place, velocity))
        return table[0], table[1]

    def links(self, place: Array, velocity: Array) -> dict[str, tuple[float, float]]:
        """Angle from +x and rate of every link of the legs."""
        _, links = self._function(self._known(place, velocity))
        return {link: (float(angle), float(rate)) for link, (angle, rate, _) in links.items()}

    def posture(self, place: Array) -> Array:
        """``q`` of the robot that stands on these places, the lowest of them on the ground."""
        linkage = self._robot.linkage
        _, links = self._function(self._known(place, np.zeros_like(place)))
        q = np.zeros(linkage.size)
        for link, (angle, _, _) in links.items():
            q[linkage.place[link]] = angle
        q = np.asarray(linkage.to_relative @ q, dtype=float)
        first = next(iter(self._legs.values()))
        q[-2:] += place[0] - [0.0, place[:, 1].min()] - linkage.foot(q, first.foot)
        return q

    def _known(self, place: Array, velocity: Array) -> dict[sp.Symbol, float]:
        numbers = np.concatenate([place, velocity], axis=1).ravel().tolist()
        return self._measures | dict(zip(self._inputs, numbers, strict=True))


def standing(robot: Robot, height: float, ahead: Mapping[str, float] | None = None) -> Array:
    """Return the coordinates ``q`` of a robot that stands with its hips at ``height`` (m).

    Shape (N,), in the order of its linkage, SI. Feet are on level ground below their hips, or
    ``ahead`` of them by so many m, by leg. Raises `ParameterError` for a robot without legs to
    stand on, and for feet that are out of reach.
    """
    legs, ahead = legs_of(robot), ahead or {}
    for name, leg in legs.items():
        off, folded = ahead.get(name, 0.0), abs(leg.thigh_length - leg.shank_length)
        if not folded < hypot(height, off) < leg.reach:
            raise ParameterError(
                f"leg '{name}' cannot put its foot {height:g} m below its hip and {off:g} m ahead",
                f"keep it between {folded:g} m and {leg.reach:g} m from the hip",
            )
    place = [[leg.hip + ahead.get(name, 0.0), -height] for name, leg in legs.items()]
    return LegFunction(robot, legs).posture(np.array(place))
