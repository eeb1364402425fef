"""A stride as an optimiser looks at it: peak forces, and how far it is from being no gait.

Where a quantity turns round is located on the recorded stride; a largest value changes like the
value at that time. So strides nearby need not be recorded: they are probed at the same times.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexspine.gaits.gait import contact_times
from flexspine.gaits.measures import Profile
from flexspine.gaits.problem import Problem
from flexspine.hybrid.compile import Array
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.legs import SIDES
from flexspine.models.simulation import Run

# m, of a toe, and s, of a flight: with less, any change may make a leg land once more, or keep it
# on the ground through the apex, and there is no gait of this kind.
CLEARANCE, FLIGHT = 1e-3, 1e-3
LEAST = np.array([CLEARANCE, CLEARANCE, FLIGHT, FLIGHT])

# m; of toes that never come near the ground.
ROOMY = 0.05


class Astray(Exception):  # noqa: N818 - no error, but where a search turns round
    """There is no gait where one was looked for."""


class Probe(NamedTuple):
    """Where to look at an observable: at a time (s), or just before or after an event by number."""

    name: str
    time: float = 0.0
    event: int | None = None
    after: bool = True


class Probes(NamedTuple):
    """Where forces peak, and where toes come nearest to landing once more, None if they do not."""

    peaks: tuple[Probe, ...]
    toes: tuple[Probe | None, ...]


class Stride:
    """A stride from a point of a problem: a gait, or with another's ``probes`` one next to it.

    Raises `Astray` if the animal does not come back.
    """

    def __init__(self, problem: Problem, point: Array, probes: Probes | None = None) -> None:
        self.problem, self.point = problem, point
        record = probes is None or problem.model.features.hips  # whose work is no sum of jumps
        self.evaluation = problem.evaluate(point, record=record)
        if self.evaluation.residual is None:
            raise Astray(str(self.evaluation.outcome))
        self.trajectory = self.evaluation.trajectory
        self.probes = self._located() if probes is None else probes

    @cached_property
    def profile(self) -> Profile:
        """Every quantity over the recorded stride."""
        return Profile(Run(self.problem.model, self.trajectory, self.problem.tolerance))

    @cached_property
    def peaks(self) -> Array:
        """The largest force of each leg, in N, shape (2,)."""
        return np.array([self.at(probe) for probe in self.probes.peaks])

    @cached_property
    def margins(self) -> Array:
        """How far it is from being no gait of its kind: at least `LEAST`, shape (4,).

        In m, how far each leg in the air stays away from landing once more. It would where its toe,
        held out for touchdown, came down to the ground and rose again, or rose above it and came
        down. In s, the flights after one apex and before the next.
        """
        toes = [ROOMY if probe is None else abs(self.at(probe)) for probe in self.probes.toes]
        contacts = [time for _, time in contact_times(self.trajectory)]
        return np.array([*toes, contacts[0], self.trajectory.duration - contacts[-1]])

    def at(self, probe: Probe) -> float:
        """The value of an observable where a probe looks at it."""
        bound, points = self.trajectory.bound, list(self._points())
        if probe.event is None:
            here = max((p for p in points if p.time <= probe.time), key=lambda point: point.time)
            here = integrate(bound, here, end_time=probe.time).end
        else:
            here = points[probe.event + 1]
            if not probe.after:
                before = points[probe.event]
                here = before._replace(states=here.states)
        return float(bound.observe(here.mode, here.states[None], here.held)[probe.name][0])

    def _points(self) -> Iterator[HybridState]:
        """The start, and where every event has left it."""
        yield self.trajectory.start
        for event in self.trajectory.events:
            yield event.after

    def _located(self) -> Probes:
        toes: list[Probe | None] = []
        for side in SIDES:
            name = f"{side}_toe_y"
            near = [t for t in self.profile.turns(name) if t.least == (t.value > 0)]
            nearest = min(near, key=lambda turn: abs(turn.value), default=None)
            close = nearest is not None and abs(nearest.value) < ROOMY
            toes.append(Probe(name, nearest.time) if nearest and close else None)
        return Probes(tuple(self._peak(f"{side}_grf") for side in SIDES), tuple(toes))

    def _peak(self, name: str) -> Probe:
        turns = [(turn.value, Probe(name, turn.time)) for turn in self.profile.turns(name)]
        edges = [
            Probe(name, event=number, after=after)
            for number in range(len(self.trajectory.events))
            for after in (False, True)
        ]
        return max([*turns, *((self.at(probe), probe) for probe in edges)])[1]
