"""Figures of walks with flexible and locked spines."""

from __future__ import annotations

import numpy as np

from flexspine.report.walks_figure import plot_walks
from flexspine.studies.walk_map import MEASURES, WalkMap


def test_walks_too_short_to_be_measured_are_drawn_as_nothing() -> None:
    nothing, none = np.full((2, 3), np.nan), np.zeros((2, 3), dtype=bool)
    tables = dict.fromkeys(MEASURES, nothing)
    speeds, stiffnesses = np.array([0.3, 0.5]), np.array([60.0, 120.0, 240.0])
    fell = {"flexible": none, "locked": none}
    found = WalkMap("sc618", "trot", 0.5, speeds, stiffnesses, tables, tables, fell)
    panels = plot_walks(found).axes
    drawn = [line.get_ydata() for axes in panels for line in axes.lines]
    # All that is left is the line of walks as fast as asked for.
    assert [y.tolist() for y in map(np.asarray, drawn) if np.isfinite(y).any()] == [[0.3, 0.5]]
