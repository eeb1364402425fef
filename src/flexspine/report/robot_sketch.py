"""One posture of a robot as a drawing: links, joints, spine, feet, CoM and forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

from flexspine.report.postures import Point
from flexspine.report.robot_parts import RobotLeg, RobotParts
from flexspine.report.robot_postures import RobotPosture
from flexspine.report.stick_figure import ARROW_WIDTH, TRUNK_WIDTH, Canvas, Scale, arrow_outline
from flexspine.report.style import INK, SIDE_COLORS, paler

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Sizes in lengths of the leg.
LINK_WIDTH = 0.075
TRUNK_EDGE = 0.045
JOINT = 0.05
SPINE = 0.075
FOOT = 0.085

# Legs behind the trunk and before it; forces and the CoM before all.
BEHIND, TRUNK, BEFORE, FORCES, COM = 3.0, 5.0, 7.0, 9.0, 10.0


class RobotSketch:
    """The artists of a robot; `show` moves them to a posture.

    ``sides`` are the ends of the robot at which the trunk's links are. ``points_per_metre`` is how
    large a metre is drawn, so that lines keep their proportions.
    """

    def __init__(
        self,
        axes: Axes,
        scale: Scale,
        points_per_metre: float,
        parts: RobotParts,
        sides: Mapping[str, str],
    ) -> None:
        self.scale, self.parts = scale, parts
        self.canvas = Canvas(axes, scale.leg * points_per_metre)
        self.trunk = {link: self._add_trunk(SIDE_COLORS[side]) for link, side in sides.items()}
        self.legs = {leg.name: self._add_leg(leg) for leg in parts.legs}
        self.hips = {leg.name: self._add_joint(leg) for leg in parts.legs}
        self.feet = {
            leg.name: self.canvas.dot(_order(leg) + 0.3, FOOT, "white", leg.color)
            for leg in parts.legs
        }
        self.arrows = {leg.name: self.canvas.arrow(leg.color, FORCES) for leg in parts.legs}
        if parts.spine is not None:
            self.spine = self.canvas.dot(TRUNK + 0.5, SPINE, "white", INK)
        self.com = self.canvas.com(COM)

    def show(self, posture: RobotPosture) -> None:
        """Move to a posture."""
        for link, lines in self.trunk.items():
            for line in lines:
                line.set_data(*zip(*posture.links[link], strict=True))
        for leg in self.parts.legs:
            self._show_leg(leg, posture)
        if posture.joint is not None:
            self.spine.set_data([posture.joint[0]], [posture.joint[1]])
        for artist in self.com:
            artist.set_data([posture.com[0]], [posture.com[1]])

    def _show_leg(self, leg: RobotLeg, posture: RobotPosture) -> None:
        nodes = leg_nodes(leg, posture)
        self.legs[leg.name].set_data(*zip(*nodes, strict=True))
        self.hips[leg.name].set_data(*zip(*nodes[1:], strict=True))
        foot, dot = posture.feet[leg.name], self.feet[leg.name]
        dot.set_data([foot.place[0]], [foot.place[1]])
        # Filled with its colour it carries the robot, and with ink it slides as well.
        dot.set_markerfacecolor(INK if foot.slides else leg.color if foot.stands else "white")
        force = self.scale.arrow * np.array(foot.force)
        arrow = self.arrows[leg.name]
        arrow.set_visible(bool(np.hypot(*force) > 0.02 * self.scale.leg))
        place = np.array(foot.place)
        arrow.set_xy(arrow_outline(place - force, place, ARROW_WIDTH * self.scale.leg))

    def _add_trunk(self, color: str) -> tuple[Line2D, Line2D]:
        """A bar with an outline: a wide line under a narrower one."""
        return (
            self.canvas.line(TRUNK, color=color, width=TRUNK_WIDTH),
            self.canvas.line(TRUNK + 0.1, color=paler(color), width=TRUNK_WIDTH - TRUNK_EDGE),
        )

    def _add_leg(self, leg: RobotLeg) -> Line2D:
        return self.canvas.line(_order(leg), color=leg.color, width=LINK_WIDTH)

    def _add_joint(self, leg: RobotLeg) -> Line2D:
        return self.canvas.dot(_order(leg) + 0.2, JOINT, "white", leg.color)


def leg_nodes(leg: RobotLeg, posture: RobotPosture) -> list[Point]:
    """Return the ends of a leg's links (m), from the foot's to the hip."""
    foot = np.array(posture.feet[leg.name].place)
    nodes: list[Point] = []
    for link in leg.links:
        one, other = posture.links[link]
        here = nodes[-1] if nodes else foot
        near, far = sorted((one, other), key=lambda end: float(np.hypot(*(np.array(end) - here))))
        nodes += [far] if nodes else [near, far]
    return nodes


def _order(leg: RobotLeg) -> float:
    return BEFORE if leg.near else BEHIND
