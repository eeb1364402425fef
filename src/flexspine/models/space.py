"""A robot in space, made of its description in the plane: widths, left and right, one joint more.

Every link becomes a box that pitches as the planar link does; the joint more of a leg is at its
hip, about the trunk. x is forward, y to the left, z up. The frame of a part begins at the joint
that carries it, with x along the link; legs are walked from the hip down. Hinges of the plane are
counter-clockwise seen from the right, about -y; those about x swing a foot to the left and those
about z turn to the left.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

import numpy as np

from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.leg_geometry import Leg, legs_of
from flexspine.models.robot import SPACE, Robot, SpaceNumbers
from flexspine.parameters import build

PITCH, OUT, YAW = (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)

SIDES = {"left": 1.0, "right": -1.0}

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Hinge:
    """A joint about an axis in the frame of the part that it carries, with a spring-damper."""

    name: str
    axis: Triple
    stiffness: float = 0.0
    damping: float = 0.0
    rest: float = 0.0
    motor: bool = False


@dataclass(frozen=True)
class Part:
    """A rigid body: a link with the feet that are on it.

    ``place`` is where it begins in the frame of its ``parent``; ``com`` is along x and ``inertia``
    about x, y and z through it. It is as long as its link. ``hinges`` turn one after the other, the
    first of them next to the parent.
    """

    name: str
    parent: str | None
    place: Triple
    mass: float
    com: float
    inertia: Triple
    length: float
    width: float
    height: float
    hinges: tuple[Hinge, ...]


@dataclass(frozen=True)
class Ball:
    """A spherical foot; its lowest point, when the shank is upright, is at ``end`` along x."""

    foot: str
    part: str
    end: float
    radius: float


@dataclass(frozen=True)
class LegJoints:
    """The names of a leg's hinges in space."""

    out: str
    hip: str
    knee: str

    @classmethod
    def of(cls, leg: str) -> LegJoints:
        """Those of a leg."""
        return cls(f"{leg}_abduction", f"{leg}_hip", f"{leg}_knee")


@dataclass(frozen=True)
class SpaceRobot:
    """A robot in space; ``plane`` keeps it to the plane, without hinges that would leave it.

    Raises `ParameterError` where the description does not tell enough of what is across the plane.
    """

    robot: Robot
    plane: bool = False

    def __post_init__(self) -> None:
        if not any(name.startswith(f"{SPACE}.") for name in self.robot.numbers):
            raise ParameterError(
                f"robot '{self.robot.name}' is described in the plane only",
                "tell its widths in a [space] table",
            )
        for name, parts in self.robot.legs.items():
            if parts.side not in SIDES:
                raise ParameterError(
                    f"robot '{self.robot.name}': legs.{name} is on no side",
                    'write side = "left" or side = "right"',
                )
        _check_springs(self.robot, self.legs)
        _check_sides(self.robot, self.legs)

    @cached_property
    def legs(self) -> dict[str, Leg]:
        """Its legs."""
        return legs_of(self.robot)

    @cached_property
    def numbers(self) -> SpaceNumbers:
        """What it measures across the plane."""
        own = {
            name.removeprefix(f"{SPACE}."): value
            for name, value in self.robot.numbers.items()
            if name.startswith(f"{SPACE}.")
        }
        return build(SpaceNumbers, own)

    @cached_property
    def trunk(self) -> tuple[str, ...]:
        """The links that carry legs, each after the one that it hangs on."""
        carrying = {leg.trunk for leg in self.legs.values()}
        return tuple(link for link in self.robot.parents if link in carrying)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Its bodies, each after its parent; the first one is free."""
        return (*self._trunk(), *(part for leg in self.legs.values() for part in self._leg(leg)))

    @cached_property
    def balls(self) -> tuple[Ball, ...]:
        """Its feet."""
        radius = self.numbers.foot_radius
        return tuple(
            Ball(leg.foot, leg.shank, leg.shank_length, radius) for leg in self.legs.values()
        )

    @cached_property
    def hinges(self) -> tuple[Hinge, ...]:
        """All of them, in the order of the parts."""
        return tuple(hinge for part in self.parts for hinge in part.hinges)

    @cached_property
    def motors(self) -> tuple[str, ...]:
        """The hinges with a motor, in order."""
        return tuple(hinge.name for hinge in self.hinges if hinge.motor)

    def angles(self, q: Array) -> dict[str, Array]:
        """The angles of the hinges of a robot in the plane at ``q``, shape (..., N), in rad."""
        return self._relative(self._directions(q, pi))

    def rates(self, rates: Array) -> dict[str, Array]:
        """The rates of the hinges from those of ``q``, in rad/s."""
        return self._relative(self._directions(rates, 0.0))

    def bent(self, links: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        """Angles and rates of hips and knees, from those of the legs' links under a level trunk."""
        found = {}
        for leg in self.legs.values():
            names, turned = LegJoints.of(leg.name), pi if leg.upwards else 0.0
            thigh, shank = links[leg.thigh], links[leg.shank]
            found[names.hip] = thigh[0] - turned, thigh[1]
            found[names.knee] = shank[0] - thigh[0], shank[1] - thigh[1]
        return found

    @cached_property
    def by_motor(self) -> Array:
        """The torques of motors in space by those of planar ones, shape (motors, m).

        Both do the same work in any motion in the plane.
        """
        linkage = self.robot.linkage
        rates = self.rates(np.eye(linkage.size))
        turning = np.array([rates[name] for name in self.motors])
        found: Array = np.linalg.lstsq(turning.T, linkage.actuation, rcond=None)[0]
        return found

    def root(self, q: Array) -> tuple[Array, Array]:
        """Where the first part begins, x and z (..., 2), and its pitch, of a robot at ``q``."""
        first = self.trunk[0]
        linkage = self.robot.linkage
        return linkage.point(q, first, 0.0), self._directions(q, pi)[first]

    def _directions(self, q: Array, turned: float) -> dict[str, Array]:
        """The directions of the links, those of legs from the hip down."""
        linkage = self.robot.linkage
        angles = linkage.angles(q)
        found = {link: angles[..., linkage.place[link]] for link in self.robot.parents}
        for leg in self.legs.values():
            if leg.upwards:
                for link in (leg.thigh, leg.shank):
                    found[link] = found[link] - turned
        return found

    def _relative(self, directions: Mapping[str, Array]) -> dict[str, Array]:
        found = {}
        for part in self.parts:
            for hinge in part.hinges:
                angle = 0 * directions[part.name]
                if hinge.axis == PITCH and part.parent is not None:
                    angle = directions[part.name] - directions[part.parent]
                found[hinge.name] = angle
        return found

    def _trunk(self) -> Iterator[Part]:
        robot, across = self.robot, self.numbers
        joints = {link: joint for joint, (link, _) in robot.joints.items()}
        for link in self.trunk:
            parent = robot.parents[link] if link != self.trunk[0] else None
            place, hinges = (0.0, 0.0, 0.0), []
            if parent is not None:
                place = (robot.numbers[f"{link}.at"], 0.0, 0.0)
                joint = joints.get(link, f"{link}_joint")
                hinges = [self._hinge(joint, joint)] if link in joints else [Hinge(joint, PITCH)]
                if across.yaw_stiffness and not self.plane:
                    hinges.append(
                        Hinge(f"{joint}_yaw", YAW, across.yaw_stiffness, across.yaw_damping)
                    )
            mass, com, inertia = self._mass(link, 0.0, 1.0)
            length = robot.numbers[f"{link}.length"]
            box = across.trunk_width, across.trunk_height
            yield Part(
                link, parent, place, mass, com, _of_box(mass, inertia, box), length, *box,
                tuple(hinges),
            )  # fmt: skip

    def _hinge(self, name: str, joint: str, motor: bool | None = None) -> Hinge:
        """A hinge with the spring-damper of a planar joint, and its motor if none is told."""
        stiffness, damping, rest = (
            self.robot.numbers[f"{joint}.{each}"] for each in ("stiffness", "damping", "rest")
        )
        own = self.robot.joints[joint][1]
        return Hinge(name, PITCH, stiffness, damping, rest, own if motor is None else motor)

    def _leg(self, leg: Leg) -> Iterator[Part]:
        robot, across = self.robot, self.numbers
        linkage = robot.linkage
        names, way = LegJoints.of(leg.name), -1.0 if leg.upwards else 1.0
        hip = linkage.arms(leg.thigh, leg.thigh_length if leg.upwards else 0.0)
        along = float((hip - linkage.arms(leg.trunk, 0.0))[linkage.place[leg.trunk]])
        side = SIDES[robot.legs[leg.name].side] * across.hip_width / 2
        at_hip = [] if self.plane else [Hinge(names.out, OUT, motor=True)]
        at_hip.append(self._leg_hinge(names.hip, leg.thigh, leg.trunk, pi if leg.upwards else 0.0))
        at_knee = [self._leg_hinge(names.knee, leg.shank, leg.thigh, 0.0)]
        # How far from their starts in the plane the upper ends of thigh and shank are.
        tops = (leg.thigh_length, robot.numbers[f"{leg.thigh}.at"]) if leg.upwards else (0.0, 0.0)
        box = across.leg_width, across.leg_width
        for link, parent, place, hinges, top, length in (
            (leg.thigh, leg.trunk, (along, side, 0.0), at_hip, tops[0], leg.thigh_length),
            (leg.shank, leg.thigh, (leg.thigh_length, 0.0, 0.0), at_knee, tops[1],
             leg.shank_length),
        ):  # fmt: skip
            mass, com, inertia = self._mass(link, top, way)
            yield Part(
                link, parent, place, mass, com, _of_box(mass, inertia, box), length, *box,
                tuple(hinges),
            )  # fmt: skip

    def _leg_hinge(self, name: str, lower: str, upper: str, turned: float) -> Hinge:
        """The hip or knee of a leg, with the spring-damper of the planar joint that it is.

        A thigh that is walked upwards in the plane is ``turned`` about, seen from the trunk.
        """
        for joint, (link, _) in self.robot.joints.items():
            ends = link, self.robot.parents[link]
            if ends == (lower, upper):
                return self._hinge(name, joint, motor=True)
            if ends == (upper, lower):
                found = self._hinge(name, joint, motor=True)
                return replace(found, rest=-found.rest - turned)
        return Hinge(name, PITCH, motor=True)

    def _mass(self, link: str, top: float, way: float) -> tuple[float, float, float]:
        """Mass, centre from its top and pitch inertia of a link with its feet, which are points."""
        mass, com, inertia = self.robot.linkage.with_feet(link)
        return mass, way * (com - top), inertia


def _of_box(mass: float, pitch: float, box: tuple[float, float]) -> Triple:
    """Inertias about x, y and z of a box of a width and a height that has this pitch inertia."""
    across, upright = mass * box[0] ** 2 / 12, min(mass * box[1] ** 2 / 12, pitch)
    return across + upright, pitch, pitch - upright + across


def _check_sides(robot: Robot, legs: Mapping[str, Leg]) -> None:
    """Refuse two legs in one place."""
    taken: dict[tuple[float, str], str] = {}
    for name, leg in legs.items():
        place = (leg.hip, robot.legs[name].side)
        if place in taken:
            raise ParameterError(
                f"robot '{robot.name}': legs.{name} and legs.{taken[place]} are at one hip on the "
                f"{place[1]}",
                "put one of them on the other side",
            )
        taken[place] = name


def _check_springs(robot: Robot, legs: Mapping[str, Leg]) -> None:
    """Refuse what cannot be in space: springs between the legs of two sides."""
    thighs = {leg.thigh for leg in legs.values()}
    for joint, (link, _) in robot.joints.items():
        if {link, robot.parents[link]} <= thighs:
            for kind in ("stiffness", "damping"):
                if robot.numbers[f"{joint}.{kind}"]:
                    raise ParameterError(
                        f"robot '{robot.name}': {joint}.{kind} acts between two thighs, which are "
                        "apart in space",
                        "set it to 0, or let both thighs hang on the trunk",
                    )
