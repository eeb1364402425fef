"""One run of a hybrid system, events located by the integrator to rounding error."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from flexspine.hybrid.compile import Array, BoundMode, BoundSystem, Due, Jump
from flexspine.hybrid.grazing import touches_without_crossing
from flexspine.hybrid.outcome import (
    CHATTERED,
    COMPLETED,
    DIVERGED,
    GRAZED,
    TIMED_OUT,
    Outcome,
    OutcomeKind,
)
from flexspine.hybrid.system import Decision, Guard, Section
from flexspine.hybrid.trajectory import Arc, Event, HybridState, Trajectory

# s; guards that fire closer together than this are one event.
SIMULTANEITY = 1e-12

# Guard units; a guard above this is not due now at any rate below 1e6 per second.
CLOSE = 1e-6

# Guard units; a guard this close to zero is zero with rounding error.
ZERO = 1e-12

# Units in the last place of the largest state, such as a position kilometres away: what guards are
# off by that are differences of such.
ROUNDING = 64 * np.finfo(float).eps

# Guard units per second; crossed more slowly, one rounding error of the guard (1e-16) moves the
# event by more than SIMULTANEITY.
GRAZING_RATE = 1e-4

# One guard firing this often within the system's window is chatter.
CHATTER_EVENTS = 8
RECENT_EVENTS = 4 * CHATTER_EVENTS

# s; the slowest strides take one or two.
SECTION_TIMEOUT = 10.0

# A stride takes some 30 steps; spending this many between two crossings is getting nowhere.
MAX_STEPS = 50_000


class Firing(NamedTuple):
    """When, in s, which guards fired at one instant."""

    time: float
    names: tuple[str, ...]


def integrate(
    bound: BoundSystem,
    start: HybridState,
    *,
    end_time: float = inf,
    crossings: int | None = None,
    section: Section | None = None,
    section_timeout: float = SECTION_TIMEOUT,
    max_steps: int = MAX_STEPS,
    record: bool = False,
    before: Sequence[Firing] = (),
) -> Trajectory:
    """Run until ``end_time`` (s) or until the section was crossed ``crossings`` times.

    ``section`` is the system's own if none is given. With ``crossings``, a run that stays away
    from it for ``section_timeout`` seconds ends as its ``missed`` outcome. ``max_steps``
    bounds the Taylor steps between two crossings. ``record`` keeps dense output, and only then is
    a guard noticed that touches zero without crossing it. ``before`` are firings that led to
    ``start``, which count for chatter. Always returns; the outcome tells how it ended.
    """
    watched = section or bound.system.section
    limits = end_time, crossings, watched, section_timeout, max_steps
    return _Run(bound, start, *limits, record, before).go()


class _Run:
    """The state of one integration in progress."""

    def __init__(
        self,
        bound: BoundSystem,
        start: HybridState,
        end_time: float,
        wanted: int | None,
        section: Section,
        section_timeout: float,
        max_steps: int,
        record: bool,
        before: Sequence[Firing],
    ) -> None:
        self.bound, self.start, self.record = bound, start, record
        self.end_time, self.wanted = end_time, wanted
        self.section_timeout, self.max_steps = section_timeout, max_steps
        self.section = section
        places = bound.system.places
        self.requires = [(places[s], value) for s, value in section.requires.items()]
        self.time, self.mode = start.time, start.mode
        self.states, self.held = start.states, start.held
        self.events: list[Event] = []
        self.firings = [*before]
        self.crossings: list[HybridState] = []
        self.arcs: list[Arc] = []
        self.steps, self.steps_left = 0, max_steps
        # The guards that fired at the latest instant; none of them may fire at it again.
        self.instant, self.fired = start.time, [*section.guards]
        self.limit = self._limit()
        self.outcome: Outcome | None = None

    def go(self) -> Trajectory:
        self._start()
        while self.outcome is None:
            self._flow()
        return Trajectory(
            bound=self.bound,
            start=self.start,
            end=self._here(),
            events=tuple(self.events),
            crossings=tuple(self.crossings),
            arcs=tuple(self.arcs),
            steps=self.steps,
            outcome=self.outcome,
        )

    def _here(self) -> HybridState:
        return HybridState(self.time, self.mode, self.states, self.held)

    def _limit(self) -> float:
        """How far to go before giving the section up, in s."""
        if self.wanted is None:
            return self.end_time
        return min(self.end_time, self.time + self.section_timeout)

    def _flow(self) -> None:
        """Follow the field of the present mode until something happens."""
        mode = self.bound.mode(self.mode)
        integrator = mode.enter(self.time, self.states, self.held)
        code, limit = mode.code, self.limit
        jumps = code.jumps
        advance = self._advance_recording if self.record else self._advance
        while True:
            result = advance(integrator, limit)
            if self.outcome is not None:
                return
            if result == hy.taylor_outcome.err_nf_state:
                self.outcome = Outcome(
                    DIVERGED, f"not finite after t = {self.time:.6g} s in {self.mode}"
                )
                return
            self.time, self.states = integrator.time, code.state.copy()
            index = -int(result) - 1
            if not 0 <= index < len(jumps):
                self.outcome = self._stopped(result, limit)
                return
            if self._happens(jumps[index], mode):
                return

    def _advance(self, integrator: Any, limit: float) -> Any:
        if self.steps_left <= 0:
            return hy.taylor_outcome.step_limit
        result, _, _, steps, _, _ = integrator.propagate_until(limit, self.steps_left)
        self.steps += steps
        self.steps_left -= steps
        return result

    def _advance_recording(self, integrator: Any, limit: float) -> Any:
        """Advance step by step and keep the Taylor series of each."""
        times, series = [integrator.time], []
        result = hy.taylor_outcome.success
        while result == hy.taylor_outcome.success:
            if self.steps_left <= 0:
                result = hy.taylor_outcome.step_limit
                break
            result, _ = integrator.step(limit - integrator.time, write_tc=True)
            if integrator.time > times[-1]:
                self.steps += 1
                self.steps_left -= 1
                times.append(integrator.time)
                series.append(integrator.tc.copy())
        if series:
            self._keep(Arc(self.mode, self.held, np.array(times), np.array(series)))
        return result

    def _keep(self, arc: Arc) -> None:
        """Keep an arc; if a guard touches zero within it without crossing, end the run there."""
        touch = touches_without_crossing(arc, self.bound.mode(arc.mode))
        if touch is not None:
            name, time = touch
            arc = arc.until(time)
            self.outcome = Outcome(GRAZED, f"{name} missed by a hair at t = {time:.9g} s")
        self.arcs.append(arc)
        self.time = arc.end
        self.states = arc(arc.times[-1:])[0]

    def _stopped(self, result: Any, limit: float) -> Outcome:
        if result == hy.taylor_outcome.time_limit:
            if limit == self.end_time:
                mode = self.bound.mode(self.mode)
                self._settle(mode, mode.evaluate(self.states, self.held))
                return self.outcome or Outcome(COMPLETED, f"reached t = {self.time:.6g} s")
            return Outcome(
                self.section.missed,
                f"no {self._section_name} within {self.section_timeout:g} s after "
                f"{len(self.crossings)} of {self.wanted}, still in {self.mode}",
            )
        return Outcome(
            TIMED_OUT, f"{self.max_steps} steps in {self.mode} reached only t = {self.time:g} s"
        )

    def _happens(self, jump: Jump, mode: BoundMode) -> bool:
        """Let one guard fire; returns whether the flow has to start anew."""
        guard = jump.guard
        if self.time - self.instant <= SIMULTANEITY and guard.name in self.fired:
            return False  # the same root once more; the integrator now cools it down
        crossed = guard.name in self.section.guards and self._may_cross()
        if not (crossed or jump.acts):
            return False
        if guard.decide is not None and not crossed:
            return self._decide(guard, guard.decide)
        self.instant, self.fired = self.time, [guard.name]
        before = self.mode
        if guard.jumps or guard.ends is not None:
            values = mode.evaluate(self.states, self.held)
            if guard.ends is None and self._in_doubt(guard, values[jump.rate]):
                return True
            crossed = crossed or self._section_is_due(mode, values)
            self._fire(jump, values)
        if crossed:
            self._cross()
        self._note(tuple(self.fired), before)
        self._decide_more()
        return True

    def _decide(self, guard: Guard, decide: Decision, *, starting: bool = False) -> bool:
        """Let a guard fire whose jump is computed in numbers; returns whether anything happened."""
        found = decide(self.bound, self._here())
        if found is None:
            return False
        earlier = self.fired if self.time - self.instant <= SIMULTANEITY else []
        self.instant, self.fired = self.time, [*earlier, guard.name]
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
            mode = self.bound.mode(self.mode)
            self._settle(mode, mode.evaluate(self.states, self.held))
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
                self.fired.append(due)

    def _may_cross(self) -> bool:
        return all(self.held[i] == value for i, value in self.requires)

    def _section_is_due(self, mode: BoundMode, values: Array) -> bool:
        """Whether the section is crossed at the instant of another guard."""
        if not self._may_cross():
            return False
        for name in self.section.guards:
            jump = mode.code.by_name.get(name)
            if jump is None or name in self.fired:
                continue
            value, rate = values[jump.value], values[jump.rate]
            if rate < 0 and abs(value) <= -rate * SIMULTANEITY:
                self.fired.append(name)
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
            self.fired.append(jump.guard.name)

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
            if fires and name not in self.fired:
                return name
        return None

    def _rounding(self) -> float:
        """What a guard may be off by that is a difference of states."""
        return ROUNDING * float(np.abs(self.states).max())

    def _start(self) -> None:
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

    def _settle(self, mode: BoundMode, values: Array) -> None:
        """Fire what is due at the start or the end, where no root is looked for."""
        if self.time - self.instant > SIMULTANEITY:
            self.instant, self.fired = self.time, []
        due = self._due(values[mode.code.guards], mode.code.due_here)
        if due is not None:
            jump, before = mode.code.by_name[due], self.mode
            known = len(self.fired)
            self.fired.append(jump.guard.name)
            self._fire(jump, values)
            self._note(tuple(self.fired[known:]), before)

    def _note(self, names: tuple[str, ...], before: str) -> None:
        """Note an event."""
        self.events.append(Event(names, before, self._here()))
        self.firings.append(Firing(self.time, names))

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
        crowded = len(self.firings) >= CHATTER_EVENTS and (
            self.time - self.firings[-CHATTER_EVENTS].time < window
        )
        if not (grazing or crowded):
            return None
        recent = self.firings[-RECENT_EVENTS:]
        times = sum(name in f.names for f in recent if self.time - f.time < window)
        if times >= (CHATTER_EVENTS // 2 if grazing else CHATTER_EVENTS):
            return CHATTERED
        return GRAZED if grazing else None

    def _cross(self) -> None:
        """Note a point of the section."""
        self.held = self.held.copy()
        for symbol, value in self.section.resets.items():
            self.held[self.bound.system.places[symbol]] = value
        self.crossings.append(self._here())
        if self.section.act is not None:
            found = self.section.act(self.bound, self._here())
            if isinstance(found, Outcome):
                self.outcome = found
                return
            if found is not None:
                _, self.mode, self.states, self.held = found
                self.crossings[-1] = self._here()
        self.steps_left, self.limit = self.max_steps, self._limit()
        if len(self.crossings) == self.wanted:
            self.outcome = Outcome(COMPLETED, f"{self.wanted} x {self._section_name}")

    @property
    def _section_name(self) -> str:
        return " or ".join(self.section.guards)
