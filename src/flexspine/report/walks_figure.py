"""Walks in space over speed: flexible spines of many stiffnesses, and a locked one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexspine.report.picture import Picture
from flexspine.report.style import INK, LINE, add_title, themed
from flexspine.studies.walk_map import MEASURES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from flexspine.studies.walk_map import WalkMap

COLUMNS = 4
PANEL = (2.5, 2.0)  # in

# Of a colour map from soft to stiff.
SHADES = (0.1, 0.85)

# Of a panel's height; from one cross to the next.
STACK = 0.035


def plot_walks(found: WalkMap) -> Figure:
    """Draw a panel for each measure; crosses above the axis are walks that ended early."""
    rows = -(-len(MEASURES) // COLUMNS)
    with themed():
        details = [
            f"{found.name} in MuJoCo, {found.seconds:g} s each from standing, noisy sensors; "
            "measured over the second half",
            "bars: range of the locked spine's walks that last, which differ in noise alone",
        ]
        size = (0.9 + PANEL[0] * COLUMNS, 0.9 + PANEL[1] * rows + LINE * len(details))
        figure = Picture(figsize=size, layout="constrained")
        panels = figure.subplots(rows, COLUMNS, sharex=True, squeeze=False)
        for axes, name in zip(panels.flat, MEASURES, strict=True):
            _draw(axes, found, name)
        for axes in panels[-1]:
            axes.set_xlabel("asked speed (m/s)")
        keys = [
            Line2D([], [], color=color, marker="o", markersize=3.5, linewidth=1.1)
            for color in _shades(found)
        ]
        keys.append(Line2D([], [], color=INK, marker="s", markersize=3.5, linewidth=1.1))
        labels = [*(f"{value:g}" for value in found.stiffnesses), "locked"]
        if any(table.any() for table in found.fell.values()):
            keys.append(Line2D([], [], color=INK, marker="x", markersize=4, linestyle="none"))
            labels.append("ended\nearly")
        figure.legend(keys, labels, loc="outside right center", title="$k_t$\n(N m/rad)")
        add_title(figure, f"Spines in space: {found.rhythm}", details)
    return figure


def _shades(found: WalkMap) -> list[str]:
    return [*map(to_hex, colormaps["viridis"](np.linspace(*SHADES, len(found.stiffnesses))))]


def _draw(axes: Axes, found: WalkMap, name: str) -> None:
    label, unit, factor = MEASURES[name]
    table, rigid = factor * found.flexible[name], factor * found.locked[name]
    for values, color in zip(table.T, _shades(found), strict=True):
        axes.plot(found.speeds, values, color=color, marker="o", markersize=3.5, linewidth=1.1)
    known = np.isfinite(rigid).any(axis=1)
    if known.any():
        speeds, rigid = found.speeds[known], rigid[known]
        middle = np.nanmean(rigid, axis=1)
        ends = np.abs(np.array([np.nanmin(rigid, axis=1), np.nanmax(rigid, axis=1)]) - middle)
        axes.errorbar(
            speeds, middle, ends, color=INK, marker="s", markersize=3.5, linewidth=1.1, capsize=2,
            zorder=1.5,
        )  # fmt: skip
    if name == "speed":
        axes.plot(found.speeds, found.speeds, color=INK, linewidth=0.6, linestyle=":")
    backward = 1.1 * float(np.nanmin(table, initial=0.0))
    axes.set_ylim(bottom=backward if name == "speed" else 0)
    for body, marked in found.fell.items():
        colors = _shades(found) if body == "flexible" else [INK] * len(found.stiffnesses)
        for j, color in enumerate(colors):
            here = found.speeds[marked[:, j]]
            # One above the other, in the order of the key.
            height = np.full(len(here), 0.03 + STACK * (j if body == "flexible" else -0.5))
            if len(here):
                axes.plot(
                    here, height, marker="x", markersize=4, color=color, linestyle="none",
                    transform=axes.get_xaxis_transform(), clip_on=False,
                )  # fmt: skip
    axes.set_ylabel(f"{label} ({unit})" if unit else label)
