"""A run as one JSON object: the result of ``flexspine bound``."""

from __future__ import annotations

from math import isfinite
from typing import Any

from flexspine._version import STAMP
from flexspine.gaits.measures import summarize
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
        **STAMP,
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
        "work": {name: each._asdict() for name, each in summary.work.items()},
        "cost_of_transport": summary.cost_of_transport,
        "apexes": run.apexes,
        "parameters": values(run.model.parameters),
        "touchdown_angles": dict(run.model.touchdown),
        "tolerance": run.tolerance,
    }
    return {key: finite(value) for key, value in record.items()}


def finite(value: Any) -> Any:
    """Replace what JSON cannot hold by None."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, float) and not isfinite(value):
        return None
    return value
