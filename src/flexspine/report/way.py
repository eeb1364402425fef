"""Ground that is not flat, as it is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# m; a camera stays where it is above ground that rises and falls less.
LEVEL_ENOUGH = 0.1

# m, to each side; over so much of the ground a camera takes the mean.
SMOOTHING = 1.5


@dataclass(frozen=True, eq=False)
class Way:
    """A polyline: ``points`` (k, 2) in m."""

    points: Array

    @classmethod
    def of(cls, dataset: xr.Dataset) -> Way | None:
        """The ground of a run; None where it is flat."""
        if "ground_x" not in dataset:
            return None
        return cls(np.column_stack([dataset["ground_x"].values, dataset["ground_y"].values]))

    @property
    def climbs(self) -> bool:
        """Whether a camera has to go up and down with it."""
        return bool(np.ptp(self.points[:, 1]) > LEVEL_ENOUGH)

    def height(self, x: Array) -> Array:
        """Height at places x, in m."""
        found: Array = np.interp(x, *self.points.T)
        return found

    def between(self, start: float, end: float) -> Way:
        """The part from x = ``start`` to ``end``."""
        ends = np.array([start, end])
        inner = self.points[(self.points[:, 0] > start) & (self.points[:, 0] < end)]
        first, last = np.column_stack([ends, self.height(ends)])
        return Way(np.vstack([first, inner, last]))

    def moved(self, by: tuple[float, float]) -> Way:
        """The same, so many metres further and higher."""
        return Way(self.points + by)

    def level(self, x: float) -> float:
        """Height of a camera at x, in m."""
        if not self.climbs:
            return 0.0
        return float(self.height(np.linspace(x - SMOOTHING, x + SMOOTHING, 61)).mean())


def heights(way: Way | None, x: Array) -> Array:
    """Height of the ground at places x, in m; flat ground is at zero."""
    return np.zeros(len(x)) if way is None else way.height(x)
