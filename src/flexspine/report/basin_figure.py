"""The basin of attraction of gaits: how long starts keep bounding, and where they settle."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from flexspine.errors import InputError
from flexspine.models.dataset import unit_and_meaning
from flexspine.report.caption import joined
from flexspine.report.picture import Picture
from flexspine.report.style import INK, LINE, SMALL_SIZE, add_title, themed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from flexspine.hybrid.compile import Array
    from flexspine.studies.basin import Basin

    Look = dict[str, Any]

# Strides at which another colour begins.
STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)

# Of the colour map, for starts that fell later; the lightest colour is for those that did not.
FALLEN = (0.12, 0.85)

# Natural units; rounding leaves more than the first, and a body about to fall is off by the second.
NEAREST, FARTHEST = 1e-12, 1.0

COLUMN, SIDES, PANELS = 1.95, 1.7, 5.0  # in; a column, what is beside them, and both rows

LETTERS = 15  # of small type; what fits into an inch

# What people read in place of an SI unit, and how many of it make one.
READ = {"rad": ("°", degrees(1)), "rad/s": ("°/s", degrees(1))}

FELL: Look = {"facecolor": "#D5D5D5", "linewidth": 0}
IMPOSSIBLE: Look = {"facecolor": "white", "edgecolor": "#C4C4C4", "hatch": "////", "linewidth": 0}
GAIT: Look = {
    "linestyle": "none", "marker": "o", "markersize": 5.5, "markerfacecolor": "white",
    "markeredgecolor": INK, "markeredgewidth": 1.2,
}  # fmt: skip


class Scale(NamedTuple):
    """A coordinate as people read it: what it is called, its unit, and how many make an SI one."""

    label: str
    unit: str
    factor: float

    @classmethod
    def of(cls, name: str) -> Scale:
        """That of an apex coordinate."""
        variable = {"height": "com_y", "speed": "com_x_rate"}.get(name, name)
        unit, _ = unit_and_meaning(variable)
        return cls(f"apex {name.replace('_', ' ')}", *READ.get(unit, (unit, 1.0)))


def plot_basin(basins: Sequence[Basin]) -> Figure:
    """Draw strides survived and the deviation left over starts, one column a gait.

    Raises `InputError` for basins of different slices or strides.
    """
    if len({(basin.over, basin.wanted) for basin in basins}) != 1:
        raise InputError("these basins are not of one slice", "give those of one directory")
    with themed({"hatch.linewidth": 0.5}):
        width = SIDES + COLUMN * max(len(basins), 2)
        details = joined(_details(basins[0]), int(LETTERS * width))
        figure = Picture(figsize=(width, PANELS + 0.65 + LINE * len(details)), layout="constrained")
        panels = figure.subplots(2, len(basins), sharex="col", sharey="col", squeeze=False)
        steps = [step for step in STEPS if step < basins[0].wanted] + [basins[0].wanted]
        survived, left = _survived(steps), _left()
        first, second = map(Scale.of, basins[0].over)
        for (above, below), basin in zip(panels.T, basins, strict=True):
            _draw(above, basin, basin.strides, basin.possible, survived)
            _draw(below, basin, basin.deviation, basin.lasted, left)
            above.set_title(_title(basin), loc="left")
            below.set_title(_count(basin), loc="left", fontsize=SMALL_SIZE)
            below.set_xlabel(f"{first.label} ({first.unit})")
        for axes in panels[:, 0]:
            axes.set_ylabel(f"{second.label} ({second.unit})")
        _draw_bars(figure, panels, survived, left, steps)
        figure.align_ylabels(panels[:, 0])
        key = _key(basins)
        figure.legend(
            list(key.values()), list(key), loc="outside lower left", ncols=len(key),
            columnspacing=1.6, handlelength=1.8,
        )  # fmt: skip
        add_title(figure, "Starts that keep bounding, and those that come to the gait", details)
    return figure


def _survived(steps: Sequence[int]) -> ScalarMappable:
    """Colours of strides completed: a class from each step on, the last for all strides."""
    shades = colormaps["inferno"]([*np.linspace(*FALLEN, len(steps) - 2), 1.0])
    colors = ListedColormap([to_rgba(FELL["facecolor"]), *shades])
    return ScalarMappable(BoundaryNorm([*steps, steps[-1] + 1], len(steps)), colors)


def _left() -> ScalarMappable:
    """Colours of deviations."""
    return ScalarMappable(LogNorm(NEAREST, FARTHEST), colormaps["cividis"])


def _draw(
    axes: Axes, basin: Basin, content: NDArray[Any], shown: NDArray[Any], look: ScalarMappable
) -> None:
    """Draw an image over the starts and mark the gait; plain grey are starts that have no value."""
    first, second = (
        Scale.of(name).factor * line for name, line in zip(basin.over, basin.values, strict=True)
    )
    axes.add_patch(Rectangle((0, 0), 1, 1, transform=axes.transAxes, zorder=0, **IMPOSSIBLE))
    frame = (*_edges(first), *_edges(second))
    layers: list[tuple[NDArray[Any], NDArray[Any], Look]] = [
        (np.zeros_like(content), ~basin.possible, {"cmap": ListedColormap([FELL["facecolor"]])}),
        (content, ~shown, {"cmap": look.get_cmap(), "norm": look.norm}),
    ]
    for values, without, colors in layers:
        axes.imshow(
            np.ma.masked_where(without, values).T, extent=frame, origin="lower",
            aspect="auto", interpolation="nearest", **colors,
        )  # fmt: skip
    own = [Scale.of(name).factor * basin.model.apex[name] for name in basin.over]
    axes.plot(*([value] for value in own), **GAIT)
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 3, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 3, 5, 10]))


def _edges(line: Array) -> tuple[float, float]:
    """Where the cells of a line begin and end."""
    half = (line[-1] - line[0]) / max(len(line) - 1, 1) / 2
    return float(line[0] - half), float(line[-1] + half)


def _draw_bars(
    figure: Figure,
    panels: Any,
    survived: ScalarMappable,
    left: ScalarMappable,
    steps: Sequence[int],
) -> None:
    """Draw a scale beside each row."""
    *before, wanted = steps
    bar = figure.colorbar(survived, ax=list(panels[0]), aspect=18, label="strides completed")
    middles = [(low + high) / 2 for low, high in zip(steps, [*steps[1:], wanted + 1], strict=True)]
    names = [
        f"{low}" if high == low + 1 else f"{low} to {high - 1}"
        for low, high in zip(before, steps[1:], strict=True)
    ]
    bar.set_ticks(middles, labels=[*names, f"all {wanted}"])
    bar.ax.tick_params(length=0)
    last = figure.colorbar(
        left, ax=list(panels[1]), aspect=18, extend="both",
        label=f"deviation from the gait\nafter {wanted} strides (natural units)",
    )  # fmt: skip
    last.ax.minorticks_off()


def _title(basin: Basin) -> str:
    stable = "stable" if basin.radius < 1 else "not stable"
    return f"{basin.name}\n{basin.model.apex['speed']:.3g} m/s at the apex\n" + (
        f"$|\\lambda|$ = {basin.radius:.3g}: {stable}"
    )


def _count(basin: Basin) -> str:
    """How many starts came to what."""
    row = basin.row()
    if not row["lasted"]:
        return f"none of {row['starts']} starts lasts"
    come, go = (f"{100 * row[name] / row['starts']:.3g} %" for name in ("settled", "not_settled"))
    if not row["not_settled"]:
        return f"{come} of {row['starts']} come to it"
    gaits = all(other.radius is not None for other in basin.others)
    return f"{come} come to it,\n{go} {'to other gaits' if gaits else 'not, or not yet'}"


def _details(basin: Basin) -> list[str]:
    """What all starts share."""
    names = " and ".join(Scale.of(name).label for name in basin.over)
    energy = "each with the energy of its gait, by its apex speed"
    return [
        f"starts: {names} varied about the gait",
        energy if basin.energy_kept else "their energy differs",
        "touchdown angles of the gait",
        f"{basin.wanted} strides",
        "$|\\lambda|$: spectral radius on the energy level",
        "natural units: of leg length, gravity and radians",
    ]


def _key(basins: Sequence[Basin]) -> Look:
    """What areas and marks mean, those that there are."""
    key: Look = {"the gait": Line2D([], [], **GAIT), "did not last": Patch(**FELL)}
    if not all(basin.possible.all() for basin in basins):
        key["more energy at rest than the gait has"] = Patch(**IMPOSSIBLE)
    return key
