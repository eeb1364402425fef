"""How parameters that are unknowns are counted, so that even steps reach over decades."""

from __future__ import annotations

from dataclasses import dataclass
from math import asinh, hypot, log

import numpy as np


@dataclass(frozen=True)
class ParameterScale:
    """One that cannot vanish counts by its logarithm, from the value ``unit`` (SI) on.

    One that can (``vanishes``) by its inverse hyperbolic sine: evenly below a ``unit``, by its
    logarithm far above.
    """

    unit: float
    vanishes: bool

    def coordinate(self, value: float) -> float:
        """What stands for a value."""
        return asinh(value / self.unit) if self.vanishes else log(value / self.unit)

    def value(self, coordinate: float) -> float:
        """The value that a coordinate stands for, SI."""
        return float(self.unit * (np.sinh if self.vanishes else np.exp)(coordinate))

    def slope(self, value: float) -> float:
        """By how much a value changes with its coordinate, SI."""
        return hypot(value, self.unit) if self.vanishes else value
