"""Where a robot's legs are and what they measure, worked out of its linkage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexspine.errors import ParameterError
from flexspine.models.robot import LegParts, Robot

# m; as far as the ends of links may miss each other.
CLOSE = 1e-9


@dataclass(frozen=True)
class Leg:
    """A leg of two links.

    ``hip`` is its place along the straight trunk, from the middle between the foremost and the
    hindmost hip, in m. ``upwards`` tells that thigh and shank lead from the foot to the hip.
    """

    name: str
    foot: str
    shank: str
    thigh: str
    trunk: str
    thigh_length: float
    shank_length: float
    hip: float
    upwards: bool
    knee_back: bool

    @property
    def reach(self) -> float:
        """The length of the stretched leg, in m."""
        return self.thigh_length + self.shank_length


def legs_of(robot: Robot) -> dict[str, Leg]:
    """The robot's legs by name. Raises `ParameterError` if it has none that can walk."""
    if len(robot.legs) < 2:
        raise ParameterError(
            f"robot '{robot.name}' has {len(robot.legs)} legs", "describe them in [legs.NAME]"
        )
    trunks = {parts.trunk for parts in robot.legs.values()}
    limbs = {link for parts in robot.legs.values() for link in _limb(robot, parts)}
    rest = set(robot.parents) - trunks - limbs
    if rest:
        raise ParameterError(
            f"robot '{robot.name}': links.{min(rest)} is part of no leg and carries none",
            "leave it away, or name it in [legs.NAME]",
        )
    hips = {name: _hip(robot, name, parts, trunks) for name, parts in robot.legs.items()}
    middle = (min(hips.values()) + max(hips.values())) / 2
    return {
        name: _leg(robot, name, parts, hips[name] - middle) for name, parts in robot.legs.items()
    }


def _limb(robot: Robot, parts: LegParts) -> tuple[str, str]:
    return robot.feet[parts.foot], parts.thigh


def _ends(robot: Robot, parts: LegParts) -> tuple[bool, tuple[str, float], tuple[str, float]]:
    """Whether a leg leads upwards, its hip and its knee as places on its thigh."""
    shank, thigh = _limb(robot, parts)
    upwards = robot.parents[thigh] == shank
    length = robot.numbers[f"{thigh}.length"]
    start, end = (thigh, 0.0), (thigh, length)
    return upwards, (end if upwards else start), (start if upwards else end)


def _hip(robot: Robot, name: str, parts: LegParts, trunks: set[str]) -> float:
    """How far along the straight trunk a hip is from the first link of it, in m."""
    linkage = robot.linkage
    first = next(link for link in robot.parents if link in trunks)
    _, hip, _ = _ends(robot, parts)
    arms = linkage.arms(*hip) - linkage.arms(first, 0.0)
    aside = [i for i, link in enumerate(linkage.links) if link.name not in trunks]
    if np.abs(arms[aside]).max() > CLOSE:
        raise ParameterError(
            f"robot '{robot.name}': legs.{name}: thigh '{parts.thigh}' does not end at the trunk",
            f"let it meet '{parts.trunk}'",
        )
    return float(arms.sum())


def _leg(robot: Robot, name: str, parts: LegParts, hip: float) -> Leg:
    linkage = robot.linkage
    upwards, _, knee = _ends(robot, parts)
    shank, thigh = _limb(robot, parts)
    to_foot = linkage.foot_arms(parts.foot) - linkage.arms(*knee)
    along = float(to_foot[linkage.place[shank]])
    if np.abs(np.delete(to_foot, linkage.place[shank])).max() > CLOSE:
        raise ParameterError(
            f"robot '{robot.name}': legs.{name}: shank '{shank}' and thigh '{thigh}' do not end "
            "at the same knee",
            "let each link of a leg start at an end of the other",
        )
    return Leg(
        name=name,
        foot=parts.foot,
        shank=shank,
        thigh=thigh,
        trunk=parts.trunk,
        thigh_length=robot.numbers[f"{thigh}.length"],
        shank_length=abs(along),
        hip=hip,
        upwards=upwards,
        knee_back=parts.knee_back,
    )
