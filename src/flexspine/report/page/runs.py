"""A run in a page: its player, its plots, and what ran."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flexspine.report.caption import ending, excerpt_of
from flexspine.report.page import panels
from flexspine.report.page.markup import Markup, data, joined, tag
from flexspine.report.page.reel import SLOW_DOWN, reel
from flexspine.report.sagittal import is_spatial, sagittal
from flexspine.report.style import PHASE_COLORS
from flexspine.report.timeline import check_samples, is_robot, phase_spans

if TYPE_CHECKING:
    import xarray as xr

# Seconds of a run in a second of playing.
SPEEDS = {"1/32": 1 / 32, "1/16": 1 / 16, "1/8": 1 / 8, "1/4": 1 / 4, "1/2": 1 / 2, "1": 1, "2": 2}

# More changes of phase than these make a picture grey.
MOST_SPANS = 120


def run_section(dataset: xr.Dataset, name: str) -> Markup:
    """Show a run under an id; one of fewer than two samples in words only.

    Raises `InputError` for a dataset from which nothing can be drawn.
    """
    if dataset.sizes.get("time", 0) < 2:
        return tag("p", f"Nothing to draw: {dataset.attrs.get('message', 'no samples')}.")
    flat = sagittal(dataset) if is_spatial(dataset) else dataset
    check_samples(flat, robot=is_robot(flat))
    early = ending(dataset)
    about = [
        *([tag("p", f"Ended early: {early}", class_="outcome bad")] if early else []),
        *(tag("p", line, class_="note") for line in excerpt_of(dataset)),
    ]
    found = {"panels": panels.as_data(dataset), "spans": _spans(dataset), "axis": None}
    return joined(
        [
            *about,
            tag("div", _player(is_robot(dataset)), plots_area(), data_run=name),
            data(f"{name}-reel", reel(dataset)),
            data(f"{name}-panels", found),
        ]
    )


def plots_area() -> Markup:
    """Where scripts draw panels of lines, with a cursor over them."""
    return tag(
        "div",
        tag("div", class_="plot"),
        tag("div", class_="cursor", hidden=""),
        class_="plots",
    )


def _player(robot: bool) -> Markup:
    usual = "1" if robot else f"1/{SLOW_DOWN}"
    speeds = [
        tag("option", f"speed {label}", value=value, **({"selected": ""} if label == usual else {}))
        for label, value in SPEEDS.items()
    ]
    canvas = tag(
        "canvas",
        tabindex="0",
        role="img",
        aria_label="The animal at the chosen time; arrow keys step, space plays",
    )
    return tag(
        "div",
        canvas,
        tag(
            "div",
            tag("button", "Play", type="button"),
            tag("input", type="range", min="0", value="0", step="1", aria_label="time"),
            tag("output", ""),
            tag("select", *speeds, aria_label="speed"),
            class_="controls",
        ),
        tag("p", "", class_="words"),
        class_="player",
    )


def _spans(dataset: xr.Dataset) -> list[list[Any]]:
    """The stances of a bounder as start, end (s) and colour."""
    if is_robot(dataset):
        return []
    spans = [span for span in phase_spans(dataset) if span.phase != "DF"]
    if len(spans) > MOST_SPANS:
        return []
    return [[span.start, span.end, PHASE_COLORS[span.phase]] for span in spans]
