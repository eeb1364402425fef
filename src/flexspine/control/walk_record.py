"""A walk as one JSON object: the result of ``flexspine trot``."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import Any

from flexspine._version import SCHEMA_VERSION
from flexspine.control.walk_measures import WalkSummary
from flexspine.models.robot_run import RobotRun


def walk_record(run: RobotRun, summary: WalkSummary) -> dict[str, Any]:
    """Return outcome, settings and measures, in SI units; None where there is no value."""
    return {
        "schema_version": SCHEMA_VERSION,
        "robot": run.robot.name,
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "advice": run.outcome.advice,
        "duration": run.trajectory.duration,
        "settings": {key: _plain(value) for key, value in run.settings.items()},
        "spine": {
            name: run.robot.numbers.get(f"spine.{name}")
            for name in ("stiffness", "damping", "rest")
        },
        "measures": {key: _plain(value) for key, value in asdict(summary).items()},
        "tolerance": run.tolerance,
    }


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value
