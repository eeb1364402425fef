"""What is plotted of a run: panels of lines over time, one below the other."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, isfinite, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine.report.robot_parts import RobotParts
from flexspine.report.style import ENERGY_COLORS, INK, SIDE_COLORS
from flexspine.report.timeline import is_robot

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Longer lines are drawn by the least and the largest value of each of half as many stretches.
MOST_POINTS = 2000

# Of the range of a line; a screen tells no more.
DIGITS = 6

REFERENCE = "dot"


@dataclass(frozen=True)
class Line:
    """A quantity over time."""

    name: str
    values: Array
    color: str
    dash: str = "solid"
    in_legend: bool = True


@dataclass(frozen=True)
class Panel:
    """Lines of one unit."""

    title: str
    unit: str
    lines: tuple[Line, ...]


def panels(dataset: xr.Dataset) -> list[Panel]:
    """Return what there is to see of a run."""
    found = _of_robot(dataset) if is_robot(dataset) else _of_bounder(dataset)
    return [panel for panel in found if panel.lines]


def as_data(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return the panels as scripts read them."""
    time = dataset["time"].values
    return [
        {
            "title": panel.title,
            "unit": panel.unit,
            "lines": [
                {
                    "name": line.name,
                    "color": "ink" if line.color == INK else line.color,
                    "dash": line.dash,
                    "legend": line.in_legend,
                    "x": x,
                    "y": y,
                }
                for line in panel.lines
                for x, y in (thinned(time, line.values),)
            ],
        }
        for panel in panels(dataset)
    ]


def thinned(time: Array, values: Array) -> tuple[list[float], list[float]]:
    """Return times and values of a line, no more than `MOST_POINTS`, no peak left out."""
    kept = np.arange(len(time))
    if len(time) > MOST_POINTS:
        stretches = np.array_split(kept, MOST_POINTS // 2 - 1)
        ends = [
            part[0] + pick(values[part]) for part in stretches for pick in (np.argmin, np.argmax)
        ]
        kept = np.unique([0, *ends, len(time) - 1])
    return rounded(time[kept]), rounded(values[kept])


def rounded(values: Array) -> list[float]:
    """Return numbers to `DIGITS` digits of the range that they have."""
    span = float(np.ptp(values))
    if not (isfinite(span) and span > 0):
        return [float(value) for value in values.tolist()]
    decimals = DIGITS - 1 - floor(log10(span))
    return [round(value, decimals) for value in values.tolist()]


def _of_bounder(dataset: xr.Dataset) -> list[Panel]:
    def line(name: str, words: str, color: str, factor: float = 1.0) -> list[Line]:
        return [Line(words, factor * dataset[name].values, color)] if name in dataset else []

    degrees = 180 / np.pi
    pitch = line("pitch", "pitch", INK, degrees)
    for side, color in SIDE_COLORS.items():
        pitch += line(f"{side}_pitch", f"{side} pitch", color, degrees)
    pitch += line("spine_angle", "spine (fore minus hind)", ENERGY_COLORS["spine"], degrees)
    forces = {
        axis: [
            each
            for side, color in SIDE_COLORS.items()
            for each in line(f"{side}_grf_{axis}", f"{side}", color)
        ]
        for axis in "xy"
    }
    energies = line("total_energy", "total", INK)
    for kind, name in (
        ("kinetic", "kinetic"), ("gravity", "gravity"), ("leg", "legs"), ("spine", "spine"),
        ("dissipated", "dissipated"),
    ):  # fmt: skip
        energies += line(f"{kind}_energy", name, ENERGY_COLORS[name])
    return [
        Panel("CoM height", "m", (*line("com_y", "CoM height", INK),)),
        Panel("CoM speed", "m/s", (*line("com_x_rate", "forward", INK),)),
        Panel("Pitch and spine", "°", (*pitch,)),
        Panel("Vertical force, per pair of legs", "N", (*forces["y"],)),
        Panel("Horizontal force, per pair of legs", "N", (*forces["x"],)),
        Panel("Energies", "J", (*energies,)),
    ]


def _of_robot(dataset: xr.Dataset) -> list[Panel]:
    parts, up = RobotParts.of(dataset), str(dataset["axis"].values[-1])
    com, speed, grf = dataset["com"], dataset["com_rate"], dataset["grf"]
    sideways = (
        [Panel("CoM sideways", "m", (Line("CoM", com.sel(axis="y").values, INK),))]
        if up == "z"
        else []
    )
    degrees = 180 / np.pi
    trunk = [
        Line(name.removeprefix("trunk_"), degrees * dataset[name].values, color)
        for name, color in (
            ("trunk_pitch", INK), ("trunk_roll", SIDE_COLORS["fore"]),
            ("trunk_yaw", SIDE_COLORS["hind"]),
        )
        if name in dataset
    ]  # fmt: skip
    if parts.spine is not None:
        spine = degrees * dataset["angle"].sel(joint=parts.spine).values
        trunk.append(Line("spine", spine, ENERGY_COLORS["spine"]))
    normal, tangential = [], []
    for leg in parts.legs:
        force = grf.sel(foot_name=leg.foot)
        normal.append(Line(leg.title, force.sel(axis=up).values, leg.color))
        tangential.append(Line(leg.title, force.sel(axis="x").values, leg.color))
    energies = [
        Line(words, dataset[name].values, color)
        for name, words, color in (
            ("total_energy", "total", INK),
            ("kinetic_energy", "kinetic", ENERGY_COLORS["kinetic"]),
            ("potential_energy", "potential", ENERGY_COLORS["gravity"]),
            ("motor_work", "work of motors", ENERGY_COLORS["legs"]),
            ("dissipated_energy", "dissipated", ENERGY_COLORS["dissipated"]),
            ("contact_loss", "lost to the ground", SIDE_COLORS["hind"]),
            ("damper_loss", "lost in dampers", ENERGY_COLORS["dissipated"]),
            ("impact_loss", "lost at impacts", SIDE_COLORS["hind"]),
        )
        if name in dataset
    ]
    return [
        Panel("CoM height", "m", (Line("CoM", com.sel(axis=up).values, INK),)),
        Panel("CoM speed", "m/s", (Line("forward", speed.sel(axis="x").values, INK),)),
        *sideways,
        Panel("Trunk", "°", (*trunk,)),
        *_joints(dataset, parts),
        Panel("Normal force", "N", (*normal,)),
        Panel("Tangential force", "N", (*tangential,)),
        Panel("Energies", "J", (*energies,)),
    ]


def _joints(dataset: xr.Dataset, parts: RobotParts) -> list[Panel]:
    """The joints of the legs, hips and knees apart, with the angles that they are to have."""
    degrees = 180 / np.pi
    found = []
    for place, title in enumerate(("Hips", "Knees")):
        lines = []
        for leg in parts.legs:
            if place >= len(leg.joints):
                continue
            joint = leg.joints[place]
            angle = degrees * dataset["angle"].sel(joint=joint).values
            lines.append(Line(joint.replace("_", " "), angle, leg.color))
            if "reference" in dataset:
                wanted = degrees * dataset["reference"].sel(motor=joint).values
                told = not any(line.dash == REFERENCE for line in lines)
                lines.append(Line("wanted", wanted, leg.color, REFERENCE, told))
        found.append(Panel(title, "°", (*lines,)))
    return found
