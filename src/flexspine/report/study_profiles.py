"""Strides of rigid and flexible spines side by side over time: height, forces, energy shares."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator

from flexspine.errors import InputError
from flexspine.report.caption import SIDES, joined, of_legs
from flexspine.report.figure import _shares
from flexspine.report.picture import Picture
from flexspine.report.style import (
    ENERGY_COLORS,
    FAINT,
    INK,
    LINE,
    ORANGE,
    SMALL_SIZE,
    add_title,
    themed,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    Look = dict[str, Any]
    Profiles = Mapping[tuple[str, float], xr.Dataset]

# Bodies that bend go from soft to stiff through a part of a colour map whose lightness falls all
# the way; colour-blind readers can tell it from the colours of those that do not.
RAMP, SOFT, STIFF = "viridis", 0.7, 0.15

# Relative; numbers that differ by less are one number of the setting.
EQUAL = 1e-6

GRID: Look = {"color": FAINT, "alpha": 0.25, "linewidth": 0.5}

WIDTH, HEIGHT = 8.6, 4.8  # in; of a figure, and of its panels here

LETTERS = 140  # of small type; what fits into a line

# Of the longest column; shorter strides leave some of theirs empty, that words find room.
NARROWEST = 0.5

# Of the range of heights; what a line of words takes above the curves.
WORDS = 0.08

# Fore and hind, as in `plot_run`; colours tell the bodies here.
STYLES: tuple[Any, ...] = ("-", (0, (4, 1.5)))

# The shares of energy, lowest first.
STACK = ("spine", "legs", "gravity", "kinetic", "dissipated")


def plot_profiles(profiles: Profiles, speeds: Sequence[float] = (4.0, 4.25, 4.5)) -> Figure:
    """Draw CoM height and forces over one stride, one column a mean speed in m/s.

    ``profiles`` holds strides from apex to apex by the name of the body and the speed. Drawn are
    the bodies that do not bend and the softest and the stiffest of those that do. Raises
    `InputError` if there is nothing to draw.
    """
    with themed():
        looks = _looks(profiles)
        columns = [_column(profiles, list(looks), speed) for speed in speeds]
        key: dict[str, Look] = {_told(name): {"color": color} for name, color in looks.items()}
        for side, style in zip(SIDES, STYLES, strict=True):
            key[f"{side} legs"] = {"color": INK, "linestyle": style}
        heading = "CoM height and ground reaction forces over one stride"
        parts = [*_setting(columns), "GRF: magnitude of the force of a pair of legs"]
        figure = start_figure(heading, parts, HEIGHT, key)
        panels = _panels(figure, columns)
        for axes, column, speed in zip(panels.T, columns, speeds, strict=True):
            axes[0].set_title(f"mean speed {speed:g} m/s", loc="left")
            for name, stride in column.items():
                _draw_stride(axes, stride, looks[name])
        missing = [[_told(name) for name in looks if name not in column] for column in columns]
        heights, forces = panels[:, 0]
        low, high = heights.get_ylim()
        lines = max(len(names) + bool(names) for names in missing)
        heights.set_ylim(low, high + WORDS * lines * (high - low))
        for axes, names, speed in zip(panels[0], missing, speeds, strict=True):
            if names:
                _say(axes, "\n".join([f"no gait at {speed:g} m/s:", *names]))
        forces.set_ylim(bottom=0)
        heights.set_ylabel("CoM height (m)")
        forces.set_ylabel("GRF (N per leg pair)")
    return figure


def plot_energy_shares(profiles: Profiles, speed: float = 4.5) -> Figure:
    """Draw how energy is shared over one stride at a mean speed in m/s, one column a body.

    ``profiles`` are those of `plot_profiles`; of the bodies that bend the stiffest is drawn.
    Raises `InputError` if there is nothing to draw.
    """
    with themed():
        *rigid, stiffest = _looks(profiles)
        names = [name for name in rigid if _stiffness(profiles, name) is None] + [stiffest]
        columns = [_column(profiles, [name], speed) for name in names]
        parts = _setting(columns)
        shares = [{name: _shares(stride) for name, stride in c.items()} for c in columns]
        shown = [kind for kind in STACK if any(kind in s for c in shares for s in c.values())]
        key = {kind: {"color": ENERGY_COLORS[kind], "linewidth": 6} for kind in shown[::-1]}
        heading = f"Energy shares over one stride, mean speed {speed:g} m/s"
        figure = start_figure(heading, parts, HEIGHT, key, len(key))
        panels = _panels(figure, columns)
        for axes, column, name in zip(panels.T, columns, names, strict=True):
            axes[0].set_title(_told(name), loc="left")
            for stride in column.values():
                _draw_shares(axes, stride)
            if not column:
                _say(axes[0], f"no gait at {speed:g} m/s")
        stacked, elastic = panels[:, 0]
        stacked.set_ylim(0, 100)
        stacked.set_yticks([0, 25, 50, 75, 100])
        stacked.set_ylabel("energy (% of total)")
        elastic.set_ylim(bottom=0)
        elastic.set_ylabel("legs and spine enlarged,\nnot stacked (% of total)")
    return figure


def ramp(count: int) -> list[Any]:
    """Return the colours of so many bodies that bend, softest first."""
    return [colormaps[RAMP](at) for at in np.linspace(SOFT, STIFF, count)]


def baseline_color(body: str) -> str:
    """Return the colour of a body that does not bend."""
    return ORANGE if body.startswith("locked") else INK


def start_figure(
    heading: str, parts: list[str], height: float, key: dict[str, Look], columns: int = 3
) -> Figure:
    """Return a figure without panels: a title, room of a height (in), and a key at its foot."""
    details = joined(parts, LETTERS)
    height += 0.45 + LINE * (len(details) - (-len(key) // columns))
    figure = Picture(figsize=(WIDTH, height), layout="constrained")
    add_title(figure, heading, details)
    figure.legend(
        [Line2D([], [], **look) for look in key.values()], list(key), loc="outside lower left",
        ncols=columns, columnspacing=1.4, labelspacing=0.35, handlelength=1.7,
    )  # fmt: skip
    return figure


def _looks(profiles: Profiles) -> dict[str, Any]:
    """The colours of the bodies to draw: those that do not bend, the softest, the stiffest."""
    if not profiles:
        raise InputError("there is no stride to draw", "give the strides of one body at least")
    stiffnesses = {name: _stiffness(profiles, name) for name, _ in profiles}
    rigid = [name for name, stiffness in stiffnesses.items() if stiffness is None]
    bending = sorted((k, name) for name, k in stiffnesses.items() if k is not None)
    looks = {name: baseline_color(name) for name in rigid}
    ends = list(zip(bending, ramp(len(bending)), strict=True))
    return looks | {name: color for (_, name), color in [*ends[:1], *ends[-1:]]}


def _stiffness(profiles: Profiles, name: str) -> float | None:
    """The spine stiffness of a body, None if it does not bend."""
    stride = next(stride for (body, _), stride in profiles.items() if body == name)
    value: float | None = _given(stride).get("spine.stiffness")
    return value


def _given(stride: xr.Dataset) -> dict[str, Any]:
    given: dict[str, Any] = json.loads(stride.attrs.get("parameters", "{}"))
    return given


def _column(profiles: Profiles, names: Sequence[str], speed: float) -> dict[str, xr.Dataset]:
    """The strides there are at a speed, by body."""
    return {name: profiles[name, speed] for name in names if (name, speed) in profiles}


def _told(name: str) -> str:
    return name.replace("k_t", "$k_t$")


def _setting(columns: list[dict[str, xr.Dataset]]) -> list[str]:
    """What all strides share, and what the stiffnesses are of."""
    strides = [stride for column in columns for stride in column.values()]
    if not strides:
        raise InputError("no body has a stride at these speeds", "give speeds of the profiles")
    parts = []
    for name, label, unit in (
        ("total_energy", "total energy", "J"),
        ("com_y", "apex height", "m"),
    ):
        values = [float(stride[name][0]) for stride in strides]
        if np.ptp(values) <= EQUAL * max(values):
            parts.append(f"{label} {values[0]:.4g} {unit}")
    legs = [of_legs(_given(s), "stiffness $k_l$", "stiffness", "N/m per leg pair") for s in strides]
    parts += legs[0] if all(one == legs[0] for one in legs) else []
    return [*parts, "spine stiffness $k_t$ on the relative angle"]


def _panels(figure: Figure, columns: list[dict[str, xr.Dataset]]) -> Any:
    """Two rows of panels; a second is as long in every column."""
    lengths = [max([0.0, *(_time(s)[-1] for s in column.values())]) for column in columns]
    lengths = [max(length, NARROWEST * max(lengths)) for length in lengths]
    panels = figure.subplots(
        2, len(columns), sharex="col", sharey="row", width_ratios=lengths, squeeze=False
    )
    for pair, length in zip(panels.T, lengths, strict=True):
        for axes in pair:
            axes.grid(True, **GRID)
            axes.set_axisbelow(True)
            axes.set_xlim(0, length)
            axes.xaxis.set_major_locator(MultipleLocator(0.1))
            axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
        pair[1].set_xlabel("time (s)")
    figure.align_ylabels(panels[:, 0])
    return panels


def _time(stride: xr.Dataset) -> Any:
    """Time since the apex at the start."""
    return stride["time"].values - float(stride["time"][0])


def _draw_stride(panels: Sequence[Axes], stride: xr.Dataset, color: Any) -> None:
    heights, forces = panels
    heights.plot(_time(stride), stride["com_y"], color=color)
    for side, style in zip(SIDES, STYLES, strict=True):
        force = stride[f"{side}_grf"].values
        loaded = np.convolve(force > 0, np.ones(3))[1:-1] > 0
        values = np.where(loaded, force, np.nan)
        forces.plot(_time(stride), values, color=color, linestyle=style)


def _draw_shares(panels: Sequence[Axes], stride: xr.Dataset) -> None:
    """Stack all shares, spine and legs lowest; below it these alone, each from zero."""
    stacked, elastic = panels
    time, shares = _time(stride), _shares(stride)
    kinds = [kind for kind in STACK if kind in shares]
    stacked.stackplot(
        time, [shares[kind] for kind in kinds], linewidth=0,
        colors=[ENERGY_COLORS[kind] for kind in kinds],
    )  # fmt: skip
    for kind in ("legs", "spine"):
        if kind in shares:
            color = ENERGY_COLORS[kind]
            elastic.plot(time, shares[kind], color=color)
            elastic.fill_between(time, shares[kind], color=color, alpha=0.25, linewidth=0)


def _say(axes: Axes, text: str) -> None:
    axes.text(
        0.03, 0.97, text, va="top", transform=axes.transAxes, fontsize=SMALL_SIZE
    )  # fmt: skip
