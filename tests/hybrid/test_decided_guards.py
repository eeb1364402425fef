"""Guards whose jumps are computed in numbers, and guards that are clocks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import compile_system
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import Outcome, OutcomeKind
from flexspine.hybrid.system import Decision, Guard, HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState, Trajectory

Y, V, COUNT, NEXT, TIME, G, E, RATE = sp.symbols("y v n next time g e rate", real=True)
NEVER = OutcomeKind("never", "no apex")
BROKEN = OutcomeKind("broken", "take a softer ball")
FALL = math.sqrt(2 / 9.81)


def bounced(bound: BoundSystem, point: HybridState) -> HybridState:
    """The ball turns round, and counts."""
    restitution = bound.parameters[1]
    states, held = point.states.copy(), point.held.copy()
    states[1] *= -restitution
    held[0] += 1
    return point._replace(states=states, held=held)


SYMBOLIC = Guard("bounce", Y, resets={V: -E * V, COUNT: COUNT + 1})
DECIDED = Guard("bounce", Y, decide=bounced)


def ball(*guards: Guard) -> HybridSystem:
    """A ball above a floor; a clock that says when to tick next."""
    flight = Mode("flight", {}, {Y: V, V: -G, TIME: sp.S.One}, guards, {"energy": V**2 / 2 + G * Y})
    return HybridSystem(
        name="ball",
        states=(Y, V, TIME),
        held=(COUNT, NEXT),
        parameters=(G, E, RATE),
        modes=("flight",),
        mode=lambda _: flight,
        section=Section(("apex",), {}, {}, {"height": Y}, NEVER),
    )


def drop(
    *guards: Guard, restitution: float = 0.8, rate: float = 0.0, height: float = 1.0, **options: Any
) -> Trajectory:
    bound = BoundSystem(compile_system(ball(*guards), 1e-15), np.array([9.81, restitution, rate]))
    start = HybridState(0.0, "flight", np.array([height, 0.0, 0.0]), np.zeros(2))
    return integrate(bound, start, **options)


@pytest.mark.parametrize("record", [False, True])
def test_a_ball_bounces_alike_by_numbers_and_by_expressions(record: bool) -> None:
    """And both as parabolas do."""
    runs = [drop(guard, end_time=3.0, record=record) for guard in (SYMBOLIC, DECIDED)]
    times = [FALL * (1 + 2 * sum(0.8**k for k in range(1, n))) for n in range(1, 8)]
    times = [time for time in times if time < 3.0]
    for run in runs:
        assert run.outcome.completed
        assert [event.time for event in run.events] == pytest.approx(times, abs=1e-13)
        assert [event.names for event in run.events] == [("bounce",)] * len(times)
        speeds = [event.after.states[1] for event in run.events]
        assert speeds == pytest.approx(
            [9.81 * FALL * 0.8**n for n in range(1, len(times) + 1)], abs=1e-13
        )
        assert run.end.held[0] == len(times)
    one, other = (run.end.states for run in runs)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-13)


def test_a_guard_that_nobody_minds_lets_the_run_go_on() -> None:
    """It falls through the floor that decides for nothing."""
    asked: list[float] = []

    def shrug(_: BoundSystem, point: HybridState) -> None:
        asked.append(point.time)

    run = drop(Guard("floor", Y, decide=shrug), end_time=1.0)
    assert run.outcome.completed
    assert not run.events
    assert asked == pytest.approx([FALL], abs=1e-13)
    assert run.end.states[0] == pytest.approx(1 - 9.81 / 2, abs=1e-13)


def test_a_decision_may_end_the_run() -> None:
    def breaks(_: BoundSystem, point: HybridState) -> HybridState | Outcome:
        return Outcome(BROKEN, f"at {-point.states[1]:.3g} m/s")

    run = drop(Guard("floor", Y, decide=breaks), end_time=3.0)
    assert run.outcome == Outcome(BROKEN, "at 4.43 m/s")
    assert run.end.time == pytest.approx(FALL, abs=1e-13)
    assert run.end.states[0] == pytest.approx(0.0, abs=1e-14)


def test_a_decision_may_lead_to_another_mode() -> None:
    """Into water, that bears the ball at its speed."""

    def sinks(_: BoundSystem, point: HybridState) -> HybridState:
        return point._replace(mode="water")

    modes = {
        "air": Mode("air", {}, {Y: V, V: -G}, (Guard("splash", Y, decide=sinks),)),
        "water": Mode("water", {}, {Y: V, V: sp.S.Zero}, ()),
    }
    section = Section(("none",), {}, {}, {}, NEVER)
    system = HybridSystem(
        "pool", (Y, V), (COUNT,), (G,), tuple(modes), modes.__getitem__, section
    )  # fmt: skip
    bound = BoundSystem(compile_system(system, 1e-15), np.array([9.81]))
    start = HybridState(0.0, "air", np.array([1.0, 0.0]), np.zeros(1))
    run = integrate(bound, start, end_time=1.0)
    assert run.modes == ("air", "water")
    speed = -9.81 * FALL
    assert run.end.states == pytest.approx([speed * (1 - FALL), speed], abs=1e-13)


def ticked(bound: BoundSystem, point: HybridState) -> HybridState:
    """The clock ticks, and is set to the next time."""
    held = point.held.copy()
    held[0] += 1
    held[1] = held[0] / bound.parameters[2]
    return point._replace(held=held)


def tick(timed: bool) -> Guard:
    return Guard("tick", NEXT - TIME, decide=ticked, timed=timed)


@pytest.mark.parametrize("record", [False, True])
def test_a_clock_may_tick_a_thousand_times_a_second(record: bool) -> None:
    run = drop(tick(True), rate=1000.0, end_time=0.9995, record=record, height=100.0)
    assert run.outcome.completed
    times = [event.time for event in run.events]
    steps = np.diff(times)
    assert steps == pytest.approx([1e-3] * len(steps), abs=1e-13)
    assert run.end.held[0] == len(times)
    assert len(times) >= 999
    assert run.end.states[0] == pytest.approx(100 - 9.81 * 0.9995**2 / 2, abs=1e-11)


def test_what_ticks_so_often_and_is_no_clock_is_chatter() -> None:
    run = drop(tick(False), rate=1000.0, end_time=0.9995, height=100.0)
    assert run.outcome.name == "chattered"
    assert "tick" in run.outcome.message
    assert run.end.time < 0.05


@pytest.mark.parametrize("timed", [False, True])
def test_a_clock_may_be_crossed_slowly(timed: bool) -> None:
    """At 1e-6 per second, which of any other guard of expressions would be grazing."""
    slow = Guard("slow", sp.Float(0.3e-6) - sp.Float(1e-6) * TIME, resets={COUNT: COUNT + 1})
    run = drop(replace(slow, timed=timed), end_time=0.4)
    assert run.outcome.name == ("completed" if timed else "grazed")
    assert run.end.time == pytest.approx(0.4 if timed else 0.3, abs=1e-9)
    if timed:
        assert run.end.held[0] == 1


def counted(place: int) -> Decision:
    def count(_: BoundSystem, point: HybridState) -> HybridState:
        held = point.held.copy()
        held[place] += 1
        return point._replace(held=held)

    return count


@pytest.mark.parametrize("decided_first", [False, True])
@pytest.mark.parametrize("record", [False, True])
def test_a_decided_guard_and_a_plain_one_at_one_instant_both_fire_once(
    decided_first: bool, record: bool
) -> None:
    decided = Guard("decided", Y, decide=counted(0))
    plain = Guard("plain", 2 * Y, resets={NEXT: NEXT + 1})
    guards = (decided, plain) if decided_first else (plain, decided)
    run = drop(*guards, end_time=1.0, record=record)
    assert run.outcome.completed
    assert run.end.held.tolist() == [1.0, 1.0]
    names = [name for event in run.events for name in event.names]
    assert sorted(names) == ["decided", "plain"]
    assert [event.time for event in run.events] == pytest.approx(
        [FALL] * len(run.events), abs=1e-12
    )
    assert run.end.states[0] == pytest.approx(1 - 9.81 / 2, abs=1e-13)


def struck(_: BoundSystem, point: HybridState) -> HybridState:
    """Something hits the ball upwards, at 1 m/s more, once and for all."""
    states = point.states.copy()
    states[1] += 1.0
    return point._replace(states=states)


def both(rate: float, number: int, order: int) -> Trajectory:
    """A ball that is struck at the instant of a tick."""
    strike = Guard("strike", sp.Float(number / rate) - TIME, decide=struck, timed=True)
    guards = (strike, tick(True))[::order]
    return drop(*guards, rate=rate, end_time=0.0999, height=100.0)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("rate", [100.0, 300.0, 400.0, 777.0])
def test_what_strikes_at_the_tick_of_a_clock_strikes_no_more_than_once(
    rate: float, order: int
) -> None:
    for number in range(1, 9):
        run = both(rate, number, order)
        strikes = sum("strike" in event.names for event in run.events)
        assert strikes <= 1
        assert run.end.states[1] == pytest.approx(strikes - 9.81 * 0.0999, abs=1e-12)


@pytest.mark.parametrize("order", [1, -1])
def test_what_strikes_at_the_tick_of_a_clock_does_not_stop_it(order: int) -> None:
    """Rounding may put either first."""
    for rate in (100.0, 300.0, 400.0, 777.0):
        for number in range(1, 9):
            run = both(rate, number, order)
            assert sum("strike" in event.names for event in run.events) == 1
            assert sum("tick" in event.names for event in run.events) == int(0.0999 * rate) + 1


def test_a_run_may_end_at_the_instant_of_a_decision() -> None:
    """By a guard that stands behind others that are decided."""
    other = Guard("other", Y + 5, decide=counted(0))
    guards = (other, Guard("decided", Y, decide=counted(0)), Guard("edge", 3 * Y, ends=BROKEN))
    run = drop(*guards, end_time=1.0)
    assert run.outcome.name == "broken"
    assert run.end.time == pytest.approx(FALL, abs=1e-12)
    assert run.end.states == pytest.approx([0.0, -9.81 * FALL, FALL], abs=1e-12)


def test_a_ball_that_bounces_in_numbers_chatters_too() -> None:
    """Zeno, at the sum of a geometric series."""
    run = drop(DECIDED, restitution=0.5, end_time=10.0)
    assert run.outcome.name == "chattered"
    assert run.end.time == pytest.approx(FALL * 3, abs=0.02)
    assert run.end.time <= FALL * 3


@pytest.mark.parametrize("record", [False, True])
@pytest.mark.parametrize("guard", [SYMBOLIC, DECIDED], ids=["expressions", "numbers"])
def test_no_ball_falls_through_the_floor(guard: Guard, record: bool) -> None:
    """Whichever side of zero rounding leaves it on, from bounces of 1 m to those of 1 nm."""
    rng = np.random.default_rng(0)
    for height, restitution in zip(rng.uniform(0.5, 2, 60), rng.uniform(0.3, 0.7, 60), strict=True):
        run = drop(guard, height=height, restitution=restitution, end_time=10.0, record=record)
        assert run.outcome.name == "chattered"
        rest = math.sqrt(2 * height / 9.81) * (1 + restitution) / (1 - restitution)
        assert rest - 0.02 < run.end.time <= rest


@pytest.mark.parametrize("record", [False, True])
@pytest.mark.parametrize("speed", [1e-3, 0.3, 1.75, 20.0])
def test_what_leaves_a_guard_from_exactly_zero_comes_back_to_it(speed: float, record: bool) -> None:
    bound = BoundSystem(compile_system(ball(SYMBOLIC), 1e-15), np.array([9.81, 0.5, 0.0]))
    start = HybridState(0.0, "flight", np.array([0.0, speed, 0.0]), np.zeros(2))
    back = 2 * speed / 9.81
    run = integrate(bound, start, end_time=1.2 * back, record=record)
    assert [event.time for event in run.events] == pytest.approx([back], rel=1e-12)
    if record:
        times = np.linspace(0, back, 50)
        (first, *_) = run.arcs
        expected = speed * times - 9.81 * times**2 / 2
        assert first(times)[:, 0] == pytest.approx(expected, abs=1e-14 * max(1.0, speed))
