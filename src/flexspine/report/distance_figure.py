"""How far runs over ground that is not flat come: the share still running over the distance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from flexspine.report.caption import joined
from flexspine.report.picture import Picture
from flexspine.report.style import BLUE, FAINT, INK, LINE, SMALL_SIZE, add_title, themed
from flexspine.studies.wayfaring import NO_LENGTHS

if TYPE_CHECKING:
    from flexspine.studies.wayfaring import Wayfaring

WIDTH, HEIGHT = 7.2, 3.6  # in
LETTERS = 105  # of small type; what fits into a line


def plot_distances(found: Wayfaring, record: Mapping[str, Any]) -> Figure:
    """Draw which share of the runs is still going after so many metres (Kaplan-Meier)."""
    distances, going = found.going()
    last = float(found.distances.max())
    steps = np.concatenate([[0.0], distances, [last]])
    share = np.concatenate([[1.0], going, going[-1:]])
    with themed():
        details = joined(_details(found, record), LETTERS)
        figure = Picture(figsize=(WIDTH, HEIGHT + LINE * len(details)), layout="constrained")
        axes = figure.subplots()
        axes.step(steps, 100 * share, where="post", color=BLUE)
        axes.fill_between(steps, 100 * share, step="post", color=BLUE, alpha=0.12, linewidth=0)
        axes.set_xlim(0, last)
        axes.set_ylim(0, 103)
        axes.set_xlabel("distance (m)")
        axes.set_ylabel("runs still going (%)")
        median = found.quantile(0.5)
        if median is not None and median <= last:
            axes.plot([0, median, median], [50, 50, 0], color=FAINT, linewidth=0.8)
            axes.annotate(
                f"half have ended by {median:.1f} m", (median, 50), (6, 4),
                textcoords="offset points", fontsize=SMALL_SIZE, color=INK,
            )  # fmt: skip
        add_title(figure, _heading(found, record), details)
    return figure


def _heading(found: Wayfaring, record: Mapping[str, Any]) -> str:
    kind = found.terrain.kind.rpartition("/")[2]
    return f"{record['preset']}: {len(found.fates)} runs over ground of kind '{kind}'"


def _details(found: Wayfaring, record: Mapping[str, Any]) -> list[str]:
    numbers = found.terrain.all_numbers
    parts = [f"{n} {value:g}{'' if n in NO_LENGTHS else ' m'}" for n, value in numbers.items()]
    how = (
        "fixed touchdown angles" if record["passive"] else f"steered: {', '.join(record['inputs'])}"
    )
    parts += [how, f"mean speed {record['mean_speed']:.3g} m/s", f"up to {found.strides} strides"]
    parts.append(", ".join(f"{count} {name}" for name, count in found.outcomes.items()))
    return parts
