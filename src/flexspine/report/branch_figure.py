"""A branch of gaits: peak forces, stability and touchdown angles over what is followed.

Where actuators work, what is spent; where further parameters are free, what they are.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from math import degrees, isclose, nan
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from flexspine.gaits.family import BRANCHING, DOUBLING, FOLD, NEIMARK_SACKER, UNIT
from flexspine.gaits.landmarks import (
    CONTACTS,
    GRAZING,
    NO_FLIGHT,
    REFUTED,
    SECOND_TOUCHDOWN,
    SYMMETRY_BREAKING,
)
from flexspine.report.branch_axis import NAMES, Axis, axis_of, spread
from flexspine.report.caption import SIDES, joined, of_legs
from flexspine.report.picture import Picture
from flexspine.report.style import (
    FAINT,
    GREEN,
    INK,
    LINE,
    MARKS,
    ORANGE,
    PURPLE,
    SIDE_COLORS,
    SMALL_SIZE,
    add_legend,
    add_title,
    themed,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    Record = dict[str, Any]

# In the order of their marks.
KINDS = (
    FOLD,
    SYMMETRY_BREAKING,
    DOUBLING,
    NEIMARK_SACKER,
    UNIT,
    CONTACTS,
    SECOND_TOUCHDOWN,
    GRAZING,
    BRANCHING,
    NO_FLIGHT,
    REFUTED,
)

# Forces of both ends that differ by less, relatively, are drawn as one curve.
EQUAL = 1e-6

# A spectral radius that varies by more than the first factor is drawn on a logarithmic axis, and
# by more than the second with fewer labels; one that is zero up to rounding counts as the third.
WIDE, VERY_WIDE, TINY = 5.0, 100.0, 1e-12

# What fits into a line of small type.
LETTERS = 105

# Values of one kind of landmark that are listed.
MOST_VALUES = 8

# in; of a letter of small type, and of a panel; how high three panels are, and any further one.
LETTER, PANEL = 0.066, 5.9
THREE, FURTHER = 6.6, 1.75


class Curve(NamedTuple):
    """Something drawn over the branch, ``of`` a gait."""

    of: Callable[[Record], float]
    color: str
    label: str | None = None
    dashed: bool = False


def plot_branch(record: Record) -> Figure:
    """Draw a branch, as `branch_record` gives it: peak GRF, stability and touchdown angles.

    Cost of transport and free parameters have their panels where there are any.
    """
    with themed():
        points = record["points"]
        axis = axis_of(record["over"], points[0]["model"])
        details, key = _details(record, axis), _key(record, axis)
        spent = any(gait["work"] for gait in points)
        extra = len(record["free"]) + spent
        height = 0.38 + LINE * (len(details) + sum(1 + text.count("\n") for text in key))
        figure = Picture(figsize=(7.4, THREE + FURTHER * extra + height), layout="constrained")
        panels = figure.subplots(3 + extra, 1, sharex=True, height_ratios=[1.2, *[1] * (2 + extra)])
        forces, *further, radius, angles = panels
        spread(angles, [axis.of(gait) for gait in points])
        _draw(forces, _forces(forces, points), record, axis)
        for axes, name in zip(further, record["free"], strict=False):
            _draw(axes, [_free(axes, axis_of(name, points[0]["model"]))], record, axis)
        if spent:
            _draw(further[-1], [_cost(further[-1])], record, axis)
        _draw(radius, [_radius(radius, points)], record, axis)
        _draw(angles, _angles(angles), record, axis)
        _name_ends(forces, record, axis)
        angles.set_xlabel(axis.told)
        figure.align_ylabels(panels)
        figure.legend(
            [Line2D([], [], **look) for look in key.values()], list(key),
            loc="outside lower left", labelspacing=0.35, handlelength=1.5,
        )  # fmt: skip
        add_title(figure, f"{points[0]['preset']}: branch of gaits over {axis.label}", details)
    return figure


def _details(record: Record, axis: Axis) -> list[str]:
    """What a reader must know: what is kept, and the stiffnesses."""
    gait, kept = record["points"][0], []
    for name, value in record["fixed"].items():
        one = axis_of(name, gait["model"])
        kept.append(f"{one.label} {one.shown(value):.6g} {one.unit}".replace(" °", "°"))
    changing = (axis.name, *record["free"])
    given = {name: value for name, value in gait["parameters"].items() if name not in changing}
    parts = [f"{'symmetric' if record['symmetric'] else 'general'} gaits"]
    parts += [f"kept: {', '.join(kept)}"] if kept else []
    freed = [axis_of(name, gait["model"]).label for name in record["free"]]
    parts += [f"free: {', '.join(freed)}"] if freed else []
    both = of_legs(given, "stiffness $k_l$", "stiffness", "N/m per leg pair")
    for name in ("spine.stiffness", "fore.leg.stiffness", "hind.leg.stiffness"):
        if name in given and not (both and "leg" in name):
            label, unit = NAMES[name]
            parts.append(f"{label} = {given[name]:g} {unit}")
    if given.get("spine.damping"):
        label, unit = NAMES["spine.damping"]
        parts.append(f"{label} = {given['spine.damping']:g} {unit}")
    return joined([*parts, *both])


def _forces(axes: Axes, points: list[Record]) -> list[Curve]:
    axes.set_ylabel("peak GRF\n(N per leg pair)")
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    fore, hind = (np.array([_peak(gait, side) for gait in points]) for side in SIDES)
    if np.nanmax(np.abs(fore - hind), initial=0.0) <= EQUAL * np.nanmax(fore, initial=0.0):
        return [Curve(lambda gait: _peak(gait, "fore"), INK, "fore legs =\nhind legs")]
    return _of_sides(_peak, dashed="hind")


def _peak(gait: Record, side: str) -> float:
    """The peak force, NaN for a gait on the brink that could not be run as far as its peak."""
    return float(gait["peak_grf"][side]) if gait["confirmed"] else nan


def _free(axes: Axes, axis: Axis) -> Curve:
    """The curve of a free parameter."""
    axes.set_ylabel(axis.told)
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    return Curve(axis.of, PURPLE)


def _cost(axes: Axes) -> Curve:
    axes.set_ylabel("cost of transport")
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    return Curve(lambda gait: gait["cost_of_transport"] if gait["confirmed"] else nan, ORANGE)


def _radius(axes: Axes, points: list[Record]) -> Curve:
    level = "" if points[0]["energy_identity"] is None else "\non the energy level"
    axes.set_ylabel(f"spectral radius{level}")
    axes.axhline(1.0, color=INK, linewidth=0.8, linestyle=(0, (6, 3)), label="stable\nbelow 1")
    curve = Curve(lambda gait: float(gait["level_spectral_radius"]), INK)
    radii = [curve.of(gait) for gait in points]
    spread = max(radii) / max(min(radii), TINY)
    if spread > WIDE:
        axes.set_yscale("log")
        subs = (1.0, 2.0, 5.0) if spread < VERY_WIDE else (1.0,)
        axes.yaxis.set_major_locator(LogLocator(10, subs=subs))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    return curve


def _angles(axes: Axes) -> list[Curve]:
    axes.set_ylabel("touchdown angle (°)\nfoot ahead positive")
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    return _of_sides(lambda gait, side: degrees(gait["touchdown_angles"][side]))


def _of_sides(of: Callable[[Record, str], float], dashed: str = "") -> list[Curve]:
    """A curve of the fore legs and one of the hind legs; a dashed one lets the other show."""

    def curve(side: str) -> Curve:
        return Curve(lambda gait: of(gait, side), SIDE_COLORS[side], f"{side} legs", side == dashed)

    return [curve(side) for side in SIDES]


def _draw(axes: Axes, curves: list[Curve], record: Record, axis: Axis) -> None:
    """Draw the curves of a panel with what happens on them."""
    points = record["points"]
    along = [axis.of(gait) for gait in points]
    for curve in curves:
        values = [curve.of(gait) for gait in points]
        axes.plot(
            along, values, color=curve.color, label=curve.label,
            linestyle=(0, (4, 1.5)) if curve.dashed else "-",
        )  # fmt: skip
        steady = [
            value if gait["stable"] else np.nan for gait, value in zip(points, values, strict=True)
        ]
        axes.plot(along, steady, **STABLE)
        for mark in record["landmarks"]:
            where = (axis.of(mark["gait"]), curve.of(mark["gait"]))
            axes.plot(*([x] for x in where), **_look(mark["kind"]), clip_on=False)
    for end in (along[0], along[-1]):
        axes.axvline(end, color=FAINT, linewidth=0.8, linestyle=":", zorder=1)
    axes.yaxis.grid(True, color=FAINT, alpha=0.25, linewidth=0.5)
    axes.margins(y=0.12)
    if axes.get_legend_handles_labels()[0]:
        add_legend(axes)


STABLE: dict[str, Any] = {
    "color": GREEN,
    "alpha": 0.35,
    "linewidth": 7.0,
    "solid_capstyle": "butt",
    "zorder": 1.8,
}


def _look(kind: str) -> dict[str, Any]:
    """How a landmark is drawn."""
    shape, color = MARKS[KINDS.index(kind)]
    return {
        "linestyle": "none", "marker": shape, "markersize": 6.0, "zorder": 5,
        "markerfacecolor": color, "markeredgecolor": INK, "markeredgewidth": 0.7,
    }  # fmt: skip


def _key(record: Record, axis: Axis) -> dict[str, dict[str, Any]]:
    """What marks look like by what they mean: where landmarks of a kind are, and what."""
    key = {}
    if any(gait["stable"] for gait in record["points"]):
        level = "" if record["points"][0]["energy_identity"] is None else " at this energy"
        key[f"stable: small deviations{level} die out"] = STABLE
    for kind in KINDS:
        marks = [mark for mark in record["landmarks"] if mark["kind"] == kind]
        if marks:
            key["\n".join(wrap(_told(marks, axis), LETTERS))] = _look(kind)
    return key


def _told(marks: list[Record], axis: Axis) -> str:
    """Where landmarks of one kind are, and what they are if all are the same."""
    values = [f"{axis.shown(mark['value']):.5g}" for mark in marks]
    if len(values) > MOST_VALUES:
        values = [*values[:MOST_VALUES], f"{len(marks) - MOST_VALUES} more"]
    text = f"{marks[0]['kind']} at {', '.join(values)} {axis.unit}".replace(" °", "°")
    details = {mark["detail"].replace(axis.name, axis.label) for mark in marks}
    return f"{text}: {details.pop()}" if len(details) == 1 else text


def _name_ends(axes: Axes, record: Record, axis: Axis) -> None:
    """Say above the panel why the branch ends where it does."""
    ends = [axis.of(record["points"][at]) for at in (0, -1)]
    even = axes.xaxis.get_transform().transform
    low, high = even(axes.get_xlim())
    told = sorted(zip(ends, map(_brief, record["ends"]), strict=True))
    if told[0][1] == told[1][1] and isclose(told[0][0], told[1][0]):
        told = [(told[0][0], f"both {told[0][1].replace('ends', 'end')}")]
    shares = [float(even(end) - low) / (high - low) for end, _ in told]
    rights = [share > 0.5 for share in shares]
    length = LETTER * sum(len(text) + 2 for _, text in told)
    apart = (shares[-1] - shares[0]) * PANEL
    aside = rights == [False, True] and length < apart
    for row, ((end, text), right) in enumerate(zip(told, rights, strict=True)):
        axes.annotate(
            f"{text} ▾" if right else f"▾ {text}", (end, 1.0),
            xycoords=("data", "axes fraction"), textcoords="offset points",
            xytext=(4 if right else -4, 3 if aside else 3 + 11 * row),
            ha="right" if right else "left", fontsize=SMALL_SIZE, color=INK,
        )  # fmt: skip


def _brief(end: str) -> str:
    """The first words of why a branch ends."""
    if end.startswith("reached"):
        return "ends at the bound"
    for kind in KINDS:
        if end.startswith(kind):
            return f"ends: {kind}"
    return f"ends: {re.split(' beyond | after |:', end)[0]}"
