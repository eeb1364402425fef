"""What animals survive: the share of runs over the size of what disturbed them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from flexspine.report.caption import joined
from flexspine.report.picture import Picture
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

LETTERS = 120  # of small type; what fits into a line

# Of a bin; what animals are drawn beside each other.
ASIDE = 0.2

COLORS = (INK, ORANGE, GREEN, PURPLE)
MARKERS = ("s", "o", "^", "D")

# Sizes in these units are shown in smaller ones.
SHOWN = {"m": (1000.0, "mm"), "1": (100.0, "%"), "N s": (1.0, "N s")}


def plot_robustness(found: Robustness, animals: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw the share of runs that survived, by animal, with its 95 % interval.

    ``animals`` tells of each gait what ``flexspine.control.steered_record.stabilizer_record`` does.
    """
    factor, unit = SHOWN[found.kind.unit]
    shared, own = _gaits([animals[name] for name in found.animals])
    with themed():
        runs = len(next(iter(found.animals.values())).fates)
        details = joined(
            [
                *shared,
                f"{runs:,} run{'s' * (runs != 1)} of each, the same disturbances",
                f"survived: {found.strides} strides made",
                "bars: 95 % intervals (Wilson)",
            ],
            LETTERS,
        )
        figure = Picture(figsize=(WIDTH, HEIGHT + LINE * len(details)), layout="constrained")
        axes = figure.subplots()
        for number, ((name, each), more) in enumerate(zip(found.animals.items(), own, strict=True)):
            color, marker = COLORS[number % len(COLORS)], MARKERS[number % len(MARKERS)]
            bins = [one for one in each.bins(found.edges) if one.runs]
            low, high, least, share, most = np.array(
                [(b.low, b.high, b.least, b.survived / b.runs, b.most) for b in bins]
            ).T
            # Beside each other, that no bar hides another.
            aside = (number - (len(found.animals) - 1) / 2) * ASIDE
            axes.errorbar(
                factor * ((low + high) / 2 + aside * (high - low)), 100 * share,
                100 * np.array([share - least, most - share]).clip(0), color=color, marker=marker,
                markersize=3.5, linewidth=1.2, elinewidth=0.8, capsize=1.5,
                label="\n".join([name.replace("-", " "), *more]),
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


def _gaits(records: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """What all gaits have in common, and what each has of its own."""
    told = [
        [
            f"{record['mean_speed']:.3g} m/s",
            f"{record['energy']:.3g} J",
            f"apex height {record['apex']['height']:.3g} m",
            *_of_spine(record["parameters"]),
        ]
        for record in records
    ]
    shared = [part for part in told[0] if all(part in each for each in told)]
    return shared, [[part for part in each if part not in shared] for each in told]


def _of_spine(parameters: Mapping[str, Any]) -> list[str]:
    stiffness = parameters.get("spine.stiffness")
    return [] if stiffness is None else [f"$k_t$ = {stiffness:g} N m/rad"]
