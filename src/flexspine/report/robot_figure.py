"""A robot's run over time: feet, joints, forces, centre of mass and trunk in one figure."""

from __future__ import annotations

import json
from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from flexspine.errors import ParameterError
from flexspine.report.caption import WIDE, describe, ending, heading, joined
from flexspine.report.picture import Picture
from flexspine.report.robot_parts import RobotLeg, RobotParts, typical_force
from flexspine.report.sagittal import is_spatial, sagittal
from flexspine.report.style import (
    FAINT,
    GREEN,
    INK,
    LINE,
    PURPLE,
    SIDE_COLORS,
    SMALL_SIZE,
    add_legend,
    add_title,
    paler,
    themed,
    widen,
)
from flexspine.report.timeline import check_samples, drawable, phase_spans

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CYCLES = 4  # strides that are shown of a long run

LEAST_IMPULSE = 1e-9  # N s; what is less comes from rounding
LEAST_SHARE = 0.01  # of the largest impulse; what is less looks like none
FAR_OVER = 3.0  # typical forces; what is more is left out of the picture, and said
SCALE_ROOM = 0.13  # widths of a panel, for a scale on its right


_STEM: dict[str, Any] = {"linewidth": 0.7, "markersize": 3.2, "markeredgewidth": 0.8}


def plot_robot(dataset: xr.Dataset, *, window: tuple[float, float] | None = None) -> Figure:
    """Draw a robot's run: stances, joints, ground reaction forces, CoM, trunk and spine.

    ``window`` (s) is the part that is drawn; if not given, the last four strides, or all of a
    shorter run. Joints and forces are those of the first rear and the first front leg. Of a run in
    space all three coordinates of the CoM are drawn. Raises `InputError` for a dataset without
    samples and `ParameterError` for a window without any.
    """
    spatial = is_spatial(dataset)
    check_samples(sagittal(dataset) if spatial else dataset, robot=True)
    whole = drawable(dataset)
    limits = _limits(whole, window)
    time = whole["time"].values
    shown = whole.isel(time=(time >= limits[0]) & (time <= limits[1]))
    flat = sagittal(shown) if spatial else shown
    parts = RobotParts.of(sagittal(whole) if spatial else whole)
    legs = [leg for leg in (parts.first("hind"), parts.first("fore")) if leg is not None]
    joints = [(leg, joint) for leg in legs for joint in leg.joints]
    com = [0.62] * 3 if spatial else [0.9]
    with themed({"lines.linewidth": 1.2}):
        details = joined([*describe(whole), _part(whole, limits)], WIDE)
        early = ending(dataset)
        heights = [0.2 * len(parts.legs), *[0.62] * len(joints), 1.05, 1.05, *com, 0.9]
        size = (8.4, sum(heights) + 0.12 * len(heights) + 1.0 + LINE * len(details))
        figure = Picture(figsize=size, layout="constrained")
        bars, *rest = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        angles, (normal, tangential, *places, trunk) = rest[: len(joints)], rest[len(joints) :]
        _draw_stances(bars, flat, parts)
        for axes, (leg, joint) in zip(angles, joints, strict=True):
            _draw_joint(axes, flat, leg, joint)
            if joint == leg.joints[0]:
                add_legend(axes)
        _draw_forces(normal, flat, legs, "y")
        _draw_forces(tangential, flat, legs, "x")
        if spatial:
            _draw_places(places, shown)
        else:
            _draw_com(places[0], shown)
        _draw_angles(trunk, shown, parts)
        trunk.set_xlim(*limits)
        trunk.set_xlabel("time (s)")
        figure.align_ylabels(rest)
        add_title(figure, heading(dataset), details, wrap(early, 100) if early else ())
    return figure


def _limits(dataset: xr.Dataset, window: tuple[float, float] | None) -> tuple[float, float]:
    time = dataset["time"].values
    first, last = float(time[0]), float(time[-1])
    if window is not None:
        if not np.any((time >= window[0]) & (time <= window[1])):
            raise ParameterError(
                f"the run has no samples within {window[0]:g} s to {window[1]:g} s",
                f"give times between {first:g} s and {last:g} s, the earlier first",
            )
        return window[0], max(window[1], window[0] + 1e-6)
    cycle = _cycle(dataset)
    start = max(first, last - CYCLES * cycle) if cycle else first
    return start, max(last, start + 1e-6)


def _cycle(dataset: xr.Dataset) -> float | None:
    """How long a stride takes, in s."""
    frequency = json.loads(dataset.attrs.get("gains", "{}")).get("gait.frequency")
    if frequency:
        return float(1 / frequency)
    stance = json.loads(dataset.attrs.get("settings", "{}")).get("gait.stance")
    # Each pair of legs stands once in a stride.
    return 2 * stance if stance else None


def _part(dataset: xr.Dataset, limits: tuple[float, float]) -> str:
    """What is shown of the run, in words."""
    first, last = (float(dataset["time"][end]) for end in (0, -1))
    if limits[0] <= first and limits[1] >= last:
        return f"the whole run of {last - first:.3g} s"
    part = f"{limits[0]:.4g} s to {limits[1]:.4g} s"
    return f"shown: {part} of a run from {first:.4g} s to {last:.4g} s"


def _draw_stances(axes: Axes, dataset: xr.Dataset, parts: RobotParts) -> None:
    """A bar per leg while its foot stands, darker while it slides."""
    draw_stances(axes, dataset, parts)
    axes.set_yticks(range(len(parts.legs)), [leg.title for leg in parts.legs])
    axes.tick_params(axis="both", length=0)
    axes.spines[:].set_visible(False)
    keys = [Patch(color=FAINT), Patch(color=INK)]
    add_legend(axes, keys, ["stands", "slides"])


def draw_stances(axes: Axes, dataset: xr.Dataset, parts: RobotParts) -> None:
    """Fill axes with rows for the legs, the first one on top: when they stand and slide."""
    spans = phase_spans(dataset, "footing")
    for row, leg in enumerate(parts.legs):
        foot = dataset.sel(foot_name=leg.foot)
        stands, slides = foot["stands"].values, foot["slides"].values
        for sliding, color in ((False, paler(SIDE_COLORS[leg.side])), (True, INK)):
            pieces = [
                (span.start, span.end - span.start)
                for span in spans
                if stands[span.first] and bool(slides[span.first]) == sliding
            ]
            axes.broken_barh(pieces, (row - 0.36, 0.72), facecolors=color, linewidth=0)
    axes.set_ylim(len(parts.legs) - 0.5, -0.5)


def _draw_joint(axes: Axes, dataset: xr.Dataset, leg: RobotLeg, joint: str) -> None:
    time = dataset["time"].values
    real = np.degrees(dataset["angle"].sel(joint=joint).values)
    axes.plot(time, real, color=SIDE_COLORS[leg.side], label="real")
    if "reference" in dataset:
        wanted = np.degrees(dataset["reference"].sel(motor=joint).values)
        axes.plot(time, wanted, color=INK, linestyle="--", linewidth=0.9, label="desired")
    name = joint.removeprefix(f"{leg.name}_").replace("_", " ")
    axes.set_ylabel(f"{leg.title}\n{name} (°)")
    _few_ticks(axes)
    widen(axes, 1.0)


def _draw_forces(axes: Axes, dataset: xr.Dataset, legs: list[RobotLeg], axis: str) -> None:
    """Forces as lines, and what feet got at impacts as stems on a scale of their own."""
    time = dataset["time"].values
    top = FAR_OVER * typical_force(dataset)
    forces = dataset["grf"].sel(axis=axis)
    for leg, style in zip(legs, ("-", (0, (4, 1.5))), strict=False):
        one = forces.sel(foot_name=leg.foot).values
        stands = dataset["stands"].sel(foot_name=leg.foot).values > 0
        axes.plot(
            time, np.where(stands, one, np.nan), color=SIDE_COLORS[leg.side], linestyle=style,
            label=leg.title,
        )  # fmt: skip
    most = float(abs(forces.sel(foot_name=[leg.foot for leg in legs])).max())
    reach = 1.1 * min(most, top) or 1.0
    axes.set_ylim(0 if axis == "y" else -reach, reach)
    if reach < most:
        axes.text(
            0.99, 0.96, f"up to {most:.0f} N", transform=axes.transAxes, ha="right", va="top",
            fontsize=SMALL_SIZE, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
        )  # fmt: skip
    axes.set_ylabel(f"{'normal' if axis == 'y' else 'tangential'}\nGRF (N)")
    _few_ticks(axes)
    handles, labels = axes.get_legend_handles_labels()
    scaled = _draw_impulses(axes, dataset, legs, axis)
    if scaled:
        handles.append(Line2D([], [], color=FAINT, marker="o", markerfacecolor="white", **_STEM))
        labels.append("impulse at\nimpact")
    add_legend(axes, handles, labels, aside=SCALE_ROOM if scaled else 0.0)


def _draw_impulses(axes: Axes, dataset: xr.Dataset, legs: list[RobotLeg], axis: str) -> bool:
    first, last = (float(dataset["time"][end]) for end in (0, -1))
    times = dataset["event_time"].values
    inside = (times >= first) & (times <= last)
    impulses = dataset["event_impulse"].sel(axis=axis).isel(event=inside)
    found = [(leg, impulses.sel(foot_name=leg.foot).values) for leg in legs]
    largest = max((float(abs(values).max(initial=0.0)) for _, values in found), default=0.0)
    if largest <= LEAST_IMPULSE:
        return False
    twin = axes.twinx()
    for leg, values in found:
        hit = abs(values) > max(LEAST_IMPULSE, LEAST_SHARE * largest)
        color = SIDE_COLORS[leg.side]
        twin.vlines(times[inside][hit], 0, values[hit], color=color, linewidth=_STEM["linewidth"])
        twin.plot(
            times[inside][hit], values[hit], color=color, linestyle="none", marker="o",
            markerfacecolor="white", **_STEM,
        )  # fmt: skip
    # Twice the room, so that stems stay below the forces.
    twin.set_ylim(0 if axis == "y" else -2 * largest, 2 * largest)
    twin.spines["right"].set_visible(True)
    twin.set_ylabel("impulse (N s)")
    _few_ticks(twin)
    return True


def _draw_com(axes: Axes, dataset: xr.Dataset) -> None:
    """Height, and how far ahead of steady motion it is."""
    time = dataset["time"].values
    x, y = dataset["com"].values.T
    (height,) = axes.plot(time, y, color=INK, label="height")
    axes.set_ylabel("CoM height (m)")
    widen(axes, 0.01)
    _few_ticks(axes)
    twin = axes.twinx()
    (ahead,) = twin.plot(time, x - steady(time, x), color=GREEN, linestyle="--", label="ahead")
    twin.set_ylabel("ahead (m)", color=GREEN, labelpad=8)
    twin.tick_params(axis="y", colors=GREEN)
    twin.spines["right"].set_visible(True)
    widen(twin, 0.01)
    _few_ticks(twin)
    add_legend(axes, [height, ahead], ["height", "ahead of\nsteady motion"], aside=SCALE_ROOM)


def _draw_places(panels: Sequence[Axes], dataset: xr.Dataset) -> None:
    """The CoM in space, a panel each way."""
    time = dataset["time"].values
    for axes, name, place in zip(panels, "xyz", dataset["com"].values.T, strict=True):
        axes.plot(time, place, color=INK)
        axes.set_ylabel(f"CoM\n{name} (m)")
        widen(axes, 0.01)
        _few_ticks(axes)


def steady(time: Array, x: Array) -> Array:
    """Return the straight line over time (s) that is nearest to ``x``."""
    if len(time) < 2:
        return x
    line: Array = np.polynomial.Polynomial.fit(time, x, 1)(time)
    return line


def _draw_angles(axes: Axes, dataset: xr.Dataset, parts: RobotParts) -> None:
    """How the trunk is turned, and by how much its spine is bent."""
    time = dataset["time"].values
    for name, style in (("pitch", "-"), ("roll", "--"), ("yaw", ":")):
        if f"trunk_{name}" in dataset:
            turned = np.degrees(dataset[f"trunk_{name}"].values)
            axes.plot(time, turned, color=INK, linestyle=style, label=f"trunk {name}")
    if parts.spine is not None:
        angle = np.degrees(dataset["angle"].sel(joint=parts.spine).values)
        axes.plot(time, angle, color=PURPLE, label=f"{parts.spine.replace('_', ' ')} angle")
    axes.set_ylabel("angle (°)")
    widen(axes, 0.5)
    _few_ticks(axes)
    if axes.get_lines():
        add_legend(axes)


def _few_ticks(axes: Axes) -> None:
    axes.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
