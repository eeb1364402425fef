"""Events that follow each other quickly, of many runs: what tells a chattering one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexspine.hybrid.compile import Array, CompiledMode
from flexspine.hybrid.events import CHATTER_EVENTS, RECENT_EVENTS, Firing
from flexspine.hybrid.step_events import Indices


class Crowds:
    """The recent firings of runs in some slots; those within ``window`` seconds count."""

    def __init__(self, slots: int, window: float) -> None:
        self._window = window
        # One column a slot, written round and round; ``_next`` is the place of the next one.
        self._times = np.full((RECENT_EVENTS, slots), -np.inf)
        self._which = np.zeros((RECENT_EVENTS, slots), dtype=int)  # positions in ``_names``
        self._next = np.zeros(slots, dtype=int)
        self._names: list[tuple[str, ...]] = []
        self._first: dict[str, int] = {}  # where a mode's guards begin among them

    def forget(self, slots: Indices) -> None:
        """Forget what was in some slots."""
        self._times[:, slots] = -np.inf

    def note(
        self, code: CompiledMode, slots: Indices, guards: Array, times: Array
    ) -> NDArray[np.bool_]:
        """Note a guard of one mode for each slot; returns where the next one may be chatter."""
        name = code.mode.name
        if name not in self._first:
            self._first[name] = len(self._names)
            self._names += [(guard.name,) for guard in code.mode.guards]
        place = self._next[slots]
        self._times[place, slots] = times
        self._which[place, slots] = guards + self._first[name]
        self._next[slots] = (place + 1) % RECENT_EVENTS
        earlier = self._times[place - (CHATTER_EVENTS - 2), slots]
        crowded: NDArray[np.bool_] = times - earlier < self._window
        return crowded

    def of(self, slot: int) -> list[Firing]:
        """The recent firings in a slot, in order."""
        order = np.roll(np.arange(RECENT_EVENTS), -self._next[slot])
        times, which = self._times[order, slot].tolist(), self._which[order, slot].tolist()
        return [
            Firing(time, self._names[w])
            for time, w in zip(times, which, strict=True)
            if time > -np.inf
        ]

    def go_on(self, slot: int, firings: list[Firing]) -> None:
        """Note what else happened in a slot."""
        for time, names in firings:
            if names not in self._names:
                self._names.append(names)
            place = self._next[slot]
            self._times[place, slot], self._which[place, slot] = time, self._names.index(names)
            self._next[slot] = (place + 1) % RECENT_EVENTS
