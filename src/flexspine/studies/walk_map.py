"""Walks in space over spine stiffness and speed, a locked spine beside the flexible ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexspine.errors import InputError, ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.simulation import check_count
from flexspine.parameters import is_number, shortened
from flexspine.studies.axes import GRID, Axis
from flexspine.studies.plan import Plan
from flexspine.studies.store import Store, read_plan_of
from flexspine.studies.tables import Row, known
from flexspine.studies.task_kinds import WALK_SECONDS, WALKS
from flexspine.studies.walkers import Walker

STIFFNESS, SPEED = "spine.stiffness", "gait.speed"

# N m/rad; of the spine. Speeds are shares of the walk's own, as feet are told to move.
STIFFNESSES = (30.0, 60.0, 120.0, 240.0, 480.0, 960.0)
SPEEDS = (0.6, 0.8, 1.0, 1.2, 1.4, 1.6)

# rad; how badly joints are read off, so that no result hangs on a symmetry.
SENSING = 0.005

# What is compared: column, meaning, unit, factor to that unit.
MEASURES: dict[str, tuple[str, str, float]] = {
    "peak_normal": ("peak normal force", "N", 1.0),
    "impact": ("mean impact peak", "N", 1.0),
    "normal": ("mean normal force", "N", 1.0),
    "bounce": ("CoM oscillation, height", "mm", 1e3),
    "pitch": ("trunk pitch (rms)", "°", 180 / np.pi),
    "cost_of_transport": ("cost of transport", "", 1.0),
    "contact_loss": ("lost to the ground a stride", "J", 1.0),
    "speed": ("speed reached", "m/s", 1.0),
}


def walk_plan(
    walker: Walker,
    stiffnesses: tuple[float, ...] = STIFFNESSES,
    speeds: tuple[float, ...] | None = None,
    *,
    seconds: float = WALK_SECONDS,
    seed: int = 0,
) -> Plan:
    """Plan to let a robot walk at every stiffness (N m/rad) and asked speed (m/s).

    The locked one walks as often at every speed, each time with another noise on its sensors, drawn
    from ``seed``. Walks last ``seconds`` (s); without ``speeds`` they are shares of the walk's own,
    0.6 to 1.6. `sweep` does the plan, `read_walks` reads what it found. Raises `ParameterError`.
    """
    if not isinstance(walker, Walker):
        raise ParameterError(
            f"{shortened(walker)} is no walker",
            'make one: Walker("name", load_robot(...), load_walk(...))',
        )
    own = walker.numbers[SPEED]
    speeds = tuple(round(share * own, 4) for share in SPEEDS) if speeds is None else speeds
    for name, values in ((STIFFNESS, stiffnesses), (SPEED, speeds)):
        check_count(f"values of {name}", len(values))
        for value in values:
            if not is_number(value):
                raise ParameterError(f"{name} = {shortened(value)} is no number", "give numbers")
    return Plan(
        (walker, walker.with_locked_spine()),
        (Axis(SPEED, tuple(sorted(speeds))), Axis(STIFFNESS, tuple(sorted(stiffnesses)))),
        task=WALKS,
        seed=seed,
        options={"seconds": seconds, "sensing": SENSING},
    )


@dataclass(frozen=True)
class WalkMap:
    """Walks in space of one robot, ``name``, over asked speeds and stiffnesses of its spine.

    ``speeds`` (n,) are in m/s, ``stiffnesses`` (m,) in N m/rad. ``flexible`` and ``locked`` have by
    measure an array (n, m), SI, NaN where the walk ended early; those of the locked spine are as
    many repeats. ``fell`` tells which walks ended early, by body, (n, m). Walks have a ``rhythm``
    and were to last ``seconds`` (s).
    """

    name: str
    rhythm: str
    seconds: float
    speeds: Array
    stiffnesses: Array
    flexible: dict[str, Array]
    locked: dict[str, Array]
    fell: dict[str, Array]

    def rows(self) -> list[Row]:
        """Return a row for every walk, None where there is no value; SI."""
        return [
            {
                "body": body,
                "asked_speed": float(speed),
                "spine_stiffness": float(stiffness) if body == "flexible" else None,
                "fell": bool(self.fell[body][i, j]),
                **{name: known(table[name][i, j]) for name in MEASURES},
            }
            for body, table in (("flexible", self.flexible), ("locked", self.locked))
            for i, speed in enumerate(self.speeds)
            for j, stiffness in enumerate(self.stiffnesses)
        ]

    def compared(self, measure: str) -> list[Row]:
        """Return by speed the mean of the locked spine, and the best stiffness with its value.

        ``measure`` is such as ``peak_normal``; least is best, of ``speed`` most.
        """
        better = np.nanargmax if measure == "speed" else np.nanargmin
        found: list[Row] = []
        for i, speed in enumerate(self.speeds):
            ours, theirs = self.flexible[measure][i], self.locked[measure][i]
            at = int(better(ours)) if np.isfinite(ours).any() else None
            found.append(
                {
                    "asked_speed": float(speed),
                    "locked": float(np.nanmean(theirs)) if np.isfinite(theirs).any() else None,
                    "best": None if at is None else float(ours[at]),
                    "best_stiffness": None if at is None else float(self.stiffnesses[at]),
                }
            )
        return found


def read_walks(path: str | Path) -> WalkMap:
    """Read what a sweep of `walk_plan` has found.

    ``path`` is the directory of the sweep. Raises `InputError` if it holds none, or an unfinished
    one.
    """
    folder = Path(path)
    plan = read_plan_of(folder)
    names = tuple(axis.name for axis in plan.axes)
    if (plan.task, plan.method, names, len(plan.models)) != (WALKS, GRID, (SPEED, STIFFNESS), 2):
        raise InputError(
            f"'{folder}' holds no such walks", "give a directory of 'flexspine spines'"
        )
    speeds, stiffnesses = (axis.grid(0.0) for axis in plan.axes)
    shape = (len(speeds), len(stiffnesses))
    tables, fell = [], []
    for number in range(2):
        columns = Store(folder, plan).columns(number, ["outcome", *MEASURES])
        tables.append({name: columns[name].astype(float).reshape(shape) for name in MEASURES})
        fell.append((columns["outcome"] != "completed").reshape(shape))
    walker = plan.walkers[0]
    return WalkMap(
        name=walker.robot.name,
        rhythm=walker.walk.rhythm,
        seconds=plan.all_options["seconds"],
        speeds=speeds,
        stiffnesses=stiffnesses,
        flexible=tables[0],
        locked=tables[1],
        fell={"flexible": fell[0], "locked": fell[1]},
    )
