"""The coordinates of a robot: its links, joints and feet in a posture that tells them apart.

Those of a bounder are drawn by `flexspine.report.bounder_coordinates`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexspine.models.model import Model
from flexspine.report.bounder_coordinates import plot_bounder_coordinates
from flexspine.report.picture import Picture
from flexspine.report.stick_figure import wavy_arc
from flexspine.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    SMALL_SIZE,
    TEXT_SIZE,
    VERMILION,
    add_title,
    lay_out,
    themed,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Bbox
    from numpy.typing import NDArray

    from flexspine.models.robot import Robot

    Array = NDArray[np.float64]

BASE = (0.45, 0.3)  # where the base is, in lengths of two of the longest link
ARC = 0.2  # radius of an angle's arc, in lengths of the longest link
ARC_STEP = 0.11  # more for each further link at the same joint
SPRING = 0.3  # size of a spring's sign, the same way
STEPS = 40  # points of an arc

# Degrees from +x of thigh and shank, from the hip down, in turn for the legs on one trunk.
SPREAD = ((-148.0, -82.0), (-42.0, -104.0))
TRUNK_ANGLES = (8.0, -14.0)
CHAIN_ANGLE = 35.0  # of each link from its parent, for a robot without legs


def plot_coordinates(robot: Robot | Model) -> Figure:
    """Draw a robot with its coordinates ``q``, in their order, by number and name of the joint.

    Angles of links are relative to the extension of their parents, but for the first, which is
    from +x; lengths are in m. Of a bounder, draw its pitches, legs and lengths, with the letters
    of ``flexspine equations``.
    """
    if isinstance(robot, Model):
        return plot_bounder_coordinates(robot)
    linkage = robot.linkage
    q = told_apart(robot)
    ends = np.array(
        [[linkage.point(q, each.name, s) for s in (0.0, each.length)] for each in linkage.links]
    )
    with themed():
        figure = Picture(figsize=(8.4, 5.3), layout="constrained")
        axes = figure.subplots()
        drawing = _Drawing(figure, axes, robot, q, ends)
        drawing.draw()
        _frame(axes, np.vstack([ends.reshape(-1, 2), drawing.strokes_points(), [[0.0, 0.0]]]))
        _add_key(figure)
        angles = len(linkage.links)
        details = [
            "angles counter-clockwise: $q_1$ from +x, all others from the extension of the parent;"
            f" $q_{{{angles + 1}}}$, $q_{{{angles + 2}}}$: where {linkage.links[0].name} starts"
        ]
        add_title(figure, f"{robot.name}: coordinates", details)
        lay_out(figure)
        drawing.write()
    return figure


def told_apart(robot: Robot) -> Array:
    """Return coordinates at which no link of a robot lies on another, shape (N,)."""
    linkage = robot.linkage
    angles = {link.name: CHAIN_ANGLE * n for n, link in enumerate(linkage.links)}
    trunks = list(dict.fromkeys(leg.trunk for leg in robot.legs.values()))
    for number, trunk in enumerate(trunks):
        angles[trunk] = TRUNK_ANGLES[number % len(TRUNK_ANGLES)]
        on_it = [leg for leg in robot.legs.values() if leg.trunk == trunk]
        for leg, spread in zip(on_it, SPREAD * len(on_it), strict=False):
            shank = robot.feet[leg.foot]
            # A leg at which the tree begins is walked upwards.
            turn = 180.0 if robot.parents[leg.thigh] == shank else 0.0
            angles[leg.thigh], angles[shank] = (angle + turn for angle in spread)
    absolute = np.radians([*angles.values(), 0.0, 0.0])
    relative = np.linalg.solve(linkage.to_absolute, absolute)[:-2]
    longest = max(link.length for link in linkage.links)
    turns = (relative + np.pi) % (2 * np.pi) - np.pi
    q: Array = np.array([*turns, *(2 * longest * place for place in BASE)])
    return q


class _Drawing:
    """What is drawn, and the words that are written beside it where there is room."""

    def __init__(self, figure: Figure, axes: Axes, robot: Robot, q: Array, ends: Array) -> None:
        self.figure, self.axes, self.linkage = figure, axes, robot.linkage
        self.q, self.ends = q, ends
        self.unit = max(link.length for link in self.linkage.links)
        self.strokes: list[Array] = []  # what words are not to hide
        self.words: list[tuple[str, Array, dict[str, Any]]] = []  # with what they may stand at

    def strokes_points(self) -> Array:
        """Points of all that is drawn, shape (points, 2)."""
        return np.vstack(self.strokes)

    def draw(self) -> None:
        """Draw all but the words."""
        for link, (start, end) in zip(self.linkage.links, self.ends, strict=True):
            self._stroke(np.linspace(start, end, STEPS), color=FAINT, linewidth=5, zorder=2)
            spots = start + np.linspace(0.35, 0.75, 9)[:, None] * (end - start)
            self.words.append((link.name, spots, {"fontsize": SMALL_SIZE, "color": "#5A5A5A"}))
        self._draw_base()
        seen: dict[tuple[float, float], int] = {}
        for number, link in enumerate(self.linkage.links[1:], start=1):
            x, y = np.round(self.ends[number, 0], 9)
            seen[x, y] = seen.get((x, y), 0) + 1
            self._draw_angle(number, ARC + ARC_STEP * (seen[x, y] - 1), self._name_of(link.name))
        for foot in self.linkage.feet:
            place = self.linkage.foot(self.q, foot.name)
            self.axes.plot(*place, "o", color=VERMILION, markersize=9, zorder=6)
            self.words.append((foot.name, place[None], {"color": VERMILION}))

    def _draw_base(self) -> None:
        """The first link's angle and the place of its start, as lengths from the axes."""
        base, n = self.ends[0, 0], len(self.linkage.links)
        for way, number in ((np.array([1.0, 0.0]), n + 1), (np.array([0.0, 1.0]), n + 2)):
            at = base * (1 - way)
            self._arrow(at, base, GREEN, shrink=5.0)
            self.words.append((f"$q_{{{number}}}$", (at + base)[None] / 2, {"color": GREEN}))
            self._arrow(np.zeros(2), 0.45 * self.unit * way, INK)
            name = "x" if way[0] else "y"
            self.words.append((f"{name} (m)", 0.45 * self.unit * way[None], {}))
        self._draw_arc(base, 0.0, self.q[0], ARC, "$q_1$")

    def _draw_angle(self, number: int, radius: float, name: str) -> None:
        """From the extension of the parent to the link, and the sign of the joint."""
        link = self.linkage.links[number]
        parent = self.linkage.angles(self.q)[self.linkage.place[str(link.parent)]]
        self._draw_arc(
            self.ends[number, 0], parent, self.q[number], radius, f"$q_{{{number + 1}}}$ {name}"
        )
        joint = next((each for each in self.linkage.joints if each.link == link.name), None)
        filled = joint is not None and joint.actuated
        self.axes.plot(
            *self.ends[number, 0], "o", color=INK, markersize=8, zorder=5,
            markerfacecolor=INK if filled else "white",
        )  # fmt: skip
        if joint is not None and joint.stiffness:
            curve = wavy_arc(parent + np.pi / 6, np.pi * 2 / 3) * SPRING * self.unit
            self._stroke(self.ends[number, 0] + curve, color=INK, linewidth=1.0, zorder=4)

    def _draw_arc(self, centre: Array, start: float, turn: float, radius: float, text: str) -> None:
        radius *= self.unit
        angles = start + turn * np.linspace(0.0, 1.0, STEPS)
        ways = np.column_stack([np.cos(angles), np.sin(angles)])
        dashes = np.linspace(centre, centre + 1.35 * radius * ways[0], STEPS)
        self._stroke(dashes, color=INK, linewidth=0.7, linestyle=(0, (4, 3)), zorder=3)
        self._stroke(centre + radius * ways, color=BLUE, linewidth=1.1, zorder=4)
        look = {"arrowstyle": "-|>", "color": BLUE, "shrinkA": 0, "shrinkB": 0}
        tail, tip = centre + radius * ways[-4], centre + radius * ways[-1]
        self.axes.annotate("", _pair(tip), _pair(tail), arrowprops=look)
        spots = centre + radius * ways[[20, 14, 26, 8, 32]]
        self.words.append((text, spots, {"color": BLUE}))

    def _stroke(self, points: Array, **style: Any) -> None:
        self.axes.plot(*points.T, solid_capstyle="round", **style)
        self.strokes.append(points)

    def _arrow(self, tail: Array, tip: Array, color: str, shrink: float = 0.0) -> None:
        look = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": shrink}
        self.axes.annotate("", _pair(tip), _pair(tail), arrowprops=look)
        self.strokes.append(np.linspace(tail, tip, STEPS))

    def _name_of(self, link: str) -> str:
        return next((joint.name for joint in self.linkage.joints if joint.link == link), link)

    def write(self) -> None:
        """Write the words where they hide nothing, angles first."""
        canvas: Any = FigureCanvasAgg(self.figure)
        canvas.draw()
        place = self.axes.transData.transform
        taken: list[Bbox] = []
        drawn = place(self.strokes_points())
        common: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 8}
        for words, spots, style in sorted(self.words, key=lambda each: "$" not in each[0]):
            text = self.axes.text(0, 0, words, **{"fontsize": TEXT_SIZE, **common, **style})
            box = text.get_window_extent(canvas.get_renderer()).padded(2)
            spot = _free(box, place(spots), taken, drawn)
            text.set_position(_pair(self.axes.transData.inverted().transform(spot)))
            taken.append(box.translated(*(spot - _middle(box))))


def _pair(place: Array) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _middle(box: Bbox) -> Array:
    middle: Array = np.array([box.x0 + box.x1, box.y0 + box.y1]) / 2
    return middle


def _free(box: Bbox, spots: Array, taken: list[Bbox], drawn: Array) -> Array:
    """The place (pixels) for a box, close to one of the spots, that hides the least."""
    size = np.array([box.width, box.height])
    ways = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    around = np.column_stack([np.cos(ways), np.sin(ways)])
    far = np.array([0.62, 0.8, 1.0, 1.3, 1.7, 2.2, 2.8])[:, None, None]
    shifts = around * (size * [0.62, 0.8] + 14 * (far - 0.5))
    places = shifts[:, :, None] + spots
    low, high = (places[..., None, :] + side * size / 2 for side in (-1, 1))
    hidden = ((drawn > low) & (drawn < high)).all(axis=-1).sum(axis=-1)
    corners = np.array([[each.min, each.max] for each in taken]).reshape(-1, 2, 2)
    over = ((low < corners[:, 1]) & (high > corners[:, 0])).all(axis=-1).sum(axis=-1)
    cost = 1000 * over + 10 * hidden + 12 * far + 0.2 * np.arange(len(spots))
    best: Array = places.reshape(-1, 2)[cost.argmin()]
    return best


def _frame(axes: Axes, points: Array) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    air = 0.08 * float((high - low).max())
    axes.set_xlim(low[0] - air, high[0] + air)
    axes.set_ylim(low[1] - air, high[1] + air)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _add_key(figure: Figure) -> None:
    look: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 8}
    handles = [
        Line2D([], [], color=INK, label="joint with a motor", **look),
        Line2D([], [], color=INK, markerfacecolor="white", label="passive joint", **look),
        Line2D([], [], color=VERMILION, label="foot", **look),
        Line2D([], [], color=INK, linewidth=0.7, linestyle="--", label="extension of the parent"),
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=len(handles))
