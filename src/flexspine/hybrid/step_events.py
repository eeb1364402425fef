"""Events and largest values within the steps of many lanes, after the steps were taken.

The same rules as for one run hold here. What is out of the ordinary (a grazing guard, two at one
instant, a guard that turns and may have touched zero) is only recognised: it is left to others.
All of it is compiled, without branches, so that lanes stay together.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from flexspine.hybrid.branchless import cubic_root, horner, larger, negated
from flexspine.hybrid.compile import (
    Array,
    CompiledMode,
    CompiledSystem,
    Jump,
    compile_expressions,
)
from flexspine.hybrid.events import GRAZING_RATE, SIMULTANEITY, ZERO
from flexspine.hybrid.grazing import GRAZING_DEPTH
from flexspine.hybrid.system import Guard, Mode

Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]

# s; Newton's iteration for an event ends here, well within what counts as one instant.
LOCATED = SIMULTANEITY / 10

# Newton's iterations for an event, from a guess that is good to some 1e-6 s; what takes more is
# out of the ordinary.
ITERATIONS = 3

# In place of a guard's position.
NOTHING = -1.0


class Screening(NamedTuple):
    """What there may be in a step of each of k lanes.

    ``guard`` (k,) fires first, at about ``share`` of the step, or is NOTHING. ``lost`` is not 0
    where the step left all numbers, nor ``doubt`` where a guard turns and may have touched zero,
    nor ``top`` where something tracked is largest within the step, nor ``soon`` where either seems
    to be ahead in the next step.
    """

    guard: Array
    share: Array
    lost: Array
    doubt: Array
    top: Array
    soon: Array


class Outlook(NamedTuple):
    """What comes of a step of each of k lanes.

    ``time`` (k,) since the step's beginning in s, of the event or the step's end; states (n, k)
    and held variables (m, k) after it; ``odd`` is not 0 where the rules for one guard do not
    decide what follows; ``largest`` (t, k) of what is tracked, up to then.
    """

    time: Array
    states: Array
    held: Array
    odd: Array
    largest: Array

    def take(self, lanes: Indices) -> Outlook:
        """The same for some of the lanes."""
        return Outlook(*(part.take(lanes, axis=-1) for part in self))


class StepEvents:
    """What happens within steps in one mode.

    ``numbers`` are the held variables and then the parameters, shape (m + p, k). ``tracked`` are
    the positions, among all that the system tracks, of what is not always zero in this mode or
    when it is left.
    """

    def __init__(self, compiled: CompiledSystem, code: CompiledMode, order: int) -> None:
        system, mode = compiled.system, code.mode
        self.code, self._n, self._m = code, len(system.states), len(system.held)
        observed = [mode.observables[what] for what in system.tracked]
        self._changed = [_changed(compiled, mode, guard) for guard in mode.guards]
        lasting = {i for i, expression in enumerate(observed) if expression != 0}
        self.tracked = sorted(lasting.union(*self._changed))
        expressions = [guard.expression for guard in mode.guards]
        expressions += [observed[i] for i in self.tracked]
        values, self._states = compiled.with_rates(mode, expressions)
        self._guards = values[: 2 * len(mode.guards)]
        self._tracked = values[2 * len(mode.guards) :]
        section = system.section
        # The guards to look for, and what held variables have to be for a mere marker.
        self._wanted = {
            row: [] if jump.acts else [(system.places[s], v) for s, v in section.requires.items()]
            for row, jump in enumerate(code.jumps)
            if jump.acts or jump.guard.name in section.guards
        }
        self._screen = self._compile_screen()
        self._look = self._compile_look(compiled, order)

    def screen(self, steps: Array, numbers: Array) -> Screening:
        """Look for what happens in ``steps`` (2 n + 1, k): states at both ends, lengths in s."""
        return Screening(*self._screen(steps, pars=numbers[: self._screen.nparams]))

    def look(self, series: Array, numbers: Array) -> Outlook:
        """Follow steps to their events or ends.

        ``series`` (n (order + 1) + 2, k) are the Taylor coefficients of one state after the other,
        the time in s (of an event roughly) and the guard that fires, or NOTHING.
        """
        answer = self._look(series, pars=numbers[: self._look.nparams])
        n, m = self._n, self._m
        parts = answer[0], answer[1 : n + 1], answer[n + 1 : n + m + 1]
        return Outlook(*parts, answer[n + m + 1], answer[n + m + 2 :])

    def _at(self, what: list[Any], states: list[Any]) -> list[Any]:
        """Expressions of the states, at other ones."""
        return list(hy.subs(what, dict(zip(self._states, states, strict=True)))) if what else []

    def _compile_screen(self) -> Any:
        end = [hy.expression(f"e{i}") for i in range(len(self._states))]
        length = hy.expression("length")
        later = self._at(self._guards, end)
        which, falling = hy.expression(0.0), hy.expression(0.0)
        values = [hy.expression(0.0)] * 4
        doubt, top, soon = (hy.expression(0.0) for _ in range(3))
        for row, requires in self._wanted.items():
            g0, r0 = self._guards[2 * row : 2 * row + 2]
            g1, r1 = later[2 * row : 2 * row + 2]
            armed, above = _armed(g0, r0, requires), hy.gt(g1, _margin(r1, 0.0))
            falls = hy.logical_and([armed, negated(above)])
            falling += falls
            which = hy.select(falls, hy.expression(float(row)), which)
            own = (g0, r0 * length, g1, r1 * length)
            values = [hy.select(falls, v, w) for v, w in zip(own, values, strict=True)]
            ahead = g1 + r1 * length + (r1 - r0) * length / 2.0
            soon += hy.logical_and([above, hy.lt(ahead, 0.0), *_held(requires)])
            # A guard that turns once is bounded by its tangents at both ends.
            left, right = g0 + r0 * length, g1 - r1 * length
            depth = GRAZING_DEPTH if self.code.jumps[row].guard.jumps else 0.0
            dips = [armed, above, hy.lt(r0, 0.0)]
            turned = [hy.gt(r1, 0.0), hy.lte(left, depth), hy.lte(right, depth)]
            doubt += hy.logical_and([*dips, *turned])
            # A step ends before it comes so close, so that the next one sees it turn.
            doubt += hy.logical_and([*dips, hy.lte(r1, 0.0), hy.lte(g1, depth)])
            if not requires:
                humps = [negated(armed), negated(above), hy.gt(r0, 0.0), hy.lt(r1, 0.0)]
                doubt += hy.logical_and([*humps, hy.gte(left, 0.0), hy.gte(right, 0.0)])
        rates = self._tracked[1::2]
        for before, after in zip(rates, self._at(rates, end), strict=True):
            top += hy.logical_and([hy.gt(before, 0.0), hy.lt(after, 0.0)])
            soon += hy.logical_and([hy.gt(after, 0.0), hy.lt(2.0 * after - before, 0.0)])
        guard = hy.select(hy.gt(falling, 0.0), which, hy.expression(NOTHING))
        # Which of several falls first is seen in shorter steps.
        doubt += hy.gt(falling, 1.0)
        size = hy.sum([state**2.0 for state in end]) + length
        lost = negated(hy.lt(size, np.inf))
        answer = [guard, cubic_root(*values), lost, doubt, top, soon]
        return compile_expressions(answer, [*self._states, *end, length])

    def _compile_look(self, compiled: CompiledSystem, order: int) -> Any:
        n = len(self._states)
        series = [[hy.expression(f"c{i}_{k}") for k in range(order + 1)] for i in range(n)]
        given, which = hy.expression("time"), hy.expression("which")
        time, change = given, hy.expression(0.0)
        for _ in range(ITERATIONS):
            value, rate = self._chosen(which, self._at(self._guards, horner(series, time)))
            change = value / rate
            time = time - change
        states = horner(series, time)
        begin, now = [row[0] for row in series], self._at(self._guards, states)
        odd = self._odd(which, time, change, self._at(self._guards, begin), now)
        after, further = self._jumped(compiled, which, states)
        tops = self._entering(compiled, which, states, self._tops(series, begin, time))
        return compile_expressions(
            [time, *after, odd + further, *tops],
            [*(c for row in series for c in row), given, which],
        )

    def _chosen(self, which: Any, guards: list[Any]) -> tuple[Any, Any]:
        """Value and rate of the guard at position ``which``; those of NOTHING change no time."""
        value, rate = hy.expression(0.0), hy.expression(-1.0)
        for row in self._wanted:
            here = hy.eq(which, float(row))
            value = hy.select(here, guards[2 * row], value)
            rate = hy.select(here, guards[2 * row + 1], rate)
        return value, rate

    def _odd(self, which: Any, time: Any, change: Any, before: list[Any], now: list[Any]) -> Any:
        """Whether an event is not located, grazes, or another guard fires with it or before it."""
        _, rate = self._chosen(which, now)
        odd = negated(hy.gte(time, 0.0)) + hy.gt(rate, -GRAZING_RATE)
        odd += negated(hy.lte(change**2.0, LOCATED**2))
        for row, requires in self._wanted.items():
            armed = _armed(before[2 * row], before[2 * row + 1], requires)
            due = negated(hy.gt(now[2 * row], _margin(now[2 * row + 1], 0.0)))
            odd += hy.logical_and([armed, due, hy.neq(which, float(row))])
        return odd

    def _jumped(
        self, compiled: CompiledSystem, which: Any, states: list[Any]
    ) -> tuple[list[Any], Any]:
        """States and held variables after an event, and whether a further guard is due there."""
        after, further = [*states, *(hy.par[i] for i in range(self._m))], hy.expression(0.0)
        for row, jump in enumerate(self.code.jumps):
            if not jump.guard.jumps:
                continue
            here = hy.eq(which, float(row))
            point, pairs = compiled.after(self.code.mode, jump.guard)
            moved = self._at([*point, *pairs], states)
            after = [hy.select(here, m, a) for m, a in zip(moved, after, strict=False)]
            further += hy.logical_and([here, _due(moved[len(point) :], jump)])
        return after, further

    def _tops(self, series: list[list[Any]], begin: list[Any], length: Any) -> list[Any]:
        """The largest tracked values up to a time, from the tops of cubics, corrected twice."""
        first, last = (
            self._at(self._tracked, begin),
            self._at(self._tracked, horner(series, length)),
        )
        results = []
        for i in range(0, len(first), 2):
            (f0, r0), (f1, r1) = first[i : i + 2], last[i : i + 2]
            if f0 == hy.expression(0.0):
                results.append(f0)
                continue
            rise, start, stop = f1 - f0, r0 * length, r1 * length
            middle = 6.0 * rise - 4.0 * start - 2.0 * stop
            bend = 3.0 * (start + stop) - 6.0 * rise
            root = hy.sqrt(middle**2.0 - 4.0 * bend * start)
            guess = 2.0 * start / (root - middle) * length
            curve = -root / length**2.0
            rate = self._at(self._tracked, horner(series, guess))[i + 1]
            time = guess - rate / curve
            value, left = self._at(self._tracked, horner(series, time))[i : i + 2]
            moved = time - guess
            # What is left is of second order; at a hair's breadth the cubic's curve will do.
            curve = hy.select(hy.eq(moved, 0.0), curve, (left - rate) / moved)
            highest, at_ends = value - left**2.0 / (2.0 * curve), larger(f0, f1)
            inside = hy.logical_and([hy.gt(r0, 0.0), hy.lt(r1, 0.0), hy.gt(highest, at_ends)])
            results.append(hy.select(inside, highest, at_ends))
        return results

    def _entering(
        self, compiled: CompiledSystem, which: Any, states: list[Any], tops: list[Any]
    ) -> list[Any]:
        """The largest values, with those at the beginning of the next mode, where they may jump."""
        largest = dict(zip(self.tracked, tops, strict=True))
        mode = self.code.mode
        for row, (guard, changed) in enumerate(zip(mode.guards, self._changed, strict=True)):
            here = hy.eq(which, float(row))
            values = self._at(compiled.values_after(mode, guard, changed), states)
            for i, value in zip(changed, values, strict=True):
                largest[i] = hy.select(here, larger(largest[i], value), largest[i])
        return list(largest.values())

    @cached_property
    def _first(self) -> Any:
        return compile_expressions(self._tracked[::2], self._states)

    def first(self, states: Array, numbers: Array) -> Array:
        """What is tracked, shape (t, k), at states in this mode."""
        result: Array = self._first(states, pars=numbers[: self._first.nparams])
        return result[: len(self.tracked)]


def _changed(compiled: CompiledSystem, mode: Mode, guard: Guard) -> list[int]:
    """The positions of what is tracked that is another function after a guard has fired."""
    system = compiled.system
    after = system.mode(guard.target or mode.name).observables
    pairs = [(mode.observables[what], after[what]) for what in system.tracked]
    return [i for i, (was, now) in enumerate(pairs) if now not in (was, 0)]


def _due(pairs: list[Any], jump: Jump) -> Any:
    """Whether a further guard is due right after a jump; pairs: value, rate, ... there."""
    found = hy.expression(0.0)
    for position, name, was_active, by_level in jump.due:
        if name == jump.guard.name:
            continue
        value, rate = pairs[2 * position], pairs[2 * position + 1]
        falls = hy.logical_and([hy.lt(rate, 0.0), hy.lte(value, -SIMULTANEITY * rate)])
        if by_level:
            found += falls + hy.lt(value, -ZERO)
        elif was_active:
            found += hy.logical_and([falls, hy.gte(value, SIMULTANEITY * rate)])
    return hy.gt(found, 0.0)


def _margin(rate: Any, otherwise: float) -> Any:
    """How far above zero a guard is at most that falls to it in no time."""
    return hy.select(hy.lt(rate, 0.0), -SIMULTANEITY * rate, hy.expression(otherwise))


def _armed(value: Any, rate: Any, requires: list[tuple[int, float]]) -> Any:
    """Whether a guard may fire in a step: it is above zero at its beginning, or rises from it."""
    return hy.logical_and([hy.gt(value, _margin(rate, -ZERO)), *_held(requires)])


def _held(requires: list[tuple[int, float]]) -> list[Any]:
    """Whether held variables are as required."""
    return [hy.eq(hy.par[place], wanted) for place, wanted in requires]
