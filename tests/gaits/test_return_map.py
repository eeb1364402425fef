"""The exact derivative of the stride map, on random bodies, against differences of plain runs.

The bodies are those of the comparison with the second implementation: unequal ends, legs and
spine with and without dampers. With a damper the leg force jumps at touchdown.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import Model, load_model, stride_map
from flexspine.gaits.return_map import ReturnMap, linearize
from flexspine.hybrid.integrate import integrate
from flexspine.hybrid.trajectory import Trajectory
from flexspine.models.actuation import ACTUATORS, STRIDE_PHASES
from flexspine.models.simulation import DEFAULT_TOLERANCE
from flexspine.parameters import values
from tests import second_implementation as reference
from tests.models.test_second_implementation import flexible, rigid

Vector = NDArray[np.float64]
Body = reference.Flexible | reference.Rigid
Make = Callable[[np.random.Generator, bool], tuple[Model, Body]]

# Eighth-order central difference: weights of one to four steps to either side.
WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)

# Of each quantity's scale. Four of them move no touchdown past another event, rounding of 1e-15
# in the strides makes some 1e-11 of a derivative, and truncation is far below.
STEP = 1e-4
AGREEMENT = 1e-10

# Seeds whose animal comes back to an apex.
UNDAMPED_FLEXIBLE = [1, 2, 3, 4, 7, 9, 10, 11]
DAMPED_FLEXIBLE = [0, 1, 2, 3, 5, 6, 11]
UNDAMPED_RIGID = [100, 103, 105, 108, 109, 111]
DAMPED_RIGID = [102, 103, 104, 119, 120, 123]
CASES = [
    pytest.param(make, damped, seed, id=f"{make.__name__}-{kind}-{seed}")
    for make, damped, kind, seeds in (
        (flexible, False, "undamped", UNDAMPED_FLEXIBLE),
        (flexible, True, "damped", DAMPED_FLEXIBLE),
        (rigid, False, "undamped", UNDAMPED_RIGID),
        (rigid, True, "damped", DAMPED_RIGID),
    )
    for seed in seeds
]


def stride(model: Model) -> Trajectory:
    run = integrate(model.bind(DEFAULT_TOLERANCE), model.apex_state(), crossings=1)
    assert run.outcome.completed
    return run


def derivative(model: Model, parameters: list[str]) -> ReturnMap:
    symbols = model.system.parameters
    chosen = [symbols[model.parameter_names.index(name)] for name in parameters]
    return linearize(stride(model), chosen)


def scale(model: Model, name: str) -> float:
    """A natural size of a coordinate, an angle or a parameter."""
    given = values(model.parameters)
    if name in given and name not in ("spine.rest_angle", *ACTUATORS):
        return given[name]
    by_name = {"height": 0.36, "speed": 5.0}
    return by_name.get(name, 10.0 if name.endswith("_rate") else 1.0)


def moved(model: Model, name: str, by: float) -> Model:
    kind, _, side = name.partition(".")
    if name in model.apex:
        return model.with_values(apex={name: model.apex[name] + by})
    if kind == "touchdown":
        return model.with_values(touchdown={side: model.touchdown[side] + by})
    return model.with_values({name: values(model.parameters)[name] + by})


def difference(model: Model, name: str) -> Vector:
    """How all states at the end of a stride, and its duration, change with ``name``."""
    names = [event.names for event in stride(model).events]
    step = STEP * scale(model, name)

    def end(steps: int) -> Vector:
        run = stride(moved(model, name, steps * step))
        assert [event.names for event in run.events] == names
        return np.append(run.end.states, run.duration)

    terms = [weight * (end(i) - end(-i)) for i, weight in enumerate(WEIGHTS, 1)]
    result: Vector = np.sum(terms, axis=0) / step
    return result


@pytest.mark.parametrize(("make", "damped", "seed"), CASES)
def test_the_derivative_by_every_coordinate_angle_and_parameter_is_that_of_plain_runs(
    make: Make, damped: bool, seed: int
) -> None:
    """Masses, inertias, lengths, stiffnesses, dampers, rest angle, gravity, touchdown angles."""
    model, _ = make(np.random.default_rng(seed), damped)
    assert_derivative_is_that_of_plain_runs(model, there(model, damped))


def there(model: Model, damped: bool) -> list[str]:
    """Parameters whose terms are in the equations; without those no derivative by them exists."""
    passive = [name for name in model.parameter_names if name not in ACTUATORS]
    return [name for name in passive if damped or not name.endswith("damping")]


def assert_derivative_is_that_of_plain_runs(model: Model, parameters: list[str]) -> None:
    exact = derivative(model, parameters)
    assert exact.trajectory.outcome.completed
    names = [*model.apex, *parameters]
    scales = np.array([scale(model, name) for name in names])
    found = np.vstack([exact.states, exact.time]) * scales
    expected = np.column_stack([difference(model, name) for name in names]) * scales
    np.testing.assert_allclose(found, expected, rtol=0, atol=AGREEMENT * np.abs(expected).max())


ACTUATION = {
    "legs.stiffening": 0.05, "legs.extension": 0.01, "legs.hip_lever": 0.01,
    "fore.leg.stiffening": 0.1, "fore.leg.extension": -0.005, "fore.leg.hip_lever": 0.005,
    "hind.leg.stiffening": -0.1, "hind.leg.extension": 0.01, "hind.leg.hip_lever": -0.005,
    **{f"spine.stiffness_shift.{p}": 0.1 * (i - 2.5) for i, p in enumerate(STRIDE_PHASES)},
    **{f"spine.rest_shift.{p}": 0.02 * (i - 1.5) for i, p in enumerate(STRIDE_PHASES)},
}  # fmt: skip

DAMPERS = {"fore.leg.damping": 8.0, "hind.leg.damping": 5.0, "spine.damping": 0.3}


@pytest.mark.parametrize(("damped", "seed"), [(False, 9), (True, 1)])
def test_the_derivative_by_every_actuator_is_that_of_plain_runs(damped: bool, seed: int) -> None:
    """Forces and the spine's torque jump at events; works are states like others.

    All in the same equations, whose derivatives are the largest that are compiled.
    """
    model, _ = flexible(np.random.default_rng(seed), damped)
    model = model.with_values(ACTUATION).keeping(DAMPERS)
    assert_derivative_is_that_of_plain_runs(model, list(ACTUATION))


def test_what_is_not_there_yet_has_a_derivative_too() -> None:
    """Of the next apex by actuators that are at rest, whose terms plain runs leave out."""
    model = flexible(np.random.default_rng(2), False)[0].keeping(DAMPERS)
    exact = stride_map(model, parameters=list(ACTUATION))
    rows = [model.system.states.index(s) for s in model.system.section.coordinates.values()]
    for name, found in zip(ACTUATION, exact.by_parameters.T, strict=True):
        ends = [
            stride(moved(model, name, steps * STEP)).end.states[rows]
            for steps in (-4, -3, -2, -1, 1, 2, 3, 4)
        ]
        expected = np.array([*(-w for w in WEIGHTS[::-1]), *WEIGHTS]) @ np.array(ends) / STEP
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=1e-9 * max(np.abs(expected).max(), 0.1)
        )


def test_the_random_strides_visit_every_phase_and_every_order_of_legs() -> None:
    """The test above is worth what its strides cover: all contact changes, damped and not."""
    for damped, seeds in ((False, UNDAMPED_FLEXIBLE), (True, DAMPED_FLEXIBLE)):
        seen: set[tuple[str, str]] = set()
        for seed in seeds:
            seen |= set(pairwise(stride(flexible(np.random.default_rng(seed), damped)[0]).modes))
        in_and_out = {("DF", "FS"), ("FS", "DF"), ("DF", "HS"), ("HS", "DF")}
        double = {("FS", "DS"), ("DS", "FS"), ("HS", "DS"), ("DS", "HS")}
        assert in_and_out | double <= seen


@pytest.mark.parametrize(("make", "seed"), [(flexible, 2), (rigid, 102)], ids=["flexible", "rigid"])
def test_damped_strides_have_the_derivative_of_the_second_implementation(
    make: Make, seed: int
) -> None:
    """Saltation at a touchdown whose force jumps, against differences of another program.

    By touchdown angles, and where the other program is fast by the state too.
    """
    model, body = make(np.random.default_rng(seed), True)
    exact = derivative(model, there(model, damped=True))
    apex, touchdown = dict(model.apex), dict(model.touchdown)
    pairs = [(exact.by_parameters[:, -2:], True)]
    if make is rigid:
        pairs.append((exact.by_state, False))
    for found, by_touchdown in pairs:
        theirs = reference.stride_jacobian(body, apex, touchdown, by_touchdown=by_touchdown)
        # Its differences are good to 1e-9 of the largest entry on strides such as these.
        np.testing.assert_allclose(found, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max())


def test_legs_that_land_together_have_the_derivative_of_legs_that_land_in_turn() -> None:
    """A level pronk, pitched a little: without dampers no force jumps, so the order is no matter.

    The stride map has a second derivative on either side only, so differences are good to their
    step.
    """
    model = load_model("slip")
    exact = derivative(model, [])
    assert exact.trajectory.events[0].names == ("fore touchdown", "hind touchdown")
    rows = [model.system.states.index(s) for s in model.system.section.coordinates.values()]
    step = 1e-6
    for column, name in enumerate(model.apex):
        above, below = (stride(moved(model, name, by)) for by in (step, -step))
        first = above.events[0].names
        assert len(first) == (2 if name in ("height", "speed") else 1)
        slope = (above.end.states - below.end.states)[rows] / (2 * step)
        np.testing.assert_allclose(exact.by_state[:, column], slope, rtol=0, atol=1e-5)


@pytest.mark.parametrize("dampers", [{}, DAMPERS], ids=["undamped", "damped"])
def test_two_strides_have_the_product_of_their_derivatives(dampers: dict[str, float]) -> None:
    """Chain rule; the time of both is that of the first and of the second from its image."""
    model = load_model("kamimura2015-flexible", dampers, apex={"speed": 4.6})
    names = there(model, bool(dampers))
    first = derivative(model, names)
    apex = dict(zip(model.apex, first.image.tolist(), strict=True))
    second = derivative(model.with_values(apex=apex), names)
    run = integrate(model.bind(DEFAULT_TOLERANCE), model.apex_state(), crossings=2)
    assert run.outcome.completed
    symbols = model.system.parameters
    both = linearize(run, [symbols[model.parameter_names.index(name)] for name in names])
    d, scales = len(apex), np.array([scale(model, name) for name in (*apex, *names)])
    moves = np.hstack([first.by_state, first.by_parameters]) * scales
    later = np.vstack([np.hstack([second.by_state, second.by_parameters]), second.time]) * scales
    expected = later[:, :d] / scales[:d] @ moves
    expected[:, d:] += later[:, d:]
    expected[-1] += first.time * scales
    found = np.hstack([both.by_state, both.by_parameters]) * scales
    size = AGREEMENT * np.abs(expected).max()
    np.testing.assert_allclose(found, expected[:-1], rtol=0, atol=size)
    np.testing.assert_allclose(both.time * scales, expected[-1], rtol=0, atol=size)
