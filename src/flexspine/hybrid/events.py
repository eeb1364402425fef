"""What happens to one run at the instant of an event: guards fire, lead to others, cross sections.

Guards that are due at the same instant fire one after the other, each once; an event that grazes
or one of too many ends the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from flexspine.hybrid.bound import BoundMode, BoundSystem
from flexspine.hybrid.compile import Array, Due, Jump
from flexspine.hybrid.outcome import CHATTERED, COMPLETED, GRAZED, Outcome, OutcomeKind
from flexspine.hybrid.system import Decision, Guard, Section
from flexspine.hybrid.trajectory import Event, HybridState

# s; guards that fire closer together than this are one event.
SIMULTANEITY = 1e-12

# Guard units; a guard above this is not due now at any rate below 1e6 per second.
CLOSE = 1e-6

# Guard units; a guard this close to zero is zero with rounding error.
ZERO = 1e-12

# Relative to the largest state, such as a position kilometres away: what guards are off by that
# are differences of such.
ROUNDING = 64 * np.finfo(float).eps

# Guard units per second; crossed more slowly, one rounding error of the guard (1e-16) moves the
# event by more than SIMULTANEITY.
GRAZING_RATE = 1e-4

# s; heyoka may find no root in a step that begins where the guard is zero. Where steps are of any
# length the first is this long: so soon a guard comes back in chatter only, which has ended before.
LEAVING = 1e-9

# One guard firing this often within the system's window is chatter.
CHATTER_EVENTS = 8
RECENT_EVENTS = 4 * CHATTER_EVENTS


class Firing(NamedTuple):
    """When, in s, which guards fired at one instant."""

    time: float
    names: tuple[str, ...]


class Progress:
    """Where one run is, and all that has happened to it.

    ``time`` (s), ``mode``, ``states`` and ``held`` are its point; whoever lets it flow moves them.
    ``outcome`` is None until the run has ended. ``wanted`` counts the crossings of ``section`` that
    complete it, None: no number does. ``before`` are firings that led to ``start``.
    """

    def __init__(
        self,
        bound: BoundSystem,
        start: HybridState,
        section: Section,
        wanted: int | None,
        before: Sequence[Firing],
    ) -> None:
        self.bound, self.section, self.wanted = bound, section, wanted
        places = bound.system.places
        self._requires = [(places[s], value) for s, value in section.requires.items()]
        self.time, self.mode = start.time, start.mode
        self.states, self.held = start.states, start.held
        self.events: list[Event] = []
        self.crossings: list[HybridState] = []
        self.outcome: Outcome | None = None
        self._firings = [*before]
        # The guards that fired at the latest instant; none of them may fire at it again.
        self._instant, self._fired = start.time, [*section.guards]

    @property
    def here(self) -> HybridState:
        """The point at which the run is."""
        return HybridState(self.time, self.mode, self.states, self.held)

    @property
    def section_name(self) -> str:
        """What the section is called: its guards."""
        return " or ".join(self.section.guards)

    def begin(self) -> None:
        """Refuse to start on a guard that is not crossed; fire what is due."""
        self._decide_more(starting=True)
        if self.outcome is not None:
            return
        mode = self.bound.mode(self.mode)
        values = mode.evaluate(self.states, self.held)
        numbers = values[mode.code.guards].tolist()
        for jump in mode.code.jumps:
            if jump.guard.decide is not None or jump.guard.timed:
                continue
            touching = -ZERO <= numbers[jump.value] <= ZERO
            if touching and jump.guard.jumps and abs(numbers[jump.rate]) < GRAZING_RATE:
                self.outcome = Outcome(GRAZED, f"{jump.guard.name} at the start")
                return
        self._settle(mode, values)

    def settle(self) -> None:
        """Fire what is due at an instant at which no root was looked for."""
        mode = self.bound.mode(self.mode)
        self._settle(mode, mode.evaluate(self.states, self.held))

    def leaves_a_guard(self, mode: BoundMode) -> bool:
        """Whether a guard of the present mode is zero and rising."""
        numbers = mode.evaluate(self.states, self.held)[mode.code.guards].tolist()
        pairs = zip(numbers[::2], numbers[1::2], strict=True)
        return any(abs(value) < LEAVING * rate for value, rate in pairs)

    def happen(self, jump: Jump, mode: BoundMode) -> bool:
        """Let a guard fire that the integrator has located; False: nothing came of it.

        The flow has to start anew where something did.
        """
        guard = jump.guard
        if self.time - self._instant <= SIMULTANEITY and guard.name in self._fired:
            return False  # the same root once more; the integrator now cools it down
        crossed = guard.name in self.section.guards and self._may_cross()
        if not (crossed or jump.acts):
            return False
        if guard.decide is not None and not crossed:
            return self._decide(guard, guard.decide)
        self._instant, self._fired = self.time, [guard.name]
        before = self.mode
        if guard.jumps or guard.ends is not None:
            values = mode.evaluate(self.states, self.held)
            if guard.ends is None and self._in_doubt(guard, values[jump.rate]):
                return True
            crossed = crossed or self._section_is_due(mode, values)
            self._fire(jump, values)
        if crossed:
            self._cross()
        self._note(tuple(self._fired), before)
        self._decide_more()
        return True

    def _decide(self, guard: Guard, decide: Decision, *, starting: bool = False) -> bool:
        """Let a guard fire whose jump is computed in numbers; False: nothing came of it."""
        found = decide(self.bound, self.here)
        if found is None:
            return False
        earlier = self._fired if self.time - self._instant <= SIMULTANEITY else []
        self._instant, self._fired = self.time, [*earlier, guard.name]
        if self._in_doubt(guard, -inf):
            return True
        if isinstance(found, Outcome):
            self.outcome = found
            return True
        before = self.mode
        _, self.mode, self.states, self.held = found
        if not guard.quiet:
            self._note((guard.name,), before)
        if not starting:
            self.settle()
            self._decide_more()
        return True

    def _decide_more(self, *, starting: bool = False) -> None:
        """Let decided guards fire that are due at this instant too.

        When ``starting``, only those that are armed by level, and nothing else yet.
        """
        while self.outcome is None:
            mode = self.bound.mode(self.mode)
            here = mode.code.decided_here
            if starting:
                here = tuple(due for due in here if due.by_level)
            if not here:
                return
            values = mode.evaluate(self.states, self.held)
            due = self._due(values[mode.code.guards], here)
            if due is None:
                return
            guard = mode.code.by_name[due].guard
            assert guard.decide is not None
            if not self._decide(guard, guard.decide, starting=starting):
                self._fired.append(due)

    def _may_cross(self) -> bool:
        return all(self.held[i] == value for i, value in self._requires)

    def _section_is_due(self, mode: BoundMode, values: Array) -> bool:
        """Whether the section is crossed at the instant of another guard."""
        if not self._may_cross():
            return False
        for name in self.section.guards:
            jump = mode.code.by_name.get(name)
            if jump is None or name in self._fired:
                continue
            value, rate = values[jump.value], values[jump.rate]
            if rate < 0 and abs(value) <= -rate * SIMULTANEITY:
                self._fired.append(name)
                return True
        return False

    def _fire(self, jump: Jump, values: Array) -> None:
        """Jump, then let every further guard that is due at this instant fire, each once."""
        while True:
            if jump.guard.ends is not None:
                text = f"{jump.guard.name} at t = {self.time:.6g} s"
                self.outcome = Outcome(jump.guard.ends, text)
                return
            self.states = values[jump.states].copy()
            self.held = values[jump.held].copy()
            self.mode = jump.target
            due = self._due(values[jump.guards], jump.due)
            if due is None:
                return
            mode = self.bound.mode(self.mode)
            values = mode.evaluate(self.states, self.held)
            jump = mode.code.by_name[due]
            self._fired.append(jump.guard.name)

    def _due(self, pairs: Array, candidates: tuple[Due, ...]) -> str | None:
        """Return the name of a guard that fires at this instant too; pairs: value, rate, ..."""
        numbers = pairs.tolist()
        for index, name, was_active, by_level in candidates:
            value = numbers[2 * index]
            if value > CLOSE:
                continue
            rate = numbers[2 * index + 1]
            falls_now = rate < 0 and value <= -rate * SIMULTANEITY
            if by_level:
                fires = falls_now or (value < -ZERO and value < -self._rounding())
            else:
                fires = was_active and falls_now and value >= rate * SIMULTANEITY
            if fires and name not in self._fired:
                return name
        return None

    def _rounding(self) -> float:
        """What a guard may be off by that is a difference of states."""
        return ROUNDING * float(np.abs(self.states).max())

    def _settle(self, mode: BoundMode, values: Array) -> None:
        if self.time - self._instant > SIMULTANEITY:
            self._instant, self._fired = self.time, []
        due = self._due(values[mode.code.guards], mode.code.due_here)
        if due is not None:
            jump, before = mode.code.by_name[due], self.mode
            known = len(self._fired)
            self._fired.append(jump.guard.name)
            self._fire(jump, values)
            self._note(tuple(self._fired[known:]), before)

    def _note(self, names: tuple[str, ...], before: str) -> None:
        """Note an event."""
        self.events.append(Event(names, before, self.here))
        self._firings.append(Firing(self.time, names))

    def _in_doubt(self, guard: Guard, rate: float) -> bool:
        """Whether the run has to end at an event that is no proper one."""
        kind = None if guard.timed else self._doubt(guard.name, rate)
        if kind is not None:
            self.outcome = Outcome(kind, f"{guard.name} at t = {self.time:.9g} s")
        return kind is not None

    def _doubt(self, name: str, rate: float) -> OutcomeKind | None:
        """Tell a grazing or a chattering event from a proper one."""
        window = self.bound.system.chatter_window
        grazing = -GRAZING_RATE < rate < GRAZING_RATE
        crowded = len(self._firings) >= CHATTER_EVENTS and (
            self.time - self._firings[-CHATTER_EVENTS].time < window
        )
        if not (grazing or crowded):
            return None
        recent = self._firings[-RECENT_EVENTS:]
        times = sum(name in f.names for f in recent if self.time - f.time < window)
        if times >= (CHATTER_EVENTS // 2 if grazing else CHATTER_EVENTS):
            return CHATTERED
        return GRAZED if grazing else None

    def _cross(self) -> None:
        """Note a point of the section."""
        self.held = self.held.copy()
        for symbol, value in self.section.resets.items():
            self.held[self.bound.system.places[symbol]] = value
        self.crossings.append(self.here)
        if self.section.act is not None:
            found = self.section.act(self.bound, self.here)
            if isinstance(found, Outcome):
                self.outcome = found
                return
            if found is not None:
                _, self.mode, self.states, self.held = found
                self.crossings[-1] = self.here
        if len(self.crossings) == self.wanted:
            self.outcome = Outcome(COMPLETED, f"{self.wanted} x {self.section_name}")
