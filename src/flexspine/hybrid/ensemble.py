"""Many runs of a hybrid system at once, in SIMD lanes; nothing is kept but how each ended.

A pool of runs is advanced mode by mode: all that are in one mode take a step together, events are
located within the steps, and a run that has ended makes room for the next. What is out of the
ordinary is done by `integrate`, alone, up to the next crossing of the section.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import heyoka as hy
import numpy as np

from flexspine.hybrid.batch import NONE, Ends, Starts
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array
from flexspine.hybrid.crowds import Crowds
from flexspine.hybrid.events import CLOSE, SIMULTANEITY, Firing
from flexspine.hybrid.integrate import MAX_STEPS, SECTION_TIMEOUT, integrate
from flexspine.hybrid.lanes import LaneMode, LaneSystem
from flexspine.hybrid.outcome import COMPLETED, OutcomeKind
from flexspine.hybrid.step_events import NOTHING, Flags, Indices, Outlook
from flexspine.hybrid.system import Arming
from flexspine.hybrid.trajectory import Arc, HybridState, Trajectory

# Runs in progress at a time: enough that a call from Python costs little a run, few enough that
# their Taylor series stay in the caches.
POOL = 4096

# s; a step halved to this because a guard turns in it will not become clear.
SHORTEST = 1e-6

# A mode waits until it holds this share of the runs in progress, or more than any other.
WORTHWHILE = 1 / 16

# Rounds between looks at runs that get nowhere.
CHECK_ROUNDS = 16


def run_many(lanes: LaneSystem, starts: Starts, crossings: int, *, pool: int = POOL) -> Ends:
    """Run all until the section was crossed ``crossings`` times, or they end otherwise."""
    with _one_thread():
        return _Pool(lanes, starts, crossings, min(pool, len(starts))).run()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Keep heyoka from spreading calls over threads, which for calls this short wait for work."""
    threads = hy.get_nthreads()
    hy.set_nthreads(1)
    try:
        yield
    finally:
        hy.set_nthreads(threads)


class _Pool:
    """The runs in progress, one column each, and the results so far."""

    def __init__(self, lanes: LaneSystem, starts: Starts, wanted: int, size: int) -> None:
        system = lanes.system
        self.lanes, self.system, self.starts, self.wanted = lanes, system, starts, wanted
        self.names = {name: number for number, name in enumerate(system.modes)}
        n, m, p = len(system.states), len(system.held), len(system.parameters)
        self.n_held = m
        # In progress. Numbers are the held variables and then the parameters.
        self.states, self.numbers = np.zeros((n, size)), np.zeros((m + p, size))
        self.coefficients: dict[str, Array] = {}
        # Most ensembles differ in their starts only; then there is less to gather.
        self.shared = bool((starts.parameters == starts.parameters[:, :1]).all())
        self.mode, self.run_of = np.full(size, NONE), np.zeros(size, dtype=int)
        self.time, self.since, self.longest = (np.zeros(size) for _ in range(3))
        self.round_of = np.zeros(size, dtype=int)
        self.crowds = Crowds(size, system.chatter_window)
        self.soon = np.zeros(size, dtype=bool)  # an event is to be expected in the next step
        self.requires = [(system.places[s], v) for s, v in system.section.requires.items()]
        self.resets = [(system.places[s], v) for s, v in system.section.resets.items()]
        self.started, self.round = 0, 0
        self.ends = Ends.none_yet(starts, len(system.tracked))

    def run(self) -> Ends:
        while True:
            if self.started < len(self.starts):
                self._fill(np.flatnonzero(self.mode == NONE))
            counts = np.bincount(self.mode[self.mode != NONE], minlength=len(self.names))
            if not counts.any():
                break
            enough = min(counts.max(), WORTHWHILE * counts.sum())
            for name, number in self.names.items():
                if counts[number] >= enough:
                    self._advance(self.lanes.mode(name), np.flatnonzero(self.mode == number))
            self.round += 1
            if self.round % CHECK_ROUNDS == 0:
                self._look_after()
        return self.ends

    def _fill(self, free: Indices) -> None:
        """Start runs in free slots."""
        starts = self.starts
        runs = np.arange(self.started, min(self.started + len(free), len(starts)))
        if not len(runs):
            return
        self.started += len(runs)
        slots = free[: len(runs)]
        self.states[:, slots] = starts.states[:, runs]
        self.numbers[: self.n_held, slots] = starts.held[:, runs]
        self.numbers[self.n_held :, slots] = starts.parameters[:, runs]
        self.run_of[slots], self.mode[slots] = runs, self.names[starts.mode]
        for kept in (self.time, self.since, self.soon):
            kept[slots] = 0
        self.longest[slots], self.round_of[slots] = np.inf, self.round
        self.crowds.forget(slots)
        for name, coefficients in self.coefficients.items():
            if self.shared:
                break
            mode = self.lanes.mode(name)
            coefficients[slots] = mode.coefficients(starts.parameters.take(runs, axis=1))
        mode = self.lanes.mode(starts.mode)
        states, numbers = self.states.take(slots, axis=1), self.numbers.take(slots, axis=1)
        self._raise(mode, slots, mode.events.first(states, numbers))
        self._alone(slots[self._close_to_guards(mode, states, numbers)])

    def _close_to_guards(self, mode: LaneMode, states: Array, numbers: Array) -> Flags:
        """Where a start is so close to a guard that what is due there has to be looked at."""
        values = mode.code.kernel(states, pars=numbers[: mode.code.n_inputs])
        close = np.zeros(len(states.T), dtype=bool)
        for jump in mode.code.jumps:
            if jump.acts:
                value = values[jump.value]
                by_level = jump.guard.arming is Arming.LEVEL
                close |= ~(value > CLOSE) & (by_level | ~(value < -CLOSE))
        return close

    def _numbers(self, lanes: Indices) -> Array:
        """Held variables and parameters of some slots."""
        if not self.shared:
            return self.numbers.take(lanes, axis=1)
        numbers = np.empty((len(self.numbers), len(lanes)))
        numbers[: self.n_held] = self.numbers[: self.n_held].take(lanes, axis=1)
        numbers[self.n_held :] = self.numbers[self.n_held :, :1]
        return numbers

    def _folded(self, mode: LaneMode, lanes: Indices) -> Array:
        """The coefficients of a mode's flow for some slots, or one row if all have the same."""
        if mode.name not in self.coefficients:
            parameters = self.numbers[self.n_held :, : 1 if self.shared else None]
            self.coefficients[mode.name] = mode.coefficients(parameters)
        known = self.coefficients[mode.name]
        return known if self.shared else known.take(lanes, axis=0)

    def _advance(self, mode: LaneMode, slots: Indices) -> None:
        """Let the runs in some slots, all in one mode, take a step up to their next event."""
        soon = self.soon[slots]
        first, others = _padded(slots[soon], mode), _padded(slots[~soon], mode)
        lanes, kept = np.concatenate([first, others]), len(first)
        n = len(self.states)
        steps, numbers = np.empty((2 * n + 1, len(lanes))), self._numbers(lanes)
        self.states.take(lanes, axis=1, out=steps[:n], mode="clip")
        left = self.since[lanes] + SECTION_TIMEOUT - self.time[lanes]
        longest = np.minimum(self.longest[lanes], np.maximum(left, 0.0))
        folded = self._folded(mode, lanes)
        series = mode.flow(steps, numbers, folded, longest, kept)
        found = mode.events.screen(steps, numbers)
        lived = steps[-1]
        lost, doubtful = found.lost != 0, found.doubt != 0
        happens = (found.guard != NOTHING) | (found.top != 0)
        self.soon[lanes], self.longest[lanes] = found.soon != 0, np.inf
        # Lanes that only fill up repeat another one, whose slot is written twice with the same.
        plain = np.flatnonzero(~(happens | doubtful | lost))
        self.states[:, lanes[plain]] = steps[n : 2 * n].take(plain, axis=1)
        self.time[lanes[plain]] += lived[plain]

        doubted = np.flatnonzero(doubtful)
        self.longest[lanes[doubted]] = lived[doubted] / 2
        odd = [lanes[lost], lanes[doubted[lived[doubted] < 2 * SHORTEST]]]
        known, unforeseen = np.arange(kept), kept + np.flatnonzero(happens[kept:] & ~lost[kept:])
        for few in (known, _padded(unforeseen, mode)):
            if not len(few):
                continue
            given, guard, whole = numbers.take(few, axis=1), found.guard[few], lived[few]
            if few is not known:
                own = self._folded(mode, lanes[few])
                series = mode.flow(steps.take(few, axis=1), given, own, whole, len(few))
            series[-2] = np.where(guard == NOTHING, whole, found.share[few] * whole)
            series[-1] = guard
            seen = mode.events.look(series, given)
            looked = happens[few] & ~(doubtful | lost)[few]
            odd.append(lanes[few[looked & (seen.odd != 0)]])
            clear = np.flatnonzero(looked & (seen.odd == 0))
            self._land(mode, lanes[few[clear]], guard[clear], seen.take(clear))
        self._alone(np.unique(np.concatenate(odd)))

    def _land(self, mode: LaneMode, slots: Indices, guard: Array, seen: Outlook) -> None:
        """Let runs arrive where an event or the largest value of something was in their step."""
        self.states[:, slots] = seen.states
        self.numbers[: self.n_held, slots] = seen.held
        self.time[slots] += seen.time
        self._raise(mode, slots, seen.largest)
        fired = guard != NOTHING
        self.soon[slots[fired]] = False
        self._happen(mode, slots[fired], guard[fired])

    def _raise(self, mode: LaneMode, slots: Indices, tops: Array) -> None:
        """Keep the largest values so far."""
        runs = self.run_of[slots]
        for row, which in enumerate(mode.events.tracked):
            best = self.ends.largest[which]
            best[runs] = np.maximum(best[runs], tops[row])

    def _happen(self, mode: LaneMode, slots: Indices, guards: Array) -> None:
        """Note what the events of a step lead to."""
        crowded = self.crowds.note(mode.code, slots, guards, self.time[slots])
        for row, jump in enumerate(mode.code.jumps):
            here = slots[guards == row]
            if not len(here):
                continue
            self.mode[here] = self.names[jump.target]
            if jump.guard.name in self.system.section.guards:
                self._cross(here)
            if jump.guard.ends is not None:
                self._end(here, jump.guard.ends)
        if crowded.any():
            self._alone(slots[crowded & (self.mode[slots] != NONE)])

    def _cross(self, slots: Indices) -> None:
        """Count a crossing of the section."""
        for place, value in self.resets:
            self.numbers[place, slots] = value
        runs = self.run_of[slots]
        ends = self.ends
        ends.crossings[runs] += 1
        ends.section_time[runs] = self.since[slots] = self.time[slots]
        ends.section_states[:, runs] = self.states[:, slots]
        self.round_of[slots] = self.round
        self._end(slots[ends.crossings[runs] == self.wanted], COMPLETED)

    def _end(self, slots: Indices, outcome: OutcomeKind) -> None:
        """Note how runs ended, and free their slots."""
        ends, runs = self.ends, self.run_of[slots]
        if outcome not in ends.outcomes:
            ends.outcomes.append(outcome)
        ends.kinds[runs] = ends.outcomes.index(outcome)
        ends.time[runs] = self.time[slots]
        ends.states[:, runs] = self.states[:, slots]
        self.mode[slots] = NONE

    def _look_after(self) -> None:
        """End what stays away from the section, and look closer at what gets nowhere."""
        running = self.mode != NONE
        late = running & (self.time - self.since > SECTION_TIMEOUT - SIMULTANEITY)
        self._end(np.flatnonzero(late), self.system.section.missed)
        slow = self.round - self.round_of > MAX_STEPS
        self._alone(np.flatnonzero(running & ~late & slow))

    def _alone(self, slots: Indices) -> None:
        """Do by itself, up to the next crossing, what is out of the ordinary."""
        names = list(self.names)
        for slot in slots.tolist():
            self.ends.alone += 1
            bound = BoundSystem(self.lanes.compiled, self.numbers[self.n_held :, slot].copy())
            start = HybridState(
                float(self.time[slot]),
                names[self.mode[slot]],
                self.states[:, slot].copy(),
                self.numbers[: self.n_held, slot].copy(),
            )
            left = SECTION_TIMEOUT - (start.time - float(self.since[slot]))
            done = integrate(
                bound,
                start,
                crossings=1,
                section_timeout=left,
                record=True,
                before=self.crowds.of(slot),
            )
            self.crowds.go_on(slot, [Firing(event.time, event.names) for event in done.events])
            one = np.array([slot])
            for arc in done.arcs:
                mode = self.lanes.mode(arc.mode)
                self._raise(mode, one, _largest(mode, done, arc))
            self.time[slot], self.states[:, slot] = done.end.time, done.end.states
            self.numbers[: self.n_held, slot] = done.end.held
            self.mode[slot], self.longest[slot] = self.names[done.end.mode], np.inf
            self.soon[slot] = False
            if done.outcome.completed:
                self._cross(one)
            else:
                self._end(one, done.outcome.kind)


def _padded(lanes: Indices, mode: LaneMode) -> Indices:
    """Lanes, the last one repeated until they fill the mode's integrators."""
    return np.concatenate([lanes, np.repeat(lanes[-1:], -len(lanes) % mode.width)])


def _largest(mode: LaneMode, done: Trajectory, arc: Arc) -> Array:
    """The largest tracked values in a recorded arc, shape (tracked, 1)."""
    numbers = np.concatenate([arc.held, done.bound.parameters])
    count, n, order = arc.series.shape
    series = np.empty((n * order + 2, count))
    series[:-2] = arc.series.reshape(count, -1).T
    series[-2], series[-1] = np.diff(arc.times), NOTHING
    seen = mode.events.look(series, np.repeat(numbers[:, None], count, axis=1))
    largest: Array = seen.largest.max(axis=1, keepdims=True)
    return largest
