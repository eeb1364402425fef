"""The stage of an animation: camera, ground, force key, bar of phases and what is written around.

What never changes is drawn once, as a backdrop; only what moves is drawn in every frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.ticker import MultipleLocator

from flexspine.report.caption import describe, ending, excerpt_of, heading
from flexspine.report.stick_figure import ARROW_LENGTH, ARROW_WIDTH, Scale, arrow_outline
from flexspine.report.style import FAINT, INK, SMALL_SIZE, TEXT_SIZE, TITLE_SIZE
from flexspine.report.way import Way, heights

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from flexspine.report.postures import Point

WIDTH, HEIGHT = 8.0, 5.3  # in
DOTS = 100  # per in; makes both sizes even, as the video codec demands

# in; where the parts of the figure are
LEFT, RIGHT, HEAD = 0.66, 0.2, 0.98
STAGE = WIDTH - LEFT - RIGHT
BAR_FOOT, BAR_HEIGHT = 0.46, 0.2
ABOVE_BAR = 0.6  # for positions and the force key
STATUS = HEIGHT - 0.78  # the line that tells phase, bend and time


LETTERS = 115  # of small type; what fits into a line


@dataclass(frozen=True)
class View:
    """What a camera that follows the CoM sees: metres to each side of it, and heights (m)."""

    aside: float
    low: float
    high: float

    @classmethod
    def around(cls, points: Iterable[Point], scale: Scale) -> View:
        """Return the smallest view that holds points (m ahead of the CoM, height) and some air."""
        seen = np.array([*points])
        air = 0.17 * scale.leg
        low = -(ARROW_LENGTH + 0.08) * scale.leg
        return cls(float(abs(seen[:, 0]).max()) + air, low, float(seen[:, 1].max()) + air)

    def widened(self, shape: float) -> View:
        """Return a view whose width is ``shape`` times its height."""
        height = self.high - self.low
        if 2 * self.aside < shape * height:
            return replace(self, aside=shape * height / 2)
        return replace(self, high=self.low + 2 * self.aside / shape)


@dataclass(frozen=True)
class Scenery:
    """What a stage is made for.

    ``limits`` are the times (s) that are shown, ``reach`` is where the CoM gets (m). ``draw_bar``
    fills the bar of phases, which is ``bar`` in high, and ``force_of`` is whose force is drawn.
    ``way`` is the ground where it is not flat.
    """

    view: View
    scale: Scale
    limits: tuple[float, float]
    reach: tuple[float, float]
    slow_down: float
    draw_bar: Callable[[Axes], None]
    bar: float = BAR_HEIGHT
    force_of: str = "per leg pair"
    way: Way | None = None

    @property
    def foot(self) -> float:
        """Where the axes begin, in above the figure's foot."""
        return BAR_FOOT + self.bar + ABOVE_BAR

    @property
    def fitted(self) -> View:
        """The view in the shape of the axes."""
        return self.view.widened(STAGE / (HEIGHT - HEAD - self.foot))


class Stage:
    """The figure of an animation; `follow` moves the camera to an instant."""

    def __init__(self, dataset: xr.Dataset, scenery: Scenery) -> None:
        self.scenery, self.view = scenery, scenery.fitted
        self.figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS)
        FigureCanvasAgg(self.figure)
        self.figure.add_artist(_Backdrop(_draw_backdrop(dataset, scenery)))
        self.axes = self._add_axes()
        self.metre = 72 * STAGE / (2 * self.view.aside)  # pt
        self.cursor = Line2D([], [], color=INK, linewidth=2)
        self.figure.add_artist(self.cursor)
        self.phase = write(self.figure, (LEFT + 0.05, STATUS), "", fontweight="bold")
        self.clock = write(self.figure, (WIDTH - RIGHT, STATUS), "", fontweight="bold", ha="right")

    def add_bend(self, place: float) -> tuple[Text, Polygon]:
        """Add words on the bend of the spine ``place`` in from the left, and its colour."""
        words = write(self.figure, (place, STATUS), "")
        return words, square(self.figure, (place - 0.15, STATUS))

    def follow(self, time: float, x: float) -> None:
        """Bring the camera to ``x`` (m), cursor and clock to a time (s)."""
        self.axes.set_xlim(x - self.view.aside, x + self.view.aside)
        if self.scenery.way is not None:
            level = self.scenery.way.level(x)
            self.axes.set_ylim(self.view.low + level, self.view.high + level)
        start, end = self.scenery.limits
        passed = (time - start) / (end - start)
        low, high = BAR_FOOT - 0.05, BAR_FOOT + self.scenery.bar + 0.05
        self.cursor.set_data([(LEFT + passed * STAGE) / WIDTH] * 2, [low / HEIGHT, high / HEIGHT])
        self.clock.set_text(f"t = {time:.3f} s")

    def _add_axes(self) -> Axes:
        """The axes that move along, with nothing of their own but positions."""
        axes = _axes(self.figure, self.scenery)
        axes.patch.set_visible(False)
        axes.spines[:].set_visible(False)
        axes.yaxis.set_visible(False)
        aside, (first, last) = self.view.aside, self.scenery.reach
        reach = first - aside, last + aside
        draw_ground(axes, reach, self.scenery.scale, self.scenery.way)
        axes.xaxis.set_major_locator(MultipleLocator(round_down(2 * aside / 5)))
        return axes


class _Backdrop(Artist):
    """A picture of the whole figure, put down as it is; `FigureImage` would resample it."""

    def __init__(self, picture: NDArray[np.uint8]) -> None:
        super().__init__()
        self.picture = picture
        self.set_zorder(-1)

    def draw(self, renderer: RendererBase) -> None:
        renderer.draw_image(renderer.new_gc(), 0, 0, self.picture)


def _draw_backdrop(dataset: xr.Dataset, scenery: Scenery) -> NDArray[np.uint8]:
    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS)
    axes, foot = _axes(figure, scenery), scenery.foot
    draw_heights(axes, scenery.fitted)
    axes.tick_params(bottom=False, labelbottom=False)
    moves = scenery.way is not None and scenery.way.climbs
    axes.set_ylabel("height over the way (m)" if moves else "height (m)")
    write(figure, (LEFT + STAGE / 2, foot - 0.37), "position (m)", size=TEXT_SIZE, ha="center")
    metre = STAGE / (2 * scenery.fitted.aside)
    add_force_key(figure, (LEFT, foot - 0.375), scenery.scale, metre, scenery.force_of)
    box = (LEFT / WIDTH, BAR_FOOT / HEIGHT, STAGE / WIDTH, scenery.bar / HEIGHT)
    bar = figure.add_axes(box)
    scenery.draw_bar(bar)
    bar.set_xlabel("time (s)", labelpad=1)
    write(figure, (0.15, HEIGHT - 0.2), heading(dataset), size=TITLE_SIZE, fontweight="bold")
    write(figure, (0.15, HEIGHT - 0.41), describe(dataset)[0])
    told = "  ·  ".join([*excerpt_of(dataset), ending(dataset) or ""]).removesuffix("  ·  ")
    write(figure, (0.15, HEIGHT - 0.57), shorten(told, LETTERS))
    start, end = scenery.limits
    part = "" if start <= dataset["time"][0] else f"the last {end - start:.3g} s, "
    pace = part + tell_speed(scenery.slow_down)
    write(figure, (WIDTH - RIGHT, HEIGHT - 0.2), pace, ha="right")
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[::-1]


def _axes(figure: Figure, scenery: Scenery) -> Axes:
    foot, view = scenery.foot, scenery.fitted
    box = (LEFT / WIDTH, foot / HEIGHT, STAGE / WIDTH, (HEIGHT - HEAD - foot) / HEIGHT)
    axes = figure.add_axes(box)
    axes.set_xlim(-view.aside, view.aside)
    axes.set_ylim(view.low, view.high)
    return axes


def draw_heights(axes: Axes, view: View) -> None:
    """Draw the scale of heights, from the ground on."""
    axes.set_ylim(view.low, view.high)
    axes.set_yticks([y for y in axes.get_yticks() if 0 <= y <= view.high])
    axes.spines["left"].set_bounds(0, view.high)


def draw_ground(
    axes: Axes, reach: tuple[float, float], scale: Scale, way: Way | None = None
) -> None:
    """Draw the ground, flat or ``way``, with strokes over ``reach`` (m) that show how it passes."""
    step = round_down(0.3 * scale.leg)
    x = step * np.arange(np.floor(reach[0] / step), np.ceil(reach[1] / step) + 1)
    y = heights(way, x)
    outline = np.array([[reach[0], 0.0], [reach[1], 0.0]]) if way is None else way.points
    axes.plot(*outline.T, color=INK, linewidth=1.0, zorder=2.5)
    depth = 0.35 * step
    strokes = [
        ((right, top - (at - right)), (left, top - (at - left)))
        for at, top in zip(x, y, strict=True)
        for left, right in [np.clip((at - depth, at), *reach)]
        if left < right
    ]
    axes.add_collection(LineCollection(strokes, colors=FAINT, linewidths=0.8, zorder=1))


def add_force_key(
    figure: Figure, place: Point, scale: Scale, metre: float, whose: str = "per leg pair"
) -> None:
    """Draw an arrow of a round force at ``place`` (in); a metre is drawn ``metre`` in long."""
    if not scale.force:
        return
    force = round_down(scale.force, (1, 2, 3, 4, 5, 6, 8))
    tip = np.array([metre * scale.arrow * force, 0.0])
    outline = arrow_outline(np.zeros(2), tip, metre * ARROW_WIDTH * scale.leg) + place
    corners = outline / figure.get_size_inches()
    figure.add_artist(Polygon(corners, transform=figure.transFigure, facecolor=INK, linewidth=0))
    write(figure, (place[0] + tip[0] + 0.08, place[1]), f"{force:g} N {whose}")


def square(figure: Figure, place: Point) -> Polygon:
    """Draw a small square around ``place`` (in) and return it."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    box = (np.array(place) + 0.07 * corners) / figure.get_size_inches()
    patch = Polygon(box, transform=figure.transFigure, edgecolor=INK, linewidth=0.7)
    figure.add_artist(patch)
    return patch


def write(
    figure: Figure, place: Point, text: str, *, size: float = SMALL_SIZE, **style: Any
) -> Text:
    """Write a line whose middle is at the height of ``place`` (in)."""
    x, y = np.array(place) / figure.get_size_inches()
    return figure.text(x, y, text, fontsize=size, va="center", **style)


def tell_speed(slow_down: float) -> str:
    """Return how fast the animation goes, in words."""
    if slow_down == 1:
        return "at real speed"
    return f"{slow_down:g} times slower" if slow_down > 1 else f"{1 / slow_down:g} times faster"


def round_down(value: float, steps: tuple[int, ...] = (1, 2, 5)) -> float:
    """Return the largest of ``steps`` times a power of ten that is not above ``value``."""
    power = float(10.0 ** np.floor(np.log10(value)))
    return max(step for step in steps if step * power <= value * (1 + 1e-9)) * power
