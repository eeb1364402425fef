"""A branch of gaits in a page: what it is like over what it was followed in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from math import hypot, pi
from operator import itemgetter
from typing import Any, NamedTuple

from flexspine.report.branch_axis import axis_of
from flexspine.report.page.markup import Markup, data, joined, table, tag
from flexspine.report.page.runs import plots_area
from flexspine.report.page.words import plain
from flexspine.report.style import FAINT, GREEN, INK, SIDE_COLORS

Gait = dict[str, Any]


class Curve(NamedTuple):
    """A line of a panel, ``of`` each gait."""

    name: str
    color: str
    of: Callable[[Gait], Any]
    dash: str = "solid"
    in_legend: bool = True


# Smaller moduli are drawn as this, on a logarithmic axis.
LEAST_MODULUS = 1e-6


def branch_section(record: Gait, name: str) -> Markup:
    """Show a branch under an id: panels over what it is followed in, and what happens on it."""
    points = record["points"]
    axis = axis_of(record["over"], points[0]["model"])
    marks = [
        (axis.shown(mark["value"]), mark["kind"], mark["detail"]) for mark in record["landmarks"]
    ]
    found = {
        "panels": list(_panels(record, [axis.of(gait) for gait in points])),
        "spans": [],
        "axis": {"title": _bare(axis.told), "marks": [value for value, *_ in marks]},
    }
    ends = " and ".join(record["ends"])
    parts = [
        tag("p", f"{len(points)} gaits; the branch ends: {ends}.", class_="note"),
        tag("div", plots_area(), data_branch=name),
        data(name, found),
    ]
    if marks:
        parts += [tag("h3", "On the way"), table((_bare(axis.told), "kind", "detail"), marks)]
    return joined(parts)


def _panels(record: Gait, along: list[float]) -> Iterator[dict[str, Any]]:
    """What is drawn, panel by panel, as scripts read it."""
    points = record["points"]
    for title, unit, curves, options in _drawn(record):
        lines: list[dict[str, Any]] = [
            {
                "name": curve.name, "color": "ink" if curve.color == INK else curve.color,
                "dash": curve.dash, "legend": curve.in_legend, "x": along,
                "y": list(map(curve.of, points)),
            }
            for curve in curves
        ]  # fmt: skip
        if any(value is not None for line in lines for value in line["y"]):
            yield {"title": title, "unit": unit, "lines": lines, **options}


def _drawn(record: Gait) -> Iterator[tuple[str, str, list[Curve], dict[str, Any]]]:
    """Title, unit, lines and options of each panel."""
    points = record["points"]
    yield "Peak ground reaction force, per pair of legs", "N", _sides("peak_grf"), {}
    for name in record["free"]:
        free = axis_of(name, points[0]["model"])
        label = _bare(free.label)
        yield label.capitalize(), free.unit, [Curve(label, GREEN, free.of)], {}
    if any(gait["work"] for gait in points):
        yield "Cost of transport", "", [_curve("cost_of_transport")], {}
    count = max(len(gait["floquet_multipliers"]) for gait in points)
    multipliers = [
        Curve(f"multiplier {place + 1}", FAINT, partial(_modulus, place), in_legend=False)
        for place in range(count)
    ]
    radius = _curve("level_spectral_radius", "spectral radius on the energy level")
    stability = {"log": True, "level": 1.0}
    yield "Floquet multipliers, modulus", "", [*multipliers, radius], stability
    yield "Touchdown angle", "°", _sides("touchdown_angles", 180 / pi), {}
    for key, unit in (("period", "s"), ("stride_length", "m"), ("mean_speed", "m/s")):
        if key != record["over"] and key not in record["fixed"]:
            yield plain(key).capitalize(), unit, [_curve(key)], {}


def _curve(key: str, name: str = "") -> Curve:
    return Curve(name or plain(key), INK, itemgetter(key))


def _sides(key: str, factor: float = 1.0) -> list[Curve]:
    def of(side: str, gait: Gait) -> float:
        return factor * float(gait[key][side])

    looks = zip(SIDE_COLORS.items(), ("solid", "dash"), strict=True)
    return [Curve(side, color, partial(of, side), dash) for (side, color), dash in looks]


def _modulus(place: int, gait: Gait) -> float | None:
    multipliers = gait["floquet_multipliers"]
    if place >= len(multipliers):
        return None
    return max(hypot(*multipliers[place]), LEAST_MODULUS)


def _bare(text: str) -> str:
    """A label without the marks of mathematics that pictures set."""
    return text.replace("$", "")
