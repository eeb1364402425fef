"""What a run leaves behind: arcs of flow, events, section crossings and an outcome."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

import numpy as np

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import Outcome


class HybridState(NamedTuple):
    """A point of a hybrid system: time (s), mode, states and held variables (SI)."""

    time: float
    mode: str
    states: Array
    held: Array


class Event(NamedTuple):
    """One instant at which one guard or several fired.

    ``names`` are the guards in firing order, ``mode`` the mode before, ``after`` the point right
    after.
    """

    names: tuple[str, ...]
    mode: str
    after: HybridState

    @property
    def time(self) -> float:
        """When, in s."""
        return self.after.time


@dataclass(frozen=True)
class Arc:
    """Flow in one mode between two events, as the integrator's Taylor polynomials.

    ``times`` (k+1,) are the ends of its steps in s, ``series`` (k, states, order+1) the
    coefficients of each step in powers of the time since its beginning.
    """

    mode: str
    held: Array
    times: Array
    series: Array

    @property
    def start(self) -> float:
        """When the arc begins, in s."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """When the arc ends, in s."""
        return float(self.times[-1])

    def __call__(self, times: Array) -> Array:
        """Return the states at ``times`` (s) by Horner's rule, shape (len(times), states)."""
        step = np.clip(
            np.searchsorted(self.times, times, side="right") - 1, 0, len(self.series) - 1
        )
        since = (times - self.times[step])[:, None]
        series = self.series[step]
        result = series[:, :, -1].copy()
        for power in range(series.shape[2] - 2, -1, -1):
            result *= since
            result += series[:, :, power]
        return result

    def until(self, time: float) -> Arc:
        """Return the arc cut off at ``time`` (s)."""
        kept = max(int(np.searchsorted(self.times, time)), 1)
        return replace(self, times=np.append(self.times[:kept], time), series=self.series[:kept])


@dataclass(frozen=True)
class Trajectory:
    """A run of a hybrid system. Without recording ``arcs`` is empty, all else is there.

    ``crossings`` are the points on the section, taken after its resets and what is done there;
    ``steps`` counts Taylor steps.
    """

    bound: BoundSystem
    start: HybridState
    end: HybridState
    events: tuple[Event, ...]
    crossings: tuple[HybridState, ...]
    arcs: tuple[Arc, ...]
    steps: int
    outcome: Outcome

    def __repr__(self) -> str:
        told = f"{self.duration:.4g} s, {len(self.events)} events, {self.outcome.name}"
        return f"<Trajectory: {told}>"

    @cached_property
    def modes(self) -> tuple[str, ...]:
        """The modes in the order in which they were lived through."""
        visited = [self.start.mode, *(event.after.mode for event in self.events)]
        return tuple(mode for mode, _ in groupby(visited))

    @property
    def duration(self) -> float:
        """Simulated time in s."""
        return self.end.time - self.start.time

    def pieces(self, times: Array) -> Iterator[tuple[Arc, slice]]:
        """Split sorted ``times`` (s) among the arcs; an event's instant belongs to what follows."""
        starts = np.array([arc.start for arc in self.arcs])
        owner = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, None)
        edges = np.searchsorted(owner, np.arange(len(self.arcs) + 1))
        for arc, first, last in zip(self.arcs, edges[:-1], edges[1:], strict=True):
            if last > first:
                yield arc, slice(int(first), int(last))

    def observe(self, arc: Arc, states: Array) -> dict[str, Array]:
        """Evaluate the observables of an arc's mode at states of shape (times, states)."""
        return self.bound.observe(arc.mode, states, arc.held)
