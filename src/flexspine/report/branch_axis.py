"""What a branch is followed in, and what is free along it, as people read them."""

from __future__ import annotations

from itertools import count, takewhile
from math import pi
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from matplotlib.ticker import FuncFormatter

from flexspine.models.dataset import unit_and_meaning
from flexspine.models.registry import KINDS
from flexspine.parameters import quantities
from flexspine.report.caption import SIDES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    Record = dict[str, Any]

NAMES = {
    "mean_speed": ("mean speed", "m/s"),
    "energy": ("total energy", "J"),
    "height": ("apex height", "m"),
    "speed": ("apex speed", "m/s"),
    "spine.stiffness": ("spine stiffness $k_t$", "N m/rad"),
    "spine.damping": ("spine damping $c_t$", "N m s/rad"),
    "fore.leg.stiffness": ("fore leg stiffness $k_l$", "N/m per leg pair"),
    "hind.leg.stiffness": ("hind leg stiffness $k_l$", "N/m per leg pair"),
    "legs.extension": ("leg extension", "mm"),
    "legs.stiffening": ("leg stiffening", "%"),
    "legs.hip_lever": ("hip lever", "mm"),
    **{f"touchdown.{side}": (f"{side} touchdown angle", "°") for side in SIDES},
}

# What SI values are multiplied by for units that read better.
FACTORS = {"°": 180 / pi, "mm": 1e3, "%": 1e2}

# The unit of what only a model of its own could tell: none is written.
UNKNOWN = "1"

# A branch whose middle point is below this share of its largest value reaches over decades.
DECADES = 0.1

# A value that is this much larger than another is the same.
ROUNDING = 1 + 1e-9


class Axis(NamedTuple):
    """The quantity that a branch is followed in, as people read it."""

    name: str
    label: str
    unit: str

    def of(self, gait: Record) -> float:
        """Its value for a gait."""
        return self.shown(gait[self.name])

    def shown(self, value: float) -> float:
        """An SI value in ``unit``."""
        return FACTORS.get(self.unit, 1.0) * value

    @property
    def told(self) -> str:
        """Its name with the unit, if it has one."""
        return self.label if self.unit == "1" else f"{self.label} ({self.unit})"


def axis_of(name: str, model: str) -> Axis:
    """A quantity, or a parameter of a model, by its name."""
    label, unit = _described(name, model)
    return Axis(name, label, "°" if unit == "rad" else unit)


def _described(name: str, model: str) -> tuple[str, str]:
    """What people call a quantity or parameter, and its unit."""
    if name in NAMES:
        return NAMES[name]
    words = name.replace(".", " ").replace("_", " ")
    declared = quantities(KINDS[model].parameters) if model in KINDS else ()
    units = {each.name: each.unit for each in declared}
    if name in units or "." in name:
        return words, units.get(name, UNKNOWN)
    return f"{words} at the apex", unit_and_meaning(name)[0] or UNKNOWN


def spread(axes: Axes, along: list[float]) -> None:
    """Draw a branch over decades evenly, one that begins at zero too."""
    low, high = min(along), max(along)
    if low < 0 or median(along) > DECADES * high:
        return
    axes.set_xscale("log" if low > 0 else "asinh")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if low == 0:
        decades = takewhile(lambda value: value <= high * ROUNDING, (10.0**n for n in count()))
        axes.set_xticks([0.0, *decades])
