"""Gaits with a damper in the spine, kept going by an actuator at equal energy, height and speed.

Without dampers no gait costs anything. Two questions are asked: what more damping costs, at the
spine stiffness of the comparison, and what more compliance costs, at the same damping.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.continuation import Branch, trace_branch
from flexspine.gaits.family import BranchPoint
from flexspine.gaits.gait import Gait
from flexspine.studies.spines import SpineStudy

DAMPING, STIFFNESS = "spine.damping", "spine.stiffness"

# The first makes good what the damper takes wherever only one actuator is looked at.
ACTUATORS = ("legs.extension", "legs.stiffening", "legs.hip_lever")

# Natural units along a branch.
STEP = 0.1

# Measuring a gait takes as long as finding it: so many of a branch are.
MEASURED = 80


@dataclass(frozen=True)
class DampedSetting:
    """What is followed: damping up to ``most`` (N m s/rad), stiffness up to ``stiffest`` (N m/rad).

    The latter at each of the ``dampings``. Raises `ParameterError` for one that is not usable.
    """

    most: float = 1000.0
    dampings: tuple[float, ...] = (0.1, 1.0)
    stiffest: float = 2000.0

    def __post_init__(self) -> None:
        for damping in self.dampings:
            if not 0 < damping <= self.most:
                raise ParameterError(
                    f"damping {damping:g} is not usable",
                    f"give a number above zero and up to {self.most:g}, in N m s/rad",
                )


@dataclass(frozen=True)
class DampedBranch:
    """Gaits at one mean speed whose damper an ``actuator`` makes good.

    Followed in the spine's damping or in its stiffness, as ``branch`` tells.
    """

    speed: float
    actuator: str
    branch: Branch

    @property
    def points(self) -> tuple[BranchPoint, ...]:
        """Those that are measured, in order along the branch."""
        return tuple(self.branch.points[at] for at in self.measured())

    def measured(self, first: int = 0, last: int = -1) -> list[int]:
        """Which points of the branch are measured, evenly chosen, and those two of it."""
        count = len(self.branch.points)
        chosen = np.rint(np.linspace(0, count - 1, min(count, MEASURED))).astype(int).tolist()
        first, last = first % count, last % count
        return sorted({first, *(at for at in chosen if first < at < last), last})

    @property
    def label(self) -> str:
        """Such as ``damped, k_t = 260 N m/rad, 4.5 m/s, legs.extension``."""
        kept = f"k_t = {self.kept:g} N m/rad"
        if self.branch.over == STIFFNESS:
            kept = f"c_t = {self.kept:g} N m s/rad"
        return f"damped, {kept}, {self.speed:g} m/s, {self.actuator}"

    @property
    def other(self) -> str:
        """The parameter of the spine that it is not followed in."""
        return STIFFNESS if self.branch.over == DAMPING else DAMPING

    @property
    def kept(self) -> float:
        """The value of that: a stiffness or a damping."""
        return self.branch.points[0].gait.model.numbers[self.other]

    def extreme(self, pick: Callable[..., int], first: int = 0, last: int = -1) -> BranchPoint:
        """The gait between two points that costs least (``min``) or most (``max``).

        Among the measured ones, then all between the neighbours of the best, then by a parabola.
        """
        points, chosen = self.branch.points, self.measured(first, last)
        here = chosen.index(pick(chosen, key=self.cost_at))
        around = range(chosen[max(here - 1, 0)], chosen[min(here + 1, len(chosen) - 1)] + 1)
        best = pick(around, key=self.cost_at)
        if best in (chosen[0], chosen[-1]):
            return points[best]
        near = (best - 1, best, best + 1)
        along = np.arcsinh([points[at].value for at in near])  # even over decades, from zero on
        parabola = np.polynomial.Polynomial.fit(along, [self.cost_at(at) for at in near], 2)
        turns = [turn for turn in parabola.deriv().roots() if min(along) < turn < max(along)]
        found = [point for turn in turns for point in self.branch.at(float(np.sinh(turn)))]
        return min(
            found or [points[best]],
            key=lambda point: float(np.linalg.norm(point.point - points[best].point)),
        )

    def cost_at(self, at: int) -> float:
        """The cost of transport of a point of the branch."""
        return cost(self.branch.points[at].gait)


@dataclass(frozen=True)
class DampingStudy:
    """The branches over damping, from the undamped gait on, and over stiffness."""

    over_damping: tuple[DampedBranch, ...]
    over_stiffness: tuple[DampedBranch, ...]


def cost(gait: Gait) -> float:
    """Positive work of all actuators by weight and distance."""
    return gait.summary.cost_of_transport or 0.0


def study_damping(
    study: SpineStudy,
    setting: DampedSetting | None = None,
    store: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> DampingStudy:
    """Follow damped gaits from those of the stiffest spine that runs at each compared speed.

    Every actuator is tried at the fastest of these speeds, the first of them at all. ``store`` is
    a directory that keeps the branches as they grow.
    """
    setting = setting or DampedSetting()
    speeds = sorted(set(study.setting.compared))
    starts = {v: point.gait for v in speeds if (point := study.stiffest_at(v)) is not None}
    jobs = [(v, a) for v in starts for a in (ACTUATORS if v == max(starts) else ACTUATORS[:1])]
    whole = len(jobs) + len(starts) * len(set(setting.dampings))
    done = iter(range(whole))

    def trace(gait: Gait, over: str, bounds: tuple[float, float], actuator: str, at: str) -> Branch:
        name = f"damped gaits over {over} {at} by {actuator}"
        share = next(done) / whole
        if progress is not None:
            progress(name, share)
        file = None if store is None else store / f"{name.replace(' ', '-')}.jsonl"
        return trace_branch(
            gait, over, bounds=bounds, free=(actuator,), longest_step=STEP, store=file
        )

    def softer_and_stiffer(start: DampedBranch) -> Iterator[DampedBranch]:
        stiffest = max(setting.stiffest, start.kept)
        bounds = (study.setting.softest, stiffest)
        for damping in sorted(set(setting.dampings)):
            for point in start.branch.at(damping)[:1]:
                at = f"at {damping:g} and {start.speed:g}"
                branch = trace(point.gait, STIFFNESS, bounds, start.actuator, at)
                yield DampedBranch(start.speed, start.actuator, branch)

    over_damping = tuple(
        DampedBranch(v, a, trace(starts[v], DAMPING, (0.0, setting.most), a, f"at {v:g}"))
        for v, a in jobs
    )
    over_stiffness = tuple(
        found
        for start in over_damping
        if start.actuator == ACTUATORS[0]
        for found in softer_and_stiffer(start)
    )
    return DampingStudy(over_damping, over_stiffness)
