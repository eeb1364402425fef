"""The scene of a bounder's animation: the animal on a stage, its phase and its bend in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine.report.postures import Point, Posture, postures
from flexspine.report.stage import LEFT, STAGE, Scenery, Stage, View
from flexspine.report.stick_figure import SPRING_RADIUS, Scale, StickFigure, bend_color
from flexspine.report.style import PHASE_COLORS
from flexspine.report.timeline import (
    PHASE_NAMES,
    draw_phase_bar,
    label_phases,
    phase_spans,
    window,
)
from flexspine.report.way import Way

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BEND = LEFT + 2.6  # in; where the bend of the spine is told


def view_of(shown: Sequence[Posture], scale: Scale, way: Way | None = None) -> View:
    """Return the smallest view that holds all postures, their arrows and some air."""

    def seen(posture: Posture) -> Iterable[Point]:
        level = way.level(posture.com[0]) if way is not None else 0.0
        for x, y in _outline(posture, scale):
            yield x - posture.com[0], y - level

    return View.around((point for posture in shown for point in seen(posture)), scale)


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
        limits, x = window(times), [posture.com[0] for posture in self.postures]

        def draw_bar(axes: Axes) -> None:
            spans = phase_spans(dataset)
            draw_phase_bar(axes, spans, limits)
            label_phases(axes, spans, STAGE)

        way = Way.of(dataset)
        view = view_of(self.postures, self.scale, way)
        scenery = Scenery(view, self.scale, limits, (min(x), max(x)), slow_down, draw_bar, way=way)
        self.stage = Stage(dataset, scenery)
        self.figure = self.stage.figure
        self.animal = StickFigure(self.stage.axes, self.scale, self.stage.metre, self.postures[0])
        self.bend, self.swatch = self.stage.add_bend(BEND)
        self.swatch.set_visible(self.postures[0].bend is not None)

    def show(self, posture: Posture) -> None:
        """Bring the figure to a posture, the CoM in the middle."""
        self.stage.follow(posture.time, posture.com[0])
        self.animal.show(posture)
        self.stage.phase.set_text(f"{posture.phase}: {PHASE_NAMES[posture.phase]}")
        self.stage.phase.set_bbox(pill(posture.phase))
        if posture.bend is not None:
            self.bend.set_text(tell_bend(posture.bend))
            self.swatch.set_facecolor(bend_color(posture.bend, self.scale))


def tell_bend(bend: float) -> str:
    """Return a bend of the spine (rad) in words, without a sign for next to nothing."""
    degrees = round(float(np.degrees(bend)), 1)
    if not degrees:
        return "spine straight"
    return f"spine {'sags' if degrees > 0 else 'arches'} by {abs(degrees):.1f}°"


def pill(phase: str) -> dict[str, Any]:
    """Return the box around a phase's name."""
    return {"boxstyle": "round,pad=0.35", "facecolor": PHASE_COLORS[phase], "edgecolor": "none"}
