"""Runs, gaits and branches as JSON objects, the results of the command line."""

from __future__ import annotations

from math import isfinite
from typing import Any

from flexspine._version import SCHEMA_VERSION
from flexspine.gaits.continuation import Branch
from flexspine.gaits.family import BranchPoint
from flexspine.gaits.gait import Gait
from flexspine.gaits.measures import summarize
from flexspine.gaits.stability import Stability, floquet_multipliers
from flexspine.models.legs import SIDES
from flexspine.models.simulation import Run
from flexspine.parameters import values


def run_record(run: Run) -> dict[str, Any]:
    """Return the run's outcome and measures; SI and radians, None where there is no value.

    ``period``, ``duty_factor``, ``stride_length``, ``stride_frequency`` and ``froude`` are of the
    last completed stride, everything else of the whole run.
    """
    summary = summarize(run)
    spine = summary.spine_range
    record = {
        "schema_version": SCHEMA_VERSION,
        "preset": run.model.name,
        "model": run.model.kind.name,
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "advice": run.outcome.advice,
        "strides": len(run.trajectory.crossings),
        "duration": run.trajectory.duration,
        "phases": list(run.phases),
        "period": summary.period,
        "distance": summary.distance,
        "mean_speed": summary.mean_speed,
        "peak_grf": summary.peak_grf,
        "peak_grf_vertical": summary.peak_grf_vertical,
        "duty_factor": summary.duty_factor or dict.fromkeys(SIDES),
        "stride_length": summary.stride_length,
        "stride_frequency": summary.stride_frequency,
        "froude": summary.froude,
        "spine_range": None if spine is None else {"min": spine[0], "max": spine[1]},
        "energy": summary.energy,
        "apexes": run.apexes,
        "touchdown_angles": dict(run.model.touchdown),
        "tolerance": run.tolerance,
    }
    return {key: _finite(value) for key, value in record.items()}


def gait_record(gait: Gait, stability: Stability | None = None) -> dict[str, Any]:
    """Return a gait with everything needed to run it again; SI and radians.

    ``floquet_multipliers`` are pairs [re, im], largest first, at fixed touchdown angles;
    ``modes`` tells of each its error bar, condition number and what its eigenvector moves.
    """
    stability = stability or floquet_multipliers(gait)
    summary, model = gait.summary, gait.model
    record = {
        "schema_version": SCHEMA_VERSION,
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
    return {key: _finite(value) for key, value in record.items()}


def branch_record(branch: Branch) -> dict[str, Any]:
    """Return a branch: its points as gaits, what happens on it, why it ends."""

    def record(point: BranchPoint) -> dict[str, Any]:
        return {branch.over: point.value, **gait_record(point.gait, point.stability)}

    return {
        "schema_version": SCHEMA_VERSION,
        "over": branch.over,
        "fixed": dict(branch.family.problem.fixed),
        "symmetric": branch.family.problem.symmetric,
        "ends": list(branch.ends),
        "landmarks": [
            {"kind": mark.kind, "value": mark.value, "detail": mark.detail, "gait": record(mark.at)}
            for mark in branch.landmarks
        ],
        "points": [record(point) for point in branch.points],
    }


def _finite(value: Any) -> Any:
    """Replace what JSON cannot hold by None."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not isfinite(value):
        return None
    return value
