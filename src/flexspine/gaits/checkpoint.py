"""A branch on disk while it is being traced: one line a step, so that none is ever lost."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexspine.gaits.family import BranchPoint, Family
from flexspine.gaits.landmarks import Landmark
from flexspine.gaits.newton import Attempt
from flexspine.gaits.tracing import Tracing
from flexspine.workers.journal import Journal

KEYS = {"way", "points", "count", "marks", "step", "end"}


class Checkpoint:
    """The file of one branch; opening it reads what is there. Raises `OutputError`."""

    def __init__(self, path: Path, description: Mapping[str, Any]) -> None:
        self._journal = Journal(path, description, "a branch that was traced", _is_step)

    def add(self, way: int, before: Tracing, after: Tracing) -> None:
        """Append what one step in direction ``way`` has found."""
        line = {
            "way": way,
            "points": [_plain(p) for p in after.points[len(before.points) :]],
            "count": len(after.points),  # the last step may take back a point
            "marks": [
                {"kind": mark.kind, "detail": mark.detail, "at": _plain(mark.at)}
                for mark in after.marks[len(before.marks) :]
            ],
            "step": after.step,
            "end": after.end,
        }
        if not (line["points"] or line["marks"] or line["end"]):
            return  # a step that was only made shorter is found again as quickly
        self._journal.add(line)

    def resume(self, way: int, family: Family, tracing: Tracing) -> Tracing:
        """Return how far the direction ``way`` has come."""
        points, marks = list(tracing.points), list(tracing.marks)
        step, end = tracing.step, tracing.end
        for line in self._journal.lines:
            if line["way"] != way:
                continue
            points += [_revived(family, item) for item in line["points"]]
            del points[line["count"] :]
            marks += [
                Landmark(item["kind"], item["detail"], _revived(family, item["at"]))
                for item in line["marks"]
            ]
            step, end = line["step"], line["end"]
        return Tracing(tuple(points), tuple(marks), step, end)


def _is_step(line: Any) -> bool:
    if not (isinstance(line, dict) and line.keys() >= KEYS):
        return False
    items = [*line["points"], *(mark.get("at") for mark in line["marks"])]
    return all(isinstance(item, dict) and {"point", "tangent"} <= item.keys() for item in items)


def _plain(point: BranchPoint) -> dict[str, list[float]]:
    return {"point": point.point.tolist(), "tangent": point.tangent.tolist()}


def _revived(family: Family, item: Mapping[str, Any]) -> BranchPoint:
    point, tangent = np.array(item["point"]), np.array(item["tangent"])
    attempt = Attempt(point, family.problem.evaluate(point), 0, None, None)
    revived = family.visit(attempt, tangent)
    assert isinstance(revived, BranchPoint)
    return revived
