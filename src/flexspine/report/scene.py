"""The stage of an animation: camera, ground, force key, phase bar and what is written around."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import MultipleLocator

from flexspine.report.figure import describe, ending, heading
from flexspine.report.postures import Point, Posture, postures
from flexspine.report.stick_figure import (
    ARROW_LENGTH,
    ARROW_WIDTH,
    Scale,
    StickFigure,
    arrow_outline,
    bend_color,
)
from flexspine.report.style import FAINT, INK, PHASE_COLORS, SMALL_SIZE, TITLE_SIZE
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
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

WIDTH, HEIGHT = 8.0, 5.2  # in
DOTS = 100  # per in; makes both sizes even, as the video codec demands

# in; the parts of the figure
LEFT, RIGHT = 0.66, 0.2
FOOT, HEAD = 1.16, 0.98


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
            (abs(x - posture.com[0]), y)
            for posture in shown
            for x, y in _outline(posture, scale)
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
        yield posture.joint
    for leg in posture.legs.values():
        yield from (leg.hip, leg.toe)
        yield leg.toe[0] - scale.arrow * leg.force[0], leg.toe[1]


class Scene:
    """The figure of an animation; `show` brings it to a posture."""

    def __init__(self, dataset: xr.Dataset, times: Array, slow_down: float) -> None:
        self.postures = postures(dataset, times)
        self.scale = Scale.of(dataset)
        self.figure = Figure(figsize=(WIDTH, HEIGHT))
        FigureCanvasAgg(self.figure)
        self._add_stage()
        self._add_phases(dataset, times)
        self._add_words(dataset, slow_down)

    def show(self, posture: Posture) -> None:
        """Bring the figure to a posture, the CoM in the middle."""
        x = posture.com[0]
        self.axes.set_xlim(x - self.view.aside, x + self.view.aside)
        self.animal.show(posture)
        self.cursor.set_xdata([posture.time, posture.time])
        self.clock.set_text(f"t = {posture.time:.3f} s")
        self.phase.set_text(f"{posture.phase}: {PHASE_NAMES[posture.phase]}")
        self.phase.set_bbox(pill(posture.phase))
        if posture.bend is not None:
            way = "sags" if posture.bend > 0 else "arches"
            self.bend.set_text(f"spine {way}, bend {np.degrees(posture.bend):+.1f}°")
            self.swatch.set_facecolor(bend_color(posture.bend, self.scale))

    def _add_stage(self) -> None:
        width, height = WIDTH - LEFT - RIGHT, HEIGHT - FOOT - HEAD
        self.axes = self.figure.add_axes(
            (LEFT / WIDTH, FOOT / HEIGHT, width / WIDTH, height / HEIGHT)
        )
        self.view = View.of(self.postures, self.scale).widened(width / height)
        x = [posture.com[0] for posture in self.postures]
        aside = self.view.aside
        draw_ground(self.axes, (min(x) - aside, max(x) + aside), self.view, self.scale)
        self.axes.xaxis.set_major_locator(MultipleLocator(round_down(2 * aside / 5)))
        self.axes.set_xlabel("position (m)", labelpad=1)
        self.axes.set_ylabel("height (m)")
        points = 72 * width / (2 * aside)
        self.animal = StickFigure(self.axes, self.scale, points, self.postures[0])
        self.axes.set_xlim(x[0] - aside, x[0] + aside)
        add_force_key(self.figure, self.axes, self.scale, (LEFT + 0.12, FOOT + 0.2))

    def _add_phases(self, dataset: xr.Dataset, times: Array) -> None:
        width = WIDTH - LEFT - RIGHT
        bar = self.figure.add_axes((LEFT / WIDTH, 0.46 / HEIGHT, width / WIDTH, 0.2 / HEIGHT))
        spans = phase_spans(dataset)
        draw_phase_bar(bar, spans, window(times))
        label_phases(bar, spans, width)
        bar.set_xlabel("time (s)", labelpad=1)
        (self.cursor,) = bar.plot([times[0]] * 2, [-0.2, 1.2], color=INK, lw=2, clip_on=False)

    def _add_words(self, dataset: xr.Dataset, slow_down: float) -> None:
        def write(x: float, down: float, text: str, **style: Any) -> Any:
            style = {"fontsize": SMALL_SIZE, "va": "center", **style}
            return self.figure.text(x / WIDTH, 1 - down / HEIGHT, text, **style)

        write(0.15, 0.2, heading(dataset), fontsize=TITLE_SIZE, fontweight="bold")
        early = ending(dataset)
        facts = describe(dataset)[0] + (f"  ·  {early}" if early else "")
        write(0.15, 0.44, facts)
        self.phase = write(LEFT, 0.78, "", fontweight="bold")
        self.bend = write(LEFT + 2.6, 0.78, "")
        self.clock = write(WIDTH - RIGHT, 0.78, "", ha="right", fontweight="bold")
        write(WIDTH - RIGHT, 0.2, f"{slow_down:g} times slower than real", ha="right")
        if self.postures[0].bend is not None:
            x, y, side = (LEFT + 2.4) / WIDTH, 1 - 0.78 / HEIGHT, 0.07
            corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
            box = [(x + a * side / WIDTH, y + b * side / HEIGHT) for a, b in corners]
            self.swatch = Polygon(box, transform=self.figure.transFigure, edgecolor=INK, lw=0.7)
            self.figure.add_artist(self.swatch)


def draw_ground(axes: Axes, reach: tuple[float, float], view: View, scale: Scale) -> None:
    """Draw the ground over ``reach`` (m), with strokes that show how it passes."""
    axes.set_ylim(view.low, view.high)
    axes.set_yticks([y for y in axes.get_yticks() if 0 <= y <= view.high])
    axes.axhline(0, color=INK, linewidth=1.0, zorder=2.5)
    step = round_down(0.4 * scale.leg)
    x = step * np.arange(np.floor(reach[0] / step), np.ceil(reach[1] / step) + 1)
    depth = 0.4 * step
    strokes = [[(at, 0.0), (at - depth, -depth)] for at in x]
    axes.add_collection(LineCollection(strokes, colors=FAINT, linewidths=0.8, zorder=1))


def add_force_key(figure: Figure, axes: Axes, scale: Scale, place: Point) -> None:
    """Draw an arrow of a round force at ``place`` (in), to the scale of those at the toes."""
    size = figure.get_size_inches()
    low, high = axes.get_xlim()
    metre = axes.get_position().width * size[0] / (high - low)  # in
    force = round_down(scale.force)
    length, width = metre * scale.arrow * force, metre * ARROW_WIDTH * scale.leg
    outline = arrow_outline(np.zeros(2), np.array([length, 0.0]), width) + place
    arrow = Polygon(outline / size, transform=figure.transFigure, facecolor=INK, lw=0)
    figure.add_artist(arrow)
    figure.text(
        (place[0] + length + 0.08) / size[0], place[1] / size[1],
        f"{force:g} N per leg pair, on the toe", va="center", fontsize=SMALL_SIZE,
    )  # fmt: skip


def pill(phase: str) -> dict[str, Any]:
    """Return the box around a phase's name."""
    return {"boxstyle": "round,pad=0.35", "facecolor": PHASE_COLORS[phase], "edgecolor": "none"}


def round_down(value: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not above ``value``."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)) * power)
