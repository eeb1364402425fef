"""Many runs at once on systems that have no legs: closed forms, one run alone, and neighbours."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray

from flexspine import Model, load_model
from flexspine.hybrid.batch import Ends, Starts
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import compile_system
from flexspine.hybrid.ensemble import run_many
from flexspine.hybrid.functions import section_quantities
from flexspine.hybrid.integrate import SECTION_TIMEOUT, integrate
from flexspine.hybrid.lanes import LONGEST, compile_lanes
from flexspine.hybrid.outcome import OutcomeKind
from flexspine.hybrid.system import Arming, Guard, HybridSystem, Mode, Section
from flexspine.hybrid.trajectory import HybridState, Trajectory
from tests.hybrid.test_integrate import LOST, NEVER, E, G, V, Y, ball

TOLERANCE = 1e-12
GRAVITY = 9.81

# Of the results of two ways to compute the same run that does not amplify rounding.
SAME = 1e-12

Array = NDArray[np.float64]


def numbers(k: int, *columns: float | Array) -> Array:
    """Rows of k numbers."""
    return np.array([np.broadcast_to(np.asarray(column, dtype=float), k) for column in columns])


def many(system: HybridSystem, starts: Starts, crossings: int, **options: int) -> Ends:
    lanes = compile_lanes(compile_system(system, TOLERANCE))
    return run_many(lanes, starts, crossings, **options)


def alone(system: HybridSystem, starts: Starts, crossings: int, run: int) -> Trajectory:
    """One of the runs by itself, recorded as `simulate` does."""
    bound = BoundSystem(compile_system(system, TOLERANCE), starts.parameters[:, run].copy())
    start = HybridState(0.0, starts.mode, starts.states[:, run].copy(), starts.held[:, run].copy())
    return integrate(bound, start, crossings=crossings, record=True)


def names(ends: Ends) -> list[str]:
    return [ends.outcomes[kind].name for kind in ends.kinds]


def drops(height: Array, restitution: float | Array, speed: float | Array = 0.0) -> Starts:
    """Balls let go at some heights, for `ball`."""
    k = len(height)
    return Starts(
        "flight",
        numbers(k, height, speed),
        numbers(k, 0.0),
        numbers(k, GRAVITY, restitution),
    )


def assert_as_alone(system: HybridSystem, starts: Starts, crossings: int) -> Ends:
    ends = many(system, starts, crossings)
    for run in range(len(starts)):
        single = alone(system, starts, crossings, run)
        assert names(ends)[run] == single.outcome.name, run
        assert ends.crossings[run] == len(single.crossings), run
        # A touch of no depth is a double root, which moves by the root of a rounding error.
        same = math.sqrt(SAME) if single.outcome.name == "grazed" else SAME
        assert ends.time[run] == pytest.approx(single.end.time, rel=same, abs=same), run
        np.testing.assert_allclose(ends.states[:, run], single.end.states, rtol=same, atol=same)
    return ends


def assert_same_bits(one: Ends, other: Ends, rows: slice | NDArray[np.intp]) -> None:
    """Runs of one ensemble are, bit for bit, some of the runs of another."""
    assert names(one) == np.array(names(other))[rows].tolist()
    for name in ("crossings", "time", "states", "section_time", "section_states", "largest"):
        mine, theirs = getattr(one, name), getattr(other, name)[..., rows]
        assert np.array_equal(mine, theirs), name


def taken(starts: Starts, rows: slice | NDArray[np.intp]) -> Starts:
    parts = (starts.states, starts.held, starts.parameters)
    return Starts(starts.mode, *(part[:, rows] for part in parts))


# Closed forms


def test_balls_bounce_when_the_parabolas_say() -> None:
    """The field has a finite Taylor series, so its own steps would have no end."""
    height = np.geomspace(1e-3, 300, 41)
    ends = many(ball(), drops(height, 1.0), 1)
    period = 2 * np.sqrt(2 * height / GRAVITY)
    back = period < SECTION_TIMEOUT
    assert [name == "completed" for name in names(ends)] == back.tolist()
    np.testing.assert_allclose(ends.time[back], period[back], rtol=1e-13)
    np.testing.assert_allclose(ends.section_states[0, back], height[back], rtol=1e-12)


def test_each_apex_is_lower_by_restitution_squared() -> None:
    restitution = np.linspace(0.5, 1.0, 21)
    ends = many(ball(), drops(np.ones(21), restitution), 4)
    np.testing.assert_allclose(ends.section_states[0], restitution**8, rtol=1e-12)
    fall = math.sqrt(2 / GRAVITY)
    late = sum(2 * restitution**bounce for bounce in range(1, 4)) + restitution**4
    np.testing.assert_allclose(ends.section_time, fall * (1 + late), rtol=1e-13)


def test_what_stays_away_from_the_section_is_where_physics_has_it_by_then() -> None:
    """Too high to be back in time: free fall for exactly as long as a run waits."""
    height, speed = np.linspace(700, 900, 9), np.linspace(-5, 5, 9)
    ends = many(ball(), drops(height, 1.0, speed), 1)
    assert set(names(ends)) == {NEVER.name}
    assert ends.time.tolist() == [SECTION_TIMEOUT] * 9
    t = SECTION_TIMEOUT
    np.testing.assert_allclose(ends.states[0], height + speed * t - GRAVITY * t**2 / 2, rtol=1e-11)
    np.testing.assert_allclose(ends.states[1], speed - GRAVITY * t, rtol=1e-11)


@pytest.mark.parametrize("speed", [1.0, 0.3, 1e-2])
def test_what_leaves_a_guard_comes_back_to_it(speed: float) -> None:
    """Thrown up from exactly zero, a ball bounces after 2 v / g, however short that is."""
    system = ball(Guard("floor", Y + 1.0, ends=LOST))
    starts = drops(np.zeros(3), 1.0, speed)
    for run in (many(system, starts, 1).time[0], alone(system, starts, 1, 0).end.time):
        assert run == pytest.approx(3 * speed / GRAVITY, rel=1e-12)


# As one run alone


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.8, 0.95])
def test_a_ball_coming_to_rest_chatters_and_ends(restitution: float) -> None:
    """Zeno: infinitely many bounces in finite time, at the sum of a geometric series."""
    height = np.array([0.5, 1.0, 2.0])
    ends = many(ball(), drops(height, restitution), 500)
    assert set(names(ends)) == {"chattered"}
    rest = np.sqrt(2 * height / GRAVITY) * (1 + restitution) / (1 - restitution)
    assert np.all(ends.time <= rest)
    np.testing.assert_allclose(ends.time, rest, rtol=0, atol=0.02)


def test_balls_of_all_kinds_end_as_they_do_alone() -> None:
    """Bounces, falls off the table and flights that take too long; starts on a guard too."""
    rng = np.random.default_rng(0)
    edge = Guard("edge", 30 - Y, ends=LOST)
    height = np.concatenate([rng.uniform(0, 29, 30), [0.0, 1e-13, 30.0, 30 - 1e-13]])
    speed = np.concatenate([rng.uniform(-20, 20, 30), [3.0, 3.0, -1.0, 1.0]])
    restitution = rng.uniform(0.6, 1.0, 34)
    ends = assert_as_alone(ball(edge), drops(height, restitution, speed), 2)
    assert {"completed", "lost"} <= set(names(ends))


def floors(second: sp.Expr) -> HybridSystem:
    """A fall onto two floors, the second at a height of its own."""
    a, b = sp.symbols("a b", real=True)

    def mode(name: str) -> Mode:
        one = Guard("first", Y, {"none": "first", "second": "both"}.get(name), {a: a + 1, V: -V})
        two = Guard("second", Y - second, {"none": "second", "first": "both"}.get(name), {b: b + 1})
        guards = {"none": (one, two), "first": (two,), "second": (one,), "both": ()}[name]
        top = (Guard("top", V),) if name == "both" else ()
        return Mode(name, {}, {Y: V, V: -G}, (*guards, *top))

    return HybridSystem(
        "floors", (Y, V), (a, b), (G, E), ("none", "first", "second", "both"), mode,
        Section(("top",), {}, {}, {"height": Y}, NEVER),
    )  # fmt: skip


def test_guards_at_one_instant_are_one_event_and_guards_apart_are_two() -> None:
    gaps = np.concatenate([[0.0], np.geomspace(1e-15, 0.5, 30), -np.geomspace(1e-15, 0.5, 30)])
    k = len(gaps)
    starts = Starts("none", numbers(k, 1.0, 0.0), numbers(k, 0.0, 0.0), numbers(k, GRAVITY, gaps))
    ends = assert_as_alone(floors(E), starts, 1)
    # A floor above the first is passed before the bounce; one below it is never reached in time.
    # At one instant the bounce may come first, after which the second is not being passed.
    found = np.array(names(ends))
    passed = gaps > 1e-11
    assert set(found[passed]) == {"completed"}
    assert set(found[gaps < -1e-9]) == {NEVER.name}
    np.testing.assert_allclose(ends.time[passed], 2 * math.sqrt(2 / GRAVITY), rtol=1e-12)


@pytest.mark.parametrize("arming", list(Arming))
def test_a_guard_that_is_below_zero_on_entry_fires_at_once_or_waits(arming: Arming) -> None:
    """Falling x enters 'low' at x = 1; the guard there is x - a, below zero for a > 1."""
    x, n, a, w = sp.symbols("x n a w", real=True)
    modes = {
        "high": Mode("high", {}, {x: -w}, (Guard("enter", x - 1, "low"),)),
        "low": Mode("low", {}, {x: -w}, (Guard("late", x - a, "end", {n: n + 1}, arming),)),
        "end": Mode("end", {}, {x: -w}, (Guard("done", x + 2),)),
    }
    section = Section(("done",), {}, {}, {"x": x}, NEVER)
    system = HybridSystem("ramp", (x,), (n,), (a, w), tuple(modes), modes.__getitem__, section)
    above = np.array([2.5, 1.5, 1 + 1e-9, 1 - 1e-9, 0.5, -1.0])
    k = len(above)
    starts = Starts("high", numbers(k, 3.0), numbers(k, 0.0), numbers(k, above, 1.0))
    ends = assert_as_alone(system, starts, 1)
    reached = [name == "completed" for name in names(ends)]
    assert reached == [arming is Arming.LEVEL or a < 1.0 for a in above]
    assert ends.time[reached] == pytest.approx(5.0, abs=1e-12)


@pytest.mark.parametrize("ends", [None, LOST])
def test_an_event_at_the_very_end_of_a_step_is_not_lost(ends: OutcomeKind | None) -> None:
    """Falling steadily, x takes whole steps to zero, within rounding error of either side."""
    x, n, w = sp.symbols("x n w", real=True)
    mode = Mode("only", {}, {x: -w}, (Guard("floor", x, ends=ends),))
    section = Section(("floor",) if ends is None else (), {}, {}, {"x": x}, NEVER)
    system = HybridSystem("steps", (x,), (n,), (w,), ("only",), lambda _: mode, section)
    begin = LONGEST * np.arange(1, 61)
    k = len(begin)
    found = many(system, Starts("only", numbers(k, begin), numbers(k, 0.0), numbers(k, 1.0)), 1)
    assert set(names(found)) == {"completed" if ends is None else ends.name}
    np.testing.assert_allclose(found.time, begin, rtol=1e-13)


def wheel() -> HybridSystem:
    """A point on a vertical circle of radius one whose lowest point is `c` above the floor."""
    a, n, c, w = sp.symbols("a n c w", real=True)
    touch = Guard("touch", 1 + c - sp.cos(a), "down")
    modes = {
        "up": Mode("up", {}, {a: w}, (touch, Guard("turned", 2 - a))),
        "down": Mode("down", {}, {a: w}, (Guard("turned", 2 - a),)),
    }
    section = Section(("turned",), {}, {}, {}, NEVER)
    return HybridSystem("wheel", (a,), (n,), (c, w), tuple(modes), modes.__getitem__, section)


def wheels(clearance: Array, angle: float | Array) -> Starts:
    k = len(clearance)
    return Starts("up", numbers(k, angle), numbers(k, 0.0), numbers(k, clearance, 1.0))


def test_a_guard_that_is_brushed_grazes_and_one_that_is_missed_does_not() -> None:
    """Wherever in a step the touch is; the touch of depth d lasts 2 acos(1 - d)."""
    clearance = np.repeat([1e-3, 1e-8, 1e-13, 0.0, -1e-13, -1e-10, -1e-6, -1e-3, -0.1], 8)
    angle = np.tile(-2 + np.arange(8) * 0.0027, 9)
    ends = assert_as_alone(wheel(), wheels(clearance, angle), 1)
    found = np.array(names(ends)).reshape(9, 8)
    assert np.all(found[[0, 1]] == "completed")
    assert np.all(found[2:6] == "grazed")
    assert np.all(found[6:] == "completed")


def test_a_state_that_blows_up_is_an_outcome_and_harms_nobody() -> None:
    """x' = x^2 leaves every bound at t = 1 / x; its neighbours are slower."""
    x, n, c = sp.symbols("x n c", real=True)
    mode = Mode("only", {}, {x: c * x**2}, (Guard("far", 2 - x),))
    system = HybridSystem(
        "blow-up", (x,), (n,), (c,), ("only",), lambda _: mode, Section(("far",), {}, {}, {}, NEVER)
    )
    begin = np.array([3.0, 1.0, 5.0, 0.25, 1e300])
    k = len(begin)
    starts = Starts("only", numbers(k, begin), numbers(k, 0.0), numbers(k, 1.0))
    ends = many(system, starts, 1)
    found = names(ends)
    assert found[1] == found[3] == "completed"
    np.testing.assert_allclose(ends.time[[1, 3]], 1 / begin[[1, 3]] - 0.5, rtol=1e-12)
    assert {found[0], found[2], found[4]} <= {"diverged", "timed_out"}
    assert np.all(ends.time[[0, 2]] <= 1 / begin[[0, 2]] + 1e-9)


def test_a_system_without_parameters_or_memory_runs_too() -> None:
    """x' = -x from some place falls to 1 after the logarithm of it."""
    x = sp.symbols("x", real=True)
    mode = Mode("only", {}, {x: -x}, (Guard("there", x - 1),))
    section = Section(("there",), {}, {}, {}, NEVER)
    system = HybridSystem("decay", (x,), (), (), ("only",), lambda _: mode, section)
    begin = np.geomspace(1.5, 20, 5)
    starts = Starts("only", numbers(5, begin), np.zeros((0, 5)), np.zeros((0, 5)))
    assert alone(system, starts, 1, 0).end.time == pytest.approx(np.log(begin[0]), rel=1e-12)
    np.testing.assert_allclose(many(system, starts, 1).time, np.log(begin), rtol=1e-12)


def test_what_is_not_finite_at_the_start_ends_and_harms_nobody() -> None:
    height = np.array([1.0, np.nan, 2.0, np.inf, 3.0])
    ends = many(ball(), drops(height, 1.0), 1)
    good = [0, 2, 4]
    assert [names(ends)[i] for i in good] == ["completed"] * 3
    assert_same_bits(many(ball(), drops(height[good], 1.0), 1), ends, np.array(good))
    assert {names(ends)[1], names(ends)[3]} <= {"diverged", "never"}


# The largest of what is tracked


def test_the_largest_value_is_kept_wherever_in_a_step_it_is() -> None:
    """A spring x'' = -x from some phase down to a place below: it passes its top, or starts there.

    What is largest at the very start counts like any other.
    """
    x, v, n, low, w = sp.symbols("x v n low w", real=True)
    observed = {"x": x, "nothing": sp.S.Zero}
    mode = Mode("only", {}, {x: v, v: -w * x}, (Guard("stop", x - low),), observed)
    system = HybridSystem(
        "spring", (x, v), (n,), (low, w), ("only",), lambda _: mode,
        Section(("stop",), {}, {}, {}, NEVER), tracked=("nothing", "x"),
    )  # fmt: skip
    phase, low_at = np.linspace(-1.5, 3.0, 301), -np.linspace(0.2, 1.2, 301) % 1.0 - 1.0
    k = len(phase)
    starts = Starts("only", numbers(k, np.sin(phase), np.cos(phase)), numbers(k, 0.0),
                    numbers(k, low_at, 1.0))  # fmt: skip
    ends = many(system, starts, 1)
    reached = np.array(names(ends)) == "completed"
    assert reached.any()
    top = np.where(phase < np.pi / 2, 1.0, np.sin(phase))
    np.testing.assert_allclose(ends.largest[1], np.where(reached, top, 1.0), rtol=1e-12)
    assert not ends.largest[0].any()


# Neighbours


@pytest.fixture(scope="module")
def mixed() -> Starts:
    """Balls with all sorts of ends: back in time, at rest by infinitely many bounces, too high."""
    rng = np.random.default_rng(3)
    height = rng.uniform(0.01, 3, 61)
    height[::9] = 800.0
    return drops(height, np.where(rng.random(61) < 0.3, 0.3, rng.uniform(0.9, 1, 61)))


@pytest.fixture(scope="module")
def whole(mixed: Starts) -> Ends:
    return many(ball(), mixed, 12)


@pytest.mark.parametrize("pool", [1, 2, 7, 16, 33, 60])
def test_runs_do_not_depend_on_the_size_of_the_pool(mixed: Starts, whole: Ends, pool: int) -> None:
    assert set(names(whole)) == {"completed", "chattered", NEVER.name}
    assert_same_bits(many(ball(), mixed, 12, pool=pool), whole, slice(None))


def test_runs_do_not_depend_on_their_neighbours_nor_on_their_order(
    mixed: Starts, whole: Ends
) -> None:
    for rows in (slice(0, 5), slice(3, 4), slice(10, 60, 7), slice(None, None, -1)):
        assert_same_bits(many(ball(), taken(mixed, rows), 12), whole, rows)
    order = np.random.default_rng(4).permutation(len(mixed))
    assert_same_bits(many(ball(), taken(mixed, order), 12), whole, order)


def test_a_run_among_others_with_its_parameters_is_the_same_as_among_others_without() -> None:
    """Where all have the same parameters less is moved; that must not show."""
    height = np.linspace(0.2, 2, 23)
    same = many(ball(), drops(height, 0.9), 5)
    restitution = np.full(23, 0.9)
    restitution[::2] = 0.8
    mixed = many(ball(), drops(height, restitution), 5)
    odd = np.arange(1, 23, 2)
    assert_same_bits(many(ball(), drops(height[odd], 0.9), 5), same, odd)
    assert_same_bits(many(ball(), drops(height[odd], 0.9), 5), mixed, odd)


def animals(model: Model, k: int, seed: int, spread: float = 0.1) -> Starts:
    """Many starts of one animal around its apex."""
    rng = np.random.default_rng(seed)
    start = model.apex_state()
    states = np.repeat(start.states[:, None], k, axis=1)
    for symbol in model.system.section.coordinates.values():
        states[model.system.places[symbol]] += spread * rng.normal(size=k)
    held = np.repeat(start.held[:, None], k, axis=1)
    return Starts(start.mode, states, held, np.repeat(model.parameter_vector[:, None], k, axis=1))


@pytest.mark.parametrize("name", ["kamimura2015-flexible", "scout2"])
def test_animals_do_not_depend_on_the_size_of_the_pool(name: str) -> None:
    model = load_model(name)
    starts = animals(model, 45, 5)
    whole = many(model.system, starts, 3)
    assert len(set(names(whole))) > 1
    for pool in (1, 16, 33):
        assert_same_bits(many(model.system, starts, 3, pool=pool), whole, slice(None))


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"gravity": 0.05}, "no_apex"),
        ({"fore.leg.stiffness": 1e7, "fore.leg.damping": 1e4, "fore.mass": 0.05}, "chattered"),
    ],
    ids=["too-long-in-the-air", "crowded-events"],
)
def test_rare_ends_do_not_depend_on_the_size_of_the_pool(
    change: dict[str, float], what: str
) -> None:
    """Long flights, and legs so stiff and damped that events crowd."""
    model = load_model("kamimura2015-flexible", change)
    if "fore.leg.damping" in change:
        model = model.keeping(["spine.damping"])  # equations that other tests compile as well
    starts = animals(model, 18, 6, 0.03)
    whole = many(model.system, starts, 1)
    if what == "no_apex":
        assert what in names(whole)
    for pool in (1, 7):
        assert_same_bits(many(model.system, starts, 1, pool=pool), whole, slice(None))


# Functions of points


def test_functions_of_many_points_are_those_of_each(preset: Model) -> None:
    """And the energy is what mechanics says of a body in flight: T + V."""
    starts = animals(preset, 37, 7, 0.03)
    function = section_quantities(preset.system)
    found = function.many(starts.states, starts.held, starts.parameters)
    for run in range(len(starts)):
        one = function(starts.states[:, run], starts.held[:, run], starts.parameters[:, run])
        np.testing.assert_allclose(found[:, run], one.values, rtol=1e-14)
    for count in (1, 2, 9, 36):
        few = taken(starts, slice(0, count))
        some = function.many(few.states, few.held, few.parameters)
        assert np.array_equal(some, found[:, :count])
    level = starts.states.copy()
    x_rate = len(level) // 2
    level[1:] = 0.0
    level[x_rate] = 3.0
    energy = function.many(level, starts.held, starts.parameters)[0]
    np.testing.assert_allclose(energy, preset.mass * 3.0**2 / 2, rtol=1e-13)
