"""The robot sc618 once more: its places and rates, and what a slow trot asks of its joints.

Everything here is worked out anew from sizes and trigonometry, and knows of flexspine nothing but
the numbers that it is to be checked with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

Array = NDArray[np.float64]

THIGH, SHANK, HIP = 0.16, 0.25, 0.3
PARENTS = {
    "shank_1": None, "thigh_1": "shank_1", "thigh_2": "thigh_1", "shank_2": "thigh_2",
    "hind_trunk": "thigh_1", "fore_trunk": "hind_trunk",
    "thigh_3": "fore_trunk", "shank_3": "thigh_3", "thigh_4": "fore_trunk", "shank_4": "thigh_4",
}  # fmt: skip
LENGTHS = {
    name: 0.3 if "trunk" in name else THIGH if "thigh" in name else SHANK for name in PARENTS
}
LINKS = list(PARENTS)
MOTORS = {
    "knee_1": "thigh_1", "hip_2": "thigh_2", "knee_2": "shank_2", "hip_1": "hind_trunk",
    "hip_3": "thigh_3", "knee_3": "shank_3", "hip_4": "thigh_4", "knee_4": "shank_4",
}  # fmt: skip
TOES = ("toe_1", "toe_2", "toe_3", "toe_4")
HIPS = dict(zip(TOES, (-HIP, -HIP, HIP, HIP), strict=True))
DIAGONALS = (("toe_1", "toe_4"), ("toe_2", "toe_3"))


def direction(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def normal(angle: Array) -> Array:
    return np.stack([-np.sin(angle), np.cos(angle)], axis=-1)


def ends(angles: Array, base: Array) -> dict[str, Array]:
    """Where every link ends, from absolute angles (..., 10) and the base (..., 2)."""
    found: dict[str, Array] = {}
    for i, (name, parent) in enumerate(PARENTS.items()):
        start = base if parent is None else found[parent]
        found[name] = start + LENGTHS[name] * direction(angles[..., i])
    return found


def end_rates(angles: Array, rates: Array, base_rate: Array) -> dict[str, Array]:
    """The velocities of the same."""
    found: dict[str, Array] = {}
    for i, (name, parent) in enumerate(PARENTS.items()):
        start = base_rate if parent is None else found[parent]
        turn = LENGTHS[name] * rates[..., i, None]
        found[name] = start + turn * normal(angles[..., i])
    return found


def feet(angles: Array, base: Array) -> dict[str, Array]:
    found = ends(angles, base)
    return {"toe_1": base, **{toe: found[f"shank_{toe[-1]}"] for toe in TOES[1:]}}


def foot_rates(angles: Array, rates: Array, base_rate: Array) -> dict[str, Array]:
    found = end_rates(angles, rates, base_rate)
    return {"toe_1": base_rate, **{toe: found[f"shank_{toe[-1]}"] for toe in TOES[1:]}}


def bends(absolute: Array) -> Array:
    """The angles (or rates) of the motors' joints, shape (..., 8)."""
    columns = []
    for link in MOTORS.values():
        parent = PARENTS[link]
        assert parent is not None
        columns.append(absolute[..., LINKS.index(link)] - absolute[..., LINKS.index(parent)])
    return np.stack(columns, axis=-1)


def leg_angles(reach: Array) -> tuple[Array, Array]:
    """Angles of thigh and shank, away from the hip, with the knee behind; ``reach`` (..., 2)."""
    length = np.hypot(reach[..., 0], reach[..., 1])
    along = (THIGH**2 - SHANK**2 + length**2) / (2 * length)
    aside = np.sqrt(THIGH**2 - along**2)
    ahead = reach / length[..., None]
    behind = np.stack([ahead[..., 1], -ahead[..., 0]], axis=-1)
    knee = along[..., None] * ahead + aside[..., None] * behind
    rest = reach - knee
    return np.arctan2(knee[..., 1], knee[..., 0]), np.arctan2(rest[..., 1], rest[..., 0])


def leg_rates(reach: Array, rate: Array) -> tuple[Array, Array]:
    """How fast thigh and shank turn while the foot moves at ``rate`` from the hip."""
    thigh, shank = leg_angles(reach)
    matrix = np.stack([THIGH * normal(thigh), SHANK * normal(shank)], axis=-1)
    solved = np.linalg.solve(matrix, rate[..., None])[..., 0]
    return solved[..., 0], solved[..., 1]


def joints_for(legs: Mapping[str, tuple[Array, Array]], turned: float = np.pi) -> Array:
    """Joints' angles with a straight, level trunk, from thighs and shanks, shape (..., 8).

    Thigh and shank of leg 1 are counted from the toe upwards; for rates ``turned`` is zero.
    """
    flat = np.zeros_like(legs["toe_1"][0])
    absolute = np.stack(
        [
            legs["toe_1"][1] + turned, legs["toe_1"][0] + turned, *legs["toe_2"], flat, flat,
            *legs["toe_3"], *legs["toe_4"],
        ], axis=-1,
    )  # fmt: skip
    return bends(absolute)


@dataclass(frozen=True)
class Asked:
    """A gait in SI units."""

    speed: float = 0.3
    height: float = 0.33
    stance: float = 0.4
    clearance: float = 0.04
    landing: float = 0.05
    ramp: int = 4

    def after(self, speed: float, steps: int) -> float:
        """No step changes the speed by more than its share of the whole."""
        most = steps * abs(self.speed) / self.ramp
        return speed + float(np.clip(self.speed - speed, -most, most))


# Of sin^2 (pi s) (1 - s^2), the shape of a swing.
HIGHEST = -minimize_scalar(
    lambda s: -(np.sin(np.pi * s) ** 2) * (1 - s**2),
    bounds=(0.3, 0.6), method="bounded", options={"xatol": 1e-12},
).fun  # fmt: skip


@dataclass
class Step:
    """What is asked of body and feet from the beginning of a step until its swing is over."""

    asked: Asked
    number: int
    start: float
    x: float
    speed: float
    stood: Mapping[str, float]
    gain: float = field(init=False)

    def __post_init__(self) -> None:
        self.gain = (self.asked.after(self.speed, 1) - self.speed) / self.asked.stance

    @property
    def swings(self) -> Sequence[str]:
        return DIAGONALS[1 - self.number % 2]

    def body(self, time: Array) -> tuple[Array, Array]:
        """Where the middle of the trunk is, and how fast."""
        since = time - self.start
        return self.x + since * (self.speed + self.gain * since / 2), self.speed + self.gain * since

    def aim(self, toe: str) -> float:
        """A foot lands so that the hip passes over it half-way through its time on the ground."""
        asked = self.asked
        at_end, later = asked.after(self.speed, 1), asked.after(self.speed, 2)
        travelled = (self.speed + at_end) / 2 * asked.stance
        to_come = (at_end + later) / 2 * asked.stance
        return self.x + HIPS[toe] + travelled + to_come / 2

    def foot(self, toe: str, time: Array) -> tuple[Array, Array]:
        """Where a foot is to be, and how fast."""
        if toe not in self.swings:
            place = np.stack([np.full_like(time, self.stood[toe]), np.zeros_like(time)], axis=-1)
            return place, np.zeros_like(place)
        asked, stride = self.asked, self.aim(toe) - self.stood[toe]
        s, turn = (time - self.start) / asked.stance, 2 * np.pi
        x = self.stood[toe] + stride * (s - np.sin(turn * s) / turn)
        lift = np.sin(np.pi * s) ** 2
        y = asked.clearance * lift * (1 - s**2) / HIGHEST
        y = y + asked.landing * asked.stance * (s**2 - s**3)
        dx = stride * (1 - np.cos(turn * s)) / asked.stance
        dy = np.pi * np.sin(turn * s) * (1 - s**2) - 2 * s * lift
        dy = dy * asked.clearance / HIGHEST / asked.stance
        dy = dy + asked.landing * (2 * s - 3 * s**2)
        return np.stack([x, y], axis=-1), np.stack([dx, dy], axis=-1)

    def joints(self, time: Array) -> tuple[Array, Array]:
        """Angles and rates that are asked of the motors' joints, each (times, 8)."""
        x, speed = self.body(time)
        angles, rates = {}, {}
        for toe in TOES:
            place, rate = self.foot(toe, time)
            hip = np.stack([x + HIPS[toe], np.full_like(x, self.asked.height)], axis=-1)
            hip_rate = np.stack([speed, np.zeros_like(x)], axis=-1)
            angles[toe] = leg_angles(place - hip)
            rates[toe] = leg_rates(place - hip, rate - hip_rate)
        return joints_for(angles), joints_for(rates, turned=0.0)


def steps_of(asked: Asked, starts: Sequence[float], stood: Sequence[Mapping[str, float]]) -> list[
    Step
]:  # fmt: skip
    """The steps that begin at these times, with feet that stand there then."""
    found = [Step(asked, 0, starts[0], 0.0, 0.0, stood[0])]
    for number, (time, places) in enumerate(zip(starts[1:], stood[1:], strict=True), 1):
        x, speed = found[-1].body(np.array(time))
        found.append(Step(asked, number, time, float(x), float(speed), places))
    return found


def wrapped(angle: Array) -> Array:
    """Within half a turn of zero."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
