"""What an optimisation may choose about a gait, and the gaits that it starts from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.gaits.chart import lead
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.problem import Problem
from flexspine.gaits.search import find_gaits
from flexspine.hybrid.compile import Array
from flexspine.models.actuation import ACTUATORS, BARE, SPINE_SHIFTS
from flexspine.models.model import Model
from flexspine.models.simulation import DEFAULT_TOLERANCE
from flexspine.parameters import is_finite, shortened, values
from flexspine.studies.descent import MET, Place, Task
from flexspine.studies.objectives import PEAK_GRF
from flexspine.studies.probes import Astray

Ranges = Mapping[str, tuple[float, float]]

# Starts of a search for one drawn design: enough for nearly all its gaits.
SEARCHES = 100


def phases_of(modes: Sequence[str]) -> set[str]:
    """The phases of a stride from its modes, named as actuators of the spine tell them apart."""
    stances = {"FS": "fore", "HS": "hind", "DS": "both"}
    between = {"between"} if "DF" in modes[1:-1] else set[str]()
    return {"flight", *between, *(stances[mode] for mode in modes if mode in stances)}


@dataclass(frozen=True)
class Design:
    """What there is to choose about a gait, that of ``model``, which has the wanted speed.

    ``ranges`` are low and high (SI) of parameters, and of what else need not stay what it is:
    ``energy``, apex coordinates, touchdown angles. Raises `UnknownNameError` and `ParameterError`.
    """

    model: Model
    ranges: Ranges
    tolerance: float = DEFAULT_TOLERANCE

    def __post_init__(self) -> None:
        model = self.model
        known = {**model.numbers, "energy": self.gait.energy}
        for name, ends in self.ranges.items():
            bends = any(each.startswith("spine.") for each in known)
            if name.startswith("spine.") and not bends:
                raise ParameterError(
                    f"'{model.name}' has no {name}, as it has no spine that bends",
                    "give an animal that has one, or keep what it lacks as it is",
                )
            if name not in known:
                raise UnknownNameError("parameter or quantity", name, known)
            if len(ends) != 2:
                raise ParameterError(f"{name} = {shortened(ends)} is no range", "give low and high")
            low, high = ends
            if not (is_finite(low) and is_finite(high) and low < high):
                shown = f"{shortened(low)} to {shortened(high)}"
                raise ParameterError(f"{name} from {shown} is no range", "give low before high")
            if name in values(model.parameters):
                for end in (low, high):
                    model.with_values({name: end})  # raises for values out of bounds
            elif not low <= known[name] <= high:
                raise ParameterError(
                    f"{name} = {known[name]:g} of the gait is not within {low:g} to {high:g}",
                    "start from a gait within, such as one of 'flexspine branch'",
                )
        if self.problem.surplus < 1:
            raise ParameterError(
                f"varying {', '.join(self.ranges) or 'nothing'} leaves nothing to choose",
                "vary more, such as an actuator that makes good what dampers take",
            )

    def __getstate__(self) -> dict[str, Any]:
        """What goes to another process."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def gait(self) -> Gait:
        """The gait about which there is to choose."""
        return examine(self.model, tolerance=self.tolerance)

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that vary."""
        return tuple(name for name in self.ranges if name in values(self.model.parameters))

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Those of actuators, but for the spine's: they follow from what energy is needed."""
        return tuple(n for n in self.parameters if n in ACTUATORS and n not in SPINE_SHIFTS)

    @cached_property
    def problem(self) -> Problem:
        """The equations of all gaits that there are to choose from.

        What is positive all over its range counts by its logarithm, all else as it is.
        """
        own = values(self.model.parameters)
        lows = {name: self.ranges[name][0] for name in self.parameters}
        return self._posed({n: max(own[n], low) if low > 0 else 0.0 for n, low in lows.items()})

    @cached_property
    def entrance(self) -> Problem:
        """The same with everything as it is that the gait does without, such as dampers."""
        own = values(self.model.parameters)
        return self._posed(
            {n: 0.0 for n in self.parameters if self.ranges[n][0] <= 0 or not own[n]}
        )

    def _posed(self, changes: Mapping[str, float]) -> Problem:
        own = self.gait.quantities
        kept = {n: v for n, v in own.items() if n == "mean_speed" or n not in self.ranges}
        model = self.model.with_values(changes)
        return Problem(model, kept, free=self.parameters, tolerance=self.tolerance)

    def animal(self, point: Array) -> Model:
        """The animal at a point of the problem, without what it does not use.

        Its equations have no more than it needs, and its spine stays as it is in phases that its
        stride does not have.
        """
        model = replace(self.problem.at(point), kept=BARE)
        # A logarithm and back moves the end of a range by a rounding error.
        chosen = {name: self._clipped(name, model.numbers[name]) for name in self.parameters}
        phases = phases_of(self.problem.evaluate(point).trajectory.modes)
        for name in SPINE_SHIFTS.keys() & chosen.keys():
            if name.rpartition(".")[2] not in phases:
                chosen[name] = 0.0
        return model.with_values(chosen, origin="optimised")

    def _clipped(self, name: str, value: float) -> float:
        """The nearest value within a range."""
        low, high = self.ranges[name]
        return min(max(value, low), high)

    def usable(self, point: Array) -> bool:
        """Whether a gait is in all ranges, and far enough from being none."""
        try:
            return Place(self.problem, Task(PEAK_GRF, {}, self.ranges), point).missed <= MET
        except Astray:
            return False

    def bring_in(self, gait: Gait) -> Array | None:
        """Lead a gait to where all its parameters are in their ranges; None if it cannot be."""
        point = self._led(self.entrance, self.entrance.point(gait.model), {})
        if point is None:
            return None
        found = self.problem.point(self.entrance.at(point))
        return found if self.usable(found) else None

    def restrict(self, point: Array, wanted: Mapping[str, float]) -> Array | None:
        """Lead a gait to wanted values within all ranges; None if it cannot be led there."""
        found = self._led(self.problem, point, wanted)
        return found if found is not None and self.usable(found) else None

    def _led(self, problem: Problem, point: Array, wanted: Mapping[str, float]) -> Array | None:
        ends = dict(wanted)
        for _ in self.ranges:
            point = lead(problem, point, ends)[-1]
            here = problem.values(point)
            outside = {
                name: self._clipped(name, here[name])
                for name in self.ranges
                if name in here
                and name not in ends
                and self._clipped(name, here[name]) != here[name]
            }
            if not outside:
                break
            ends |= outside  # what is brought in stays in, as others yield
        here = problem.values(point)
        close = all(abs(here[name] - end) <= MET * max(1.0, abs(end)) for name, end in ends.items())
        return point if close else None

    def drawn(self, shares: Sequence[float], seed: tuple[int, ...], most: int) -> list[Array]:
        """Gaits of a design by its shares (0 to 1) of all ranges, or as near as they can be led.

        Shares of positive parameters are on a logarithmic scale. The seed picks ``most`` of many.
        """
        wanted = {}
        for (name, (low, high)), share in zip(self.ranges.items(), shares, strict=True):
            factor = name in self.parameters and low > 0
            wanted[name] = low * (high / low) ** share if factor else low + (high - low) * share
        gaits = self._search(wanted, seed)
        picked = np.random.default_rng(seed).permutation(len(gaits))[:most].tolist()
        found = []
        for number in picked:
            start = self.bring_in(gaits[number])
            if start is not None:
                ends = {n: wanted[n] for n in self.parameters if n not in self.inputs}
                way = lead(self.problem, start, ends)
                found.append(next(point for point in reversed(way) if self.usable(point)))
        return found

    def _search(self, drawn: Mapping[str, float], seed: tuple[int, ...]) -> list[Gait]:
        """Gaits with these values; where there can be, without dampers and actuators."""
        model, own = self.model, self.gait.quantities
        fixed = {n: v if n == "mean_speed" else drawn.get(n, v) for n, v in own.items()}
        number = int(np.random.SeedSequence(seed).generate_state(1)[0])
        if model.features.conservative:
            passive = [n for n in self.parameters if n not in ACTUATORS and "damping" not in n]
            body = model.with_values({name: drawn[name] for name in passive})
            symmetric = True if body.alike else None
            found = find_gaits(body, fixed, symmetric=symmetric, starts=SEARCHES, seed=number)
            return list(found)
        if not self.inputs:
            return []
        given, *_ = self.inputs
        low, high = self.ranges[given]
        others = {name: drawn[name] for name in self.parameters if name != given}
        body = model.with_values({**others, given: max(low, 0.0)})
        return list(
            find_gaits(body, fixed, free={given: (low, high)}, starts=SEARCHES, seed=number)
        )
