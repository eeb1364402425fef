"""One posture as a stick figure: trunk, spine spring, spring legs, CoM and forces."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.path import Path as Outline

from flexspine.report.postures import SIDES, LegPosture, Point, Posture
from flexspine.report.style import BEND_COLORS, INK, SIDE_COLORS, paler

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BODY_COLOR = "#5A5A5A"

ZIGZAGS = 11  # corners of a leg's spring
WAVES = 5  # of the spine's spring

# Sizes in lengths of the leg.
ZIGZAG_WIDTH = 0.14
TRUNK_WIDTH = 0.15
SPRING_RADIUS = 0.24
SPRING_WAVE = 0.055
ARROW_LENGTH = 0.62  # of the largest force
ARROW_WIDTH = 0.045

_QUARTER = Outline.wedge(0, 90)
QUARTERS = Outline.make_compound_path(_QUARTER, Outline.wedge(180, 270))


@dataclass(frozen=True)
class Scale:
    """What all postures of a run share: leg length (m), largest force (N) and bend (rad)."""

    leg: float
    force: float
    bend: float

    @classmethod
    def of(cls, dataset: xr.Dataset) -> Scale:
        """Return the scale of a run; its force is zero where no leg ever stood."""
        legs = [float(dataset[f"{side}_leg_length"].max()) for side in SIDES]
        force = max(float(dataset[f"{side}_grf"].max()) for side in SIDES)
        bend = float(abs(dataset["spine_angle"]).max()) if "spine_angle" in dataset else 0.0
        return cls(max(legs), force, max(bend, 1e-6))

    @property
    def arrow(self) -> float:
        """Length of a force arrow, in m/N."""
        return ARROW_LENGTH * self.leg / self.force if self.force else 0.0


class Canvas:
    """Adds artists to axes; sizes are in lengths of the leg, each ``unit`` pt long."""

    def __init__(self, axes: Axes, unit: float) -> None:
        self.axes, self.unit = axes, unit

    def line(self, order: float, *, color: str = INK, width: float = 0.034) -> Line2D:
        """Add a rounded line."""
        line = Line2D(
            [], [], color=color, linewidth=width * self.unit, zorder=order,
            solid_capstyle="round", solid_joinstyle="round",
        )  # fmt: skip
        self.axes.add_line(line)
        return line

    def dot(self, order: float, size: float, fill: str, edge: str = "none") -> Line2D:
        """Add a disc."""
        return self._marker(
            order, marker="o", markersize=size * self.unit, markerfacecolor=fill,
            markeredgecolor=edge, markeredgewidth=0.022 * self.unit,
        )  # fmt: skip

    def com(self, order: float) -> tuple[Line2D, Line2D]:
        """Add the sign of a centre of mass."""
        quarters = self._marker(
            order + 1, marker=QUARTERS, markersize=0.1 * self.unit, markerfacecolor=INK,
            markeredgecolor="none",
        )  # fmt: skip
        return self.dot(order, 0.1, "white", INK), quarters

    def arrow(self, color: str, order: float = 2.0) -> Polygon:
        """Add an arrow, to be given its outline."""
        arrow = Polygon(
            np.zeros((7, 2)), facecolor=color, edgecolor="none", zorder=order, alpha=0.75
        )
        self.axes.add_patch(arrow)
        return arrow

    def _marker(self, order: float, **style: Any) -> Line2D:
        line = Line2D([], [], linestyle="none", zorder=order, **style)
        self.axes.add_line(line)
        return line


class StickFigure:
    """The artists of an animal like ``example``; `show` moves them to a posture.

    ``points_per_metre`` is how large a metre is drawn, so that lines keep their proportions.
    """

    def __init__(self, axes: Axes, scale: Scale, points_per_metre: float, example: Posture) -> None:
        self.scale = scale
        canvas = self.canvas = Canvas(axes, scale.leg * points_per_metre)
        self.jointed = example.joint is not None
        self.arrows = {side: canvas.arrow(SIDE_COLORS[side]) for side in SIDES}
        self.trunk = self._add_trunk()
        self.legs = {side: canvas.line(3, color=SIDE_COLORS[side]) for side in SIDES}
        self.toes = {side: canvas.dot(4, 0.055, SIDE_COLORS[side]) for side in SIDES}
        self.hips = {side: canvas.dot(6, 0.085, "white", SIDE_COLORS[side]) for side in SIDES}
        if self.jointed:
            self.joint = canvas.dot(7, 0.085, "white", INK)
            self.spring = (canvas.line(8, width=0.052), canvas.line(8.1, width=0.03))
        self.com = canvas.com(9)

    def show(self, posture: Posture, shift: Point = (0.0, 0.0)) -> None:
        """Move to a posture, ``shift`` m ahead of and above where it is."""
        ends = [posture.legs[side].hip for side in ("hind", "fore")]
        nodes = [ends[0], posture.joint, ends[1]] if posture.joint is not None else ends
        for lines, (start, end) in zip(self.trunk, pairwise(nodes), strict=True):
            for line in lines:
                line.set_data(*np.transpose([_moved(start, shift), _moved(end, shift)]))
        for side, leg in posture.legs.items():
            self._show_leg(side, leg, shift)
        if posture.joint is not None and posture.bend is not None:
            self._show_spring(posture, posture.joint, posture.bend, shift)
        for artist in self.com:
            artist.set_data(*_moved(posture.com, shift)[:, None])

    def _show_leg(self, side: str, leg: LegPosture, shift: Point) -> None:
        hip, toe = _moved(leg.hip, shift), _moved(leg.toe, shift)
        # A leg in the air carries nothing: thin and pale.
        line, dot = self.legs[side], self.toes[side]
        width = ZIGZAG_WIDTH * self.scale.leg * (1.0 if leg.stands else 0.6)
        line.set_data(*zigzag(hip, toe, width).T)
        line.set_linewidth(self.canvas.unit * (0.034 if leg.stands else 0.018))
        line.set_alpha(1.0 if leg.stands else 0.5)
        dot.set_data([toe[0]], [toe[1]])
        dot.set_alpha(1.0 if leg.stands else 0.5)
        self.hips[side].set_data([hip[0]], [hip[1]])
        force = self.scale.arrow * np.array(leg.force)
        arrow = self.arrows[side]
        arrow.set_visible(bool(np.hypot(*force) > 0.02 * self.scale.leg))
        arrow.set_xy(arrow_outline(toe - force, toe, ARROW_WIDTH * self.scale.leg))

    def _show_spring(self, posture: Posture, joint: Point, bend: float, shift: Point) -> None:
        centre = _moved(joint, shift)
        fore, hind = (np.array(posture.legs[side].hip) - joint for side in SIDES)
        start = float(np.arctan2(fore[1], fore[0]))
        # Over the back from fore to hind, however the body is turned.
        turn = (float(np.arctan2(hind[1], hind[0])) - start) % (2 * np.pi)
        # On a body that is short for its legs the spring stays within the trunk.
        size = min(self.scale.leg, 2.4 * float(min(np.hypot(*fore), np.hypot(*hind))))
        curve = centre + wavy_arc(start, turn) * size
        for line in self.spring:
            line.set_data(*curve.T)
        self.spring[1].set_color(bend_color(bend, self.scale))
        self.joint.set_data([centre[0]], [centre[1]])

    def _add_trunk(self) -> list[tuple[Line2D, Line2D]]:
        """Bars with an outline: a wide line under a narrower one."""
        colors = [SIDE_COLORS["hind"], SIDE_COLORS["fore"]] if self.jointed else [BODY_COLOR]
        return [
            (
                self.canvas.line(5, color=color, width=TRUNK_WIDTH),
                self.canvas.line(5.1, color=paler(color), width=TRUNK_WIDTH - 0.045),
            )
            for color in colors
        ]


def zigzag(start: Array, end: Array, width: float) -> Array:
    """A spring from ``start`` to ``end`` with straight ends, shape (points, 2)."""
    along = end - start
    length = float(np.hypot(*along))
    across = np.array([-along[1], along[0]]) / length if length else np.zeros(2)
    corners = np.linspace(0.15, 0.86, ZIGZAGS)
    sideways = np.resize([1.0, -1.0], ZIGZAGS) * width / 2
    sideways[[0, -1]] = 0.0
    body = start + np.outer(corners, along) + np.outer(sideways, across)
    return np.vstack([start, body, end])


def wavy_arc(start: float, turn: float) -> Array:
    """A spring bent around the origin from ``start`` on (rad), in lengths of the leg."""
    along = np.linspace(0.0, 1.0, 90)
    coiled = ((along - 0.12) / 0.76).clip(0, 1)  # smooth ends
    radius = SPRING_RADIUS + SPRING_WAVE * np.sin(2 * np.pi * WAVES * coiled)
    angle = start + turn * along
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def arrow_outline(tail: Array, tip: Array, width: float) -> Array:
    """An arrow as a polygon of 7 corners; a short one is thin."""
    along = tip - tail
    length = float(np.hypot(*along))
    if not length:
        return np.tile(tip, (7, 1))
    ahead = along / length
    width = min(width, length / 3.2)
    side = np.array([-ahead[1], ahead[0]]) * width / 2
    neck = tip - ahead * 2.2 * width
    corners = [
        tail + side, neck + side, neck + 2.2 * side, tip,
        neck - 2.2 * side, neck - side, tail - side,
    ]  # fmt: skip
    return np.array(corners)


_BENDS = LinearSegmentedColormap.from_list("bend", BEND_COLORS)


def bend_color(bend: float, scale: Scale) -> tuple[float, float, float, float]:
    """Colour of a bend (rad): arched, straight, sagging."""
    return _BENDS(0.5 + 0.5 * bend / scale.bend)


def bend_palette(count: int) -> list[tuple[int, int, int]]:
    """The colours of all bends in ``count`` steps of 0 to 255."""
    levels = np.rint(255 * _BENDS(np.linspace(0, 1, count))[:, :3]).astype(int)
    return [(red, green, blue) for red, green, blue in levels.tolist()]


def _moved(point: Point, shift: Point) -> Array:
    return np.array([point[0] + shift[0], point[1] + shift[1]])
