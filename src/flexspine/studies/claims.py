"""The claims of the published study, put to the test with the study's own gaits."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from flexspine.gaits.gait import Gait
from flexspine.studies import stiffness_claims
from flexspine.studies.comparison import NO_DIFFERENCE, common_speeds, compare, peak
from flexspine.studies.spines import LOCKED, RIGID, SpineStudy
from flexspine.studies.verdict import DEPENDS, FAILS, UNDECIDED, Verdict, decided


def verdicts(study: SpineStudy) -> list[Verdict]:
    """Judge claims 1 to 7 and 9."""
    judges = (
        _peaks,
        _stiffness,
        stiffness_claims.gain,
        stiffness_claims.stiff_limit,
        stiffness_claims.stability,
        _oscillation,
        _shares,
        _length,
    )
    return [judge(study) for judge in judges]


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
    counts = [len(comparison.ratios) for comparison in pair]
    below = [c.below == n for c, n in zip(pair, counts, strict=True)]
    above = [c.above == n for c, n in zip(pair, counts, strict=True)]
    verdict = decided(below, above) if lower else decided(above, below)
    return Verdict(
        number,
        claim,
        verdict if all(counts) else UNDECIDED,
        "; ".join(comparison.told(what) for comparison in pair),
        {comparison.baseline: comparison.numbers for comparison in pair},
        {name: gait for comparison in pair for name, gait in comparison.quoted(study).items()},
    )


def _peaks(study: SpineStudy) -> Verdict:
    claim = "at equal energy and speed the flexible body's peak GRF is below the rigid body's"
    return _against_both(study, 1, claim, "peak GRF", peak, lower=True)


def _stiffness(study: SpineStudy) -> Verdict:
    low, high = (study.flexible[i].stiffness for i in (0, -1))
    claim = f"peak GRF falls as k_t rises from {low:g} to {high:g} N m/rad"
    falls: dict[float, float] = {}
    rises: dict[float, float] = {}
    runs: dict[str, Gait] = {}
    for speed in common_speeds(study):
        found = [(s, point) for s in study.flexible if (point := s.at(speed)) is not None]
        if len(found) < 2:
            continue
        peaks = [peak(point.gait) for _, point in found]
        monotone = all(b < a for a, b in pairwise(peaks))
        (falls if monotone else rises)[speed] = 100 * (peaks[-1] / peaks[0] - 1)
        if speed in study.setting.compared:
            runs |= {specimen.name_at(speed): point.gait for specimen, point in found}
    told = [
        f"{word} at {len(changes)} speeds, {min(changes):.2f} to {max(changes):.2f} m/s (change "
        f"{min(changes.values()):.1f} % to {max(changes.values()):.1f} %)"
        for word, changes in (("falls", falls), ("does not fall throughout", rises))
        if changes
    ]
    cases = [True] * len(falls) + [False] * len(rises)
    verdict = decided(cases, [not case for case in cases])
    numbers = {"falls_at": list(falls), "does_not_fall_at": list(rises)}
    finding = "; ".join(told) or "fewer than two stiffnesses share a speed"
    return Verdict(2, claim, verdict, finding, numbers, runs)


def _oscillation(study: SpineStudy) -> Verdict:
    claim = "the flexible body's CoM oscillates less"
    what = "CoM amplitude (highest minus lowest)"
    return _against_both(study, 6, claim, what, lambda gait: gait.com_amplitude, lower=True)


def _shares(study: SpineStudy) -> Verdict:
    claim = "the spine stores energy and lowers the gravitational share at the apex"
    speed = max(study.setting.compared, default=study.setting.speeds[1])
    told, numbers, stores = [], {}, []
    runs: dict[str, Gait] = {}
    for specimen in study.specimens:
        point = specimen.at(speed)
        if point is None:
            continue
        shares = point.gait.apex_energy_shares
        numbers[specimen.label] = shares
        runs[specimen.name_at(speed)] = point.gait
        if specimen.stiffness is not None:
            stores.append(shares["spine"] > NO_DIFFERENCE)
        told.append(
            f"{specimen.label}: gravity {100 * shares['gravity']:.2f} %, spine "
            f"{100 * shares['spine']:.2f} %, kinetic {100 * shares['kinetic']:.2f} %"
        )
    finding = f"at {speed:g} m/s, at the apex: {'; '.join(told) or 'no flexible body runs'}"
    if all(stores) and stores:
        finding += (
            "; the spine stores energy, but at equal energy and apex height the gravitational "
            "share is fixed by the setting, whatever the spine: what it holds comes from the "
            "kinetic share"
        )
    verdict = UNDECIDED if not stores else DEPENDS if any(stores) else FAILS
    return Verdict(7, claim, verdict, finding, numbers, runs)


def _length(study: SpineStudy) -> Verdict:
    claim = "a flexible spine lengthens the stride"
    return _against_both(
        study, 9, claim, "stride length", lambda gait: gait.stride_length, lower=False
    )
