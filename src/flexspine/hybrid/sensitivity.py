"""How the end of a run changes with its beginning and with parameters, to first order.

Follows deviations along a finished trajectory: variational equations between events, saltation at
them. Source: Leine & Nijmeijer 2004, Dynamics and Bifurcations of Non-Smooth Mechanical Systems.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexspine.hybrid.compile import Array
from flexspine.hybrid.tangent import LANES, TangentFlow, compile_tangents
from flexspine.hybrid.trajectory import Event, Trajectory


@dataclass(frozen=True)
class Deviation:
    """First-order changes, one column each: of states (n, q), held (m, q), parameters (p, q)."""

    states: Array
    held: Array
    parameters: Array


@dataclass(frozen=True)
class Sensitivity:
    """What deviations of the start have become on the section where the run ended.

    ``states`` (n, q) and ``held`` (m, q) are on the section, ``time`` (q,) is the change of the
    instant (s). ``rates`` are the speeds at which each guard was crossed, in guard units per
    second: near zero is near grazing.
    """

    states: Array
    held: Array
    time: Array
    rates: tuple[float, ...]


def propagate(trajectory: Trajectory, start: Deviation) -> Sensitivity:
    """Follow deviations of the start along a run that ended on a section."""
    return _Propagation(trajectory, start).go()


class _Propagation:
    """Deviations on their way along a trajectory: those of states, held and parameters in turn."""

    def __init__(self, trajectory: Trajectory, start: Deviation) -> None:
        bound = trajectory.bound
        self.trajectory, self.bound = trajectory, bound
        self.code = compile_tangents(bound.compiled)
        self.n, self.m = len(start.states), len(start.held)
        self.deviations = np.vstack([start.states, start.held, start.parameters])
        self.count = self.deviations.shape[1]
        self.moved = tuple(np.flatnonzero(start.parameters.any(axis=1)).tolist())
        self.raw = np.repeat(bound.parameters[:, None], self.count, axis=1)
        self.time = np.zeros(self.count)
        self.rates: list[float] = []
        self.folded: dict[int, Array] = {}

    def go(self) -> Sensitivity:
        here = self.trajectory.start
        crossings = {point.time for point in self.trajectory.crossings}
        for event in self.trajectory.events:
            arrival = here.states
            if event.time > here.time:
                arrival = self._flow(here.mode, here.states, here.held, event.time - here.time)
            self._jump(event, here.mode, arrival, here.held)
            here = event.after
            if here.time in crossings:
                self._reset()
        states, held, _ = np.split(self.deviations, [self.n, self.n + self.m])
        return Sensitivity(states, held, self.time, tuple(self.rates))

    def _flow(self, mode: str, states: Array, held: Array, duration: float) -> Array:
        """Carry the deviations along one arc; returns the states at its end."""
        flow, n = self.code.flow(mode, self.moved), self.n
        integrator = flow.integrator
        state, numbers = integrator.state, integrator.pars
        numbers[flow.held] = held[flow.held, None]
        if flow.folded.stop > flow.folded.start:
            numbers[flow.folded] = self._coefficients(flow)
        for first in range(0, self.count, LANES):
            part = slice(first, min(first + LANES, self.count))
            width = part.stop - first
            moving, pushed = self.deviations[:n, part], self.deviations[flow.rows, part]
            if first and not (moving.any() or pushed.any()):
                continue  # what does not deviate will not do so before the next event
            if width < LANES:  # idle lanes
                state[n:] = 0.0
                numbers[flow.deviations] = 0.0
            state[:n] = states[:, None]
            state[n:, :width] = moving
            numbers[flow.deviations, :width] = pushed
            integrator.set_time(0.0)
            integrator.propagate_until(duration)
            self.deviations[:n, part] = state[n:, :width]
        end: Array = state[:n, 0].copy()
        return end

    def _coefficients(self, flow: TangentFlow) -> Array:
        key = id(flow)
        if key not in self.folded:
            room = flow.folded.stop - flow.folded.start
            self.folded[key] = flow.coefficients(self.bound.parameters)[:room, None]
        return self.folded[key]

    def _jump(self, event: Event, mode: str, states: Array, held: Array) -> None:
        """Let the guards of one event fire in their order."""
        n, m = self.n, self.m
        inputs = np.empty((n + m + len(self.deviations), self.count))
        for name in event.names:
            inputs[:n], inputs[n : n + m] = states[:, None], held[:, None]
            inputs[n + m :] = self.deviations
            jump = self.code.jump(mode, name)
            if jump.target is None and event is not self.trajectory.events[-1]:
                continue  # a section on the way; only the last one fixes the instant
            answer = jump.function(inputs, pars=self.raw[: jump.function.nparams])
            self.rates.append(float(answer[0, 0]))
            self.time = answer[1]
            if jump.target is None:
                self.deviations[:n] = answer[2:]
                continue
            states, held = answer[2 : 2 + n, 0], answer[2 + n : 2 + n + m, 0]
            self.deviations[: n + m] = answer[2 + n + m :]
            mode = jump.target

    def _reset(self) -> None:
        """What the section sets does not deviate."""
        places = self.bound.system.places
        for symbol in self.bound.system.section.resets:
            self.deviations[self.n + places[symbol]] = 0.0
