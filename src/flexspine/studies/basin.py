"""The basin of attraction of a gait: which starts about it keep running, and where they settle.

Starts lie on a slice through the gait's apex. The apex speed is adjusted over the slice so that
all have the energy of the gait: others could settle on its neighbours only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.gaits.continuation import trace_branch
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.stability import floquet_multipliers
from flexspine.hybrid.compile import Array
from flexspine.models.model import Model, check_between
from flexspine.models.presets import load_model
from flexspine.models.simulation import check_count
from flexspine.studies.axes import GRID, Axis, free_axes, grid_points
from flexspine.studies.following import STEP
from flexspine.studies.plan import Plan
from flexspine.studies.store import Store, read_plan_of
from flexspine.studies.tables import Row
from flexspine.studies.task_kinds import RUNS

STRIDES, POINTS = 100, 100

# Starts in one piece of work: enough to fill the lanes, few enough that progress shows.
CHUNK = 2500

# How far to go from a gait, SI: of a body that does not bend, and of one that does.
RIGID_SLICE = {"pitch": 0.8, "pitch_rate": 8.0}
BENDING_SLICE = {"fore_pitch": 0.3, "hind_pitch": 0.3}

# Natural units; a run this close to a gait has settled on it, one that has not is far off.
SETTLED = 1e-6

# Natural units; runs that end within this are said to end alike, and how many such ends are told.
TOGETHER, MOST_OTHERS = 1e-3, 5

# Apex speeds (m/s) and pitch rates (deg/s) of gaits of Scout II that are not stable.
UNSTABLE = ((4.0, 300.0), (2.0, 220.0), (1.0, 140.0))


@dataclass(frozen=True)
class Other:
    """Where else ``starts`` of a basin end: at an ``apex`` of another gait, or of none.

    ``radius`` is its spectral radius on the energy level, None if that apex does not repeat.
    """

    apex: Mapping[str, float]
    starts: int
    radius: float | None


@dataclass(frozen=True)
class Basin:
    """What became of starts on a slice through the apex of a gait.

    ``name`` is that of the gait, ``model`` starts on it, ``energy`` (J) is its total energy and
    ``radius`` its spectral radius on its energy level; ``energy_kept`` if all starts have that
    energy. ``over`` are the two coordinates varied (SI), ``values`` theirs; ``wanted`` strides were
    to be run. By start, shape (first, second): ``strides`` completed; ``deviation`` from the gait,
    from whichever of its apexes is nearest, in natural units after all strides, NaN if it ended
    before; ``possible`` is False where a body at rest would have more than the energy kept.
    ``others`` is where else they end, the most common first.
    """

    name: str
    model: Model
    radius: float
    energy: float
    energy_kept: bool
    over: tuple[str, str]
    values: tuple[Array, Array]
    wanted: int
    strides: NDArray[np.int64]
    deviation: Array
    possible: NDArray[np.bool_]
    others: tuple[Other, ...]

    @property
    def lasted(self) -> NDArray[np.bool_]:
        """Which starts ran all strides, shape (first, second)."""
        return np.isfinite(self.deviation)

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Which starts came to this very gait, within 1e-6 natural units, (first, second)."""
        return self.deviation < SETTLED

    def row(self) -> Row:
        """Return the gait, and how many starts came to what, by column; SI and radians."""
        return {
            "name": self.name,
            **{f"apex_{name}": value for name, value in self.model.apex.items()},
            **{f"touchdown_{side}": angle for side, angle in self.model.touchdown.items()},
            "energy": self.energy,
            "level_spectral_radius": self.radius,
            "stable": self.radius < 1,
            "starts": int(self.possible.sum()),
            "fell_in_the_first_stride": int((self.possible & (self.strides == 0)).sum()),
            "lasted": int(self.lasted.sum()),
            "settled": int(self.settled.sum()),
            "not_settled": int((self.lasted & ~self.settled).sum()),
        }


def example_gaits() -> dict[str, Gait]:
    """The stable gait of preset ``scout2``, and three of the same body that are not stable."""
    own = examine(load_model("scout2"))
    found = {"scout2": own}
    for speed, rate in UNSTABLE:
        gait = _moved(_moved(own, "pitch_rate", radians(rate)), "speed", speed)
        found[f"scout2-{speed:g}mps-{rate:g}dps"] = gait
    return found


def _moved(gait: Gait, over: str, value: float) -> Gait:
    """The gait whose apex differs in one coordinate alone."""
    here = gait.model.apex[over]
    if here == value:
        return gait
    fixed = {name: gait.model.apex[name] for name in ("height", "speed", "pitch_rate")}
    bounds = min(here, value), max(here, value)
    branch = trace_branch(gait, over, bounds=bounds, fixed=fixed, longest_step=STEP)
    return branch.at(value)[0].gait


def basin_plan(
    gaits: Mapping[str, Gait],
    over: Mapping[str, float] | None = None,
    *,
    points: int = POINTS,
    strides: int = STRIDES,
    keep_energy: bool = True,
) -> Plan:
    """Plan runs of ``strides`` strides from starts about each of ``gaits``, given by name.

    ``over`` names two apex coordinates and how far to go from the gait in each, to both sides (SI,
    radians), ``points`` how many values of each; None: pitch and pitch rate of a body that does not
    bend, else both pitches. With ``keep_energy`` the apex speed follows from the others. `sweep`
    does the plan, `read_basins` reads what it found. Raises `ParameterError` and
    `UnknownNameError`.
    """
    if not gaits:
        raise ParameterError("there is no gait", "give one at least")
    for name, gait in gaits.items():
        if not isinstance(gait, Gait):
            raise ParameterError(f"'{name}' is no gait", "make one with examine(model)")
    ways = dict(_usual_slice(gaits) if over is None else over)
    check_count("points", points)
    for name, gait in gaits.items():
        _check_gait(name, gait, ways)
    _check_slice(ways, keep_energy)
    axes = [Axis(name, within=float(amount), steps=points) for name, amount in ways.items()]
    if keep_energy:
        axes.append(Axis("speed", keeps="energy"))
    plan = Plan(
        models=tuple(gait.model.renamed(name, gait.model.source) for name, gait in gaits.items()),
        axes=tuple(axes),
        task=RUNS,
        chunk=CHUNK,
        options={"strides": strides, "tolerance": min(g.tolerance for g in gaits.values())},
    )
    for model in plan.bounders:
        if not grid_points(model, plan.axes, 0, plan.points).get("speed", np.ones(1)).any():
            raise ParameterError(
                f"about '{model.name}' every start has more energy than the gait, even at rest",
                f"go less far in {' and '.join(ways)}",
            )
    return plan


def _check_slice(ways: Mapping[str, float], keep_energy: bool) -> None:
    if len(ways) != 2:
        raise ParameterError(f"{len(ways)} coordinates make no slice", "vary two")
    for name, amount in ways.items():
        check_between(f"how far to go in {name}", amount, 0, float("inf"))
    if keep_energy and "speed" in ways:
        raise ParameterError(
            "the speed cannot vary, as it keeps the energy",
            "vary other coordinates, or let the energy differ (--any-energy)",
        )


def _usual_slice(gaits: Mapping[str, Gait]) -> Mapping[str, float]:
    rigid = all("pitch" in gait.model.apex for gait in gaits.values())
    return RIGID_SLICE if rigid else BENDING_SLICE


def _check_gait(name: str, gait: Gait, over: Mapping[str, float]) -> None:
    if gait.flaw is not None:
        raise ParameterError(f"'{name}' is no gait: {gait.flaw}", "find one with find_gaits")
    if gait.strides != 1:
        raise ParameterError(
            f"'{name}' takes {gait.strides} strides to repeat", "give a gait of one stride"
        )
    for coordinate in over:
        if coordinate not in gait.model.apex:
            raise UnknownNameError("apex coordinate", coordinate, gait.model.apex)


def read_basins(path: str | Path) -> list[Basin]:
    """Read what a sweep of `basin_plan` has found, a basin for each gait.

    ``path`` is the directory of the sweep. Raises `InputError` if it holds none, or an unfinished
    one.
    """
    folder = Path(path)
    plan = read_plan_of(folder)
    free = free_axes(plan.axes)
    slices = len(free) == 2 and all(axis.within and axis.steps for axis in free)
    if plan.task != RUNS or plan.method != GRID or not slices:
        raise InputError(f"'{folder}' holds no basin", "give a directory of 'flexspine basin'")
    return [_basin(Store(folder, plan), number) for number in range(len(plan.models))]


def _basin(store: Store, number: int) -> Basin:
    plan = store.plan
    model, (first, second) = plan.bounders[number], free_axes(plan.axes)
    gait = examine(model, tolerance=plan.tolerance)
    kept = len(plan.axes) > len((first, second))
    ends = [f"apex_{name}" for name in model.apex]
    speeds = ["at_speed"] if kept else []
    table = store.columns(number, ["outcome", "strides", *ends, *speeds])
    # The speed is exactly zero only where there is none that keeps the energy.
    possible = table["at_speed"] != 0 if kept else np.ones(len(table["strides"]), dtype=bool)
    lasted = (table["outcome"] == "completed") & possible
    scaled = np.transpose([table[f"apex_{name}"] / model.scales[name] for name in model.apex])
    apart = np.linalg.norm(scaled[:, None] - gait.orbit, axis=2).min(axis=1)
    shape = (first.steps or 1, second.steps or 1)
    return Basin(
        name=model.name,
        model=model,
        radius=floquet_multipliers(gait).level_spectral_radius,
        energy=gait.energy,
        energy_kept=kept,
        over=(first.name, second.name),
        values=(first.grid(first.own(model)), second.grid(second.own(model))),
        wanted=int(plan.options["strides"]),
        strides=table["strides"].reshape(shape),
        deviation=np.where(lasted, apart, np.nan).reshape(shape),
        possible=possible.reshape(shape),
        others=tuple(_others(gait, scaled[lasted & (apart >= SETTLED)])),
    )


def _others(gait: Gait, ends: Array) -> Iterator[Other]:
    """The apexes, in natural units, at which most of some runs end."""
    if not len(ends):
        return
    _, places, counts = np.unique(
        np.round(ends / TOGETHER), axis=0, return_index=True, return_counts=True
    )
    for which in np.argsort(-counts, kind="stable")[:MOST_OTHERS]:
        apex = {
            n: float(v) * gait.model.scales[n]
            for n, v in zip(gait.model.apex, ends[places[which]], strict=True)
        }
        found = examine(gait.model.with_values(apex=apex), tolerance=gait.tolerance)
        radius = None if found.flaw else floquet_multipliers(found).level_spectral_radius
        yield Other(apex, int(counts[which]), radius)
