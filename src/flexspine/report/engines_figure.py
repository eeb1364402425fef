"""Our motions and MuJoCo's: how the differences shrink, in three panels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from flexspine.report.picture import Picture
from flexspine.report.style import (
    BLUE,
    GREEN,
    INK,
    LINE,
    ORANGE,
    PURPLE,
    VERMILION,
    add_title,
    themed,
)
from flexspine.studies.pinned_check import ALLOWED, COMPARED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from flexspine.studies.pinned_check import PinnedCheck
    from flexspine.studies.replay_check import ReplayCheck
    from flexspine.studies.template_check import TemplateCheck

    Array = NDArray[np.float64]

SIZE = (10.2, 3.6)  # in

STYLES = (("o", BLUE), ("s", VERMILION), ("^", GREEN), ("D", PURPLE))


def plot_engines(pinned: PinnedCheck, replay: ReplayCheck, template: TemplateCheck) -> Figure:
    """Draw differences over steps, grounds and masses of toes."""
    with themed():
        details = ["dashed: what is allowed; dotted: the order that is expected"]
        size = (SIZE[0], SIZE[1] + LINE * len(details))
        figure = Picture(figsize=size, layout="constrained")
        one, two, three = figure.subplots(1, 3)
        _draw_pinned(one, pinned)
        _draw_replay(two, replay)
        _draw_template(three, template)
        add_title(figure, "We and MuJoCo: differences", details)
    return figure


def _draw_pinned(axes: Axes, check: PinnedCheck) -> None:
    for case, (marker, color) in zip(check.cases, STYLES, strict=False):
        axes.loglog(
            case.steps, case.compared, marker=marker, color=color, markersize=4, label=case.name
        )
    steps = np.array(check.cases[0].steps)
    _slope(axes, steps, float(check.cases[0].compared[-1]), 4)
    axes.axhline(ALLOWED, color=INK, linewidth=0.8, linestyle="--")
    axes.set_title(f"pinned by {check.foot}, up to {COMPARED:g} s")
    axes.set_xlabel("MuJoCo's step (s)")
    _plain(axes)
    axes.set_ylabel("largest difference of a link (rad)")
    axes.legend(loc="lower right")


def _draw_replay(axes: Axes, check: ReplayCheck) -> None:
    names = [
        f"{1e3 * case.ground.radius:g} mm\n{case.ground.stiffness:g}".replace("e+0", "e")
        for case in check.cases
    ]
    for (label, values), (marker, color) in zip(
        {
            "joints (rad)": [case.angle for case in check.cases],
            "CoM height (m)": [case.height for case in check.cases],
            "mean normal force (share)": [case.mean_normal for case in check.cases],
        }.items(),
        STYLES,
        strict=False,
    ):
        axes.semilogy(names, values, marker=marker, color=color, markersize=4, label=label)
    axes.set_title("trot in the plane, replayed")
    axes.set_xlabel("radius of feet, ground (N/m)")
    axes.set_ylabel("difference (root mean square)")
    axes.legend(loc="upper right")


def _draw_template(axes: Axes, check: TemplateCheck) -> None:
    shares = np.array([each.level.share for each in check.strides])
    labels = ("CoM (m)", "segments (rad)", "contact times (s)", "peak force (share)")
    for column, label, (marker, color) in zip(check.differences.T, labels, STYLES, strict=True):
        axes.loglog(shares, column, marker=marker, color=color, markersize=4, label=label)
    _slope(axes, shares, float(check.differences[-1].min()) / 2, 1)
    axes.set_title(f"a stride of {check.model.name}")
    axes.set_xlabel("mass of a toe (share), steps alike")
    axes.set_ylim(top=4 * float(check.differences.max()))
    _plain(axes)
    axes.set_ylabel("largest difference")
    axes.legend(loc="upper left", ncols=2)


def _plain(axes: Axes) -> None:
    """Leave ticks between powers of ten without labels, which would overlap."""
    axes.xaxis.set_minor_formatter(NullFormatter())


def _slope(axes: Axes, x: Array, last: float, order: int) -> None:
    """The line that differences of an order follow, through the last one."""
    axes.loglog(x, last * (x / x[-1]) ** order, color=ORANGE, linewidth=1.0, linestyle=":")
