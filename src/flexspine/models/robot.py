"""Planar robots: a linkage made from a description, with its numbers by dotted name.

A description (TOML) has tables ``links``, ``joints`` and ``feet``; `flexspine.robots` has those
that come with flexspine. The first link is free, every other one has a parent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.mechanics.linkage import Foot, Joint, Link, Linkage
from flexspine.models.model import Source
from flexspine.parameters import ParameterSet, build, quantity, values

# What is across the plane.
SPACE = "space"


class LinkNumbers(ParameterSet):
    """What a link measures."""

    length: float = quantity("m", "from its start to its end", above=0, upper=1e3)
    mass: float = quantity("kg", "of the link", above=0, upper=1e6)
    com: float = quantity("m", "its centre of mass, from its start", at_least=-1e3, upper=1e3)
    inertia: float = quantity("kg m^2", "about its centre of mass", at_least=0, upper=1e9)
    at: float = quantity(
        "m", "where it starts, from the start of its parent", at_least=-1e3, upper=1e3, default=0.0
    )


class JointNumbers(ParameterSet):
    """The spring-damper of a joint."""

    stiffness: float = quantity(
        "N m/rad", "on the relative angle", at_least=0, upper=1e9, default=0.0
    )
    damping: float = quantity("N m s/rad", "on its rate", at_least=0, upper=1e9, default=0.0)
    rest: float = quantity(
        "rad", "where the spring is at rest", at_least=-10, upper=10, default=0.0
    )


class FootNumbers(ParameterSet):
    """A foot."""

    at: float = quantity("m", "from the start of its link", at_least=-1e3, upper=1e3)
    mass: float = quantity("kg", "of the foot, a point", at_least=0, upper=1e6, default=0.0)


class GroundNumbers(ParameterSet):
    """What the robot stands on and falls to."""

    gravity: float = quantity("m/s^2", "downwards", at_least=0, upper=1e3, default=9.81)
    friction: float = quantity(
        "1", "of feet on the ground (Coulomb)", at_least=0, upper=10, default=0.8
    )


class SpaceNumbers(ParameterSet):
    """What a robot measures across its plane, and how the ground gives that it meets in space."""

    hip_width: float = quantity("m", "from the left to the right hips", above=0, upper=1e3)
    trunk_width: float = quantity("m", "of the trunk", above=0, upper=1e3)
    trunk_height: float = quantity("m", "of the trunk", above=0, upper=1e3)
    leg_width: float = quantity("m", "of thighs and shanks, which are square", above=0, upper=1e3)
    foot_radius: float = quantity("m", "of the feet, which are spheres", above=0, upper=1e3)
    yaw_stiffness: float = quantity(
        "N m/rad", "of the trunk sideways; 0: it does not bend", at_least=0, upper=1e9, default=0.0
    )
    yaw_damping: float = quantity(
        "N m s/rad", "of the trunk sideways", at_least=0, upper=1e9, default=0.0
    )
    ground_stiffness: float = quantity(
        "N/m", "of the ground under a foot", above=0, upper=1e9, default=5e4
    )
    ground_damping: float = quantity(
        "N s/m", "of the ground under a foot", at_least=0, upper=1e9, default=1e3
    )


@dataclass(frozen=True)
class LegParts:
    """What makes a leg: its foot, its thigh and the part of the trunk that carries it.

    The shank is the link of the foot. ``knee_back``: the knee is behind the line from hip to foot.
    ``side`` is ``left`` or ``right``, or nothing for a robot that stays in the plane.
    """

    foot: str
    thigh: str
    trunk: str
    knee_back: bool = True
    side: str = ""


@dataclass(frozen=True)
class Robot:
    """A planar robot: what hangs on what, and its numbers.

    ``parents`` by link, in the order of the coordinates; the first has none. ``joints`` by name:
    link and whether it has a motor. ``feet`` by name: link. ``numbers`` by dotted name, such as
    ``spine.stiffness``, in SI units and radians; those under ``space.`` are across the plane.
    ``legs`` by name, for gaits. ``source`` tells where numbers come from. `load_robot` makes one.
    """

    name: str
    parents: Mapping[str, str | None]
    joints: Mapping[str, tuple[str, bool]]
    feet: Mapping[str, str]
    numbers: Mapping[str, float]
    source: Source
    legs: Mapping[str, LegParts] = field(default_factory=dict)

    def __repr__(self) -> str:
        told = f"{len(self.parents)} links, {len(self.motors)} motors, {len(self.feet)} feet"
        return f"<Robot {self.name}: {told}>"

    @cached_property
    def linkage(self) -> Linkage:
        """The mechanism: kinematics and the terms of its equations of motion."""
        return Linkage(
            tuple(
                Link(name=name, parent=parent, **self._of(name, LinkNumbers))
                for name, parent in self.parents.items()
            ),
            tuple(
                Joint(name=name, link=link, actuated=motor, **self._of(name, JointNumbers))
                for name, (link, motor) in self.joints.items()
            ),
            tuple(
                Foot(name=name, link=link, **self._of(name, FootNumbers))
                for name, link in self.feet.items()
            ),
            self.numbers["gravity"],
        )

    @cached_property
    def motors(self) -> tuple[str, ...]:
        """The joints with a motor, in order."""
        return tuple(joint for joint, (_, motor) in self.joints.items() if motor)

    @property
    def friction(self) -> float:
        """The coefficient of Coulomb friction of feet on the ground."""
        return self.numbers["friction"]

    def with_values(self, changes: Mapping[str, Any], origin: str = "set by user") -> Robot:
        """Return the same robot with some numbers changed, by dotted name.

        ``origin`` tells where they come from. Raises `UnknownNameError` and `ParameterError`.
        """
        for name in changes:
            if name not in self.numbers:
                raise UnknownNameError("parameter", name, self.numbers)
        numbers = checked(self.parents, self.joints, self.feet, {**self.numbers, **changes})
        provenance = {**self.source.provenance, **dict.fromkeys(changes, origin)}
        return replace(self, numbers=numbers, source=replace(self.source, provenance=provenance))

    def _of(self, name: str, kind: type[ParameterSet]) -> dict[str, float]:
        return {each: self.numbers[f"{name}.{each}"] for each in kind.model_fields}


def checked(
    parents: Mapping[str, Any],
    joints: Mapping[str, Any],
    feet: Mapping[str, Any],
    numbers: Mapping[str, Any],
) -> dict[str, float]:
    """All numbers by dotted name, defaults filled in. Raises `ParameterError`."""
    kinds: dict[str, type[ParameterSet]] = dict.fromkeys(parents, LinkNumbers)
    kinds |= dict.fromkeys(joints, JointNumbers) | dict.fromkeys(feet, FootNumbers)
    if any(name.startswith(f"{SPACE}.") for name in numbers):
        kinds[SPACE] = SpaceNumbers
    ground = {name: value for name, value in numbers.items() if "." not in name}
    found = values(build(GroundNumbers, ground))
    for part, kind in kinds.items():
        own = {
            name.removeprefix(f"{part}."): value
            for name, value in numbers.items()
            if name.startswith(f"{part}.")
        }
        try:
            found |= values(build(kind, own), f"{part}.")
        except InputError as failure:
            raise ParameterError(f"{part}: {failure.message}", failure.remedy) from None
    return found
