"""A walk as one JSON object: the result of ``flexspine trot``."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from flexspine._version import STAMP
from flexspine.control.walk_measures import WalkSummary
from flexspine.gaits.record import finite
from flexspine.models.robot_run import RobotRun


def walk_record(run: RobotRun, summary: WalkSummary) -> dict[str, Any]:
    """Return outcome, settings and measures, in SI units; None where there is no value."""
    return {
        **STAMP,
        "robot": run.robot.name,
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "advice": run.outcome.advice,
        "duration": run.trajectory.duration,
        "settings": finite(run.settings),
        "spine": {
            name: run.robot.numbers.get(f"spine.{name}")
            for name in ("stiffness", "damping", "rest")
        },
        "measures": finite(asdict(summary)),
        "tolerance": run.tolerance,
    }
