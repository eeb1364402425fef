"""What is written over the pictures: the name of what ran, its numbers and how it ended."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

SIDES = ("fore", "hind")

LONGEST_NAME = 56  # letters; what fits into a line of a title


def describe(dataset: xr.Dataset) -> list[str]:
    """Return what a reader must know about a run, in lines: parameters, energy, speed."""
    given: dict[str, Any] = json.loads(dataset.attrs.get("parameters", "{}"))
    parts = []
    if "spine.stiffness" in given:
        parts.append(f"spine stiffness $k_t$ = {given['spine.stiffness']:g} N m/rad")
        if given.get("spine.damping"):
            parts.append(f"spine damping $c_t$ = {given['spine.damping']:g} N m s/rad")
    parts += of_legs(given, "stiffness $k_l$", "stiffness", "N/m per leg pair")
    if any(given.get(f"{side}.leg.damping") for side in SIDES):
        parts += of_legs(given, "damping $c_l$", "damping", "N s/m per leg pair")
    angles = json.loads(dataset.attrs.get("touchdown_angles", "{}"))
    if angles:
        both = ", ".join(f"{side} {np.degrees(angle):.1f}°" for side, angle in angles.items())
        parts.append(f"touchdown angles: {both}")
    parts.append(f"energy at the start {float(dataset['total_energy'][0]):.4g} J")
    duration = float(dataset["time"][-1] - dataset["time"][0])
    if duration > 0:
        moved = float(dataset["com_x"][-1] - dataset["com_x"][0])
        parts.append(f"mean speed {moved / duration:#.3g} m/s")
    origins = json.loads(dataset.attrs.get("provenance", "{}"))
    changed = [name for name, origin in origins.items() if origin == "set by user"]
    return joined(parts) + ([f"changed from the preset: {_few(changed)}"] if changed else [])


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
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"


def ending(dataset: xr.Dataset) -> str | None:
    """Return how a run ended early, or None if it completed."""
    outcome = dataset.attrs.get("outcome", "completed")
    if outcome == "completed":
        return None
    return f"{outcome.replace('_', ' ')}: {dataset.attrs.get('message', '')}"
