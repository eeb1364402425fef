"""Machine code for many runs at once: each mode's flow in SIMD lanes, without events.

Event detection inside an integrator has to stop lanes one by one. Here a lane takes a full step
of its own length, keeps the step's Taylor series, and events are looked for afterwards, for
hundreds of lanes in one call.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np

from flexspine.hybrid.cache import mend_cache
from flexspine.hybrid.compile import Array, CompiledSystem
from flexspine.hybrid.lowering import Lowering
from flexspine.hybrid.step_events import StepEvents

# Bytes; the Taylor coefficients of all terms of all lanes of an integrator stay in fast memory.
COEFFICIENTS = 130_000

# SIMD registers side by side: so many that a call from Python costs little a lane.
REGISTERS = (2, 8)


# s; where neither field nor guards set an end to a step.
LONGEST = 0.05


class LaneMode:
    """The code of one mode for many runs, ``width`` of them in one integrator.

    Arrays have one column a run.
    """

    def __init__(self, compiled: CompiledSystem, name: str) -> None:
        system = compiled.system
        self.name, self.code = name, compiled.mode(name)
        mode = self.code.mode
        states = [hy.expression(f"s{i}") for i in range(len(system.states))]
        held = {s: hy.par[i] for i, s in enumerate(system.held)}
        known = {**dict(zip(system.states, states, strict=True)), **held}
        lower = Lowering(known, system.parameters, mode.definitions, len(held))
        rates = {s: lower(mode.field[s]) for s in system.states}
        field = list(zip(states, rates.values(), strict=True))
        if self.code.endless:
            # Its guards come along, to be resolved by steps.
            for i, guard in enumerate(mode.guards):
                value = lower(guard.expression)
                slope = [hy.diff(value, v) * rate for v, rate in field[: len(states)]]
                field.append((hy.expression(f"g{i}"), hy.sum(slope)))
        self.width = _width(self.code.integrator)
        self._integrator = hy.taylor_adaptive_batch(
            field,
            np.zeros((len(field), self.width)),
            tol=compiled.tolerance,
            opt_level=compiled.effort,
        )
        self._coefficients = compiled.coefficients(lower.coefficients)
        # Code that needs few numbers may not reach as far as all held variables.
        count = len(self._integrator.pars)
        self.n_held, self.n_coefficients = min(len(held), count), max(count - len(held), 0)
        self._limited = False
        self.events = StepEvents(compiled, self.code, self._integrator.order)

    def coefficients(self, parameters: Array) -> Array:
        """The folded numbers of the flow for parameters of shape (p, k), shape (k, numbers)."""
        count = parameters.shape[1]
        # Whole registers only: what is left over would be computed by other instructions.
        filled = np.arange(count + -count % self.width).clip(max=count - 1)
        if not len(parameters):
            return np.zeros((count, self.n_coefficients))
        result: Array = self._coefficients(parameters.take(filled, axis=1))
        return result[: self.n_coefficients, :count].T.copy()

    def flow(
        self, steps: Array, held: Array, folded: Array, longest: Array, kept: int = 0
    ) -> Array:
        """Take one step of every lane; their number has to be a multiple of ``width``.

        ``steps`` (2 n + 1, k) hold the states where they begin; the states where they end and their
        lengths in s are filled in, below. ``held`` (m, k) or more rows, ``folded`` from
        `coefficients`, or one row of them for all; ``longest`` (k,) bounds the steps, in s, as
        LONGEST does. Returns the Taylor series of the first ``kept`` lanes, shape
        (n (order + 1) + 2, kept), of which the last two rows are free.
        """
        integrator, width, n = self._integrator, self.width, len(steps) // 2
        state, length = integrator.state[:n], integrator.last_h
        taylor = integrator.tc[:n].reshape(-1, width)
        blocks, numbers = _blocks(steps[:n], width), self._numbers(held, folded)
        given = integrator.pars[: numbers.shape[1]]
        lengths, series = np.empty((len(blocks), width)), np.empty((len(taylor) + 2, kept))
        bounds = np.minimum(longest, LONGEST).reshape(-1, width)
        bounded = np.logical_or((bounds < LONGEST).any(axis=1), self._limited)
        limits = bounds.tolist() if bounded.any() else []
        each = zip(blocks, numbers, lengths, bounded.tolist(), strict=True)
        for i, (here, own, lived, limit) in enumerate(each):
            state[...] = here
            given[...] = own
            keep = i * width < kept
            if limit:
                integrator.step(limits[i], write_tc=keep)
            elif keep:
                integrator.step(write_tc=True)
            else:
                integrator.step()
            here[...] = state
            lived[...] = length
            if keep:
                series[:-2, i * width : (i + 1) * width] = taylor
        # Flows are autonomous, and a time that is not finite would stick.
        integrator.set_time(0.0)
        if not self._limited and not (lengths <= LONGEST).all():
            self._limited = True
            return self.flow(steps, held, folded, longest, kept)
        steps[n : 2 * n].reshape(n, -1, width)[...] = blocks.transpose(1, 0, 2)
        steps[-1] = lengths.reshape(-1)
        return series

    def _numbers(self, held: Array, folded: Array) -> Array:
        """What changes of the integrator's parameters from block to block: the first of them."""
        n, pars = self.n_held, self._integrator.pars
        if len(folded) == 1:
            pars[n:] = folded[0, :, None]
            return _blocks(held[:n], self.width)
        return _blocks(np.concatenate([held[:n], folded.T]), self.width)


def _width(integrator: Any) -> int:
    """How many lanes suit a field: the fewer, the longer it is."""
    register = hy.recommended_simd_size()
    lane = 8 * (integrator.order + 1) * len(integrator.decomposition)
    return int(register * np.clip(COEFFICIENTS // (lane * register), *REGISTERS))


def _blocks(columns: Array, width: int) -> Array:
    """Columns in blocks, shape (blocks, rows, width)."""
    rows, count = columns.shape
    return columns.reshape(rows, count // width, width).transpose(1, 0, 2).copy()


class LaneSystem:
    """The lane code of a compiled system, mode by mode on demand."""

    def __init__(self, compiled: CompiledSystem) -> None:
        self.compiled, self.system = compiled, compiled.system
        self._modes: dict[str, LaneMode] = {}

    def mode(self, name: str) -> LaneMode:
        """Return the named mode, compiled."""
        if name not in self._modes:
            self._modes[name] = LaneMode(self.compiled, name)
            mend_cache()
        return self._modes[name]


@lru_cache(maxsize=64)
def compile_lanes(compiled: CompiledSystem) -> LaneSystem:
    """Return the lane code of a system, the same object for the same argument."""
    return LaneSystem(compiled)
