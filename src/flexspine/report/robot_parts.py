"""What is what in the dataset of a robot's run: its legs, which are rear and front, its spine."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from flexspine.report.style import SIDE_COLORS, paler

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class RobotLeg:
    """A leg by the names of its parts: links from the foot up, motors' joints from the hip down.

    ``near``: in front of the others of its ``side``, hind or fore, as it is the first of them.
    """

    name: str
    foot: str
    links: tuple[str, ...]
    joints: tuple[str, ...]
    side: str
    near: bool

    @property
    def color(self) -> str:
        """In which it is drawn; legs behind are paler."""
        color = SIDE_COLORS[self.side]
        return color if self.near else paler(color)

    @property
    def title(self) -> str:
        """Its name for a reader."""
        return self.name.replace("_", " ")


@dataclass(frozen=True)
class RobotParts:
    """The parts of a robot by name; ``spine`` is the joint within the trunk, if there is one.

    ``spine_link`` turns at it; ``bends`` is 1 where a growing angle lets the back sag, else -1.
    """

    legs: tuple[RobotLeg, ...]
    trunk: tuple[str, ...]
    spine: str | None
    spine_link: str | None
    bends: float

    @classmethod
    def of(cls, dataset: xr.Dataset) -> RobotParts:
        """Return the parts of the robot that ran."""
        parents, joints, feet = (
            json.loads(dataset.attrs.get(name, "{}")) for name in ("parents", "joints", "legs")
        )
        feet = feet or {str(name): str(name) for name in dataset["foot_name"].values}
        if "limbs" in dataset.attrs:
            return cls._in_space(dataset, parents, joints, feet)
        tree = _Tree(parents, joints, {leg: _carrier(dataset, feet[leg]) for leg in feet})
        links = {leg: tree.leg(leg) for leg in feet}
        of_legs = {link for each in links.values() for link in each}
        trunk = tuple(link for link in parents if link not in of_legs)
        sides, motors = _sides(dataset, feet), dataset["motor"].values.tolist()
        legs: list[RobotLeg] = []
        for leg, foot in feet.items():
            near = all(other.side != sides[leg] for other in legs)
            own = tuple(j for j in tree.upper_joints(links[leg], trunk) if j in motors)
            legs.append(RobotLeg(leg, foot, links[leg], own, sides[leg], near))
        return cls._of_legs(dataset, legs, trunk, parents, joints)

    @classmethod
    def _in_space(
        cls,
        dataset: xr.Dataset,
        parents: Mapping[str, str | None],
        joints: Mapping[str, str],
        feet: Mapping[str, str],
    ) -> RobotParts:
        """A robot in space, seen from the right; it says itself what its legs are made of."""
        limbs, sides = json.loads(dataset.attrs["limbs"]), _sides(dataset, feet)
        legs = [
            RobotLeg(
                name, feet[name], tuple(limb["links"]), tuple(limb["joints"]), sides[name],
                limb["side"] == "right",
            )
            for name, limb in limbs.items()
        ]  # fmt: skip
        of_legs = {link for leg in legs for link in leg.links}
        trunk = tuple(link for link in parents if link not in of_legs)
        return cls._of_legs(dataset, legs, trunk, parents, joints)

    @classmethod
    def _of_legs(
        cls,
        dataset: xr.Dataset,
        legs: list[RobotLeg],
        trunk: tuple[str, ...],
        parents: Mapping[str, str | None],
        joints: Mapping[str, str],
    ) -> RobotParts:
        spine = next((j for j in joints if {joints[j], parents[joints[j]]} <= {*trunk}), None)
        turned = None if spine is None else joints[spine]
        above = None if turned is None else parents[turned]
        return cls(tuple(legs), trunk, spine, turned, _way(dataset, above, turned))

    def first(self, side: str) -> RobotLeg | None:
        """Return the first leg of a side."""
        return next((leg for leg in self.legs if leg.side == side), None)

    def side_of(self, dataset: xr.Dataset, link: str) -> str:
        """Return at which end of the robot a link is at the first sample."""
        x = _middles(dataset)
        return "fore" if x[link] >= np.mean([x[each] for each in self.trunk]) else "hind"


@dataclass(frozen=True)
class _Tree:
    """What hangs on what, and the link that carries each leg's foot."""

    parents: Mapping[str, str | None]
    joints: Mapping[str, str]
    carriers: Mapping[str, str]

    def leg(self, name: str) -> tuple[str, ...]:
        """The shank, and the thigh unless the shank hangs on what carries other legs."""
        shank = self.carriers[name]
        others = {link for leg, link in self.carriers.items() if leg != name}
        beside = self._beside(shank)
        if len(beside) == 1 and not others & {*beside, *self._beside(beside[0])}:
            return shank, beside[0]
        return (shank,)

    def upper_joints(self, links: tuple[str, ...], trunk: tuple[str, ...]) -> tuple[str, ...]:
        """The joints of a leg's links with the trunk and with each other, from the hip down."""
        # A leg may hang on the thigh of the one beside it instead.
        others = [link for link in self.parents if link not in (*links, *trunk)]
        hips = (self.joint_of(links[-1], each) for each in (*trunk, *others))
        inner = [self.joint_of(*pair) for pair in pairwise(links)]
        found = [next((hip for hip in hips if hip is not None), None), *inner[::-1]]
        return tuple(joint for joint in found if joint is not None)

    def joint_of(self, one: str, other: str) -> str | None:
        """The joint at which two links meet."""
        for joint, link in self.joints.items():
            if (link, self.parents[link]) in ((one, other), (other, one)):
                return joint
        return None

    def _beside(self, link: str) -> list[str]:
        """The links that a link meets."""
        above = self.parents[link]
        below = [each for each, parent in self.parents.items() if parent == link]
        return below if above is None else [above, *below]


def _carrier(dataset: xr.Dataset, foot: str) -> str:
    """The link that a foot is on: the one on whose line it always is, at one place."""
    place = dataset["foot"].sel(foot_name=foot).values[:, None]
    start, angle = dataset["link_start"].values, dataset["link_angle"].values
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    at = json.loads(dataset.attrs.get("parameters", "{}"))[f"{foot}.at"]
    apart = np.hypot(*np.moveaxis(start + at * along - place, -1, 0)).max(axis=0)
    return str(dataset["link"].values[int(apart.argmin())])


def _sides(dataset: xr.Dataset, feet: Mapping[str, str]) -> dict[str, str]:
    """The end of the robot at which each leg stands at the first sample."""
    at = dataset["foot"].isel(time=0, axis=0)
    x = {name: float(at.sel(foot_name=foot)) for name, foot in feet.items()}
    middle = (min(x.values()) + max(x.values())) / 2 if x else 0.0
    return {name: "fore" if place >= middle else "hind" for name, place in x.items()}


def _way(dataset: xr.Dataset, parent: str | None, link: str | None) -> float:
    if link is None or parent is None:
        return 1.0
    x = _middles(dataset)
    return 1.0 if x[link] >= x[parent] else -1.0


def _middles(dataset: xr.Dataset) -> dict[str, float]:
    """Where the middles of the links are at the first sample, x in m."""
    ends = dataset[["link_start", "link_end"]].isel(time=0, axis=0)
    x = (ends["link_start"] + ends["link_end"]).values / 2
    return dict(zip(dataset["link"].values.tolist(), x.tolist(), strict=True))


def typical_force(dataset: xr.Dataset) -> float:
    """Return the median force (N) on the feet that stand, zero if none ever does."""
    forces = np.hypot(*np.moveaxis(dataset["grf"].values, -1, 0))
    forces = forces[dataset["stands"].values > 0]
    return float(np.median(forces)) if len(forces) else 0.0
