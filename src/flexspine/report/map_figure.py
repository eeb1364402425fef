"""A map of gaits over mean speed and spine stiffness: peak forces and stability as images."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from flexspine.errors import InputError
from flexspine.parameters import values
from flexspine.report.caption import joined, of_legs
from flexspine.report.picture import Picture
from flexspine.report.style import INK, LINE, SMALL_SIZE, VERMILION, add_title, themed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

    from flexspine.hybrid.compile import Array
    from flexspine.studies.gait_map import GaitMap

    Look = dict[str, Any]

# N m/rad; the stiffnesses of Kamimura et al. 2015.
PUBLISHED = (200.0, 220.0, 240.0, 260.0)

WIDTH, HEIGHT = 8.6, 4.5  # in; of a figure, and of its panels with their scales

LETTERS = 130  # of small type; what fits into a line

# How the end of a branch is told at which a leg would land once more.
SECOND_TOUCHDOWN = "second touchdown"

# Parts of a cell, in each direction, that are drawn or not where gaits end within it.
FINE = 8

LIMIT = 1.0

# Of full brightness.
DARK = 0.6

ABSENT: Look = {"facecolor": "#F2F2F2", "edgecolor": "#CFCFCF", "hatch": "////", "linewidth": 0}
EDGE: Look = {"color": INK, "linewidth": 1.4}
MARK: Look = {"color": INK, "linewidth": 0.9, "linestyle": (0, (5, 3))}
HALO: Look = {"color": "white", "linewidth": 2.0, "alpha": 0.45}
STABLE: Look = {"color": VERMILION, "linewidth": 2.4}


class Panel(NamedTuple):
    """How something is drawn of every gait."""

    content: Array
    label: str
    colors: str
    norm: Normalize
    levels: Sequence[float]


def plot_map(found: GaitMap, published: Sequence[float] = PUBLISHED) -> Figure:
    """Draw peak GRF and the spectral radius over mean speed and spine stiffness.

    ``published`` are stiffnesses to mark, in N m/rad. Raises `InputError` if there is no gait.
    """
    if not found.found:
        raise InputError("the map has no gait", "map other speeds or stiffnesses")
    with themed({"hatch.linewidth": 0.5}):
        details = joined(_details(found), LETTERS)
        marks = [k for k in published if found.stiffnesses[0] <= k <= found.stiffnesses[-1]]
        key = _key(found, marks)
        figure = Picture(figsize=(WIDTH, HEIGHT + 0.65 + LINE * len(details)), layout="constrained")
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, picture in zip(panels, (_forces(found), _radii(found)), strict=True):
            image = _draw_image(axes, found, picture)
            bar = figure.colorbar(
                image, ax=axes, location="top", aspect=32, label=picture.label
            )  # fmt: skip
            bar.outline.set_visible(False)
            bar.ax.xaxis.set_major_locator(FixedLocator(picture.levels))
            bar.ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            bar.ax.xaxis.set_minor_locator(NullLocator())
            _draw_lines(axes, found, marks)
            axes.set_xlabel("mean speed (m/s)")
        panels[0].set_ylabel("spine stiffness $k_t$ (N m/rad)")
        figure.legend(
            list(key.values()), list(key), loc="outside lower left", ncols=4,
            columnspacing=1.6, handlelength=2.2,
        )  # fmt: skip
        add_title(figure, "Gaits over mean speed and spine stiffness", details)
    return figure


def _forces(found: GaitMap) -> Panel:
    known = found.peak_grf[np.isfinite(found.peak_grf)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    step = next((s for s in (10, 20, 50, 100, 200, 500) if (high - low) / s < 12), 1000)
    levels = [float(step * n) for n in range(ceil(low / step), ceil(high / step))]
    norm = Normalize(low, high)
    return Panel(found.peak_grf, "peak GRF (N per leg pair)", "viridis", norm, levels)


def _radii(found: GaitMap) -> Panel:
    low, high = float(np.nanmin(found.radius)), float(np.nanmax(found.radius))
    levels = [v for v in (0.2, 0.5, 1, 1.5, 2, 3, 4, 5, 7, 10, 20, 50) if low < v < high]
    norm = LogNorm(low, max(high, 1.01 * low))
    label = "spectral radius on the energy level: stable below 1"
    return Panel(found.radius, label, "cividis_r", norm, levels)


def _draw_image(axes: Axes, found: GaitMap, picture: Panel) -> AxesImage:
    """Draw every gait as a cell, cut where gaits end, and hatch what is left empty."""
    axes.add_patch(Rectangle((0, 0), 1, 1, transform=axes.transAxes, zorder=0, **ABSENT))
    (x0, dx, nx), (y0, dy, ny) = (
        (line[0], line[1] - line[0], len(line)) for line in (found.speeds, found.stiffnesses)
    )
    across, up = ((np.arange(FINE * n) + 0.5) / FINE - 0.5 for n in (nx, ny))
    speeds = x0 + dx * across
    first, last = (_between(ends, up)[:, None] for ends in _bounds(found))
    columns, lines = (np.rint(at).astype(int) for at in (across, up))
    shown = _widened(picture.content)[lines][:, columns]
    inside = (first <= speeds) & (speeds <= last)
    image = axes.imshow(
        np.ma.masked_invalid(np.where(inside, shown, np.nan)), norm=picture.norm,
        cmap=colormaps[picture.colors], origin="lower", aspect="auto", interpolation="nearest",
        extent=(x0 - dx / 2, x0 + (nx - 0.5) * dx, y0 - dy / 2, y0 + (ny - 0.5) * dy),
    )  # fmt: skip
    whole = [level for level in picture.levels if level % 1 == 0 and level != LIMIT]
    if whole:
        shown = np.ma.masked_invalid(picture.content)
        contours = axes.contour(
            found.speeds, found.stiffnesses, shown, whole, linewidths=0.7,
            colors=[_legible(image, level) for level in whole],
        )  # fmt: skip
        axes.clabel(contours, fontsize=SMALL_SIZE - 1, fmt="%g")
    return image


def _legible(image: AxesImage, value: float) -> str:
    """Ink on light colours, white on dark ones."""
    red, green, blue, _ = image.to_rgba(np.array([value]))[0]
    return INK if 0.3 * red + 0.59 * green + 0.11 * blue > DARK else "white"


def _bounds(found: GaitMap) -> tuple[Array, Array]:
    """The speeds between which each line has gaits: endless where the map ends before."""
    there = np.isfinite(found.radius).any(axis=1)
    low = np.where(np.isnan(found.slowest), -np.inf, found.slowest)
    high = np.where(np.isnan(found.fastest), np.inf, found.fastest)
    return np.where(there, low, np.nan), np.where(there, high, np.nan)


def _between(ends: Array, at: Array) -> Array:
    """Where gaits end between lines: straight from one to the next, else as on the nearest."""
    before = np.floor(at).astype(int).clip(0, len(ends) - 2)
    share = (at - before).clip(0, 1)
    with np.errstate(invalid="ignore"):
        straight = (1 - share) * ends[before] + share * ends[before + 1]
    found: Array = np.where(np.isfinite(straight), straight, ends[np.rint(at).astype(int)])
    return found


def _widened(content: Array) -> Array:
    """The same with the first and the last gait of every line repeated outwards."""
    wide = content.copy()
    for line in wide:
        known = np.flatnonzero(np.isfinite(line))
        if len(known):
            line[: known[0]], line[known[-1] :] = line[known[0]], line[known[-1]]
    return wide


def _draw_lines(axes: Axes, found: GaitMap, marks: Sequence[float]) -> None:
    """Draw where gaits end and where they turn stable, and mark stiffnesses."""
    limits = (found.speeds[0], found.speeds[-1])
    for ends in (found.slowest, found.fastest):
        axes.plot(ends, found.stiffnesses, **EDGE)
    if 0 < found.stable < found.found:
        shown = np.ma.masked_invalid(found.radius)
        axes.contour(
            found.speeds, found.stiffnesses, shown, [LIMIT], colors=STABLE["color"],
            linewidths=STABLE["linewidth"],
        )  # fmt: skip
    for stiffness in marks:
        axes.axhline(stiffness, **HALO)
        axes.axhline(stiffness, **MARK)
    axes.set_xlim(*limits)
    axes.set_ylim(found.stiffnesses[0], found.stiffnesses[-1])


def _details(found: GaitMap) -> list[str]:
    """What all gaits share, and how stable the most stable of them is."""
    given = values(found.model.parameters)
    i, j = np.unravel_index(np.nanargmin(found.radius), found.radius.shape)
    where = f"$k_t$ = {found.stiffnesses[i]:g} N m/rad and {found.speeds[j]:.3g} m/s"
    stable = "" if found.stable else "no gait here is stable: "
    return [
        found.model.name,
        f"total energy {found.energy:.4g} J",
        f"apex height {found.height:.4g} m",
        *of_legs(given, "stiffness $k_l$", "stiffness", "N/m per leg pair"),
        "followed over speed, stiffness by stiffness",
        "peak: of fore or hind legs, whichever is larger",
        f"{stable}least spectral radius {found.radius[i, j]:.3g}, at {where}",
    ]


def _key(found: GaitMap, marks: Sequence[float]) -> Look:
    """What lines and areas mean, those that there are."""
    key: Look = {}
    if np.isnan(found.radius).any():
        key["no gait reached"] = Patch(**ABSENT)
    if np.isfinite([found.slowest, found.fastest]).any():
        slow = any(reason.startswith(SECOND_TOUCHDOWN) for reason in found.reasons)
        why = f" (slow side: {SECOND_TOUCHDOWN})" if slow else ""
        key[f"where gaits end{why}"] = Line2D([], [], **EDGE)
    if marks:
        key["stiffness in Kamimura et al. 2015"] = Line2D([], [], **MARK)
    if 0 < found.stable < found.found:
        key["limit of stability"] = Line2D([], [], **STABLE)
    return key
