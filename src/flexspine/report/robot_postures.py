"""Where every part of a robot is at given times, for drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexspine.report.postures import Point
from flexspine.report.robot_parts import RobotParts

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Stretch = tuple[Point, Point]


@dataclass(frozen=True)
class FootPosture:
    """A foot (m), whether it stands and slides, and the ground reaction force on it (N)."""

    place: Point
    stands: bool
    slides: bool
    force: Point


@dataclass(frozen=True)
class RobotPosture:
    """A robot at a time (s): links from start to end and feet by leg, in m.

    ``joint`` is where the spine bends and ``bend`` by how much, in rad, positive if it sags; None
    for a robot without a spine.
    """

    time: float
    com: Point
    links: Mapping[str, Stretch]
    feet: Mapping[str, FootPosture]
    joint: Point | None
    bend: float | None


def robot_postures(dataset: xr.Dataset, parts: RobotParts, times: Array) -> list[RobotPosture]:
    """Return the postures at ``times`` (s), interpolated between the samples.

    Whether feet stand and slide is that of the sample before.
    """
    sampled = dataset["time"].values
    before = (np.searchsorted(sampled, times, side="right") - 1).clip(min=0)
    names = [str(name) for name in dataset["link"].values]
    com, foot, grf, starts, ends = (
        _at(dataset, name, times) for name in ("com", "foot", "grf", "link_start", "link_end")
    )
    stands, slides = (dataset[name].values[before] != 0 for name in ("stands", "slides"))
    grf[~stands] = 0.0
    places = {str(name): i for i, name in enumerate(dataset["foot_name"].values)}
    bends: list[float | None] = [None] * len(times)
    if parts.spine is not None:
        spine = dataset["joint"].values.tolist().index(parts.spine)
        bends = (parts.bends * _at(dataset, "angle", times)[:, spine]).tolist()
    return [
        RobotPosture(
            float(time),
            _point(com[i]),
            {link: (_point(starts[i, n]), _point(ends[i, n])) for n, link in enumerate(names)},
            {
                leg.name: FootPosture(
                    _point(foot[i, n]), bool(stands[i, n]), bool(slides[i, n]), _point(grf[i, n])
                )
                for leg in parts.legs
                for n in (places[leg.foot],)
            },
            None if parts.spine_link is None else _point(starts[i, names.index(parts.spine_link)]),
            bends[i],
        )
        for i, time in enumerate(times)
    ]


def _at(dataset: xr.Dataset, name: str, times: Array) -> Array:
    """A variable at times (s), shape (times, ...)."""
    values = dataset[name].values
    columns = values.reshape(len(values), -1).T
    found = [np.interp(times, dataset["time"].values, column) for column in columns]
    return np.array(found).T.reshape(len(times), *values.shape[1:])


def _point(place: Array) -> Point:
    return float(place[0]), float(place[1])
