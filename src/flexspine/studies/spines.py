"""The published comparison: the same bounding gaits with a rigid, a locked and a flexible spine.

Setting of Kamimura et al. 2015, Artif Life Robotics 20:270-275: equal total energy, equal apex
height, symmetric gaits that land on the fore leg first. Two baselines: the rigid body as published,
which has 2.6 times the pitch inertia, and the flexible body with its spine locked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.continuation import Branch, trace_branch
from flexspine.gaits.family import BranchPoint
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.newton import solve
from flexspine.gaits.problem import Problem
from flexspine.gaits.stability import Stability, floquet_multipliers
from flexspine.models.model import Model
from flexspine.models.presets import load_model
from flexspine.studies.following import STEP, LostGaitError, carried

RIGID, LOCKED, FLEXIBLE = "published rigid", "locked spine", "flexible"
PRESETS = {
    RIGID: "kamimura2015-rigid",
    LOCKED: "kamimura2015-locked",
    FLEXIBLE: "kamimura2015-flexible",
}

# Natural units; a gait of a stiff spine that bends more than this is none of a locked one.
ALMOST_STRAIGHT = 0.05

STIFF_POINTS = 60


@dataclass(frozen=True)
class Setting:
    """What is compared. SI; stiffness in N m/rad, on the relative angle.

    ``speeds`` bound the branches, ``compared`` are the mean speeds of profiles and sweeps over
    stiffness, which reach from ``softest`` to ``stiffest``.
    """

    energy: float = 290.0
    height: float = 0.32
    speeds: tuple[float, float] = (2.4, 4.7)
    stiffnesses: tuple[float, ...] = (200.0, 220.0, 240.0, 260.0)
    compared: tuple[float, ...] = (4.0, 4.25, 4.5)
    softest: float = 20.0
    stiffest: float = 1e6


@dataclass(frozen=True)
class Specimen:
    """One body with its branch of gaits over mean speed; ``stiffness`` None if it does not bend."""

    body: str
    stiffness: float | None
    branch: Branch
    _known: dict[float, BranchPoint | None] = field(default_factory=dict, repr=False)

    @property
    def label(self) -> str:
        """Such as ``flexible, k_t = 260 N m/rad``."""
        if self.stiffness is None:
            return self.body
        return f"{self.body}, k_t = {self.stiffness:g} N m/rad"

    def name_at(self, speed: float) -> str:
        """The name of its gait at a mean speed, such as ``flexible-260-at-4.5``."""
        body = self.body.replace(" ", "-")
        which = body if self.stiffness is None else f"{body}-{self.stiffness:g}"
        return f"{which}-at-{speed:g}"

    def at(self, speed: float) -> BranchPoint | None:
        """The gait at a mean speed, the first from the slow end where the branch folds."""
        if speed not in self._known:
            self._known[speed] = next(iter(self.branch.at(speed)), None)
        return self._known[speed]


@dataclass(frozen=True)
class StiffnessSweep:
    """Gaits over spine stiffness at one mean speed.

    ``branch`` continues the published gait; ``stiff`` are gaits of ever stiffer spines next to
    that of the locked one, ``locked``.
    """

    speed: float
    branch: Branch
    stiff: tuple[tuple[float, Gait, Stability], ...]
    locked: BranchPoint | None


@dataclass(frozen=True)
class SpineStudy:
    """All branches of the comparison."""

    setting: Setting
    specimens: tuple[Specimen, ...]
    sweeps: tuple[StiffnessSweep, ...]

    def specimen(self, body: str, stiffness: float | None = None) -> Specimen:
        """Return one of the specimens."""
        return next(s for s in self.specimens if (s.body, s.stiffness) == (body, stiffness))

    @property
    def flexible(self) -> tuple[Specimen, ...]:
        """The specimens that bend, softest first."""
        return tuple(s for s in self.specimens if s.stiffness is not None)

    def stiffest_at(self, speed: float) -> BranchPoint | None:
        """The gait of the stiffest spine that runs at a mean speed."""
        found = (point for s in reversed(self.flexible) if (point := s.at(speed)) is not None)
        return next(found, None)


def study_spines(
    setting: Setting,
    store: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> SpineStudy:
    """Trace every branch of the comparison.

    ``store`` is a directory that keeps the branches as they grow; a study that was interrupted
    goes on from there. Raises `ParameterError` where a setting has no gaits to compare.
    """
    _check(setting)
    steps = iter(range(1, 4 + len(setting.stiffnesses) + len(setting.compared)))
    whole = 3 + len(setting.stiffnesses) + len(setting.compared)

    def trace(gait: Gait, over: str, bounds: tuple[float, float], name: str) -> Branch:
        share = (next(steps) - 1) / whole
        if progress is not None:
            progress(name, share)
        file = None if store is None else store / f"{name.replace(' ', '-')}.jsonl"
        return trace_branch(gait, over, bounds=bounds, longest_step=STEP, store=file)

    specimens = [
        Specimen(body, None, trace(gait_of(body, setting), "mean_speed", setting.speeds, body))
        for body in (RIGID, LOCKED)
    ]
    flexible = gait_of(FLEXIBLE, setting)
    own = flexible.model.parameter_vector[flexible.model.parameter_names.index("spine.stiffness")]
    low, high = min(*setting.stiffnesses, own), max(*setting.stiffnesses, own)
    across = (
        trace(flexible, "spine.stiffness", (low, high), "over stiffness") if low < high else None
    )
    for stiffness in sorted(set(setting.stiffnesses)):
        found = [] if across is None else across.at(stiffness)
        gait = found[0].gait if found else flexible if stiffness == own else None
        if gait is None:
            raise ParameterError(
                f"k_t = {stiffness:g} N m/rad has no gait of the published family"
                f" ({'; '.join(across.ends) if across else ''})",
                "leave this stiffness out",
            )
        name = f"flexible {stiffness:g}"
        branch = trace(gait, "mean_speed", setting.speeds, name)
        specimens.append(Specimen(FLEXIBLE, stiffness, branch))
    study = SpineStudy(setting, tuple(specimens), ())
    sweeps = [
        sweep
        for speed in sorted(set(setting.compared))
        if (sweep := _sweep(study, speed, trace)) is not None
    ]
    return SpineStudy(setting, tuple(specimens), tuple(sweeps))


def _check(setting: Setting) -> None:
    low, high = setting.speeds
    if not 0 < low < high:
        raise ParameterError(f"speeds {low:g} to {high:g} are no range", "give low before high")
    if not setting.stiffnesses:
        raise ParameterError("no stiffness is given", "give at least one")
    for stiffness in setting.stiffnesses:
        if not 0 < stiffness < inf:
            raise ParameterError(
                f"stiffness {stiffness:g} is not usable", "give a number above zero, in N m/rad"
            )
    for speed in setting.compared:
        if not low <= speed <= high:
            raise ParameterError(
                f"speed {speed:g} to compare at is not within {low:g} to {high:g}",
                "give one within the speeds",
            )
    if not 0 < setting.softest < setting.stiffest:
        raise ParameterError(
            f"stiffnesses {setting.softest:g} to {setting.stiffest:g} are no range",
            "give the softest before the stiffest",
        )


def gait_of(body: str, setting: Setting) -> Gait:
    """The preset's gait, carried over to the energy, the height and the speeds of the setting."""
    gait = examine(load_model(PRESETS[body]))
    for over, low, high in (
        ("energy", setting.energy, setting.energy),
        ("height", setting.height, setting.height),
        ("mean_speed", *setting.speeds),
    ):
        value = min(max(gait.quantities[over], low), high)
        try:
            gait = carried(gait, over, value)
        except LostGaitError as lost:
            raise ParameterError(
                f"{body}: no gait of the published family at {over} = {value:g} ({lost})",
                f"give a value nearer to {gait.quantities[over]:g}",
            ) from None
    return gait


def _sweep(
    study: SpineStudy, speed: float, trace: Callable[[Gait, str, tuple[float, float], str], Branch]
) -> StiffnessSweep | None:
    """Follow the stiffest specimen that runs at this speed over all stiffnesses."""
    setting = study.setting
    start = study.stiffest_at(speed)
    if start is None:
        return None
    bounds = (setting.softest, setting.stiffest)
    branch = trace(start.gait, "spine.stiffness", bounds, f"over stiffness at {speed:g}")
    locked = study.specimen(LOCKED).at(speed)
    stiff = () if locked is None else tuple(_stiff(start.gait.model, locked.gait, setting))
    return StiffnessSweep(speed, branch, stiff, locked)


def _stiff(model: Model, locked: Gait, setting: Setting) -> Iterator[tuple[float, Gait, Stability]]:
    """Gaits of stiff spines next to the locked gait, stiffest first."""
    apex = locked.model.apex
    start = {
        "height": apex["height"],
        "fore_pitch": apex["pitch"],
        "hind_pitch": apex["pitch"],
        "speed": apex["speed"],
        "fore_pitch_rate": apex["pitch_rate"],
        "hind_pitch_rate": apex["pitch_rate"],
    }
    fixed = {"energy": setting.energy, "height": setting.height, "mean_speed": locked.mean_speed}
    softest = max(setting.softest, max(setting.stiffnesses))
    for stiffness in np.geomspace(setting.stiffest, softest, STIFF_POINTS):
        body = model.with_values(
            {"spine.stiffness": float(stiffness)}, apex=start, touchdown=locked.model.touchdown
        )
        problem = Problem(body, fixed, symmetric=True, tolerance=locked.tolerance)
        attempt = solve(problem, problem.point(body))
        if not attempt.solved:
            continue
        gait = examine(problem.at(attempt.point), tolerance=locked.tolerance)
        bend = abs(gait.model.apex["fore_pitch"] - gait.model.apex["hind_pitch"])
        if gait.flaw is None and bend < ALMOST_STRAIGHT:
            yield float(stiffness), gait, floquet_multipliers(gait)
