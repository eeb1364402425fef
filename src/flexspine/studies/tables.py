"""The study's gaits as tables: one row a gait, SI units, and how tables are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any

from flexspine.gaits.gait import ENERGIES, Gait
from flexspine.gaits.stability import Stability
from flexspine.models.legs import SIDES
from flexspine.studies.damping import DAMPING, STIFFNESS, DampingStudy, cost
from flexspine.studies.spines import FLEXIBLE, LOCKED, SpineStudy

Row = dict[str, Any]

CONTINUED, STIFF = "continued from the published gait", "next to the locked spine"


def gait_row(gait: Gait, stability: Stability) -> Row:
    """The scalar measures of a gait. Forces in N per pair of legs, angles in rad."""
    summary = gait.summary
    duty = summary.duty_factor or {}
    return {
        "mean_speed": gait.mean_speed,
        "energy": gait.energy,
        **{f"apex_{name}": value for name, value in _apex(gait).items()},
        "phases": "-".join(gait.phases),
        "family": gait.family,
        **{f"peak_grf_{side}": gait.peak_grf[side] for side in SIDES},
        **{f"peak_grf_vertical_{side}": summary.peak_grf_vertical[side] for side in SIDES},
        "com_amplitude": gait.com_amplitude,
        "period": gait.period,
        "stride_length": gait.stride_length,
        **{f"duty_factor_{side}": duty.get(side) for side in SIDES},
        **{f"apex_share_{kind}": gait.apex_energy_shares[kind] for kind in ENERGIES},
        **{f"mean_share_{kind}": gait.mean_energy_shares[kind] for kind in ENERGIES},
        "floquet_multipliers": " ".join(f"{value:.12g}" for value in stability.multipliers),
        "spectral_radius": stability.spectral_radius,
        "level_spectral_radius": stability.level_spectral_radius,
        "stable": stability.stable,
        "energy_identity": stability.energy_identity,
        "residual": gait.residual,
        "confirmed": gait.confirmed,
        **{f"touchdown_{side}": gait.touchdown_angles[side] for side in SIDES},
        **{f"liftoff_{side}": gait.liftoff_angles[side] for side in SIDES},
    }


def _apex(gait: Gait) -> dict[str, float]:
    """The apex, with a rigid body's pitch as that of both its ends, so that all rows are alike."""
    apex = gait.model.apex
    names = ("height", "speed", *(f"{side}_pitch" for side in SIDES))
    names += tuple(f"{side}_pitch_rate" for side in SIDES)
    return {n: apex[n] if n in apex else apex[n.partition("_")[2]] for n in names}


def gaits_table(study: SpineStudy) -> list[Row]:
    """Every gait of every branch over mean speed, in order along each branch."""
    return [
        {
            "body": specimen.body,
            "spine_stiffness": specimen.stiffness,
            "position": position,
            **gait_row(point.gait, point.stability),
        }
        for specimen in study.specimens
        for position, point in enumerate(specimen.branch.points)
    ]


def stiffness_table(study: SpineStudy) -> list[Row]:
    """Every gait of the sweeps over stiffness, and the locked one at each speed."""
    rows: list[Row] = []

    def add(speed: float, kind: str, stiffness: float | None, gait: Gait, of: Stability) -> None:
        head = {"speed": speed, "kind": kind, "spine_stiffness": stiffness}
        rows.append({**head, **gait_row(gait, of)})

    for sweep in study.sweeps:
        for point in sweep.branch.points:
            add(sweep.speed, CONTINUED, point.value, point.gait, point.stability)
        for stiffness, gait, stability in sweep.stiff:
            add(sweep.speed, STIFF, stiffness, gait, stability)
        if sweep.locked is not None:
            add(sweep.speed, LOCKED, None, sweep.locked.gait, sweep.locked.stability)
    return rows


def damping_table(study: DampingStudy) -> list[Row]:
    """The measured gaits of damped spines, in order along each branch.

    ``amplitude`` is the actuator's, in m or as a share of leg stiffness; work in J per stride.
    """
    rows: list[Row] = []
    for damped in (*study.over_damping, *study.over_stiffness):
        for position, point in enumerate(damped.points):
            numbers, work = point.gait.model.numbers, point.gait.summary.work.values()
            head = {
                "over": damped.branch.over,
                "speed": damped.speed,
                "actuator": damped.actuator,
                "position": position,
                "spine_stiffness": numbers[STIFFNESS],
                "spine_damping": numbers[DAMPING],
                "amplitude": numbers[damped.actuator],
                "cost_of_transport": cost(point.gait),
                "positive_work": sum(each.positive for each in work),
                "net_work": sum(each.net for each in work),
            }
            rows.append({**head, **gait_row(point.gait, point.stability)})
    return rows


def landmarks_table(study: SpineStudy, damping: DampingStudy | None = None) -> list[Row]:
    """What happens on every branch, and why it ends."""
    branches = [(s.label, s.branch) for s in study.specimens]
    branches += [(f"{FLEXIBLE}, {w.speed:g} m/s", w.branch) for w in study.sweeps]
    damped = (*damping.over_damping, *damping.over_stiffness) if damping else ()
    branches += [(each.label, each.branch) for each in damped]
    rows: list[Row] = []
    for label, branch in branches:
        rows += [
            {
                "branch": label,
                "over": branch.over,
                "kind": mark.kind,
                "value": mark.value,
                "detail": mark.detail,
            }
            for mark in branch.landmarks
        ]
        rows += [
            {"branch": label, "over": branch.over, "kind": "end", "value": p.value, "detail": why}
            for p, why in zip((branch.points[0], branch.points[-1]), branch.ends, strict=True)
        ]
    return rows


def known(value: float) -> float | None:
    """Return a number as tables have it, None for NaN and infinities."""
    return float(value) if isfinite(value) else None


def published_readings() -> list[Row]:
    """The readings of the published figure: body, spine_stiffness, mean_speed, peak_grf.

    By eye from Fig. 4 of Kamimura et al. 2015; 8 N and 0.02 m/s either way.
    """
    text = (files("flexspine") / "studies" / "published.csv").read_text(encoding="utf-8")
    lines = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    return [
        {
            "body": body,
            "spine_stiffness": float(stiffness) if stiffness else None,
            "mean_speed": float(speed),
            "peak_grf": float(peak),
        }
        for body, stiffness, speed, peak in lines
    ]


def write_table(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write a table as Parquet or CSV, told by the suffix."""
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    table = pa.Table.from_pylist([dict(row) for row in rows])
    if path.suffix == ".parquet":
        pa.parquet.write_table(table, path)
    else:
        pa.csv.write_csv(table, path)
