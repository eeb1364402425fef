"""A robot pinned by a foot, by our equations and by MuJoCo's: the difference, and what moved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
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
    SKY,
    VERMILION,
    add_title,
    themed,
)
from flexspine.studies.pinned_check import ALLOWED, COMPARED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.typing import HashableList

    from flexspine.studies.pinned_check import PinnedCase, PinnedCheck

    Look = dict[str, Any]

WIDTH, ROW = 9.6, 2.35  # in; of the figure, and the height of a row of panels

# The links that are drawn are those that turn most; more than these cannot be told apart.
LINK_COLORS = (BLUE, VERMILION, GREEN, PURPLE)

DOTS = 40  # of MuJoCo's motion in a panel

HEADROOM = 1e3  # above the points, for the legend

POSTURES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the run

# rad, J; panels show nothing smaller, as rounding is all that there is.
LEAST, LEAST_ENERGY = 1e-16, 1e-14

LIMIT: Look = {"color": INK, "linewidth": 0.8, "linestyle": (0, (6, 3)), "zorder": 1.5}
MARKS = {"without dampers": ("o", BLUE), "with dampers": ("s", VERMILION)}


def plot_pinned(check: PinnedCheck) -> Figure:
    """Draw differences over time and step, angles of both, energies and postures."""
    over_time = [_draw_difference, _draw_angles, _draw_energies]
    count = len(check.cases)
    with themed():
        details = _details(check)
        layout: list[HashableList[str]] = [
            [f"{row} {i}" for i in range(count)] for row in range(len(over_time))
        ]
        layout.append(["steps", "postures"] if count > 1 else ["steps"])
        if count == 1:
            layout.append(["postures"])
        height = ROW * len(layout) + 0.4 + LINE * len(details)
        width = WIDTH if count > 1 else WIDTH * 0.7
        figure = Picture(figsize=(width, height))
        panels: dict[str, Axes] = figure.subplot_mosaic(layout)
        for i, case in enumerate(check.cases):
            for row, draw in enumerate(over_time):
                axes = panels[f"{row} {i}"]
                draw(axes, case)
                axes.set_xlim(case.times[0], case.times[-1])
                axes.set_xlabel("time (s)")
            panels[f"0 {i}"].set_title(case.name, loc="left", fontweight="bold")
        _draw_steps(panels["steps"], check)
        _draw_postures(panels["postures"], check.cases[0])
        add_title(
            figure, f"{check.robot.name} pinned by {check.foot}, by us and by MuJoCo", details
        )
    return figure


def _details(check: PinnedCheck) -> list[str]:
    """What a reader must know."""
    numbers = check.robot.numbers
    springs = "  ·  ".join(
        f"{joint}: stiffness {numbers[f'{joint}.stiffness']:g} N m/rad, "
        f"damping {numbers[f'{joint}.damping']:g} N m s/rad"
        for joint in check.robot.joints
        if numbers[f"{joint}.stiffness"] or numbers[f"{joint}.damping"]
    )
    return [
        "let go from rest in a crouch, motors limp, no ground; MuJoCo by its RK4, ours to rounding",
        f"dashed: the smallest step has to stay below {ALLOWED:g} rad up to {COMPARED:g} s",
        *([springs] if springs else []),
    ]


def _draw_difference(axes: Axes, case: PinnedCase) -> None:
    """Draw how far the links are apart over time, a line a step."""
    shades = colormaps["viridis"](np.linspace(0.85, 0.0, len(case.steps)))
    for step, apart, color in zip(case.steps, case.differences, shades, strict=True):
        axes.semilogy(
            case.times, np.maximum(apart, LEAST), color=color, linewidth=1.2, label=_step(step)
        )
    axes.axhline(ALLOWED, **LIMIT)
    axes.axvline(COMPARED, **LIMIT)
    axes.set_ylabel("largest difference\nof an angle (rad)")
    axes.set_ylim(LEAST, 1e4)
    axes.legend(title="MuJoCo's step", loc="upper left", ncols=2, title_fontsize="small")


def _draw_angles(axes: Axes, case: PinnedCase) -> None:
    """Draw the links that turn most: lines are ours, dots MuJoCo's at its smallest step."""
    spans = np.ptp(case.angles, axis=0)
    names = [link.name for link in case.run.linkage.links]
    theirs = case.theirs[-1].angles
    some = slice(None, None, max(1, len(case.times) // DOTS))
    for number, color in zip(np.argsort(-spans)[: len(LINK_COLORS)], LINK_COLORS, strict=False):
        axes.plot(case.times, case.angles[:, number], color=color, label=names[number])
        axes.plot(case.times[some], theirs[some, number], ".", color=color, markersize=5)
    axes.set_ylabel("angle from +x (rad)\nline: ours, dots: MuJoCo")
    axes.legend(loc="best", ncols=2)


def _draw_energies(axes: Axes, case: PinnedCase) -> None:
    """Draw how far the energies of both are off their balance."""
    axes.semilogy(case.times, _size(case.imbalance), color=BLUE, linewidth=1.2, label="ours")
    for values, step, color in (
        (case.their_imbalance[0], case.steps[0], ORANGE),
        (case.their_imbalance[-1], case.steps[-1], SKY),
    ):
        axes.semilogy(
            case.times, _size(values), color=color, linewidth=1.2, label=f"MuJoCo, {_step(step)}"
        )
    axes.set_ylim(LEAST_ENERGY, 1e6)
    axes.set_ylabel("imbalance of\nenergy (J)")
    most = float(case.energies.kinetic.max())
    axes.legend(
        loc="upper left", title=f"kinetic energy up to {most:.3g} J",
        title_fontsize="small",
    )  # fmt: skip


def _size(values: Any) -> Any:
    return np.maximum(np.abs(values), LEAST_ENERGY)


def _draw_steps(axes: Axes, check: PinnedCheck) -> None:
    """Draw the difference up to the compared time over the step, and the slope of order 4."""
    found = np.concatenate([case.compared for case in check.cases])
    for case in check.cases:
        mark, color = MARKS[case.name]
        order = "not to be told" if case.order is None else f"{case.order:.2f}"
        steps, apart = np.array(case.steps), np.maximum(case.compared, LEAST)
        look: Look = {"marker": mark, "color": color, "markersize": 5, "linestyle": "none"}
        axes.loglog(
            steps[case.fitted], apart[case.fitted], label=f"{case.name}: order {order}", **look
        )
        axes.loglog(steps[~case.fitted], apart[~case.fitted], markerfacecolor="white", **look)
        if case.order is not None:
            last = np.flatnonzero(case.fitted)[-1]
            slope = case.compared[last] * (steps / steps[last]) ** 4
            axes.loglog(steps, slope, color=color, linewidth=0.9)
    axes.axhline(ALLOWED, **LIMIT)
    axes.set_xticks(check.cases[0].steps, [_step(step) for step in check.cases[0].steps])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(top=HEADROOM * max(ALLOWED, *(each for each in found if np.isfinite(each))))
    axes.set_xlabel("MuJoCo's step; lines: slope 4; hollow: not fitted")
    axes.set_ylabel(f"largest difference\nup to {COMPARED:g} s (rad)")
    axes.legend(loc="upper left")


def _draw_postures(axes: Axes, case: PinnedCase) -> None:
    """Draw the robot at a few times side by side, the pinned foot marked."""
    linkage = case.run.linkage
    times = np.array(POSTURES) * case.times[-1]
    q = case.run.coordinates(times)
    ends = [
        np.stack([linkage.point(q, link.name, at) for at in (0.0, link.length)], axis=1)
        for link in linkage.links
    ]
    places = np.array(ends)  # links, times, ends, axes
    reach = np.ptp(places[..., 0], axis=(0, 2))
    reach = np.maximum(reach, 0.4 * reach.max())  # room for what is written below
    room = 0.12 * reach.max()
    left = 0.0
    for i, time in enumerate(times):
        shift = left - places[:, i, :, 0].min()
        for link in places[:, i]:
            axes.plot(link[:, 0] + shift, link[:, 1], color=INK, linewidth=1.2)
        axes.plot(shift, 0.0, "o", color=VERMILION, markersize=5)
        low = places[..., 1].min() - 0.05 * reach.max()
        axes.text(
            left + reach[i] / 2, low, f"{time:.2g} s", ha="center", va="top", fontsize="small"
        )
        left += reach[i] + room
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"postures, {case.name}", loc="left")


def _step(step: float) -> str:
    """A step as people read it."""
    return f"{1e6 * step:.4g} µs" if step < 1e-3 else f"{1e3 * step:.4g} ms"
