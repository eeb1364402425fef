"""The scene of a robot's animation: the robot on a stage, its footing and its bend in words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from flexspine.report.postures import Point
from flexspine.report.robot_figure import FAR_OVER, draw_stances
from flexspine.report.robot_parts import RobotParts, typical_force
from flexspine.report.robot_postures import RobotPosture, robot_postures
from flexspine.report.robot_sketch import RobotSketch
from flexspine.report.scene import pill, tell_bend
from flexspine.report.stage import LEFT, Scenery, Stage, View
from flexspine.report.stick_figure import ARROW_LENGTH, Scale, bend_color
from flexspine.report.timeline import drawable, window

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BEND = LEFT + 4.35  # in; where the bend of the spine is told
ROW = 0.11  # in; of the bar, for each leg
ROW_SIZE = 6.5  # pt


class RobotScene:
    """The figure of an animation; `show` brings it to a posture."""

    def __init__(self, dataset: xr.Dataset, times: Array, slow_down: float) -> None:
        run = drawable(dataset)
        self.parts = RobotParts.of(run)
        self.postures = robot_postures(run, self.parts, times)
        self.scale = scale_of(run, self.parts)
        limits, x = window(times), [posture.com[0] for posture in self.postures]

        def draw_bar(axes: Axes) -> None:
            draw_stances(axes, run, self.parts)
            axes.set_xlim(*limits)
            names = [leg.title for leg in self.parts.legs]
            axes.set_yticks(range(len(names)), names, fontsize=ROW_SIZE)
            axes.tick_params(axis="y", length=0, pad=2)
            axes.spines[:].set_visible(False)

        view = View.around(_outline(self.postures, self.scale), self.scale)
        self.stage = Stage(
            run,
            Scenery(
                view, self.scale, limits, (min(x), max(x)), slow_down, draw_bar,
                bar=ROW * len(self.parts.legs), force_of="per leg",
            ),
        )  # fmt: skip
        self.figure = self.stage.figure
        sides = {link: self.parts.side_of(run, link) for link in self.parts.trunk}
        self.robot = RobotSketch(self.stage.axes, self.scale, self.stage.metre, self.parts, sides)
        self.bend, self.swatch = self.stage.add_bend(BEND)
        self.swatch.set_visible(self.parts.spine is not None)

    def show(self, posture: RobotPosture) -> None:
        """Bring the figure to a posture, the CoM in the middle."""
        self.stage.follow(posture.time, posture.com[0])
        self.robot.show(posture)
        self.stage.phase.set_text(tell_footing(posture, self.parts))
        self.stage.phase.set_bbox(pill(_phase(posture, self.parts)))
        if posture.bend is not None:
            self.bend.set_text(tell_bend(posture.bend))
            self.swatch.set_facecolor(bend_color(posture.bend, self.scale))


def scale_of(dataset: xr.Dataset, parts: RobotParts) -> Scale:
    """Return the scale of a run; forces far above the usual run out of the picture."""
    first = dataset[["link_start", "link_end"]].isel(time=0)
    lengths = np.hypot(*(first["link_end"] - first["link_start"]).values.T)
    of_link = dict(zip(dataset["link"].values.tolist(), lengths.tolist(), strict=True))
    legs = [sum(of_link[link] for link in leg.links) for leg in parts.legs]
    force = np.hypot(*np.moveaxis(dataset["grf"].values, -1, 0)).max(initial=0.0)
    bend = 0.0
    if parts.spine is not None:
        bend = float(abs(dataset["angle"].sel(joint=parts.spine)).max())
    usual = FAR_OVER * typical_force(dataset)
    return Scale(max(legs or lengths), float(min(force, usual)), max(bend, 1e-6))


def _outline(shown: list[RobotPosture], scale: Scale) -> Iterable[Point]:
    """Points that are to be seen, from the CoM."""
    reach = ARROW_LENGTH * scale.leg
    for posture in shown:
        x, y = posture.com
        yield 0.0, y
        for start, end in posture.links.values():
            yield from ((start[0] - x, start[1]), (end[0] - x, end[1]))
        for foot in posture.feet.values():
            tail = np.clip(scale.arrow * foot.force[0], -reach, reach)
            yield foot.place[0] - x - float(tail), foot.place[1]


def tell_footing(posture: RobotPosture, parts: RobotParts) -> str:
    """Return in words which legs stand and which of these slide."""
    feet = {leg.title: posture.feet[leg.name] for leg in parts.legs}
    stand = [name for name, foot in feet.items() if foot.stands and not foot.slides]
    slide = [name for name, foot in feet.items() if foot.slides]
    told = [f"on {', '.join(stand)}"] if stand else []
    told += [f"sliding on {', '.join(slide)}"] if slide else []
    return ", ".join(told) or "in flight"


def _phase(posture: RobotPosture, parts: RobotParts) -> str:
    """The phase that a bounder would be in, for its colour."""
    sides = {leg.side for leg in parts.legs if posture.feet[leg.name].stands}
    if len(sides) == 2:
        return "DS"
    return {"fore": "FS", "hind": "HS"}[sides.pop()] if sides else "DF"
