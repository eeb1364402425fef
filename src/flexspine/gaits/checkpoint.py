"""A branch on disk while it is being traced: one line a step, so that none is ever lost.

The file is made of JSON lines. The first describes what is traced; each further one adds what a
step has found. A last line that was cut off by a crash is dropped.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexspine.errors import OUT_OF_SPACE, OutputError
from flexspine.gaits.family import BranchPoint, Family
from flexspine.gaits.landmarks import Landmark
from flexspine.gaits.newton import Attempt
from flexspine.gaits.tracing import Tracing

KEYS = {"way", "points", "count", "marks", "step", "end"}


class Checkpoint:
    """The file of one branch; opening it reads what is there. Raises `OutputError`."""

    def __init__(self, path: Path, description: Mapping[str, Any]) -> None:
        self.path = path
        self._lines: list[dict[str, Any]] = []
        header = json.loads(json.dumps(description))
        try:
            if path.exists():
                self._read(header)
            else:
                path.write_text(json.dumps(header) + "\n", encoding="utf-8")
        except OSError as failure:
            if failure.errno in OUT_OF_SPACE:
                raise
            raise OutputError(
                f"cannot use '{path}' ({failure.strerror})", "give another place"
            ) from None

    def _read(self, header: dict[str, Any]) -> None:
        rest = ""
        try:
            whole, _, rest = self.path.read_text(encoding="utf-8").rpartition("\n")
            first, *lines = [json.loads(line) for line in whole.splitlines()] or [None]
        except ValueError:
            first, lines = None, []
        if first != header or not all(map(_is_step, lines)):
            raise OutputError(
                f"'{self.path}' is damaged, or holds a branch that was traced with other settings",
                "give another place, or delete it to begin anew",
            )
        if rest:
            self.path.write_text(whole + "\n", encoding="utf-8")
        self._lines = lines

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
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")

    def resume(self, way: int, family: Family, tracing: Tracing) -> Tracing:
        """Return how far the direction ``way`` has come."""
        points, marks = list(tracing.points), list(tracing.marks)
        step, end = tracing.step, tracing.end
        for line in self._lines:
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
