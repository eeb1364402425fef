"""The scene of an animation: camera, ground, force key, phase bar and what is written around.

What never changes is drawn once, as a backdrop; only what moves is drawn in every frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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

from flexspine.report.caption import describe, ending, heading
from flexspine.report.postures import Point, Posture, postures
from flexspine.report.stick_figure import (
    ARROW_LENGTH,
    ARROW_WIDTH,
    SPRING_RADIUS,
    Scale,
    StickFigure,
    arrow_outline,
    bend_color,
)
from flexspine.report.style import FAINT, INK, PHASE_COLORS, SMALL_SIZE, TEXT_SIZE, TITLE_SIZE
from flexspine.report.timeline import (
    PHASE_NAMES,
    draw_phase_bar,
    label_phases,
    phase_spans,
    window,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase
    from matplotlib.text import Text
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

WIDTH, HEIGHT = 8.0, 5.3  # in
DOTS = 100  # per in; makes both sizes even, as the video codec demands

# in; where the parts of the figure are
LEFT, RIGHT, FOOT, HEAD = 0.66, 0.2, 1.26, 0.98
STAGE = WIDTH - LEFT - RIGHT, HEIGHT - FOOT - HEAD
BAR_FOOT, BAR_HEIGHT = 0.46, 0.2
STATUS = HEIGHT - 0.78  # the line that tells phase, bend and time
BEND = LEFT + 2.6


@dataclass(frozen=True)
class View:
    """What a camera that follows the CoM sees: metres to each side of it, and heights (m)."""

    aside: float
    low: float
    high: float

    @classmethod
    def of(cls, shown: Sequence[Posture], scale: Scale) -> View:
        """Return the smallest view that holds all postures, their arrows and some air."""
        points = [
            (abs(x - posture.com[0]), y) for posture in shown for x, y in _outline(posture, scale)
        ]
        air = 0.17 * scale.leg
        low = -(ARROW_LENGTH + 0.08) * scale.leg
        return cls(max(x for x, _ in points) + air, low, max(y for _, y in points) + air)

    def widened(self, shape: float) -> View:
        """Return a view whose width is ``shape`` times its height."""
        height = self.high - self.low
        if 2 * self.aside < shape * height:
            return replace(self, aside=shape * height / 2)
        return replace(self, high=self.low + 2 * self.aside / shape)


def _outline(posture: Posture, scale: Scale) -> Iterable[Point]:
    yield posture.com
    if posture.joint is not None:
        yield posture.joint[0], posture.joint[1] + SPRING_RADIUS * scale.leg
    for leg in posture.legs.values():
        yield from (leg.hip, leg.toe)
        yield leg.toe[0] - scale.arrow * leg.force[0], leg.toe[1]


class Scene:
    """The figure of an animation; `show` brings it to a posture."""

    def __init__(self, dataset: xr.Dataset, times: Array, slow_down: float) -> None:
        self.postures = postures(dataset, times)
        self.scale = Scale.of(dataset)
        self.view = View.of(self.postures, self.scale).widened(STAGE[0] / STAGE[1])
        self.limits = window(times)
        self.figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS)
        FigureCanvasAgg(self.figure)
        self.figure.add_artist(_Backdrop(_draw_backdrop(self, dataset, slow_down)))
        self.axes = self._add_stage()
        points = 72 * STAGE[0] / (2 * self.view.aside)
        self.animal = StickFigure(self.axes, self.scale, points, self.postures[0])
        self.cursor = Line2D([], [], color=INK, linewidth=2)
        self.figure.add_artist(self.cursor)
        self.phase = write(self.figure, (LEFT + 0.05, STATUS), "", fontweight="bold")
        self.clock = write(self.figure, (WIDTH - RIGHT, STATUS), "", fontweight="bold", ha="right")
        self.bend = write(self.figure, (BEND, STATUS), "")
        self.swatch = square(self.figure, (BEND - 0.15, STATUS))
        self.swatch.set_visible(self.postures[0].bend is not None)

    def show(self, posture: Posture) -> None:
        """Bring the figure to a posture, the CoM in the middle."""
        x = posture.com[0]
        self.axes.set_xlim(x - self.view.aside, x + self.view.aside)
        self.animal.show(posture)
        passed = (posture.time - self.limits[0]) / (self.limits[1] - self.limits[0])
        low, high = BAR_FOOT - 0.05, BAR_FOOT + BAR_HEIGHT + 0.05
        self.cursor.set_data(
            [(LEFT + passed * STAGE[0]) / WIDTH] * 2, [low / HEIGHT, high / HEIGHT]
        )
        self.clock.set_text(f"t = {posture.time:.3f} s")
        self.phase.set_text(f"{posture.phase}: {PHASE_NAMES[posture.phase]}")
        self.phase.set_bbox(pill(posture.phase))
        if posture.bend is not None:
            self.bend.set_text(tell_bend(posture.bend))
            self.swatch.set_facecolor(bend_color(posture.bend, self.scale))

    def _add_stage(self) -> Axes:
        """The axes that move along, with nothing of their own but positions."""
        axes = _stage(self.figure, self.view)
        axes.patch.set_visible(False)
        axes.spines[:].set_visible(False)
        axes.yaxis.set_visible(False)
        x = [posture.com[0] for posture in self.postures]
        aside = self.view.aside
        draw_strokes(axes, (min(x) - aside, max(x) + aside), self.scale)
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


def _draw_backdrop(scene: Scene, dataset: xr.Dataset, slow_down: float) -> NDArray[np.uint8]:
    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS)
    axes = _stage(figure, scene.view)
    draw_ground(axes, scene.view)
    axes.tick_params(bottom=False, labelbottom=False)
    axes.set_ylabel("height (m)")
    write(figure, (LEFT + STAGE[0] / 2, FOOT - 0.37), "position (m)", size=TEXT_SIZE, ha="center")
    add_force_key(figure, (LEFT, FOOT - 0.375), scene.scale, STAGE[0] / (2 * scene.view.aside))
    box = (LEFT / WIDTH, BAR_FOOT / HEIGHT, STAGE[0] / WIDTH, BAR_HEIGHT / HEIGHT)
    bar = figure.add_axes(box)
    spans = phase_spans(dataset)
    draw_phase_bar(bar, spans, scene.limits)
    label_phases(bar, spans, STAGE[0])
    bar.set_xlabel("time (s)", labelpad=1)
    write(figure, (0.15, HEIGHT - 0.2), heading(dataset), size=TITLE_SIZE, fontweight="bold")
    write(figure, (0.15, HEIGHT - 0.41), describe(dataset)[0])
    write(figure, (0.15, HEIGHT - 0.57), shorten(ending(dataset) or "", 110))
    shown = scene.limits[1] - scene.limits[0]
    part = "" if scene.limits[0] <= dataset["time"][0] else f"the last {shown:.3g} s, "
    speed = part + tell_speed(slow_down)
    write(figure, (WIDTH - RIGHT, HEIGHT - 0.2), speed, ha="right")
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[::-1]


def _stage(figure: Figure, view: View) -> Axes:
    box = (LEFT / WIDTH, FOOT / HEIGHT, STAGE[0] / WIDTH, STAGE[1] / HEIGHT)
    axes = figure.add_axes(box)
    axes.set_xlim(-view.aside, view.aside)
    axes.set_ylim(view.low, view.high)
    return axes


def draw_ground(axes: Axes, view: View) -> None:
    """Draw the ground, and heights only above it."""
    axes.set_ylim(view.low, view.high)
    axes.set_yticks([y for y in axes.get_yticks() if 0 <= y <= view.high])
    axes.spines["left"].set_bounds(0, view.high)
    axes.axhline(0, color=INK, linewidth=1.0, zorder=2.5)


def draw_strokes(axes: Axes, reach: tuple[float, float], scale: Scale) -> None:
    """Draw strokes in the ground over ``reach`` (m), which show how it passes."""
    step = round_down(0.3 * scale.leg)
    x = step * np.arange(np.floor(reach[0] / step), np.ceil(reach[1] / step) + 1)
    depth = 0.35 * step
    strokes = [[(at, 0.0), (at - depth, -depth)] for at in x]
    axes.add_collection(LineCollection(strokes, colors=FAINT, linewidths=0.8, zorder=1))


def add_force_key(figure: Figure, place: Point, scale: Scale, metre: float) -> None:
    """Draw an arrow of a round force at ``place`` (in); a metre is drawn ``metre`` in long."""
    if not scale.force:
        return
    force = round_down(scale.force, (1, 2, 3, 4, 5, 6, 8))
    tip = np.array([metre * scale.arrow * force, 0.0])
    outline = arrow_outline(np.zeros(2), tip, metre * ARROW_WIDTH * scale.leg) + place
    corners = outline / figure.get_size_inches()
    figure.add_artist(Polygon(corners, transform=figure.transFigure, facecolor=INK, linewidth=0))
    write(figure, (place[0] + tip[0] + 0.08, place[1]), f"{force:g} N per leg pair")


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


def tell_bend(bend: float) -> str:
    """Return a bend of the spine (rad) in words, without a sign for next to nothing."""
    degrees = round(float(np.degrees(bend)), 1)
    if not degrees:
        return "spine straight"
    return f"spine {'sags' if degrees > 0 else 'arches'} by {abs(degrees):.1f}°"


def tell_speed(slow_down: float) -> str:
    """Return how fast the animation goes, in words."""
    if slow_down == 1:
        return "at real speed"
    return f"{slow_down:g} times slower" if slow_down > 1 else f"{1 / slow_down:g} times faster"


def pill(phase: str) -> dict[str, Any]:
    """Return the box around a phase's name."""
    return {"boxstyle": "round,pad=0.35", "facecolor": PHASE_COLORS[phase], "edgecolor": "none"}


def round_down(value: float, steps: tuple[int, ...] = (1, 2, 5)) -> float:
    """Return the largest of ``steps`` times a power of ten that is not above ``value``."""
    power = float(10.0 ** np.floor(np.log10(value)))
    return max(step for step in steps if step * power <= value * (1 + 1e-9)) * power
