"""Derivatives across events on falling balls, where all of them can be written down.

Expected values are derivatives, taken by SymPy, of textbook formulas for height and time.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
import sympy as sp

from flexspine.gaits.return_map import ReturnMap, linearize
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import compile_system
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.outcome import OutcomeKind
from flexspine.hybrid.system import Guard, HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState

# Relative; the integrator's tolerance is 1e-12, and every derivative here is of order one.
EXACT = 1e-11

Y, V, BOUNCES, STORED = sp.symbols("y v n s", real=True)
G, LOW, E, LEVEL = sp.symbols("g g_low e level", positive=True)
HEIGHT = sp.Symbol("h", positive=True)
NEVER = OutcomeKind("never", "no apex")
ABOVE, BELOW = Guard("above", LEVEL - Y, "high"), Guard("below", Y - LEVEL, "low")
APEX = Guard("apex", V)


def system(name: str, parameters: tuple[sp.Symbol, ...], *modes: Mode) -> HybridSystem:
    """A ball that starts in the first mode; its section is the apex after a bounce."""
    table = {mode.name: mode for mode in modes}
    return HybridSystem(
        name=name,
        states=(Y, V),
        held=(BOUNCES, STORED),
        parameters=parameters,
        modes=tuple(table),
        mode=table.__getitem__,
        section=Section(("apex",), {BOUNCES: 1.0}, {BOUNCES: 0.0}, {"height": Y}, NEVER),
    )


def flight(name: str, gravity: sp.Expr, *guards: Guard) -> Mode:
    return Mode(name, {}, {Y: V, V: -gravity}, (*guards, APEX))


def bounce(target: str | None = None, stored: sp.Expr = STORED) -> Guard:
    return Guard("bounce", Y, target, {V: -E * V, BOUNCES: BOUNCES + 1, STORED: stored})


PLAIN = system("bouncing ball", (G, E), flight("flight", G, bounce()))

# Weight is g above a level and g_low below it: nothing jumps there but the acceleration.
MEDIA = system(
    "ball between media",
    (G, LOW, E, LEVEL),
    flight("high", G, BELOW),
    flight("low", LOW, bounce(), ABOVE),
)

# The bounce switches the weight from g to g_low: velocity and acceleration jump at once.
SWITCH = system(
    "ball on a switch", (G, LOW, E), flight("fall", G, bounce("rise")), flight("rise", LOW)
)

# The bounce sets the weight to g_low times the squared speed of impact, as a leg sets its toe.
MEMORY = system(
    "ball with a memory",
    (G, LOW, E),
    flight("fall", G, bounce("rise", stored=LOW * V**2)),
    flight("rise", STORED),
)


def drop(
    ball: HybridSystem, height: float, numbers: Mapping[sp.Symbol, float], bounces: int = 1
) -> ReturnMap:
    """Drop a ball and differentiate its way to an apex, by height and all parameters."""
    bound = BoundSystem(
        compile_system(ball, 1e-12), np.array([numbers[symbol] for symbol in ball.parameters])
    )
    start = HybridState(0.0, ball.modes[0], np.array([height, 0.0]), np.zeros(2))
    run = integrate(bound, start, crossings=bounces)
    assert run.outcome.completed
    return linearize(run, ball.parameters)


def assert_is(
    found: ReturnMap, top: sp.Expr, time: sp.Expr, height: float, numbers: Mapping[sp.Symbol, float]
) -> None:
    """Compare apex, duration and all their derivatives with those of the formulas."""
    symbols = (HEIGHT, *found.trajectory.bound.system.parameters)
    at = {**numbers, HEIGHT: height}

    def slopes(formula: sp.Expr) -> list[float]:
        return [float(sp.diff(formula, symbol).subs(at)) for symbol in symbols]

    assert found.image[0] == pytest.approx(float(top.subs(at)), rel=EXACT)
    assert found.trajectory.duration == pytest.approx(float(time.subs(at)), rel=EXACT)
    by_all = [*found.by_state[0], *found.by_parameters[0]]
    assert by_all == pytest.approx(slopes(top), rel=EXACT, abs=EXACT)
    assert found.time == pytest.approx(slopes(time), rel=EXACT, abs=EXACT)


NUMBERS = {G: 9.81, LOW: 3.7, E: 0.8, LEVEL: 0.6}


@pytest.mark.parametrize("height", [0.3, 1.0, 2.5])
def test_a_bounce_returns_restitution_squared_of_the_height_whatever_the_weight(
    height: float,
) -> None:
    time = (1 + E) * sp.sqrt(2 * HEIGHT / G)
    assert_is(drop(PLAIN, height, NUMBERS), E**2 * HEIGHT, time, height, NUMBERS)


@pytest.mark.parametrize(("low", "restitution"), [(3.7, 0.8), (25.0, 0.9), (9.81, 0.8)])
def test_a_ball_that_falls_into_another_medium_and_out_again(
    low: float, restitution: float
) -> None:
    """Energy from part to part; restitution large enough for the ball to come out again."""
    numbers, height = {**NUMBERS, LOW: low, E: restitution}, 3.0
    entry = sp.sqrt(2 * G * (HEIGHT - LEVEL))
    impact = sp.sqrt(entry**2 + 2 * LOW * LEVEL)
    leaving = sp.sqrt(E**2 * impact**2 - 2 * LOW * LEVEL)
    top = LEVEL + leaving**2 / (2 * G)
    time = entry / G + (impact - entry) / LOW + (E * impact - leaving) / LOW + leaving / G
    found = drop(MEDIA, height, numbers)
    assert [event.names for event in found.trajectory.events] == [
        ("below",), ("bounce",), ("above",), ("apex",),
    ]  # fmt: skip
    assert_is(found, top, time, height, numbers)


def test_a_ball_that_turns_below_the_level_has_never_been_above_it() -> None:
    """No second change of medium: the apex is below, where the weight is the other one."""
    numbers, height = {**NUMBERS, LOW: 20.0, E: 0.5}, 1.0
    impact = sp.sqrt(2 * G * (HEIGHT - LEVEL) + 2 * LOW * LEVEL)
    entry = sp.sqrt(2 * G * (HEIGHT - LEVEL))
    time = entry / G + (impact - entry) / LOW + E * impact / LOW
    found = drop(MEDIA, height, numbers)
    assert_is(found, E**2 * impact**2 / (2 * LOW), time, height, numbers)


def test_velocity_and_weight_that_change_at_one_bounce() -> None:
    impact = sp.sqrt(2 * G * HEIGHT)
    top, time = E**2 * impact**2 / (2 * LOW), impact / G + E * impact / LOW
    assert_is(drop(SWITCH, 1.3, NUMBERS), top, time, 1.3, NUMBERS)


def test_what_is_set_at_a_bounce_from_the_state_carries_its_deviation_on() -> None:
    """Weight in proportion to the squared speed: all heights end at the same one."""
    impact = sp.sqrt(2 * G * HEIGHT)
    weight = LOW * impact**2
    found = drop(MEMORY, 1.3, NUMBERS)
    assert_is(found, E**2 / (2 * LOW), impact / G + E * impact / weight, 1.3, NUMBERS)
    assert abs(found.by_state[0, 0]) < EXACT


def test_two_returns_are_the_product_of_both() -> None:
    first = drop(PLAIN, 1.5, NUMBERS)
    second = drop(PLAIN, float(first.image[0]), NUMBERS)
    both = drop(PLAIN, 1.5, NUMBERS, bounces=2)
    assert both.by_state == pytest.approx(second.by_state @ first.by_state, rel=EXACT)
    chained = second.by_state @ first.by_parameters + second.by_parameters
    assert both.by_parameters == pytest.approx(chained, rel=EXACT, abs=EXACT)


@pytest.mark.parametrize("bounces", [2, 3])
def test_the_time_of_several_returns_depends_on_the_start_as_their_sum_does(bounces: int) -> None:
    """Each return takes e times as long as the one before."""
    time = sum((E**k for k in range(bounces)), sp.S.Zero) * (1 + E) * sp.sqrt(2 * HEIGHT / G)
    found = drop(PLAIN, 1.5, NUMBERS, bounces=bounces)
    assert_is(found, E ** (2 * bounces) * HEIGHT, time, 1.5, NUMBERS)


@pytest.mark.parametrize("above", [0.5, 1e-2, 1e-4, 1e-6])
def test_the_nearer_to_grazing_the_slower_the_crossing_that_is_reported(above: float) -> None:
    """From ``above`` over a level a ball passes it at sqrt(2 g above), on its way back as well."""
    numbers = {**NUMBERS, LOW: 3.7, E: 1.0}
    found = drop(MEDIA, NUMBERS[LEVEL] + above, numbers)
    entry = np.sqrt(2 * 9.81 * above)
    impact = np.sqrt(entry**2 + 2 * 3.7 * 0.6)
    # The level is given to 1e-16 m, so a slow crossing is known to 1e-16 / above.
    expected = [-entry, -impact, -entry, -9.81]
    assert found.crossing_rates == pytest.approx(expected, rel=EXACT + 1e-15 / above)
