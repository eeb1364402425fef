"""Many runs of one hybrid system: where they start, and how they end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import COMPLETED, OutcomeKind

# In place of a position.
NONE = -1


@dataclass(frozen=True)
class Starts:
    """Where k runs start: one mode, states (n, k), held variables (m, k), parameters (p, k)."""

    mode: str
    states: Array
    held: Array
    parameters: Array

    def __len__(self) -> int:
        return len(self.states.T)


@dataclass
class Ends:
    """How k runs ended.

    ``kinds`` (k,) are positions in ``outcomes``; ``crossings`` (k,) of the section; ``time`` (k,)
    the end and ``section_time`` (k,) the last crossing, in s; ``states`` (n, k) at the end and
    ``section_states`` (n, k) at the last crossing, or the start if there is none; ``largest``
    (t, k) of the tracked observables. ``alone`` counts how often a run had to be done by itself.
    """

    outcomes: list[OutcomeKind]
    kinds: NDArray[np.int8]
    crossings: NDArray[np.int64]
    time: Array
    states: Array
    section_time: Array
    section_states: Array
    largest: Array
    alone: int = 0

    @classmethod
    def none_yet(cls, starts: Starts, tracked: int) -> Ends:
        """The ends of runs of which none has ended."""
        total = len(starts)
        return cls(
            outcomes=[COMPLETED],
            kinds=np.full(total, NONE, dtype=np.int8),
            crossings=np.zeros(total, dtype=np.int64),
            time=np.zeros(total),
            states=starts.states.copy(),
            section_time=np.zeros(total),
            section_states=starts.states.copy(),
            largest=np.zeros((tracked, total)),
        )
