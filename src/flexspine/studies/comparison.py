"""One measure of the flexible bodies over that of a baseline, at every common speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexspine.gaits.gait import Gait
from flexspine.studies.spines import FLEXIBLE, SpineStudy

# Relative; smaller differences are none.
NO_DIFFERENCE = 1e-3

# m/s between the speeds at which bodies are compared.
SPEED_STEP = 0.05

# Of a speed step; the ends of a range are on the grid if they are this close to it.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Comparison:
    """Ratios of one measure, flexible over baseline, at every common speed and stiffness."""

    baseline: str
    ratios: tuple[tuple[float, float, float], ...]
    """Each (stiffness, mean speed, ratio)."""

    @property
    def lowest(self) -> tuple[float, float, float]:
        """Where the ratio is smallest."""
        return min(self.ratios, key=lambda item: item[2])

    @property
    def highest(self) -> tuple[float, float, float]:
        """Where the ratio is largest."""
        return max(self.ratios, key=lambda item: item[2])

    @property
    def below(self) -> int:
        """In how many cases the flexible body has less."""
        return sum(ratio < 1 - NO_DIFFERENCE for *_, ratio in self.ratios)

    @property
    def above(self) -> int:
        """In how many cases the flexible body has more."""
        return sum(ratio > 1 + NO_DIFFERENCE for *_, ratio in self.ratios)

    def told(self, what: str) -> str:
        """Say it in words."""
        if not self.ratios:
            return f"no common speed with the {self.baseline} body"
        (k0, v0, r0), (k1, v1, r1) = self.lowest, self.highest
        return (
            f"{what} over that of the {self.baseline} body: {r0:.3f} (k_t = {k0:g}, {v0:.2f} m/s) "
            f"to {r1:.3f} (k_t = {k1:g}, {v1:.2f} m/s), lower in {self.below} and higher in "
            f"{self.above} of {len(self.ratios)} pairs"
        )

    def quoted(self, study: SpineStudy) -> dict[str, Gait]:
        """The gaits whose ratios are told, by name."""
        if not self.ratios:
            return {}
        found = {}
        for stiffness, speed, _ in (self.lowest, self.highest):
            for specimen in (study.specimen(FLEXIBLE, stiffness), study.specimen(self.baseline)):
                point = specimen.at(speed)
                if point is not None:
                    found[specimen.name_at(speed)] = point.gait
        return found

    @property
    def numbers(self) -> dict[str, Any]:
        """Say it for machines."""
        return {
            "pairs": len(self.ratios),
            "lower": self.below,
            "higher": self.above,
            "smallest_ratio": self.lowest[2] if self.ratios else None,
            "largest_ratio": self.highest[2] if self.ratios else None,
        }


def common_speeds(study: SpineStudy) -> list[float]:
    """The grid of speeds at which bodies are compared."""
    low, high = study.setting.speeds
    first = int(np.ceil(low / SPEED_STEP - ROUNDING))
    last = int(np.floor(high / SPEED_STEP + ROUNDING))
    return [round(number * SPEED_STEP, 9) for number in range(first, last + 1)]


def compare(study: SpineStudy, measure: Callable[[Gait], float], baseline: str) -> Comparison:
    """Compare every flexible specimen with a baseline wherever both run."""
    base = study.specimen(baseline)
    ratios = []
    for speed in common_speeds(study):
        reference = base.at(speed)
        if reference is None:
            continue
        for specimen in study.flexible:
            point = specimen.at(speed)
            if point is not None:
                ratio = measure(point.gait) / measure(reference.gait)
                ratios.append((specimen.stiffness or 0.0, speed, ratio))
    return Comparison(baseline, tuple(ratios))


def peak(gait: Gait) -> float:
    """The larger of both legs' peak GRF, in N per pair of legs."""
    return max(gait.peak_grf.values())
