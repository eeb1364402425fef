"""Random starts for a gait search."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from math import asin, inf, pi, sqrt

import numpy as np

from flexspine.errors import ParameterError
from flexspine.gaits.problem import Problem
from flexspine.hybrid.compile import Array
from flexspine.hybrid.functions import section_quantities
from flexspine.models.legs import ANGLES
from flexspine.parameters import values

# rad; pitches of a bounding animal at its apex.
LARGEST_PITCH = 0.5

# Natural units; pitch rates of a bounding animal at its apex.
LARGEST_RATE = 2.0

# A leg swept through the half period of a bounce on one pair of legs stands at most this much too
# flat for the speed; pitching makes stances shorter than that.
ANGLE_MARGIN = 1.1
SMALLEST_ANGLE = -0.1

# Halvings of an interval when a start is put on an energy level; starts need not be exact.
ENERGY_HALVINGS = 20

# Most points that fall at once are drawn anew this often before one is taken all the same.
MOST_DRAWS = 20


class Sampler:
    """Random starts of a problem."""

    def __init__(
        self,
        problem: Problem,
        generator: np.random.Generator,
        bounds: Mapping[str, tuple[float, float]],
    ) -> None:
        self.problem, self.generator = problem, generator
        for name, (low, high) in bounds.items():
            if not -inf < low < high < inf:
                raise ParameterError(
                    f"bounds {low:g} to {high:g} of '{name}' are no range", "give low before high"
                )
            if name not in problem.unknowns:
                raise ParameterError(
                    f"bounds for '{name}', which is not unknown",
                    f"unknown are {', '.join(problem.unknowns)}",
                )
        pairs = [
            [problem.coordinate(name, value) for value in bounds.get(name, self._usual(name))]
            for name in problem.unknowns
        ]
        self.low, self.high = np.array(pairs).T
        # Iterations may leave for a while, and solutions too where no bounds are given.
        room = self.high - self.low
        self.limits = self.low - room, self.high + room
        self._given = np.array([name in bounds for name in problem.unknowns])
        self.posture = np.array(["pitch" in name for name in problem.unknowns])
        self.dropped: Counter[str] = Counter()

    def _usual(self, name: str) -> tuple[float, float]:
        """Where an unknown is looked for, SI."""
        problem, scales = self.problem, self.problem.model.scales
        speed = problem.fixed.get("mean_speed", problem.fixed.get("speed"))
        if name in ANGLES:
            legs = values(problem.model.parameters)
            stiffness = (legs["fore.leg.stiffness"] + legs["hind.leg.stiffness"]) / 2
            bounce = pi * sqrt(problem.model.mass / (2 * stiffness))
            reach = (speed or scales["mean_speed"]) * bounce / 2 / scales["height"]
            return SMALLEST_ANGLE, ANGLE_MARGIN * asin(min(0.9, abs(reach)))
        if name == "speed":
            return (0.0, 3 * scales["mean_speed"]) if speed is None else (0.9 * speed, 1.1 * speed)
        if name == "height":
            return 0.8 * scales["height"], 1.3 * scales["height"]
        if name.endswith("_rate"):
            return -LARGEST_RATE * scales[name], LARGEST_RATE * scales[name]
        if name.endswith("pitch"):
            return -LARGEST_PITCH, LARGEST_PITCH
        given = values(problem.model.parameters)[name]
        return 0.5 * given, 2.0 * given

    def contains(self, point: Array) -> bool:
        """Whether a point keeps the bounds that were given."""
        outside = (point < self.low) | (point > self.high)
        return not np.any(outside & self._given)

    def draw(self) -> Array:
        """Draw a start from which the animal comes back; what was ``dropped`` is counted."""
        point = self._draw()
        for _ in range(MOST_DRAWS - 1):
            evaluation = self.problem.evaluate(point)
            if evaluation.residual is not None:
                break
            self.dropped[evaluation.outcome.name] += 1
            point = self._draw()
        return point

    def _draw(self) -> Array:
        """Draw a point; where the energy is fixed, its posture and rates are scaled to it."""
        start: Array = self.generator.uniform(self.low, self.high)
        wanted = self.problem.fixed.get("energy")
        if wanted is None or not self.posture.any():
            return start
        low, high = 0.0, 2.0
        for _ in range(ENERGY_HALVINGS):
            middle = (low + high) / 2
            if self._energy(np.where(self.posture, middle * start, start)) > wanted:
                high = middle
            else:
                low = middle
        scaled: Array = np.where(self.posture, low * start, start)
        return scaled

    def _energy(self, point: Array) -> float:
        states, parameters = self.problem.expand(point)
        quantities = section_quantities(self.problem.system)
        held = np.zeros(len(self.problem.system.held))
        return float(quantities(states, held, parameters).values[0])
