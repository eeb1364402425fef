"""From where feet and body are to be to what the joints are to do, in symbols.

The trunk is to be straight and level and to move forward at a changing speed; each foot is to
stand, or to swing along a cycloid and to come down at a small speed at its end. The angles of a
leg follow from hip and foot by trigonometry, their rates and accelerations from
``d' = l_1 a' n_a + l_2 b' n_b`` and its derivative, where ``d`` leads from hip to foot and ``n``
are normal to thigh and shank.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np
import sympy as sp

from flexspine.hybrid.compile import Array, compile_expressions
from flexspine.hybrid.lowering import Lowering
from flexspine.models.articulated import CLOCK
from flexspine.models.leg_geometry import Leg
from flexspine.models.robot import Robot

# Of (1 - cos 2 pi s) / 2 (1 - s^2); its last factor takes away the upward acceleration at the end,
# with which a foot that lands early would leave the ground again.
HIGHEST = 0.7782717312270072

# Angle, rate and acceleration.
Motion = tuple[sp.Expr, sp.Expr, sp.Expr]

# Place, velocity and acceleration.
Course = tuple[sp.Matrix, sp.Matrix, sp.Matrix]

Define = Callable[[str, sp.Expr], sp.Symbol]


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


@dataclass(frozen=True)
class BodyCourse:
    """How the middle of the trunk is to move: from ``x`` at ``start`` on with ``speed``.

    SI units; the height of the hips, and what is gained in speed a second.
    """

    x: sp.Symbol
    speed: sp.Symbol
    gain: sp.Symbol
    start: sp.Symbol
    height: sp.Symbol

    def motion(self) -> Course:
        """Place, velocity and acceleration."""
        x, speed = _evenly(self.x, self.speed, self.gain, CLOCK - self.start)
        return sp.Matrix([x, self.height]), sp.Matrix([speed, 0]), sp.Matrix([self.gain, 0])

    def at(self, held: Mapping[sp.Symbol, float], time: float) -> tuple[float, float]:
        """Place along x and speed at a time, in numbers."""
        since = time - held[self.start]
        return _evenly(held[self.x], held[self.speed], held[self.gain], since)


def _evenly(x: Any, speed: Any, gain: Any, since: Any) -> tuple[Any, Any]:
    """Place and speed under an even gain in speed, in symbols or in numbers."""
    return x + speed * since + gain * since**2 / 2, speed + gain * since


@dataclass(frozen=True)
class FootPath:
    """How one foot is to move since ``start``, in SI units.

    From ``x`` on the ground it goes ``stride`` forward within ``span``, ``lift`` high on its way,
    so that it comes down at ``landing`` a second; and all the while it sinks by ``sink`` a second.
    """

    x: sp.Symbol
    stride: sp.Symbol
    lift: sp.Symbol
    landing: sp.Symbol
    sink: sp.Symbol
    start: sp.Symbol
    span: sp.Symbol

    @classmethod
    @lru_cache(maxsize=256)
    def of(cls, leg: str) -> FootPath:
        """The path of a leg's foot."""
        return cls(*(_symbol(f"path_{each.name}_{leg}") for each in fields(cls)))

    def motion(self) -> Course:
        """Place, velocity and acceleration."""
        own = {getattr(ANY_PATH, each.name): getattr(self, each.name) for each in fields(self)}
        place, velocity, acceleration = (part.xreplace(own) for part in _course())
        return place, velocity, acceleration


ANY_PATH = FootPath.of("any leg")


@lru_cache
def _course() -> Course:
    """Place, velocity and acceleration along `ANY_PATH`; to derive them takes a while."""
    path = ANY_PATH
    since = CLOCK - path.start
    share, turn = since / path.span, 2 * sp.pi / path.span
    x = path.x + path.stride * (share - sp.sin(turn * since) / (2 * sp.pi))
    y = path.lift * (1 - sp.cos(turn * since)) / 2 * (1 - share**2) / HIGHEST
    y -= path.sink * since
    y += path.landing * path.span * share**2 * (1 - share)
    place = sp.Matrix([x, y])
    return place, place.diff(CLOCK), place.diff(CLOCK, 2)


BODY = BodyCourse(*(_symbol(f"body_{each.name}") for each in fields(BodyCourse)))


def leg_number(kind: str, leg: str) -> sp.Symbol:
    """What a leg measures: its ``thigh``, its ``shank``, or where its ``hip`` is."""
    return _symbol(f"{kind}_{leg}")


def leg_numbers(legs: Mapping[str, Leg]) -> dict[sp.Symbol, float]:
    """What all legs measure."""
    return {
        leg_number(kind, name): value
        for name, leg in legs.items()
        for kind, value in (
            ("thigh", leg.thigh_length), ("shank", leg.shank_length), ("hip", leg.hip)
        )
    }  # fmt: skip


@dataclass(frozen=True)
class References:
    """What joints are to do: angle, rate and acceleration by joint, in terms of definitions.

    ``links`` are the same of the legs' links, from +x; those of the trunk are level. ``stretch``
    is how far each leg is stretched, in m.
    """

    definitions: Mapping[sp.Symbol, sp.Expr]
    joints: Mapping[str, Motion]
    links: Mapping[str, Motion]
    stretch: Mapping[str, sp.Expr]


def references(
    robot: Robot, legs: Mapping[str, Leg], body: Course, feet: Mapping[str, Course]
) -> References:
    """What the motors' joints are to do, from what the middle of the trunk and the feet are to."""
    definitions: dict[sp.Symbol, sp.Expr] = {}

    def define(name: str, expression: sp.Expr) -> sp.Symbol:
        symbol = _symbol(name)
        definitions[symbol] = expression
        return symbol

    links: dict[str, Motion] = {}
    stretch = {}
    for name, leg in legs.items():
        place, *rest = body
        hips = [place + sp.Matrix([leg_number("hip", name), 0]), *rest]
        reach = [
            sp.Matrix(
                [define(f"reach_{axis}{order}_{name}", part[i]) for i, axis in enumerate("xy")]
            )
            for order, part in enumerate(f - h for f, h in zip(feet[name], hips, strict=True))
        ]
        lengths = leg_number("thigh", name), leg_number("shank", name)
        stretch[name] = define(f"stretch_{name}", sp.sqrt(reach[0].dot(reach[0])))
        angles = _angles(name, reach[0], stretch[name], lengths, leg.knee_back, define)
        motion = _turns(name, angles, reach, lengths, define)
        turned = sp.pi if leg.upwards else 0
        for link, (angle, rate, acceleration) in zip((leg.thigh, leg.shank), motion, strict=True):
            links[link] = (angle + turned, rate, acceleration)
    still = (sp.S.Zero, sp.S.Zero, sp.S.Zero)
    joints = {}
    for joint, (link, motor) in robot.joints.items():
        if motor:
            child, parent = links.get(link, still), links.get(robot.parents[link] or "", still)
            here = [c - p for c, p in zip(child, parent, strict=True)]
            joints[joint] = (here[0], here[1], here[2])
    return References(definitions, joints, links, stretch)


def _angles(
    name: str,
    reach: sp.Matrix,
    length: sp.Expr,
    lengths: tuple[sp.Symbol, sp.Symbol],
    back: bool,
    define: Define,
) -> tuple[sp.Symbol, sp.Symbol]:
    """Angles of thigh and shank, from hip to knee and from knee to foot, from +x."""
    thigh, shank = lengths
    way = sp.atan2(reach[1], reach[0])
    at_hip = sp.acos((thigh**2 + length**2 - shank**2) / (2 * thigh * length))
    at_foot = sp.acos((shank**2 + length**2 - thigh**2) / (2 * shank * length))
    side = -1 if back else 1
    return (
        define(f"thigh_to_be_{name}", way + side * at_hip),
        define(f"shank_to_be_{name}", way - side * at_foot),
    )


def _turns(
    name: str,
    angles: tuple[sp.Symbol, sp.Symbol],
    reach: list[sp.Matrix],
    lengths: tuple[sp.Symbol, sp.Symbol],
    define: Define,
) -> tuple[Motion, Motion]:
    """Angle, rate and acceleration of thigh and shank."""
    thigh, shank = (
        sp.Matrix([define(f"{f.__name__}_{angle.name}", f(angle)) for f in (sp.cos, sp.sin)])
        for angle in angles
    )
    bend = define(f"sin_knee_to_be_{name}", thigh[0] * shank[1] - thigh[1] * shank[0])
    arms = lengths[0] * bend, -lengths[1] * bend
    rates = [
        define(f"thigh_to_be_{name}_rate", reach[1].dot(shank) / arms[0]),
        define(f"shank_to_be_{name}_rate", reach[1].dot(thigh) / arms[1]),
    ]
    pull = reach[2] + lengths[0] * rates[0] ** 2 * thigh + lengths[1] * rates[1] ** 2 * shank
    gains = [
        define(f"thigh_to_be_{name}_gain", pull.dot(shank) / arms[0]),
        define(f"shank_to_be_{name}_gain", pull.dot(thigh) / arms[1]),
    ]
    return (angles[0], rates[0], gains[0]), (angles[1], rates[1], gains[1])


class ReferenceFunction:
    """References in numbers, compiled."""

    def __init__(self, of: References, motors: Sequence[str], inputs: Sequence[sp.Symbol]) -> None:
        self._inputs = tuple(inputs)
        variables = [hy.expression(f"z{i}") for i in range(len(self._inputs))]
        lower = Lowering(dict(zip(self._inputs, variables, strict=True)), (), of.definitions, 0)
        wanted = [of.joints[joint] for joint in motors] + list(of.links.values())
        self._function = compile_expressions(
            [lower(part) for motion in wanted for part in motion], variables
        )
        self._motors, self._links = len(motors), tuple(of.links)

    def __call__(self, known: Mapping[sp.Symbol, float]) -> tuple[Array, dict[str, Array]]:
        """Angle, rate and acceleration of the motors' joints, shape (3, m), and of links (3,)."""
        found = self._function(np.array([known[symbol] for symbol in self._inputs]))
        table = found.reshape(-1, 3)
        links = dict(zip(self._links, table[self._motors :], strict=True))
        return table[: self._motors].T, links
