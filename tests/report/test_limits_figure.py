"""The picture of limits."""

from __future__ import annotations

from flexspine.report.limits_figure import plot_limits
from flexspine.studies.limits import Cell


def test_every_limit_is_within_its_panel() -> None:
    def cell(speed: float, design: str, size: float) -> Cell:
        return Cell(260.0, speed, design, 1.3, 0.5, {"push_forward": size}, None)

    cells = [cell(4.0, "one", 0.1), cell(4.5, "one", 0.2), cell(4.5, "other", 7.0)]
    panels = plot_limits([*cells, Cell(260.0, 3.0, "one", None, None, {}, "none")]).axes
    assert len(panels) == 2
    for axes in panels:
        low, high = axes.get_ylim()
        assert low == 0.0
        assert high > 7.0
