"""Gaits of rigid and flexible spines: peak forces and stability over speed and over k_t.

The figures draw rows of tables as `flexspine.studies.tables` makes them, and add nothing to them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import nan
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgba
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from flexspine.errors import InputError
from flexspine.report.caption import SIDES
from flexspine.report.study_profiles import (
    EQUAL,
    GRID,
    RAMP,
    baseline_color,
    plot_energy_shares,
    plot_profiles,
    ramp,
    start_figure,
)
from flexspine.report.style import FAINT, INK, ORANGE, SMALL_SIZE, themed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

    Row = Mapping[str, Any]
    Look = dict[str, Any]

__all__ = [
    "plot_energy_shares",
    "plot_peak_grf",
    "plot_peak_grf_stiffness",
    "plot_profiles",
    "plot_stability_speed",
    "plot_stability_stiffness",
]

# N/m per pair of legs; that of the published setting, which the tables do not hold.
LEG_STIFFNESS = 6340.0

# N per pair of legs and m/s; half the sides of the box around a published reading.
PEAK_ERROR, SPEED_ERROR = 8.0, 0.02

# How the kind of rows over stiffness begins that are no branch but gaits one by one.
ONE_BY_ONE = "next to"

# The share of the speeds, at their fast end, that is drawn once more: branches fold there.
ENLARGED = 0.1

# A logarithmic axis that spans more than this is labelled at powers of ten only.
VERY_WIDE = 1e3

# in; of one row of panels and of two.
ONE_ROW, TWO_ROWS = 3.7, 6.0

END: Look = {
    "linestyle": "none", "marker": "o", "markersize": 4.5, "markerfacecolor": "white",
    "markeredgewidth": 1.2, "zorder": 4,
}  # fmt: skip
STABLE: Look = {"linewidth": 4.5, "solid_capstyle": "butt", "zorder": 2.5}
BRANCH: Look = {"color": colormaps[RAMP](0.4)}
DOTS: Look = {"color": ORANGE, "linestyle": "none", "marker": ".", "markersize": 5}
LEVEL: Look = {"color": ORANGE, "linewidth": 1.2, "linestyle": (0, (2, 1.5)), "zorder": 1.8}
LIMIT: Look = {"color": INK, "linewidth": 0.8, "linestyle": (0, (6, 3)), "zorder": 1.5}


class Measure(NamedTuple):
    """What a figure shows ``of`` every gait; with a ``limit`` it is drawn logarithmically."""

    name: str
    label: str
    meaning: str
    of: Callable[[Row], float]
    limit: float | None = None


class Body(NamedTuple):
    """The gaits of one body in order along their branch, and the colour of their line."""

    label: str
    color: Any
    rows: list[Row]


def plot_peak_grf(
    rows: Sequence[Row], published: Sequence[Row] = (), *, leg_stiffness: float = LEG_STIFFNESS
) -> Figure:
    """Draw peak GRF over mean speed, from the table of gaits, with the published readings.

    ``leg_stiffness`` is that of a pair of legs, for the title.
    """
    with themed():
        bodies = _bodies(rows)
        key = {}
        if published:
            key[READING_NAME] = {"linestyle": "none", "marker": "s", "markersize": 6.5, **_box(INK)}
        figure, panels = _over_speed(PEAK, rows, bodies, key, leg_stiffness)
        for axes in panels:
            for reading in published:
                _mark(axes, reading, bodies)
    return figure


def plot_stability_speed(rows: Sequence[Row], *, leg_stiffness: float = LEG_STIFFNESS) -> Figure:
    """Draw the spectral radius on the energy level over mean speed, from the table of gaits."""
    with themed():
        bodies = _bodies(rows)
        key = {STABLE_NAME: {"color": FAINT, **STABLE}, LIMIT_NAME: LIMIT}
        figure, panels = _over_speed(RADIUS, rows, bodies, key, leg_stiffness)
        for axes in panels:
            for body in bodies:
                steady = [_radius(row) if row["stable"] else nan for row in body.rows]
                axes.plot(_speeds(body.rows), steady, color=body.color, **STABLE)
    return figure


def plot_peak_grf_stiffness(rows: Sequence[Row], *, leg_stiffness: float = LEG_STIFFNESS) -> Figure:
    """Draw peak GRF over spine stiffness at each speed, from the table over stiffness."""
    with themed():
        return _over_stiffness(PEAK, rows, {}, leg_stiffness)


def plot_stability_stiffness(
    rows: Sequence[Row], *, leg_stiffness: float = LEG_STIFFNESS
) -> Figure:
    """Draw the spectral radius over spine stiffness at each speed, from the table over it."""
    with themed():
        return _over_stiffness(RADIUS, rows, {LIMIT_NAME: LIMIT}, leg_stiffness)


def _peak(row: Row) -> float:
    """The peak force, NaN for a gait on the brink that could not be run as far as its peak."""
    return max(row[f"peak_grf_{side}"] for side in SIDES) if row["confirmed"] else nan


def _radius(row: Row) -> float:
    return float(row["level_spectral_radius"])


PEAK = Measure(
    "Peak ground reaction force",
    "peak GRF (N per leg pair)",
    "peak: greatest GRF magnitude within a stride, of fore or hind legs, whichever is larger",
    _peak,
)
RADIUS = Measure(
    "Stability",
    "spectral radius on the energy level",
    "spectral radius: growth of small deviations of equal energy within a stride",
    _radius,
    limit=1.0,
)

READING_NAME = f"reading of Kamimura et al. 2015, Fig. 4: ±{PEAK_ERROR:g} N, ±{SPEED_ERROR:g} m/s"
LIMIT_NAME = "limit of stability: stable below 1"
STABLE_NAME = "thick: stable"
END_NAME = "end of a branch, as far as followed"


def _speeds(rows: Sequence[Row]) -> list[float]:
    return [row["mean_speed"] for row in rows]


def _bodies(rows: Sequence[Row]) -> list[Body]:
    """Bodies that do not bend in the order of the table, then the others, softest first."""
    groups: dict[tuple[str, float | None], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["body"], row["spine_stiffness"]), []).append(row)
    stiff = [name for name in groups if name[1] is None]
    bending = sorted((name for name in groups if name[1] is not None), key=lambda n: n[1] or 0.0)
    colors = [baseline_color(body) for body, _ in stiff]
    return [
        Body(
            name[0] if name[1] is None else f"{name[0]}, $k_t$ = {name[1]:g} N m/rad",
            color,
            sorted(groups[name], key=lambda row: int(row["position"])),
        )
        for name, color in zip([*stiff, *bending], [*colors, *ramp(len(bending))], strict=True)
    ]


def _box(color: Any) -> Look:
    return {"markerfacecolor": to_rgba(color, 0.25), "markeredgecolor": color}


def _mark(axes: Axes, reading: Row, bodies: Iterable[Body]) -> None:
    """Draw a published reading with its errors in the colour of its body."""
    x, y = reading["mean_speed"], reading["peak_grf"]
    color = FAINT
    for body in bodies:
        row = body.rows[0]
        same = row["spine_stiffness"] == reading["spine_stiffness"]
        if same and row["body"].endswith(reading["body"]):
            color = body.color
    box = Rectangle(
        (x - SPEED_ERROR, y - PEAK_ERROR), 2 * SPEED_ERROR, 2 * PEAK_ERROR,
        facecolor=to_rgba(color, 0.25), edgecolor=color, linewidth=1.0, zorder=5,
    )  # fmt: skip
    axes.add_patch(box)
    axes.plot([x], [y], linestyle="none", marker=".", markersize=3.5, color=color, zorder=5)


def _over_speed(
    measure: Measure,
    rows: Sequence[Row],
    bodies: list[Body],
    more: dict[str, Look],
    leg_stiffness: float,
) -> tuple[Figure, Sequence[Axes]]:
    """Draw a measure of every body over mean speed, and the fast end once more."""
    lines = {body.label: {"color": body.color} for body in bodies}
    key = {**lines, **more, END_NAME: {**END, "markeredgecolor": INK}}
    parts = [*setting_of(rows, leg_stiffness), measure.meaning]
    figure = start_figure(f"{measure.name} over mean speed", parts, ONE_ROW, key)
    whole, part = panels = figure.subplots(1, 2, width_ratios=[1.45, 1])
    for axes in panels:
        _prepare(axes, measure, rows)
        for body in bodies:
            _draw(axes, _speeds(body.rows), list(map(measure.of, body.rows)), body.color)
        axes.set_xlabel("mean speed (m/s)")
    whole.set_ylabel(measure.label)
    _enlarge(whole, part, [(row["mean_speed"], measure.of(row)) for row in rows])
    return figure, panels


def _enlarge(whole: Axes, part: Axes, points: list[tuple[float, float]]) -> None:
    """Limit a panel to the fast end, and frame that in the other."""
    speeds = [speed for speed, _ in points]
    length = ENLARGED * (max(speeds) - min(speeds)) or 1.0
    left = max(speeds) - length
    part.set_xlim(left, max(speeds) + 0.08 * length)
    inside = [value for speed, value in points if speed >= left and np.isfinite(value)]
    if inside:
        straight = part.yaxis.get_transform()
        low, high = straight.transform([min(inside), max(inside)])
        room = 0.06 * (high - low) or 1.0
        part.set_ylim(*straight.inverted().transform([low - room, high + room]))
    part.set_title("the fast end, enlarged", fontsize=SMALL_SIZE, loc="left")
    (x0, x1), (y0, y1) = part.get_xlim(), part.get_ylim()
    whole.add_patch(
        Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=FAINT, linewidth=0.8)
    )


def _over_stiffness(
    measure: Measure, rows: Sequence[Row], more: dict[str, Look], leg_stiffness: float
) -> Figure:
    """Draw a measure over spine stiffness, one column a speed, and the branches once more."""
    looks = {row["kind"]: _look(row) for row in rows}
    key = {**looks, **more, END_NAME: {**END, "markeredgecolor": INK}}
    parts = [*setting_of(rows, leg_stiffness), measure.meaning]
    figure = start_figure(f"{measure.name} over spine stiffness", parts, TWO_ROWS, key)
    speeds = sorted({float(row["speed"]) for row in rows})
    panels = figure.subplots(2, len(speeds), sharex="row", sharey=True, squeeze=False)
    for pair, speed in zip(panels.T, speeds, strict=True):
        here = [row for row in rows if row["speed"] == speed]
        for axes in pair:
            axes.set_xscale("log")
            axes.set_xlabel("spine stiffness $k_t$ (N m/rad)")
            _prepare(axes, measure, rows)
            for kind, look in looks.items():
                _draw_kind(axes, [row for row in here if row["kind"] == kind], measure, look)
        missing = [kind for kind in looks if all(row["kind"] != kind for row in here)]
        if missing:
            pair[0].text(
                0.97, 0.97, "\n".join([f"no gait at {speed:g} m/s:", *missing]), va="top",
                ha="right", transform=pair[0].transAxes, fontsize=SMALL_SIZE,
            )  # fmt: skip
        pair[0].set_title(f"mean speed {speed:g} m/s", loc="left")
        pair[1].set_title("the branch, enlarged", fontsize=SMALL_SIZE, loc="left")
    branches = [row["spine_stiffness"] for row in rows if looks[row["kind"]] is BRANCH]
    if branches:
        panels[1, 0].set_xlim(min(branches) / 1.15, max(branches) * 1.15)
    for axes in panels[:, 0]:
        _label_logarithmic(axes.xaxis, axes.get_xlim())
        axes.set_ylabel(measure.label)
    return figure


def _draw_kind(axes: Axes, rows: Sequence[Row], measure: Measure, look: Look) -> None:
    along, values = [row["spine_stiffness"] for row in rows], list(map(measure.of, rows))
    if look is BRANCH:
        _draw(axes, along, values, look["color"])
    elif look is DOTS:
        axes.plot(along, values, **look)
    else:
        for value in values:
            axes.axhline(value, **look)


def _look(row: Row) -> Look:
    """How rows of this kind are drawn over stiffness."""
    if row["spine_stiffness"] is None:
        return LEVEL
    return DOTS if row["kind"].startswith(ONE_BY_ONE) else BRANCH


def _draw(axes: Axes, along: list[float], values: list[float], color: Any) -> None:
    """Draw a branch in its order, since it folds, and mark its ends."""
    axes.plot(along, values, color=color)
    known = [point for point in zip(along, values, strict=True) if np.isfinite(point[1])]
    for x, y in known[:1] + known[-1:]:
        axes.plot([x], [y], **END, markeredgecolor=color)


def _prepare(axes: Axes, measure: Measure, rows: Sequence[Row]) -> None:
    """Set up the vertical axis and the grid."""
    axes.grid(True, **GRID)
    if measure.limit is None:
        axes.yaxis.set_major_locator(MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
        return
    axes.axhline(measure.limit, **LIMIT)
    axes.set_yscale("log")
    values = [measure.of(row) for row in rows]
    _label_logarithmic(axes.yaxis, (min(values), max(values)))


def _label_logarithmic(axis: Axis, limits: tuple[float, float]) -> None:
    """Label a logarithmic axis that is not very wide at 1, 2, 5, 10 and so on."""
    if limits[1] < VERY_WIDE * limits[0]:
        axis.set_major_locator(LogLocator(10, subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def setting_of(rows: Sequence[Row], leg_stiffness: float) -> list[str]:
    """What all gaits share, and what the stiffnesses are of."""
    if not rows:
        raise InputError("the table has no rows", "give one with a gait at least")
    parts = []
    for name, label, unit in (("energy", "total energy", "J"), ("apex_height", "apex height", "m")):
        values = [row[name] for row in rows]
        if np.ptp(values) <= EQUAL * max(values):
            parts.append(f"{label} {values[0]:.4g} {unit}")
    parts.append(f"leg stiffness $k_l$ = {leg_stiffness:g} N/m per leg pair")
    return [*parts, "spine stiffness $k_t$ on the relative angle"]
