"""Charts of the set of gaits: every point of one is a gait, whatever was asked of it."""

from __future__ import annotations

import numpy as np
import pytest

from flexspine import Model, examine
from flexspine.gaits.chart import Chart, lead
from flexspine.gaits.problem import Problem
from flexspine.models.simulation import DEFAULT_TOLERANCE

FREE = ("legs.extension", "spine.damping", "spine.stiffness")


@pytest.fixture
def problem(flexible: Model) -> Problem:
    """Gaits with dampers, thrust and any stiffness: two more unknowns than equations."""
    own = examine(flexible).quantities
    return Problem(flexible, own, free=FREE, tolerance=DEFAULT_TOLERANCE)


def test_coordinates_lead_to_gaits_that_have_them(problem: Problem) -> None:
    point = problem.point(problem.model)
    chart = Chart(problem, point, problem.linearize(problem.evaluate(point)))
    assert chart.basis.shape == (len(problem.unknowns), 2)
    for at in (np.array([0.02, 0.0]), np.array([-0.01, 0.03])):
        found = chart.solve(at, point, chart.basis)
        assert found.solved
        assert chart.coordinates(found.point) == pytest.approx(at, abs=1e-11)
        assert problem.evaluate(found.point).norm < 1e-11


def test_the_tangent_is_how_gaits_move_with_their_coordinates(problem: Problem) -> None:
    point = problem.point(problem.model)
    chart = Chart(problem, point, problem.linearize(problem.evaluate(point)))
    here = chart.solve(np.array([0.02, -0.01]), point, chart.basis).point
    tangent = chart.tangent(problem.linearize(problem.evaluate(here)))
    step = 1e-5
    for way in range(2):
        ends = [
            chart.solve(chart.coordinates(here) + s * np.eye(2)[way], here, tangent).point
            for s in (step, -step)
        ]
        difference = (ends[0] - ends[1]) / (2 * step)
        assert tangent[:, way] == pytest.approx(difference, abs=1e-5)


def test_a_gait_is_led_to_wanted_values_to_the_last_digit(problem: Problem) -> None:
    wanted = {"spine.damping": 0.2, "spine.stiffness": 255.0}
    way = lead(problem, problem.point(problem.model), wanted)
    model = problem.at(way[-1])
    assert model.numbers["spine.damping"] == 0.2
    assert model.numbers["spine.stiffness"] == pytest.approx(255.0, rel=1e-15)
    gait = examine(model)
    assert gait.flaw is None
    assert gait.quantities == pytest.approx(examine(problem.model).quantities, rel=1e-11)


def test_a_gait_that_cannot_be_led_there_stays_a_gait(problem: Problem) -> None:
    """A damper so firm that the equations cannot be integrated is not reached."""
    way = lead(problem, problem.point(problem.model), {"spine.damping": 1e6})
    assert 0 < problem.at(way[-1]).numbers["spine.damping"] < 1e6
    assert all(examine(problem.at(point)).flaw is None for point in way)
