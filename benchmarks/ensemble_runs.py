"""Strides from scattered starts, by the thousand or one by one, for the ensemble benchmark."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexspine import load_model
from flexspine.hybrid.batch import Starts
from flexspine.hybrid.ensemble import run_many
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.lanes import compile_lanes
from flexspine.hybrid.trajectory import HybridState, Trajectory

Array = NDArray[np.float64]

PRESET = "kamimura2015-flexible"
RUNS, STRIDES = 10_000, 5
SPREAD, SEED = 1e-3, 1


class Runs:
    """The gait of a preset and starts scattered around it, at the apex."""

    def __init__(self, preset: str) -> None:
        self.preset, self.model = preset, load_model(preset)
        self.apex = self.model.apex_state()
        shape = (RUNS, len(self.apex.states))
        scatter = np.random.default_rng(SEED).uniform(-SPREAD, SPREAD, shape)
        scatter[:, [0, -1]] = 0.0  # where it is and what is dissipated change nothing
        self.states = (self.apex.states * (1.0 + scatter)).T.copy()
        self.states[self.model.state_names.index("com_y_rate")] = 0.0

    def starts(self, count: int = RUNS) -> Starts:
        held, parameters = self.apex.held[:, None], self.model.bind(1e-12).parameters[:, None]
        return Starts(
            self.apex.mode,
            self.states[:, :count],
            np.repeat(held, count, axis=1),
            np.repeat(parameters, count, axis=1),
        )

    def job(self, tolerance: float) -> Callable[[], object]:
        """Work that makes RUNS times STRIDES strides."""
        lanes, starts = compile_lanes(self.model.bind(tolerance).compiled), self.starts()

        def work() -> None:
            made = run_many(lanes, starts, STRIDES).crossings.sum()
            assert made == RUNS * STRIDES

        return work

    def ends(self, tolerance: float, count: int) -> Array:
        """Where the first strides of the first runs end, in lanes."""
        lanes = compile_lanes(self.model.bind(tolerance).compiled)
        return run_many(lanes, self.starts(count), 1).section_states

    def alone(self, tolerance: float, count: int) -> Callable[[], Array]:
        """Work that makes the first strides of the first runs one by one; returns their ends."""
        bound = self.model.bind(tolerance)
        points = [
            HybridState(0.0, self.apex.mode, states.copy(), self.apex.held)
            for states in self.states.T[:count]
        ]
        return lambda: np.array([integrate(bound, at, crossings=1).end.states for at in points]).T

    def recorded(self, tolerance: float) -> Trajectory:
        """One stride of the gait itself, with its arcs."""
        return integrate(self.model.bind(tolerance), self.apex, crossings=1, record=True)
