"""The coordinates of a bounder: its angles, lengths and legs in a posture that tells them apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from flexspine.models.actuation import BARE
from flexspine.models.bounder import X, Y
from flexspine.parameters import values
from flexspine.report.picture import Picture
from flexspine.report.stick_figure import wavy_arc, zigzag
from flexspine.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    SIDE_COLORS,
    TEXT_SIZE,
    add_title,
    themed,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from flexspine.models.model import Model

    Array = NDArray[np.float64]

# The posture that is drawn, in rad: pitches of the ends (one of a body that does not bend) and
# angles of the legs from the vertical. The hind leg stands.
PITCHES = {"fore": 0.38, "hind": 0.14}
LEG_ANGLES = {"fore": 0.42, "hind": 0.34}
STANDING = "hind"
COMPRESSED = 0.88  # length of the leg that stands, in rest lengths

ARC = 0.45  # radius of an angle's arc, in lengths of the fore leg
STEPS = 40  # points of an arc
AHEAD = {"fore": 1.0, "hind": -1.0}


def plot_bounder_coordinates(model: Model) -> Figure:
    """Draw a bounder with the letters of its coordinates, angles and lengths.

    Lengths are in proportion (m); the posture is one that tells them apart, not one of a gait.
    """
    with themed():
        figure = Picture(figsize=(8.0, 4.6), layout="constrained")
        axes = figure.subplots()
        _Sketch(axes, model).draw()
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.margins(0.06)
        details = ["angles counter-clockwise, those of legs from the vertical, foot ahead positive"]
        add_title(figure, f"{model.kind.name}: coordinates", details)
    return figure


class _Sketch:
    """What is drawn, in m, with the toe that stands on the ground at y = 0."""

    def __init__(self, axes: Axes, model: Model) -> None:
        self.axes, self.numbers = axes, values(model.parameters)
        body = model.kind.body(BARE)
        self.bends = len(body.coordinates) > 1
        self.pitches = PITCHES if self.bends else dict.fromkeys(PITCHES, PITCHES[STANDING])
        given = {symbol: self.numbers[name] for name, symbol in body.parameters.items()
                 if name in self.numbers}  # fmt: skip
        given |= {body.pitches[side][0]: angle for side, angle in self.pitches.items()}
        given |= {X: 0.0, Y: 0.0}
        for symbol, value in body.definitions.items():
            given[symbol] = value.subs(given)
        place = {
            name: np.array([float(part.subs(given)) for part in point])
            for name, point in {**body.hips, **body.low_points}.items()
        }
        self.unit = self.numbers["fore.leg.rest_length"]
        foot = place[STANDING] + self._leg(STANDING)
        self.com = -foot
        place = {name: point + self.com for name, point in place.items()}
        self.hips = {side: place.pop(side) for side in AHEAD}
        self.joint = place.get("spine joint")

    def _leg(self, side: str) -> Array:
        """From hip to foot."""
        angle = LEG_ANGLES[side]
        length = self.numbers[f"{side}.leg.rest_length"]
        if side == STANDING:
            length *= COMPRESSED
        return length * np.array([np.sin(angle), -np.cos(angle)])

    def draw(self) -> None:
        """Draw all of it."""
        right = self.hips["fore"][0] + 0.9 * self.unit
        left = self.hips["hind"][0] - 0.75 * self.unit
        self.axes.plot([left, right], [0, 0], color=FAINT, linewidth=1.2, zorder=1)
        self._draw_trunk()
        for side in AHEAD:
            self._draw_leg(side)
        self._draw_axes(left)

    def _draw_trunk(self) -> None:
        meeting = self.com if self.joint is None else self.joint
        for side, ahead in AHEAD.items():
            hip = self.hips[side]
            self._line(meeting, hip, color=INK, linewidth=5, alpha=0.55, zorder=2)
            self._draw_lengths(side, meeting, hip)
            if self.bends or side == "fore":
                self._draw_pitch(side, meeting, ahead)
        if self.joint is not None:
            spring = self.joint + 0.3 * self.unit * wavy_arc(*self._spring_turn())
            self.axes.plot(*spring.T, color=GREEN, linewidth=1.2, zorder=4)
            self._word(self.joint + self.unit * np.array([0.3, -0.4]), "$k_t, c_t$", GREEN)
            self._dot(self.joint, "white", 8)
        self._dot(self.com, INK, 7)
        aside = [0.12, -0.17] if self.joint is None else [-0.48, -0.24]
        self._word(self.com + self.unit * np.array(aside), "CoM $(x, y)$", INK)

    def _spring_turn(self) -> tuple[float, float]:
        start = np.pi + self.pitches["hind"]
        return start, np.pi + self.pitches["fore"] - self.pitches["hind"]

    def _draw_lengths(self, side: str, meeting: Array, hip: Array) -> None:
        """The distances along one end, above it."""
        ahead, letter = AHEAD[side], side[0]
        angle = self.pitches[side]
        along = ahead * np.array([np.cos(angle), np.sin(angle)])
        up = self.unit * 0.27 * np.array([-np.sin(angle), np.cos(angle)])
        offset = self.numbers.get(f"{side}.spine_offset")
        if offset is None:
            self._span(meeting, hip, up, f"$h_{letter}$")
            return
        middle = hip - along * self.numbers[f"{side}.hip_offset"]
        self._dot(middle, "white", 6)
        self._span(middle - along * offset, middle, up, f"$a_{letter}$")
        self._span(middle, hip, up, f"$h_{letter}$")

    def _draw_pitch(self, side: str, meeting: Array, ahead: float) -> None:
        """The angle of one end from the horizontal."""
        angle = self.pitches[side]
        reach = self.unit * 1.15
        self._line(meeting, meeting + np.array([ahead * reach, 0.0]), color=INK, linewidth=0.7,
                   linestyle=(0, (4, 3)), zorder=3)  # fmt: skip
        turns = np.linspace(0.0, angle, STEPS) + (0.0 if ahead > 0 else np.pi)
        name = f"$\\theta_{side[0]}$" if self.bends else r"$\theta$"
        middle = turns[STEPS // 2]
        spot = meeting + reach * 1.06 * np.array([np.cos(middle), np.sin(middle)])
        self._arc(meeting, turns, reach * 0.92, name, spot)

    def _draw_leg(self, side: str) -> None:
        """A leg as a spring, its angle from the vertical; one is held out for touchdown."""
        hip, stands = self.hips[side], side == STANDING
        foot = hip + self._leg(side)
        self.axes.plot(
            *zigzag(hip, foot, 0.14 * self.unit).T,
            color=SIDE_COLORS[side], linewidth=1.8, zorder=5,
        )  # fmt: skip
        self._dot(hip, "white", 7)
        self._dot(foot, SIDE_COLORS[side], 6)
        self._line(hip, hip - np.array([0.0, 0.95 * self.unit]), color=INK, linewidth=0.7,
                   linestyle=(0, (4, 3)), zorder=3)  # fmt: skip
        angle = LEG_ANGLES[side]
        turns = -np.pi / 2 + np.linspace(0.0, angle, STEPS)
        spot = hip + 0.62 * self.unit * np.array([np.sin(angle / 2), -np.cos(angle / 2)])
        self._arc(hip, turns, 0.75 * self.unit, f"$\\gamma_{side[0]}$", spot)
        told = f"$k_{side[0]}, c_{side[0]}$\nfoot at $s_{side[0]}$" if stands else f"$l_{side[0]}$"
        aside = self.unit * np.array([0.3 if stands else 0.2, 0.0])
        self._word((hip + foot) / 2 + aside, told, SIDE_COLORS[side], ha="left")

    def _draw_axes(self, left: float) -> None:
        corner = np.array([left + 0.05 * self.unit, 0.0])
        for way, name in (([0.32, 0.0], "$x$"), ([0.0, 0.32], "$y$")):
            tip = corner + self.unit * np.array(way)
            self._arrow(corner, tip, INK)
            self._word(tip + 0.28 * (tip - corner), name, INK)

    def _span(self, start: Array, end: Array, up: Array, text: str) -> None:
        """A length between two points, drawn aside of them."""
        look = {"arrowstyle": "<->", "color": BLUE, "shrinkA": 0, "shrinkB": 0, "linewidth": 0.9}
        self.axes.annotate("", _pair(start + up), _pair(end + up), arrowprops=look)
        for point in (start, end):
            self._line(point + 0.25 * up, point + 1.1 * up, color=BLUE, linewidth=0.5, zorder=2)
        self._word((start + end) / 2 + 1.3 * up, text, BLUE)

    def _arc(self, centre: Array, turns: Array, radius: float, text: str, spot: Array) -> None:
        ways = np.column_stack([np.cos(turns), np.sin(turns)])
        self.axes.plot(*(centre + radius * ways).T, color=BLUE, linewidth=1.1, zorder=4)
        self._arrow(centre + radius * ways[-4], centre + radius * ways[-1], BLUE)
        self._word(spot, text, BLUE)

    def _arrow(self, tail: Array, tip: Array, color: str) -> None:
        look = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", _pair(tip), _pair(tail), arrowprops=look)

    def _line(self, start: Array, end: Array, **look: Any) -> None:
        self.axes.plot(*np.array([start, end]).T, **look)

    def _dot(self, at: Array, fill: str, size: float) -> None:
        self.axes.plot(*at, "o", color=INK, markerfacecolor=fill, markersize=size, zorder=6)

    def _word(self, at: Array, text: str, color: str, ha: str = "center") -> None:
        look: dict[str, Any] = {"color": color, "ha": ha, "va": "center", "zorder": 8}
        self.axes.text(float(at[0]), float(at[1]), text, fontsize=TEXT_SIZE + 1, **look)


def _pair(place: Array) -> tuple[float, float]:
    return float(place[0]), float(place[1])
