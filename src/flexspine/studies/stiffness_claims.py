"""The claims about what a stiffer spine does, judged by the sweeps over stiffness: 3, 4 and 5."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexspine.gaits.family import BranchPoint
from flexspine.gaits.gait import Gait
from flexspine.studies.comparison import NO_DIFFERENCE, peak
from flexspine.studies.spines import FLEXIBLE, LOCKED, RIGID, SpineStudy, StiffnessSweep
from flexspine.studies.verdict import DEPENDS, HOLDS, Verdict, decided

NO_SWEEP = "no speed at which to vary the stiffness"

# Relative; a stiff spine whose gait is this close to the locked one's behaves like it.
ALIKE = 0.01


def swept_name(stiffness: float, speed: float, side: str = "") -> str:
    """The name of a gait of a sweep."""
    return f"{FLEXIBLE}-{stiffness:.6g}{side}-at-{speed:g}"


def baselines(study: SpineStudy, speed: float) -> dict[str, Gait]:
    """The gaits of both baselines at a speed, by name."""
    found = {}
    for body in (RIGID, LOCKED):
        specimen = study.specimen(body)
        point = specimen.at(speed)
        if point is not None:
            found[specimen.name_at(speed)] = point.gait
    return found


@dataclass(frozen=True)
class _Sides:
    """A sweep's branch in two: it folds at its softest gait.

    ``published`` is the side from there on that the published gaits are on, ``other`` the rest.
    """

    published: tuple[BranchPoint, ...]
    other: tuple[BranchPoint, ...]

    @classmethod
    def of(cls, sweep: StiffnessSweep) -> _Sides:
        points = sweep.branch.points
        softest = min(range(len(points)), key=lambda i: points[i].value)
        return cls(points[softest:], points[:softest])


def _radius(point: BranchPoint) -> float:
    return point.stability.level_spectral_radius


def _force(point: BranchPoint) -> float:
    return peak(point.gait)


def gain(study: SpineStudy) -> Verdict:
    """Claim 3."""
    claim = "beyond some k_t there is no further gain"
    told, numbers, ends = [], {}, []
    runs: dict[str, Gait] = {}
    for sweep in study.sweeps:
        sides = _Sides.of(sweep)
        best, end = min(sides.published, key=_force), sides.published[-1]
        runs[swept_name(best.value, sweep.speed)] = best.gait
        text = f"at {sweep.speed:g} m/s peak GRF is least, {_force(best):.0f} N, at k_t = "
        text += f"{best.value:.0f} N m/rad on the published side of the branch"
        text += ", where that ends" if best is end else f", and {_force(end):.0f} N at its end"
        entry: dict[str, Any] = {"best_stiffness": best.value, "least_peak": _force(best)}
        entry["ends_at"] = end.value
        if sides.other:
            beyond = min(sides.other, key=_force)
            runs[swept_name(beyond.value, sweep.speed, "-beyond-the-fold")] = beyond.gait
            text += f" (beyond its fold {_force(beyond):.0f} N at {beyond.value:.0f})"
            entry["beyond_the_fold"] = {"stiffness": beyond.value, "least_peak": _force(beyond)}
        if sweep.stiff:
            stiffest, gait, _ = sweep.stiff[0]
            runs[swept_name(stiffest, sweep.speed)] = gait
            text += f"; the stiffest spine ({stiffest:.0e} N m/rad) bears {peak(gait):.0f} N"
            entry["stiffest_peak"] = peak(gait)
            ends.append(peak(gait) > _force(best) * (1 + NO_DIFFERENCE))
        told.append(text)
        numbers[f"{sweep.speed:g} m/s"] = entry
    verdict = decided(ends, [not ended for ended in ends])
    if verdict == HOLDS:
        told.append("it is no levelling off: the gait ends, and far stiffer spines bear more")
    return Verdict(3, claim, verdict, "; ".join(told) or NO_SWEEP, numbers, runs)


@dataclass(frozen=True)
class _StiffCase:
    """The stiffest spine at one speed against the locked and the published rigid body."""

    speed: float
    stiffness: float
    to_locked: float
    alike_from: float
    to_rigid: float | None
    radius: float
    locked_radius: float
    runs: Mapping[str, Gait]

    @property
    def numbers(self) -> dict[str, float | None]:
        return {
            "stiffness": self.stiffness,
            "peak_relative_to_locked": self.to_locked,
            "within_1_percent_from": self.alike_from,
            "peak_relative_to_rigid": self.to_rigid,
            "level_spectral_radius": self.radius,
            "locked_level_spectral_radius": self.locked_radius,
        }

    @property
    def less_stable(self) -> bool:
        return self.locked_radius < 1 - ALIKE < self.radius

    def told(self) -> str:
        text = (
            f"at {self.speed:g} m/s and k_t = {self.stiffness:.0e} N m/rad the peak GRF differs "
            f"from the locked spine's by {100 * self.to_locked:+.2g} % (within 1 % from "
            f"{self.alike_from:.0f} on)"
        )
        if self.to_rigid is not None:
            text += f" and from the published rigid body's by {100 * self.to_rigid:+.2g} %"
        return (
            f"{text}, the spectral radius on the energy level is {self.radius:.3f}, that of the "
            f"locked spine {self.locked_radius:.3f}"
        )


def _stiff_case(study: SpineStudy, sweep: StiffnessSweep) -> _StiffCase | None:
    if not sweep.stiff or sweep.locked is None:
        return None
    stiffness, gait, stability = sweep.stiff[0]
    locked, rigid = sweep.locked, study.specimen(RIGID).at(sweep.speed)
    of_locked = peak(locked.gait)
    return _StiffCase(
        speed=sweep.speed,
        stiffness=stiffness,
        to_locked=peak(gait) / of_locked - 1,
        alike_from=min(k for k, g, _ in sweep.stiff if abs(peak(g) / of_locked - 1) < ALIKE),
        to_rigid=None if rigid is None else peak(gait) / peak(rigid.gait) - 1,
        radius=stability.level_spectral_radius,
        locked_radius=locked.stability.level_spectral_radius,
        runs={swept_name(stiffness, sweep.speed): gait, **baselines(study, sweep.speed)},
    )


def stiff_limit(study: SpineStudy) -> Verdict:
    """Claim 4."""
    claim = "a very stiff spine behaves like the rigid body"
    cases = [case for sweep in study.sweeps if (case := _stiff_case(study, sweep)) is not None]
    runs = {name: gait for case in cases for name, gait in case.runs.items()}
    told = [case.told() for case in cases]
    alike_rigid = [case.to_rigid is not None and abs(case.to_rigid) < ALIKE for case in cases]
    alike_locked = [abs(case.to_locked) < ALIKE for case in cases]
    verdict = decided(alike_rigid, [not alike for alike in alike_locked])
    if not cases:
        told = ["no speed with a gait of the locked spine"]
    elif all(alike_locked) and not all(alike_rigid):
        verdict = DEPENDS
        told.append(
            "its forces are those of its own body with the spine locked, not of the published "
            "rigid one, which has another pitch inertia"
        )
    worse = [f"{case.speed:g}" for case in cases if case.less_stable]
    if worse:
        told.append(
            "an undamped spine keeps swinging, so that its gait is less stable than the locked one "
            f"at {', '.join(worse)} m/s"
        )
    numbers = {f"{case.speed:g} m/s": case.numbers for case in cases}
    return Verdict(4, claim, verdict, "; ".join(told), numbers, runs)


def stability(study: SpineStudy) -> Verdict:
    """Claim 5."""
    claim = "stability is best at moderate k_t"
    told, numbers = [], {}
    runs: dict[str, Gait] = {}
    interior, best_of_all = [], []
    for sweep in study.sweeps:
        side = _Sides.of(sweep).published
        best = min(side, key=_radius)
        interior.append(best is not side[0] and best is not side[-1])
        runs |= {swept_name(best.value, sweep.speed): best.gait, **baselines(study, sweep.speed)}
        text = f"at {sweep.speed:g} m/s the published side of the branch is least unstable at k_t "
        text += f"= {best.value:.0f} N m/rad (spectral radius on the energy level "
        text += f"{_radius(best):.3f})"
        entry: dict[str, Any] = {"best_stiffness": best.value}
        entry["level_spectral_radius"] = _radius(best)
        for baseline in (LOCKED, RIGID):
            point = study.specimen(baseline).at(sweep.speed)
            if point is not None:
                entry[baseline] = _radius(point)
                text += f", {baseline} {_radius(point):.3f}"
                best_of_all.append(_radius(best) < _radius(point))
        if sweep.stiff:
            stiffness, gait, of = min(sweep.stiff, key=lambda item: item[2].level_spectral_radius)
            radius = of.level_spectral_radius
            runs[swept_name(stiffness, sweep.speed)] = gait
            entry["best_next_to_locked"] = {"stiffness": stiffness, "level_spectral_radius": radius}
            text += f", next to the locked spine {radius:.3f} at k_t = {stiffness:.0f}"
            best_of_all.append(_radius(best) < radius)
        told.append(text)
        numbers[f"{sweep.speed:g} m/s"] = entry
    cases = [*interior, *best_of_all]
    verdict = decided(cases, [not case for case in cases])
    return Verdict(5, claim, verdict, "; ".join(told) or NO_SWEEP, numbers, runs)
