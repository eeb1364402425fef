"""Pareto fronts: one objective over the other, stability, and the stiffness that it takes."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from flexspine.errors import InputError
from flexspine.report.branch_axis import NAMES
from flexspine.report.caption import joined, of_legs
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
from flexspine.studies.design import phases_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    Record = dict[str, Any]
    Look = dict[str, Any]

LABELS = {
    "peak_grf": "peak GRF\n(N per leg pair)",
    "cost_of_transport": "cost of transport",
    "spectral_radius": "spectral radius",
}

_DOT: Look = {"markerfacecolor": "white", "markeredgewidth": 1.2}
SPINES: dict[str, Look] = {
    "constant": {**_DOT, "color": INK, "marker": "o", "markersize": 8.0, "zorder": 3.5},
    "by phase": {**_DOT, "color": GREEN, "marker": "D", "markersize": 4.6, "zorder": 5.5},
}

STIFFNESS, SHIFT = "spine.stiffness", "spine.stiffness_shift."

_PHASE: Look = {"markeredgewidth": 0.0, "markersize": 6.0, "zorder": 5}
PHASES: dict[str, Look] = {
    "flight": {"color": GREEN, "marker": "_", "markersize": 13.0, "markeredgewidth": 2.4},
    "between": {**_PHASE, "color": "#8A8A8A", "marker": "s", "markersize": 5.0},
    "fore": {**_PHASE, "color": SIDE_COLORS["fore"], "marker": "<"},
    "hind": {**_PHASE, "color": SIDE_COLORS["hind"], "marker": ">"},
    "both": {**_PHASE, "color": PURPLE, "marker": "P", "markersize": 6.5},
}
LEGEND = {
    "flight": "around the apex",
    "between": "between stances",
    "fore": "fore stance",
    "hind": "hind stance",
    "both": "both stand",
}

SYMBOLS = {
    STIFFNESS: "$k_t$ (N m/rad)",
    "spine.damping": "$c_t$ (N m s/rad)",
    "legs.extension": "leg thrust (m)",
}

# An axis whose ends differ by more than the first factor is logarithmic, by more than the second
# one with fewer labels.
WIDE, VERY_WIDE = 5.0, 100.0

LETTERS = 120  # of small type; what fits into a line

WIDTH, UNIT = 7.6, 1.75  # in; of a figure, and of a panel of height 1

LIMIT: Look = {"color": INK, "linewidth": 0.8, "linestyle": (0, (6, 3)), "zorder": 1}


def plot_fronts(record: Record) -> Figure:
    """Draw fronts as `front_record` gives them. Raises `InputError` if there is no gait."""
    fronts = {spine: front["points"] for spine, front in record["fronts"].items()}
    gaits = [point for points in fronts.values() for point in points]
    if not gaits:
        raise InputError("there is no front to draw", "optimise with wider ranges or more draws")
    first, second = record["minimised"]
    (third,) = LABELS.keys() - {first, second}
    heights = [1.6, 1.0, 1.3] if any(STIFFNESS in gait["varied"] for gait in gaits) else [1.6, 1.0]
    with themed():
        details = _details(record)
        size = WIDTH, UNIT * sum(heights) + LINE * len(details)
        figure = Picture(figsize=size, layout="constrained")
        panels = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        _draw(panels[0], fronts, second, first, {"drawstyle": "steps-post"})
        for spine in fronts:
            panels[0].plot([], [], linestyle="none", **SPINES[spine], label=f"stiffness\n{spine}")
        _draw(panels[1], fronts, second, third, {"alpha": 0.45})
        _scale(panels[-1], "x", [gait["objectives"][second] for gait in gaits])
        _mark_reference(panels[0], record, first)
        if len(panels) > 2:
            _draw_stiffness(panels[2], fronts, second)
        panels[-1].set_xlabel(LABELS[second].replace("\n", " "))
        for axes in panels:
            axes.grid(True, color=FAINT, alpha=0.25, linewidth=0.5)
            if axes.get_legend_handles_labels()[0]:
                add_legend(axes)
        figure.align_ylabels(panels)
        what = [LABELS[name].partition("\n")[0] for name in (first, second)]
        heading = f"Least {what[0]} for a {what[1]} at {record['mean_speed']:.4g} m/s"
        add_title(figure, heading, details)
    return figure


def _draw(axes: Axes, fronts: dict[str, list[Record]], over: str, name: str, line: Look) -> None:
    """Draw an objective of every gait of every front."""
    axes.set_ylabel(LABELS[name])
    shown = []
    for spine, points in fronts.items():
        look = SPINES[spine]
        x, y = ([point["objectives"][each] for point in points] for each in (over, name))
        axes.plot(x, y, color=look["color"], linewidth=1.2, zorder=look["zorder"] - 1, **line)
        _dots(axes, x, y, points, look)
        shown += y
    if name == "spectral_radius":
        axes.axhline(1.0, **LIMIT, label="stable\nbelow 1")
        shown.append(1.0)
    _scale(axes, "y", shown)


def _dots(axes: Axes, x: list[float], y: list[float], points: list[Record], look: Look) -> None:
    """Draw gaits, stable ones filled."""
    for at, value, point in zip(x, y, points, strict=True):
        inside = look["color"] if point["stable"] else "white"
        axes.plot([at], [value], linestyle="none", **{**look, "markerfacecolor": inside})


def _scale(axes: Axes, which: str, values: Sequence[float]) -> None:
    """Make an axis logarithmic where values differ by factors."""
    least, most = min(values), max(values)
    axis = axes.xaxis if which == "x" else axes.yaxis
    if least > 0 and most > WIDE * least:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
        subs = (1.0, 2.0, 5.0) if most < VERY_WIDE * least else (1.0,)
        axis.set_major_locator(LogLocator(10, subs=subs))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    else:
        axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    axes.margins(y=0.1)


def _mark_reference(axes: Axes, record: Record, first: str) -> None:
    """Draw what the gait has that all began with, where that can be compared."""
    reference = record["reference"]
    values = {
        "peak_grf": max(reference["peak_grf"].values()),
        "spectral_radius": reference["level_spectral_radius"],
    }
    if first not in values:
        return
    cost = reference["cost_of_transport"]
    told = "without losses" if not cost else f"cost {cost:.3g}"
    axes.axhline(
        values[first], color=ORANGE, linewidth=1.4, linestyle=(0, (2, 1.5)), zorder=1.5,
        label=f"gait it began\nwith, {told}",
    )  # fmt: skip


def _draw_stiffness(axes: Axes, fronts: dict[str, list[Record]], over: str) -> None:
    """Draw the stiffness of every gait, in the phases that it has."""
    axes.set_ylabel("spine stiffness $k_t$\n(N m/rad)")
    shown: list[float] = []
    for spine, points in fronts.items():
        phased = any(name.startswith(SHIFT) for point in points for name in point["varied"])
        for phase, look in PHASES.items() if phased else (("", SPINES[spine]),):
            having = [p for p in points if not phase or phase in phases_of(p["phases"])]
            if not having or STIFFNESS not in having[0]["varied"]:
                continue
            x = [point["objectives"][over] for point in having]
            y = [_stiffness(point["varied"], phase) for point in having]
            axes.plot(x, y, linestyle="none", **look, label=f"{LEGEND.get(phase, spine)}")
            shown += y
    _scale(axes, "y", shown)


def _stiffness(varied: dict[str, float], phase: str) -> float:
    return varied[STIFFNESS] * (1 + varied.get(f"{SHIFT}{phase}", 0.0))


def _details(record: Record) -> list[str]:
    """What all gaits share, what varies, and what stiffness by phase buys."""
    reference = record["reference"]
    ranges = {name: ends for each in record["ranges"].values() for name, ends in each.items()}
    parts = [reference["preset"]]
    kept = {"energy": (reference["energy"], "J"), "height": (reference["apex"]["height"], "m")}
    for name, (value, unit) in kept.items():
        if name not in ranges:
            parts.append(f"{NAMES[name][0]} {value:.4g} {unit}")
    parts += of_legs(reference["parameters"], "stiffness $k_l$", "stiffness", "N/m per leg pair")
    shifts = [ends for name, ends in ranges.items() if name.startswith(SHIFT)]
    told = {**{n: e for n, e in ranges.items() if not n.startswith(SHIFT)}}
    parts += [f"{_called(name)} {low:g} to {high:g}" for name, (low, high) in told.items()]
    if shifts:
        parts.append(f"by phase {100 * shifts[0][0]:+g} to {100 * shifts[0][1]:+g} %")
    gaits = [point for front in record["fronts"].values() for point in front["points"]]
    stable = "filled: stable" if any(g["stable"] for g in gaits) else "no gait is stable"
    return [*joined(parts, LETTERS), *joined([*wrap(_bought(record), LETTERS), stable], LETTERS)]


def _bought(record: Record) -> str:
    """What stiffness by phase buys, in short."""
    if not record["gains"] or not all(record["gains"].values()):
        return str(record["told"] or "")
    most = {name: 100 * max(0.0, *shares) for name, shares in record["gains"].items()}
    told = [f"{LABELS[name].splitlines()[0]} up to {m:.1f} % lower" for name, m in most.items()]
    return f"by phase: {', '.join(told)}, the other kept"


def _called(name: str) -> str:
    """What people call something that varies."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    return NAMES[name][0] if name in NAMES else name.replace(".", " ").replace("_", " ")
