"""The claims of the published study, put to the test with the study's own gaits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import Any

from flexspine.gaits.gait import Gait
from flexspine.studies.comparison import NO_DIFFERENCE, common_speeds, compare, peak
from flexspine.studies.spines import LOCKED, RIGID, Specimen, SpineStudy, Sweep

HOLDS, FAILS, DEPENDS = "holds", "fails", "depends on"

NO_SWEEP = "no speed was given at which to vary the stiffness"

# Relative; a stiff spine whose gait is this close to the locked one's behaves like it.
ALIKE = 0.01


@dataclass(frozen=True)
class Verdict:
    """What the runs say about a claim: ``holds``, ``fails`` or ``depends on``.

    ``finding`` says it in words with the numbers; ``numbers`` are these for machines, ``runs`` the
    gaits behind it by label and mean speed.
    """

    number: int
    claim: str
    verdict: str
    finding: str
    numbers: dict[str, Any] = field(default_factory=dict)
    runs: tuple[tuple[str, float], ...] = ()


def verdicts(study: SpineStudy) -> list[Verdict]:
    """Judge claims 1 to 7 and 9."""
    judges = (_peaks, _stiffness, _gain, _stiff_limit, _stability, _oscillation, _shares, _length)
    return [judge(study) for judge in judges]


def _runs(study: SpineStudy, speeds: Iterable[float]) -> tuple[tuple[str, float], ...]:
    return tuple(
        (specimen.label, speed)
        for speed in speeds
        for specimen in study.specimens
        if specimen.at(speed) is not None
    )


def _against_both(
    study: SpineStudy,
    number: int,
    claim: str,
    what: str,
    measure: Callable[[Gait], float],
    *,
    lower: bool,
) -> Verdict:
    """A claim that a measure is always lower (or higher) than that of the rigid body."""
    pair = [compare(study, measure, baseline) for baseline in (RIGID, LOCKED)]
    kept = [(c.below if lower else c.above) for c in pair]
    broken = [(c.above if lower else c.below) for c in pair]
    counts = [len(c.ratios) for c in pair]
    if not all(counts):
        verdict = DEPENDS
    elif all(k == n for k, n in zip(kept, counts, strict=True)):
        verdict = HOLDS
    elif all(b == n for b, n in zip(broken, counts, strict=True)):
        verdict = FAILS
    else:
        verdict = DEPENDS
    return Verdict(
        number,
        claim,
        verdict,
        "; ".join(comparison.told(what) for comparison in pair),
        {comparison.baseline: comparison.numbers for comparison in pair},
        _runs(study, study.setting.compared),
    )


def _peaks(study: SpineStudy) -> Verdict:
    claim = "at equal energy and speed the flexible body's peak GRF is below the rigid body's"
    return _against_both(study, 1, claim, "peak GRF", peak, lower=True)


def _stiffness(study: SpineStudy) -> Verdict:
    low, high = (study.flexible[i].stiffness for i in (0, -1))
    claim = f"peak GRF falls as k_t rises from {low:g} to {high:g} N m/rad"
    falls: list[tuple[float, float, float]] = []
    rises: list[tuple[float, float, float]] = []
    for speed in common_speeds(study):
        points = [specimen.at(speed) for specimen in study.flexible]
        peaks = [peak(point.gait) for point in points if point is not None]
        if len(peaks) < 2:
            continue
        change = peaks[-1] / peaks[0] - 1
        monotone = all(b < a for a, b in pairwise(peaks))
        (falls if monotone else rises).append((speed, peaks[0], change))
    told = []
    for word, cases in (("falls", falls), ("does not fall throughout", rises)):
        if cases:
            speeds = [speed for speed, *_ in cases]
            changes = [100 * change for *_, change in cases]
            told.append(
                f"{word} at {len(cases)} speeds, {min(speeds):.2f} to {max(speeds):.2f} m/s "
                f"(change {min(changes):.1f} % to {max(changes):.1f} %)"
            )
    verdict = HOLDS if falls and not rises else FAILS if rises and not falls else DEPENDS
    numbers = {"falls_at": [s for s, *_ in falls], "does_not_fall_at": [s for s, *_ in rises]}
    finding = "; ".join(told) or "fewer than two stiffnesses share a speed"
    return Verdict(2, claim, verdict, finding, numbers, _runs(study, study.setting.compared))


def _near(sweep: Sweep) -> list[tuple[float, float, float]]:
    """Stiffness, peak GRF and spectral radius of the continued gaits, on the published side.

    The branch over stiffness folds; the published gaits lie on the piece that reaches the stiff
    end, from its softest point on.
    """
    points = list(sweep.branch.points)
    softest = min(range(len(points)), key=lambda i: points[i].value)
    return [
        (point.value, peak(point.gait), point.stability.level_spectral_radius)
        for point in points[softest:]
    ]


def _gain(study: SpineStudy) -> Verdict:
    claim = "beyond some k_t there is no further gain"
    told, numbers, holds = [], {}, []
    for sweep in study.sweeps:
        near = _near(sweep)
        best = min(near, key=lambda item: item[1])
        end = near[-1]
        text = f"at {sweep.speed:g} m/s the continued gait bears least, {best[1]:.0f} N, at k_t = "
        text += f"{best[0]:.0f} N m/rad"
        text += ", where it ends" if best == end else f", and {end[1]:.0f} N at its stiff end"
        entry: dict[str, Any] = {"best_stiffness": best[0], "least_peak": best[1]}
        entry["stiff_end"] = end[0]
        if sweep.stiff:
            stiffest, gait, _ = sweep.stiff[0]
            text += f"; the stiffest spine ({stiffest:.0e} N m/rad) bears {peak(gait):.0f} N"
            entry["stiffest_peak"] = peak(gait)
            holds.append(peak(gait) > best[1] * (1 + NO_DIFFERENCE))
        told.append(text)
        numbers[f"{sweep.speed:g} m/s"] = entry
    verdict = HOLDS if holds and all(holds) else FAILS if holds and not any(holds) else DEPENDS
    return Verdict(
        3,
        claim,
        verdict,
        "; ".join(told) or NO_SWEEP,
        numbers,
        _runs(study, study.setting.compared),
    )


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


def _stiff_case(study: SpineStudy, sweep: Sweep) -> _StiffCase | None:
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
    )


def _stiff_limit(study: SpineStudy) -> Verdict:
    claim = "a very stiff spine behaves like the rigid body"
    cases = [case for sweep in study.sweeps if (case := _stiff_case(study, sweep)) is not None]
    told = [case.told() for case in cases]
    alike_rigid = [case.to_rigid is not None and abs(case.to_rigid) < ALIKE for case in cases]
    alike_locked = [abs(case.to_locked) < ALIKE for case in cases]
    if not cases:
        verdict, told = DEPENDS, ["no speed with a gait of the locked spine"]
    elif all(alike_rigid):
        verdict = HOLDS
    elif all(alike_locked):
        verdict = DEPENDS
        told.append(
            "its forces are those of its own body with the spine locked, not of the published "
            "rigid one, which has another pitch inertia"
        )
    else:
        verdict = FAILS
    worse = [f"{case.speed:g}" for case in cases if case.less_stable]
    if worse:
        told.append(
            "an undamped spine keeps swinging, so that its gait is less stable than the locked one "
            f"at {', '.join(worse)} m/s"
        )
    numbers = {f"{case.speed:g} m/s": asdict(case) for case in cases}
    return Verdict(
        4, claim, verdict, "; ".join(told), numbers, _runs(study, study.setting.compared)
    )


def _stability(study: SpineStudy) -> Verdict:
    claim = "stability is best at moderate k_t"
    told, numbers = [], {}
    interior, best_of_all = [], []
    for sweep in study.sweeps:
        near = _near(sweep)
        best = min(near, key=lambda item: item[2])
        interior.append(near[0][0] < best[0] < near[-1][0])
        text = f"at {sweep.speed:g} m/s the continued gait is least unstable at k_t = {best[0]:.0f}"
        text += f" N m/rad (spectral radius on the energy level {best[2]:.3f})"
        entry: dict[str, Any] = {"best_stiffness": best[0], "level_spectral_radius": best[2]}
        for baseline in (LOCKED, RIGID):
            point = study.specimen(baseline).at(sweep.speed)
            if point is not None:
                radius = point.stability.level_spectral_radius
                entry[baseline] = radius
                text += f", {baseline} {radius:.3f}"
                best_of_all.append(best[2] < radius)
        if sweep.stiff:
            stiff = min(sweep.stiff, key=lambda item: item[2].level_spectral_radius)
            radius = stiff[2].level_spectral_radius
            entry["best_next_to_locked"] = {"stiffness": stiff[0], "level_spectral_radius": radius}
            text += f", next to the locked spine {radius:.3f} at k_t = {stiff[0]:.0f}"
            best_of_all.append(best[2] < radius)
        told.append(text)
        numbers[f"{sweep.speed:g} m/s"] = entry
    if all(interior) and all(best_of_all) and interior:
        verdict = HOLDS
    elif interior and not any(interior) and not any(best_of_all):
        verdict = FAILS
    else:
        verdict = DEPENDS
    return Verdict(
        5,
        claim,
        verdict,
        "; ".join(told) or NO_SWEEP,
        numbers,
        _runs(study, study.setting.compared),
    )


def _oscillation(study: SpineStudy) -> Verdict:
    claim = "the flexible body's CoM oscillates less"
    what = "CoM amplitude (highest minus lowest)"
    return _against_both(study, 6, claim, what, lambda gait: gait.com_amplitude, lower=True)


def _shares(study: SpineStudy) -> Verdict:
    claim = "the spine stores energy and lowers the gravitational share at the apex"
    speed = max(study.setting.compared, default=study.setting.speeds[1])
    told, numbers = [], {}
    stores = []
    specimen: Specimen
    for specimen in study.specimens:
        point = specimen.at(speed)
        if point is None:
            continue
        shares = point.gait.apex_energy_shares
        numbers[specimen.label] = shares
        if specimen.stiffness is not None:
            stores.append(shares["spine"])
        told.append(
            f"{specimen.label}: gravity {100 * shares['gravity']:.2f} %, spine "
            f"{100 * shares['spine']:.2f} %, kinetic {100 * shares['kinetic']:.2f} %"
        )
    note = (
        "; the spine stores energy, but at equal energy and apex height the gravitational share is "
        "fixed by the setting, whatever the spine: what it holds comes from the kinetic share"
    )
    stored = bool(stores) and min(stores) > NO_DIFFERENCE
    verdict = DEPENDS if stored else FAILS
    return Verdict(
        7, claim, verdict, f"at {speed:g} m/s, at the apex: {'; '.join(told)}{note * stored}",
        numbers, _runs(study, [speed]),
    )  # fmt: skip


def _length(study: SpineStudy) -> Verdict:
    claim = "a flexible spine lengthens the stride"
    return _against_both(
        study, 9, claim, "stride length", lambda gait: gait.stride_length, lower=False
    )
