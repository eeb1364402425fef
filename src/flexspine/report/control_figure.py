"""A gait under feedback, stride by stride: how far it is off, and what is steered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from flexspine.errors import InputError
from flexspine.report.caption import joined
from flexspine.report.picture import Picture
from flexspine.report.style import (
    FAINT,
    GREEN,
    INK,
    LINE,
    ORANGE,
    PURPLE,
    SIDE_COLORS,
    add_legend,
    add_title,
    themed,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, PANEL = 8.6, 1.7  # in

LETTERS = 125  # of small type; what fits into a line

# More strides than this are drawn without a dot for each.
DOTTED = 60

# Below it a deviation is rounding.
FLOOR = 1e-14

# The largest deviation over the smallest from which on their scale is logarithmic.
DECAYED = 100.0

OTHER_COLORS = (GREEN, ORANGE, PURPLE, INK)


def plot_control(record: Mapping[str, Any], table: Sequence[Mapping[str, float]]) -> Figure:
    """Draw deviations and inputs over strides, from `steered_record` and `apex_table`.

    Raises `InputError` for a run without an apex.
    """
    if not table:
        raise InputError("the run has no apex", "run at least one stride")
    columns = {name: np.array([row[name] for row in table]) for name in table[0]}
    angles = [name for name in record["inputs"] if name.startswith("touchdown.")]
    others = [name for name in record["inputs"] if name not in angles]
    panels = 2 + len(others) if angles else 1 + len(others)
    with themed():
        details = joined(_details(record), LETTERS)
        height = 0.75 + PANEL * panels + LINE * len(details)
        figure = Picture(figsize=(WIDTH, height), layout="constrained")
        every = figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0]
        _draw_deviation(every[0], columns)
        rest = list(every[1:])
        if angles:
            _draw_angles(rest.pop(0), columns, angles, record)
        for axes, name, color in zip(rest, others, cycle(OTHER_COLORS), strict=False):
            usual = record["usual"][record["inputs"].index(name)]
            _draw_input(axes, columns["stride"], columns[name], usual, name, color)
        every[-1].set_xlabel("stride")
        add_title(figure, _heading(record), details)
    return figure


def _heading(record: Mapping[str, Any]) -> str:
    strides = record["strides"]
    end = "" if record["outcome"] == "completed" else f", then {record['outcome']}"
    return f"{record['preset']} under feedback: {strides} stride{'s' * (strides != 1)}{end}"


def _details(record: Mapping[str, Any]) -> list[str]:
    radius, noise = record["spectral_radius"], record["noise"]
    often = "at both flight apexes" if record["acts_per_stride"] == 2 else "once a stride"
    parts = [
        f"{record['method']}, {often}",
        f"spectral radius {radius['without']:.3f} without feedback, "
        f"{radius['on_level']:.3f} with it",
    ]
    if noise["acting"]:
        kind = "uniform, up to" if noise["uniform"] else "Gaussian,"
        parts.append(f"noise on what is steered: {kind} {100 * noise['acting']:g} %")
    if noise["sensing"]:
        parts.append(f"noise on the apex: {noise['sensing']:g}")
    if record.get("push"):
        parts.append(f"push of {record['push']:g} N s at the start")
    if record["ground"]:
        parts.append(record["ground"])
    return parts


def _style(count: int) -> dict[str, Any]:
    dots = count <= DOTTED
    return {"marker": "o" if dots else None, "markersize": 3, "linewidth": 1.1 if dots else 0.7}


def _draw_deviation(axes: Axes, columns: Mapping[str, Any]) -> None:
    size = np.where(columns["deviation"] > FLOOR, columns["deviation"], np.nan)
    axes.plot(columns["stride"], size, color=INK, **_style(len(size)))
    known = size[np.isfinite(size)]
    if known.size and known.max() > DECAYED * known.min():
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0)
    axes.set_ylabel("deviation of\nthe apex (1)")


def _draw_angles(
    axes: Axes, columns: Mapping[str, Any], angles: list[str], record: Mapping[str, Any]
) -> None:
    for name in angles:
        side = name.partition(".")[2]
        degrees = np.degrees(columns[name])
        axes.plot(
            columns["stride"], degrees, color=SIDE_COLORS[side], label=side, **_style(len(degrees))
        )
        usual = np.degrees(record["touchdown_angles"][side])
        axes.axhline(usual, color=FAINT, linewidth=0.7, zorder=1)
    axes.set_ylabel("touchdown\nangle (°)")
    add_legend(axes)


def _draw_input(axes: Axes, strides: Any, values: Any, usual: float, name: str, color: str) -> None:
    length = name.endswith((".extension", ".hip_lever"))
    factor, unit = (1000.0, " (mm)") if length else (1.0, "")
    axes.plot(strides, factor * values, color=color, **_style(len(values)))
    axes.axhline(factor * usual, color=FAINT, linewidth=0.7, zorder=1)
    axes.set_ylabel(name.replace(".", ".\n") + unit)
