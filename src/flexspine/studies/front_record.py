"""Pareto fronts as rows of a table, and as one JSON object."""

from __future__ import annotations

from typing import Any

from flexspine._version import STAMP
from flexspine.gaits.gait_record import gait_record
from flexspine.gaits.record import finite
from flexspine.studies.objectives import COST, PEAK_GRF
from flexspine.studies.optimise import BY_PHASE, CONSTANT, Optimisation
from flexspine.studies.pareto import FrontPoint, gains
from flexspine.studies.tables import Row, gait_row


def point_name(spine: str, number: int) -> str:
    """What a gait of a front is called, such as ``by-phase-3``."""
    return f"{spine.replace(' ', '-')}-{number + 1}"


def front_rows(found: Optimisation) -> list[Row]:
    """Every gait of every front, in order; SI units, what varied by its name."""
    varied = dict.fromkeys(name for ranges in found.ranges.values() for name in ranges)
    return [
        {
            "spine": spine,
            "gait": point_name(spine, number),
            **{name: point.values[name] for name in (PEAK_GRF, COST)},
            **{name: _known(point)[name] for name in varied},
            **_certificate(point),
            **gait_row(point.gait, point.stability),
        }
        for spine, front in found.fronts.items()
        for number, point in enumerate(front.points)
    ]


def front_record(found: Optimisation) -> dict[str, Any]:
    """Return the fronts, what one has over the other, and what all began with, as JSON holds it.

    SI and radians; ``gains`` are by objective the shares by which stiffness by phase lowers it.
    """
    return {
        **STAMP,
        "mean_speed": found.reference.mean_speed,
        "minimised": list(found.minimise),
        "seed": found.seed,
        "told": found.told,
        "gains": _gains(found),
        "ranges": {
            spine: {name: list(ends) for name, ends in ranges.items()}
            for spine, ranges in found.ranges.items()
        },
        "reference": gait_record(found.reference),
        "fronts": {
            spine: {
                "points": [
                    {
                        "gait": point_name(spine, number),
                        "objectives": point.values,
                        "varied": {name: _known(point)[name] for name in found.ranges[spine]},
                        **finite(_certificate(point)),
                        "residual": point.gait.residual,
                        "phases": list(point.gait.phases),
                        "family": point.gait.family,
                        "period": point.gait.period,
                        "stable": point.stability.stable,
                        "floquet_multipliers": [
                            [value.real, value.imag] for value in point.stability.multipliers
                        ],
                        "multiplier_errors": finite(point.stability.errors.tolist()),
                    }
                    for number, point in enumerate(front.points)
                ],
                "refused": list(front.refused),
            }
            for spine, front in found.fronts.items()
        },
    }


def _known(point: FrontPoint) -> dict[str, float]:
    return {**point.gait.model.numbers, "energy": point.gait.energy}


def _certificate(point: FrontPoint) -> Row:
    """What bears a gait out besides its residual: the balance of energy, and of multipliers."""
    gait, summary = point.gait, point.gait.summary
    lost = gait.model.state_names.index("dissipated_energy")
    return {
        "net_work": float(sum(work.net for work in summary.work.values())),
        "dissipated": float(gait.run.trajectory.end.states[lost]),
        "relative_drift": summary.energy["relative_drift"],
        "largest_multiplier_error": float(point.stability.errors[0]),
    }


def _gains(found: Optimisation) -> dict[str, list[float]] | None:
    """By objective, the shares by which stiffness by phase lowers it, point by point."""
    if not {CONSTANT, BY_PHASE} <= found.fronts.keys():
        return None
    fronts = found.fronts[CONSTANT], found.fronts[BY_PHASE]
    return {goal: gains(*fronts, goal) for goal in found.minimise}
