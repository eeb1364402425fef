"""Gaits and branches as JSON objects: the results of ``flexspine gait`` and ``branch``."""

from __future__ import annotations

from typing import Any

from flexspine._version import STAMP
from flexspine.gaits.continuation import Branch
from flexspine.gaits.family import BranchPoint
from flexspine.gaits.gait import Gait
from flexspine.gaits.record import finite
from flexspine.gaits.stability import Stability, floquet_multipliers
from flexspine.models.legs import SIDES
from flexspine.parameters import values


def gait_record(gait: Gait, stability: Stability | None = None) -> dict[str, Any]:
    """Return a gait with everything needed to run it again; SI and radians.

    ``floquet_multipliers`` are pairs [re, im], largest first, at fixed touchdown angles;
    ``modes`` tells of each its error bar, condition number and what its eigenvector moves.
    """
    stability = stability or floquet_multipliers(gait)
    summary, model = gait.summary, gait.model
    record = {
        **STAMP,
        "preset": model.name,
        "model": model.kind.name,
        "parameters": values(model.parameters),
        "family": gait.family,
        "symmetric": gait.symmetric,
        "strides": gait.strides,
        "apex": dict(model.apex),
        "touchdown_angles": gait.touchdown_angles,
        "liftoff_angles": gait.liftoff_angles,
        "phases": list(gait.phases),
        "period": gait.period,
        "stride_length": gait.stride_length,
        "mean_speed": gait.mean_speed,
        "energy": gait.energy,
        "peak_grf": gait.peak_grf,
        "peak_grf_vertical": summary.peak_grf_vertical,
        "duty_factor": summary.duty_factor or dict.fromkeys(SIDES),
        "com_amplitude": gait.com_amplitude,
        "work": {name: each._asdict() for name, each in summary.work.items()},
        "cost_of_transport": summary.cost_of_transport,
        "energy_shares": {"apex": gait.apex_energy_shares, "mean": gait.mean_energy_shares},
        "floquet_multipliers": [[value.real, value.imag] for value in stability.multipliers],
        "spectral_radius": stability.spectral_radius,
        "level_spectral_radius": stability.level_spectral_radius,
        "stable": stability.stable,
        "modes": [
            {"error": float(error), "condition_number": float(condition), "moves": shares}
            for error, condition, shares in zip(
                stability.errors,
                stability.condition_numbers,
                map(stability.shares, range(len(stability.multipliers))),
                strict=True,
            )
        ],
        "energy_identity": stability.energy_identity,
        "residual": gait.residual,
        "confirmed": gait.confirmed,
        "doubt": gait.doubt,
        "tolerance": gait.tolerance,
    }
    return {key: finite(value) for key, value in record.items()}


def branch_record(branch: Branch) -> dict[str, Any]:
    """Return a branch: its points as gaits, what happens on it, why it ends.

    Each point names the value of what the branch is followed in and those of free parameters.
    """

    def record(point: BranchPoint) -> dict[str, Any]:
        numbers = point.gait.model.numbers
        freed = {name: numbers[name] for name in branch.free}
        return {branch.over: point.value, **freed, **gait_record(point.gait, point.stability)}

    return {
        **STAMP,
        "over": branch.over,
        "fixed": dict(branch.family.problem.fixed),
        "free": list(branch.free),
        "symmetric": branch.family.problem.symmetric,
        "ends": list(branch.ends),
        "landmarks": [
            {"kind": mark.kind, "value": mark.value, "detail": mark.detail, "gait": record(mark.at)}
            for mark in branch.landmarks
        ],
        "points": [record(point) for point in branch.points],
    }
