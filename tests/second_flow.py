"""Integration from event to event for the second implementation: SciPy's DOP853, own event finding.

Nothing here comes from the package under test.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

State = NDArray[np.float64]
Gauge = Callable[[State], float]
Field = Callable[[State], State]

SAME_TIME = 1e-12  # s; guards closer together than this are one event
MAX_STEP = 0.01  # s
GAUSS = np.polynomial.legendre.leggauss(8)  # the error of the dense output is greater
DIFFERENCE = 1e-6  # s; half-width of the central difference along the flow


@dataclass(frozen=True)
class Guard:
    """Fires when `value` falls through zero, having been positive before."""

    name: str
    value: Gauge


def slope(gauge: Gauge, s: State, ds: State) -> float:
    """Rate of a gauge along the flow, by a central difference."""
    step = DIFFERENCE * ds
    return (gauge(s + step) - gauge(s - step)) / (2.0 * DIFFERENCE)


class Flow:
    """One integration from a state over a span, with its nodes and dense output."""

    def __init__(self, field: Field, s: State, span: float, rtol: float, atol: float) -> None:
        self.field, self.rtol, self.atol = field, rtol, atol
        run: Any = solve_ivp(
            lambda _, state: field(state),
            (0.0, span),
            s,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            max_step=MAX_STEP,
            dense_output=True,
        )
        self.success: bool = run.success
        self.times: list[float] = run.t.tolist()
        self.states: list[State] = list(run.y.T)
        self.dense: Callable[[float], State] = run.sol
        self._rates: dict[int, State] = {}

    def rates(self, k: int) -> State:
        """The field at node k."""
        if k not in self._rates:
            self._rates[k] = self.field(self.states[k])
        return self._rates[k]

    def turning_point(self, gauge: Gauge, left: float, right: float) -> tuple[float, float]:
        """Time and value of a gauge's extremum between two times with slopes of unlike sign."""

        def steepness(t: float) -> float:
            s = self.dense(t)
            return slope(gauge, s, self.field(s))

        if steepness(left) * steepness(right) >= 0.0:  # one of them is zero to rounding
            return left, gauge(self.dense(left))
        t = float(brentq(steepness, left, right, xtol=1e-12))
        return t, gauge(self.dense(t))

    def root(self, gauge: Gauge, left: float, right: float) -> float:
        """Zero of a gauge on the dense output, where it falls between two times."""

        def value(t: float) -> float:
            return gauge(self.dense(t))

        if value(left) <= 0.0:
            return left
        if value(right) >= 0.0:
            return right
        return float(brentq(value, left, right, xtol=1e-14))

    def integral(self, gauge: Gauge, k: int, end: float) -> tuple[float, float]:
        """Integrals of a gauge's positive part, and of all of it, over k steps and on to a time.

        Gauss's formula on the dense output of each step; a step in which the sign changes between
        its ends is cut there.
        """

        def value(t: float) -> float:
            return gauge(self.dense(t))

        positive = whole = 0.0
        times = [*self.times[: k + 1], end]
        for left, right in pairwise(times):
            cuts = [left, right]
            if value(left) * value(right) < 0.0:
                cuts.insert(1, float(brentq(value, left, right, xtol=1e-14)))
            for a, b in pairwise(cuts):
                middle, half = (a + b) / 2.0, (b - a) / 2.0
                parts = [w * value(middle + half * x) for x, w in zip(*GAUSS, strict=True)]
                area = half * sum(parts)
                whole += area
                positive += max(area, 0.0)
        return positive, whole

    def polish(self, gauge: Gauge, k: int, guess: float) -> tuple[float, State]:
        """Zero of a gauge after node k by Newton steps on newly integrated states."""
        left, right = self.times[k], self.times[k + 1]
        t, s = left, self.states[k]
        move = guess - left
        for _ in range(10):
            s = self.shift(s, move)
            t += move
            ds = self.field(s)
            rate = slope(gauge, s, ds)
            if rate >= 0.0:  # grazing: keep what the dense output says
                break
            move = min(max(t - gauge(s) / rate, left), right) - t
            if abs(move) < 1e-14:
                s, t = s + move * ds, t + move
                break
        return t, s

    def shift(self, s: State, span: float) -> State:
        """Carry a state along the flow by a (possibly tiny or negative) time."""
        if abs(span) < 1e-10:
            return s + span * self.field(s)
        return Flow(self.field, s, span, self.rtol, self.atol).states[-1]


def is_above(gauge: Gauge, s: State, ds: State) -> bool:
    """Whether a gauge is positive; on zero, whether it is about to be."""
    value, rate = gauge(s), slope(gauge, s, ds)
    return rate > 0.0 if abs(value) <= SAME_TIME * abs(rate) else value > 0.0


def brackets(flow: Flow, guard: Guard, k: int, above: bool) -> Iterator[tuple[float, float]]:
    """Intervals between nodes k and k + 1 in which a guard falls through zero."""
    left, right = flow.times[k], flow.times[k + 1]
    s0, s1 = flow.states[k], flow.states[k + 1]
    below = guard.value(s1) <= 0.0
    if above and below:
        yield left, right
        return
    if above == below:  # it rises through zero: no event
        return
    # Same side at both nodes: look at an extremum on the way, lest two crossings be missed.
    rate0 = slope(guard.value, s0, flow.rates(k))
    rate1 = slope(guard.value, s1, flow.rates(k + 1))
    if above and rate0 < 0.0 < rate1:
        turn, value = flow.turning_point(guard.value, left, right)
        if value <= 0.0:
            yield left, turn
    elif not above and rate0 > 0.0 > rate1:
        turn, value = flow.turning_point(guard.value, left, right)
        if value > 0.0:
            yield turn, right


def first_event(
    flow: Flow, guards: list[Guard], above: list[bool]
) -> tuple[int, float, State, set[str]] | None:
    """Node before the first event, its time and state and the names of the guards that fire.

    `above` says which guards are positive at the first node; it is updated to the last.
    """
    for k in range(len(flow.times) - 1):
        found: dict[int, tuple[float, State]] = {}
        for i, guard in enumerate(guards):
            for bracket in brackets(flow, guard, k, above[i]):
                found[i] = flow.polish(guard.value, k, flow.root(guard.value, *bracket))
        if found:
            t, s = min(found.values(), key=lambda event: event[0])
            ds = flow.field(s)
            fired = set()
            for i, guard in enumerate(guards):
                if i in found:
                    wait = found[i][0] - t
                elif above[i] and (rate := slope(guard.value, s, ds)) < 0.0:
                    wait = -guard.value(s) / rate
                else:
                    continue
                if wait <= SAME_TIME:
                    fired.add(guard.name)
            return k, t, s, fired
        above[:] = [guard.value(flow.states[k + 1]) > 0.0 for guard in guards]
    return None


def highest(flow: Flow, gauge: Gauge, k: int, t: float, s: State) -> float:
    """Largest value of a gauge along a flow, over its nodes up to k and on to state s at time t."""
    times = [*flow.times[: k + 1], t]
    states = [*flow.states[: k + 1], s]
    fields = [*(flow.rates(node) for node in range(k + 1)), flow.field(s)]
    rates = [slope(gauge, *at) for at in zip(states, fields, strict=True)]
    best = max(gauge(state) for state in states)
    for i in range(len(times) - 1):
        if rates[i] > 0.0 > rates[i + 1]:
            best = max(best, flow.turning_point(gauge, times[i], times[i + 1])[1])
    return best
