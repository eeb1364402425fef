"""A map of gaits over mean speed and spine stiffness: peak forces, stability, where they end."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from flexspine.errors import InputError, ParameterError
from flexspine.gaits.gait import Gait, examine
from flexspine.hybrid.compile import Array
from flexspine.models.legs import SIDES
from flexspine.models.model import Model
from flexspine.models.simulation import check_count
from flexspine.parameters import shortened
from flexspine.studies.axes import GRID, Axis
from flexspine.studies.plan import Plan
from flexspine.studies.store import Store, read_plan_of
from flexspine.studies.tables import Row, known
from flexspine.studies.task_kinds import GAITS

STIFFNESS, SPEED = "spine.stiffness", "mean_speed"

# N m/rad and m/s.
STIFFNESSES, SPEEDS = (180.0, 320.0), (2.4, 4.7)
LINES, POINTS = 29, 93

# Relative; a branch that comes this close to a bound reached it.
AT_BOUND = 1e-9


@dataclass(frozen=True)
class GaitMap:
    """Gaits over spine stiffness and mean speed, at one ``energy`` (J) and apex ``height`` (m).

    ``stiffnesses`` (n,) are in N m/rad, ``speeds`` (m,) in m/s. Shape (n, m), NaN where there is no
    gait: ``peak_grf`` in N per pair of legs, also NaN for a gait that could not be run as far as
    its peak; ``radius``, the spectral radius on the energy level. ``slowest`` and ``fastest`` (n,)
    are the speeds at which gaits end, NaN if they do not within the map. ``reasons`` tells, by
    stiffness, why they end where they do. ``model`` starts on the gait that was followed.
    """

    model: Model
    energy: float
    height: float
    stiffnesses: Array
    speeds: Array
    peak_grf: Array
    radius: Array
    slowest: Array
    fastest: Array
    reasons: tuple[str, ...]

    @property
    def found(self) -> int:
        """How many gaits there are."""
        return int(np.isfinite(self.radius).sum())

    @property
    def stable(self) -> int:
        """How many of them are stable."""
        return int((self.radius < 1).sum())

    def extremes(self, values: Array) -> Row | None:
        """Return the least and the largest of ``values`` (n, m), and where; None of no gaits.

        ``values`` are such as ``radius`` or ``peak_grf``.
        """
        if not np.isfinite(values).any():
            return None
        places = {"least": np.nanargmin(values), "largest": np.nanargmax(values)}
        return {name: self._at(int(place), values) for name, place in places.items()}

    def _at(self, place: int, values: Array) -> Row:
        i, j = np.unravel_index(place, values.shape)
        where = {"spine_stiffness": self.stiffnesses[i], "mean_speed": self.speeds[j]}
        return {name: float(v) for name, v in {"value": values[i, j], **where}.items()}

    def ends(self) -> list[Row]:
        """Return by stiffness the speeds at which gaits end, None where they reach beyond."""
        columns = (self.stiffnesses, self.slowest, self.fastest, self.reasons)
        return [
            {
                "spine_stiffness": float(stiffness),
                "slowest": known(slowest),
                "fastest": known(fastest),
                "reason": reason,
            }
            for stiffness, slowest, fastest, reason in zip(*columns, strict=True)
        ]

    def rows(self) -> list[Row]:
        """Return a row for every point of the map, None where there is no gait."""
        return [
            {
                "spine_stiffness": float(stiffness),
                "mean_speed": float(speed),
                "peak_grf": known(self.peak_grf[i, j]),
                "level_spectral_radius": known(self.radius[i, j]),
                "stable": bool(self.radius[i, j] < 1) if np.isfinite(self.radius[i, j]) else None,
            }
            for i, stiffness in enumerate(self.stiffnesses)
            for j, speed in enumerate(self.speeds)
        ]


def map_plan(
    gait: Gait,
    stiffnesses: tuple[float, float] = STIFFNESSES,
    speeds: tuple[float, float] = SPEEDS,
    *,
    lines: int = LINES,
    points: int = POINTS,
) -> Plan:
    """Plan to follow a gait over ``points`` mean speeds, for each of ``lines`` stiffnesses.

    Both ranges are low and high, SI. Energy and apex height are the gait's. `sweep` does the plan,
    `read_map` reads what it found. Raises `InputError`.
    """
    if not isinstance(gait, Gait):
        raise ParameterError(f"{shortened(gait)} is no gait", "make one with examine(model)")
    if gait.flaw is not None:
        raise ParameterError(f"there is no gait to follow: {gait.flaw}", "find one first")
    if STIFFNESS not in gait.model.numbers:
        raise InputError(f"'{gait.model.name}' has no {STIFFNESS!r}", "map a body that has")
    for name, ends in ((STIFFNESS, stiffnesses), (SPEED, speeds)):
        if not 0 < ends[0] < ends[1] < inf:
            raise ParameterError(
                f"{name} from {ends[0]:g} to {ends[1]:g} is no range",
                "give low before high, both above zero",
            )
    for name, count in (("lines", lines), ("points", points)):
        if check_count(name, count) < 2:
            raise ParameterError(f"{name} = {count} makes no map", "give 2 or more")
    axes = (
        Axis(STIFFNESS, low=stiffnesses[0], high=stiffnesses[1], steps=lines),
        Axis(SPEED, low=speeds[0], high=speeds[1], steps=points),
    )
    return Plan((gait.model,), axes, task=GAITS, options={"tolerance": gait.tolerance})


def read_map(path: str | Path) -> GaitMap:
    """Read what a sweep of `map_plan` has found.

    ``path`` is the directory of the sweep. Raises `InputError` if it holds none, or an unfinished
    one.
    """
    folder = Path(path)
    plan = read_plan_of(folder)
    names = tuple(axis.name for axis in plan.axes)
    if (plan.task, plan.method, names) != (GAITS, GRID, (STIFFNESS, SPEED)):
        raise InputError(f"'{folder}' holds no map", "give a directory of 'flexspine map'")
    peaks = [f"peak_grf_{side}" for side in SIDES]
    more = ["branch_from", "branch_to", "confirmed", "level_spectral_radius", "reason"]
    table = Store(folder, plan).columns(0, [*peaks, *more])
    stiffnesses, speeds = (axis.grid(0.0) for axis in plan.axes)
    shape = (len(stiffnesses), len(speeds))
    confirmed = np.array(table["confirmed"], dtype=float) == 1
    peak = np.where(confirmed, np.maximum(*(table[name] for name in peaks)), np.nan)
    low, high = (table[name].reshape(shape)[:, 0] for name in ("branch_from", "branch_to"))
    room = AT_BOUND * speeds[-1]
    why = table["reason"].reshape(shape)
    return GaitMap(
        model=plan.bounders[0],
        energy=examine(plan.bounders[0], tolerance=plan.tolerance).energy,
        height=plan.bounders[0].apex["height"],
        stiffnesses=stiffnesses,
        speeds=speeds,
        peak_grf=peak.reshape(shape),
        radius=table["level_spectral_radius"].reshape(shape),
        slowest=np.where(low > speeds[0] + room, low, np.nan),
        fastest=np.where(high < speeds[-1] - room, high, np.nan),
        reasons=tuple(next((str(r) for r in line if r is not None), "") for line in why),
    )
