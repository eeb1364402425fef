"""What is written over the pictures: the name of what ran, its numbers and how it ended."""

from __future__ import annotations

import json
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine.report.timeline import is_robot

if TYPE_CHECKING:
    import xarray as xr

SIDES = ("fore", "hind")

CONTROLLERS = {
    "tracking": "computed torque",
    "qp": "computed torque, least residual",
    "com": "centre of mass, pitch and swing legs",
    "pd": "joint springs and dampers",
}

# What a run under feedback has to say.
REMARKS = ("steered", "noise on what is steered", "noise on the apex")

# What an actuator is called, its factor and unit.
THRUST = {
    "extension": ("extension", 1000.0, "mm"),
    "stiffening": ("stiffening", 100.0, "%"),
    "hip_lever": ("hip lever", 1000.0, "mm"),
}
SHIFTS = {
    "spine.stiffness_shift.": ("spine stiffness", 100.0, "%"),
    "spine.rest_shift.": ("spine rest angle", 180 / pi, "°"),
}

WIDE = 115  # letters in a line of small type over a robot's pictures
LONGEST_NAME = 60  # letters; what fits into a line of a title


def describe(dataset: xr.Dataset) -> list[str]:
    """Return what a reader must know about a run, in lines: parameters, energy, speed."""
    given: dict[str, Any] = json.loads(dataset.attrs.get("parameters", "{}"))
    if is_robot(dataset):
        spine = ", ".join(part.split(maxsplit=2)[2] for part in _of_spine(given))
        parts = [*_of_task(dataset), f"spine {spine}"] if spine else _of_task(dataset)
        return joined(parts + _mean_speed(dataset), WIDE) + _set_by_user(dataset)
    parts = [dataset.attrs["ground"]] if "ground" in dataset.attrs else []
    parts += _of_spine(given)
    parts += of_legs(given, "stiffness $k_l$", "stiffness", "N/m per leg pair")
    if any(given.get(f"{side}.leg.damping") for side in SIDES):
        parts += of_legs(given, "damping $c_l$", "damping", "N s/m per leg pair")
    parts += _of_actuators(given)
    angles = json.loads(dataset.attrs.get("touchdown_angles", "{}"))
    told = [name for name in REMARKS if name in dataset.attrs]
    if told:
        parts += [f"{name}: {dataset.attrs[name]}" for name in told]
    elif angles:
        both = ", ".join(f"{side} {np.degrees(angle):.1f}°" for side, angle in angles.items())
        parts.append(f"touchdown angles: {both}")
    began, energy = float(dataset["time"][0]), float(dataset["total_energy"][0])
    parts.append(f"energy {energy:.4g} J at {f'{began:.2f} s' if began else 'the start'}")
    return joined(parts + _mean_speed(dataset)) + _set_by_user(dataset)


def _of_spine(given: dict[str, Any]) -> list[str]:
    if "spine.stiffness" not in given:
        return []
    parts = [f"spine stiffness $k_t$ = {given['spine.stiffness']:g} N m/rad"]
    if given.get("spine.damping"):
        parts.append(f"spine damping $c_t$ = {given['spine.damping']:g} N m s/rad")
    return parts


def _of_actuators(given: dict[str, Any]) -> list[str]:
    """All that is not zero of what puts energy in."""
    parts = []
    for name, (label, factor, unit) in THRUST.items():
        both = given.get(f"legs.{name}", 0.0)
        fore, hind = (factor * (given.get(f"{side}.leg.{name}", 0.0) + both) for side in SIDES)
        if fore or hind:
            told = f"{fore:.3g}" if fore == hind else f"{fore:.3g} (fore), {hind:.3g} (hind)"
            parts.append(f"leg {label} {told} {unit}")
    for name, (label, factor, unit) in SHIFTS.items():
        shifts = {key: value for key, value in given.items() if key.startswith(name) and value}
        if shifts:
            told = ", ".join(
                f"{key.rpartition('.')[2]} {factor * value:+.3g}" for key, value in shifts.items()
            )
            parts.append(f"{label} by phase: {told} {unit}")
    return parts


def _of_task(dataset: xr.Dataset) -> list[str]:
    """What a robot was asked for."""
    asked: dict[str, Any] = json.loads(dataset.attrs.get("settings", "{}"))
    parts = []
    if "controller" in asked:
        name = CONTROLLERS.get(asked["controller"], asked["controller"])
        rate = f" at {asked['rate']:g} Hz" if asked.get("rate") else ""
        parts.append(f"controller: {name}{rate}")
    if "gait.speed" in asked:
        parts.append(f"desired speed {asked['gait.speed']:g} m/s")
    gains = json.loads(dataset.attrs.get("gains", "{}"))
    if gains:
        parts.append(f"desired speed {gains['gait.speed']:g} m/s")
        parts.append(f"strides at {gains['gait.frequency']:g} Hz")
    if "contact" in dataset.attrs:
        law = next(iter(json.loads(dataset.attrs["contact"]).values()))
        parts.append(f"ground {law['stiffness']:g} N/m, {law['damping']:g} N s/m")
    if asked.get("push"):
        parts.append(f"push {asked['push']:g} N s")
    return parts


def _mean_speed(dataset: xr.Dataset) -> list[str]:
    duration = float(dataset["time"][-1] - dataset["time"][0])
    if not duration > 0:
        return []
    x = dataset["com"][:, 0] if is_robot(dataset) else dataset["com_x"]
    start = ", start included" if is_robot(dataset) else ""
    return [f"mean speed {float(x[-1] - x[0]) / duration:#.3g} m/s{start}"]


def _set_by_user(dataset: xr.Dataset) -> list[str]:
    origins = json.loads(dataset.attrs.get("provenance", "{}"))
    names = [name for name, origin in origins.items() if origin == "set by user"]
    return [f"set by user: {_few(names)}"] if names else []


def of_legs(given: dict[str, Any], what: str, name: str, unit: str) -> list[str]:
    """Say what a leg parameter is, once if both ends have the same."""
    fore, hind = (given.get(f"{side}.leg.{name}") for side in SIDES)
    if fore is None or hind is None:
        return []
    value = f"= {fore:g}" if fore == hind else f"= {fore:g} (fore), {hind:g} (hind)"
    return [f"leg {what} {value} {unit}"]


def joined(parts: list[str], limit: int = 100) -> list[str]:
    """Fill lines with whole parts."""
    lines: list[str] = []
    for part in parts:
        plain = part.replace("$", "").replace("_", "")
        if lines and len(lines[-1]) + len(plain) + 5 <= limit:
            lines[-1] += f"  ·  {part}"
        else:
            lines.append(part)
    return lines


def _few(names: list[str], most: int = 4) -> str:
    more = [f"{len(names) - most} more"] if len(names) > most else []
    return ", ".join(names[:most] + more)


def heading(dataset: xr.Dataset) -> str:
    """Return the name of what ran."""
    attrs = dataset.attrs
    name = f"{attrs.get('preset', 'run')}: {attrs.get('model', 'bounder').replace('-', ' ')}"
    if is_robot(dataset):
        name = attrs.get("title", "run of a robot")
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"


def excerpt_of(dataset: xr.Dataset) -> list[str]:
    """Return which part of a longer run is shown, nothing for all of it."""
    return [f"shown: {dataset.attrs['shown']}"] if "shown" in dataset.attrs else []


def ending(dataset: xr.Dataset) -> str | None:
    """Return how a run ended early, or None if it completed."""
    outcome = dataset.attrs.get("outcome", "completed")
    if outcome == "completed":
        return None
    return f"{outcome.replace('_', ' ')}: {dataset.attrs.get('message', '')}"
