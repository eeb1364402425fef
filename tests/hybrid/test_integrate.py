"""The hybrid machinery on systems that have no legs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp

from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import compile_system
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import OutcomeKind
from flexspine.hybrid.system import Arming, Guard, HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState, Trajectory

Y, V, BOUNCES, G, E = sp.symbols("y v n g e", real=True)
LOST = OutcomeKind("lost", "stay on the table")
NEVER = OutcomeKind("never", "no apex")


def ball(*extra: Guard) -> HybridSystem:
    """A ball on a floor, restitution e; its section is the apex after a bounce."""
    bounce = Guard("bounce", Y, resets={V: -E * V, BOUNCES: BOUNCES + 1})
    flight = Mode(
        "flight",
        definitions={},
        field={Y: V, V: -G},
        guards=(bounce, Guard("apex", V), *extra),
        observables={"energy": V**2 / 2 + G * Y},
    )
    return HybridSystem(
        name="ball",
        states=(Y, V),
        held=(BOUNCES,),
        parameters=(G, E),
        modes=("flight",),
        mode=lambda _: flight,
        section=Section(("apex",), {BOUNCES: 1.0}, {BOUNCES: 0.0}, {"height": Y}, NEVER),
    )


def drop(system: HybridSystem, height: float, restitution: float, **options: Any) -> Trajectory:
    bound = BoundSystem(compile_system(system, 1e-12), np.array([9.81, restitution]))
    start = HybridState(0.0, "flight", np.array([height, 0.0]), np.zeros(1))
    return integrate(bound, start, **options)


def test_a_ball_bounces_when_the_parabola_says() -> None:
    run = drop(ball(), 1.0, 1.0, crossings=3)
    fall = math.sqrt(2 / 9.81)
    times = [event.time for event in run.events]
    assert times == pytest.approx([fall * k for k in range(1, 7)], abs=1e-12)
    assert run.outcome.completed


def test_each_apex_is_lower_by_restitution_squared() -> None:
    run = drop(ball(), 1.0, 0.8, crossings=4)
    heights = [point.states[0] for point in run.crossings]
    assert heights == pytest.approx([0.64**k for k in range(1, 5)], abs=1e-12)


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.8, 0.95])
@pytest.mark.parametrize("record", [False, True])
def test_a_ball_coming_to_rest_chatters_and_ends(restitution: float, record: bool) -> None:
    """Zeno: infinitely many bounces in finite time, at the sum of a geometric series."""
    run = drop(ball(), 1.0, restitution, end_time=100.0, record=record)
    assert run.outcome.name == "chattered"
    rest = math.sqrt(2 / 9.81) * (1 + restitution) / (1 - restitution)
    assert run.end.time == pytest.approx(rest, abs=0.02)
    assert run.end.time <= rest


def test_a_run_away_from_its_section_ends_as_missed() -> None:
    run = drop(ball(), 100.0, 0.5, crossings=1, section_timeout=2.0)
    assert run.outcome.name == "never"
    assert run.end.time == pytest.approx(2.0)


def test_a_run_to_an_end_time_stops_there() -> None:
    run = drop(ball(), 1.0, 1.0, end_time=0.3)
    assert run.outcome.completed
    assert run.end.time == 0.3
    assert run.end.states[0] == pytest.approx(1 - 9.81 * 0.09 / 2, abs=1e-14)


@pytest.mark.parametrize("record", [False, True])
def test_a_spent_step_budget_is_an_outcome(record: bool) -> None:
    run = drop(ball(), 1.0, 1.0, end_time=1e4, max_steps=1, record=record)
    assert run.outcome.name == "timed_out"
    assert run.steps == 1


def test_two_guards_at_once_are_one_event() -> None:
    run = two_floors(gap=0.0)
    assert [event.names for event in run.events[:1]] == [("first", "second")]
    assert run.events[0].after.held.tolist() == [1.0, 1.0]
    assert run.modes == ("none", "both")


def test_two_guards_apart_are_two_events() -> None:
    run = two_floors(gap=1e-9)
    assert [event.names for event in run.events[:2]] == [("second",), ("first",)]
    assert run.modes == ("none", "second", "both")


def two_floors(gap: float) -> Trajectory:
    """A fall onto two floors, the second `gap` above the first."""
    a, b = sp.symbols("a b", real=True)

    def mode(name: str) -> Mode:
        first = Guard("first", Y, {"none": "first", "second": "both"}.get(name), {a: a + 1})
        second = Guard("second", Y - gap, {"none": "second", "first": "both"}.get(name), {b: b + 1})
        guards = {"none": (first, second), "first": (second,), "second": (first,), "both": ()}
        return Mode(name, {}, {Y: V, V: -G}, guards[name])

    system = HybridSystem(
        "floors", (Y, V), (a, b), (G, E), ("none", "first", "second", "both"), mode,
        Section(("apex",), {}, {}, {"height": Y}, NEVER),
    )  # fmt: skip
    bound = BoundSystem(compile_system(system, 1e-12), np.array([9.81, 1.0]))
    start = HybridState(0.0, "none", np.array([1.0, 0.0]), np.zeros(2))
    return integrate(bound, start, end_time=1.0)


@pytest.mark.parametrize("rising", [False, True])
def test_a_level_guard_fires_on_entry_and_a_crossing_guard_waits(rising: bool) -> None:
    """Falling x enters 'low' at x = 1, where the guard is at -1 already, falling or rising."""
    x, n = sp.symbols("x n", real=True)
    expression = -x if rising else x - 2

    def visited(arming: Arming) -> tuple[str, ...]:
        late = Guard("late", expression, "end", {n: n + 1}, arming)
        modes = {
            "high": Mode("high", {}, {x: sp.S(-1)}, (Guard("enter", x - 1, "low"),)),
            "low": Mode("low", {}, {x: sp.S(-1)}, (late,)),
            "end": Mode("end", {}, {x: sp.S(0)}, ()),
        }
        section = Section(("none",), {}, {}, {}, NEVER)
        system = HybridSystem("ramp", (x,), (n,), (), tuple(modes), modes.__getitem__, section)
        bound = BoundSystem(compile_system(system, 1e-12), np.array([]))
        start = HybridState(0.0, "high", np.array([3.0]), np.zeros(1))
        run = integrate(bound, start, end_time=5.0)
        assert run.outcome.completed
        return run.modes

    assert visited(Arming.LEVEL) == ("high", "end")
    assert visited(Arming.CROSSING) == ("high", "low")


def test_an_ending_guard_ends_the_run_with_its_outcome() -> None:
    system = ball(Guard("edge", sp.Float(0.5) - Y, ends=LOST))
    bound = BoundSystem(compile_system(system, 1e-12), np.array([9.81, 1.0]))
    start = HybridState(0.0, "flight", np.array([0.2, 3.0]), np.zeros(1))
    run = integrate(bound, start, end_time=10.0)
    assert run.outcome.name == "lost"
    assert run.end.states[0] == pytest.approx(0.5, abs=1e-14)


def rolling(clearance: float, record: bool = True) -> Trajectory:
    """A point on a vertical circle whose lowest point is `clearance` above the floor."""
    a, w = sp.symbols("a w", real=True)
    guard = Guard("touch", 1 + G - sp.cos(a), "down")
    up = Mode("up", {}, {a: sp.S(1)}, (guard,))
    down = Mode("down", {}, {a: sp.S(0)}, ())
    system = HybridSystem(
        "wheel", (a,), (w,), (G, E), ("up", "down"), {"up": up, "down": down}.__getitem__,
        Section(("none",), {}, {}, {}, NEVER),
    )  # fmt: skip
    bound = BoundSystem(compile_system(system, 1e-12), np.array([clearance, 0.0]))
    start = HybridState(0.0, "up", np.array([-2.0]), np.zeros(1))
    return integrate(bound, start, end_time=4.0, record=record)


@pytest.mark.parametrize("clearance", [1e-13, 1e-10, -1e-13, -1e-10])
def test_a_guard_that_is_only_brushed_is_reported_as_grazing(clearance: float) -> None:
    run = rolling(clearance)
    assert run.outcome.name == "grazed"
    assert run.end.time == pytest.approx(2.0, abs=1e-4)


@pytest.mark.parametrize("clearance", [1e-8, 1e-3])
def test_a_guard_that_is_missed_is_not_grazing(clearance: float) -> None:
    assert rolling(clearance).outcome.completed


def test_a_guard_that_is_crossed_slowly_but_surely_fires() -> None:
    run = rolling(-1e-6)
    assert run.modes == ("up", "down")
    assert run.events[0].time == pytest.approx(2 - math.acos(1 - 1e-6), abs=1e-9)


def test_dense_output_is_as_good_as_the_steps() -> None:
    run = drop(ball(), 1.0, 1.0, end_time=0.4, record=True)
    (arc,) = run.arcs
    times = np.linspace(0, 0.4, 101)
    np.testing.assert_allclose(arc(times)[:, 0], 1 - 9.81 * times**2 / 2, atol=1e-14)
    assert run.observe(arc, arc(times))["energy"] == pytest.approx(9.81, abs=1e-13)


def test_a_state_that_blows_up_is_an_outcome() -> None:
    x, n = sp.symbols("x n", real=True)
    mode = Mode("only", {}, {x: x**2}, ())
    system = HybridSystem(
        "blow-up", (x,), (n,), (), ("only",), lambda _: mode, Section(("none",), {}, {}, {}, NEVER)
    )
    bound = BoundSystem(compile_system(system, 1e-12), np.array([]))
    start = HybridState(0.0, "only", np.array([1.0]), np.zeros(1))
    run = integrate(bound, start, end_time=2.0)
    assert run.outcome.name in {"diverged", "timed_out"}
    assert run.end.time <= 1.0 + 1e-9


def test_an_event_at_the_very_end_of_a_run_happens() -> None:
    fall = math.sqrt(2 / 9.81)
    run = drop(ball(), 1.0, 1.0, end_time=fall)
    assert [event.names for event in run.events] == [("bounce",)]
    assert run.end.states[1] > 0


def test_every_arc_has_a_length() -> None:
    run = drop(ball(), 1.0, 0.9, crossings=4, record=True)
    assert all(arc.end > arc.start for arc in run.arcs)
