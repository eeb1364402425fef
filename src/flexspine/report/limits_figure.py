"""What stabilised gaits survive at the most, over mean speed, for every stiffness and design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from flexspine.report.picture import Picture
from flexspine.report.style import LINE, add_title, themed

if TYPE_CHECKING:
    from flexspine.studies.limits import Cell

PANEL = (2.6, 1.9)  # in

# What a limit is called in a picture, its factor and unit.
LABELS = {
    "acting_noise": ("noise on what\nis steered", 100.0, "%"),
    "sensing_noise": ("noise on\nthe apex", 100.0, "%"),
    "push_forward": ("push forward", 1.0, "N s"),
    "push_backward": ("push backward", 1.0, "N s"),
    "step_up": ("step up", 1000.0, "mm"),
    "step_down": ("step down", 1000.0, "mm"),
}

# Of a colour map from soft to stiff.
SHADES = (0.15, 0.85)


def plot_limits(cells: Sequence[Cell]) -> Figure:
    """Draw one row of panels for each limit and one column for each design."""
    known = [cell for cell in cells if cell.limits]
    names = [name for name in LABELS if any(name in cell.limits for cell in known)]
    designs = list(dict.fromkeys(cell.design for cell in known))
    stiffnesses = sorted({cell.stiffness for cell in known})
    shades = dict(
        zip(stiffnesses, colormaps["viridis"](np.linspace(*SHADES, len(stiffnesses))), strict=True)
    )
    with themed():
        details = [
            "Gaussian noise: six seeds, 1000 strides; pushes, steps (at eight places): 50 strides"
        ]
        size = (1.0 + PANEL[0] * len(designs), 0.9 + PANEL[1] * len(names) + LINE * len(details))
        figure = Picture(figsize=size, layout="constrained")
        panels = figure.subplots(len(names), len(designs), sharex=True, sharey="row", squeeze=False)
        for row, name in zip(panels, names, strict=True):
            label, factor, unit = LABELS[name]
            row[0].set_ylabel(f"{label} ({unit})")
            for axes, design in zip(row, designs, strict=True):
                for stiffness in stiffnesses:
                    here = sorted(
                        (cell.speed, factor * cell.limits[name])
                        for cell in known
                        if (cell.design, cell.stiffness) == (design, stiffness)
                    )
                    if here:
                        axes.plot(
                            *np.transpose(here), color=shades[stiffness], marker="o",
                            markersize=3.5, linewidth=1.1, label=f"{stiffness:g}",
                        )  # fmt: skip
            row[0].set_ylim(bottom=0)
        for axes, design in zip(panels[0], designs, strict=True):
            axes.set_title(design)
        for axes in panels[-1]:
            axes.set_xlabel("mean speed (m/s)")
        handles, labels = max(
            (axes.get_legend_handles_labels() for axes in panels.flat),
            key=lambda found: len(found[0]),
        )
        figure.legend(handles, labels, loc="outside right center", title="$k_t$\n(N m/rad)")
        add_title(figure, "The largest disturbances survived under feedback", details)
    return figure
