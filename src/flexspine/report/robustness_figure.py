"""What animals survive: the share of runs over the size of what disturbed them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from flexspine.report.style import (
    FAINT,
    GREEN,
    INK,
    LINE,
    ORANGE,
    PURPLE,
    add_legend,
    add_title,
    themed,
)

if TYPE_CHECKING:
    from flexspine.studies.robustness import Robustness

WIDTH, HEIGHT = 8.6, 3.8  # in

COLORS = (INK, ORANGE, GREEN, PURPLE)
MARKERS = ("s", "o", "^", "D")

# Sizes in these units are shown in smaller ones.
SHOWN = {"m": (1000.0, "mm"), "1": (100.0, "%"), "N s": (1.0, "N s")}


def plot_robustness(found: Robustness) -> Figure:
    """Draw the share of runs that survived, by animal, with its 95 % interval."""
    factor, unit = SHOWN[found.kind.unit]
    with themed():
        runs = len(next(iter(found.animals.values())).fates)
        details = [
            f"{runs:,} run{'s' * (runs != 1)} of each, the same disturbances; "
            f"survived: {found.strides} strides made",
            "bands: 95 % intervals (Wilson)",
        ]
        figure = Figure(figsize=(WIDTH, HEIGHT + LINE * len(details)), layout="constrained")
        axes = figure.subplots()
        for number, (name, each) in enumerate(found.animals.items()):
            color, marker = COLORS[number % len(COLORS)], MARKERS[number % len(MARKERS)]
            bins = [one for one in each.bins(found.edges) if one.runs]
            middle = factor * np.array([(one.low + one.high) / 2 for one in bins])
            share = 100 * np.array([one.survived / one.runs for one in bins])
            least, most = (
                100 * np.array([getattr(one, n) for one in bins]) for n in ("least", "most")
            )
            axes.fill_between(middle, least, most, color=color, alpha=0.15, linewidth=0)
            axes.plot(
                middle, share, color=color, marker=marker, markersize=3.5, linewidth=1.2,
                label=name.replace("-", " "),
            )  # fmt: skip
        axes.set_ylim(-2, 104)
        axes.set_xlim(factor * found.edges[0], factor * found.edges[-1])
        if found.kind.signed:
            axes.axvline(0, color=FAINT, linewidth=0.7, zorder=1)
        axes.set_xlabel(f"{found.kind.about} ({unit})")
        axes.set_ylabel("survived (%)")
        add_legend(axes)
        add_title(figure, "Survival under the same controller", details)
    return figure
