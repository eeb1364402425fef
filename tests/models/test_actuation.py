"""Actuators of bounders: what they give is what the animal has more."""

from __future__ import annotations

import pytest

from flexspine import Model, simulate, summarize

CASES = {
    "longer legs": {"legs.extension": 0.008, "fore.leg.extension": -0.004},
    "stiffer legs": {"legs.stiffening": 0.1, "hind.leg.stiffening": -0.15},
    "hips": {"legs.hip_lever": 0.01, "fore.leg.hip_lever": -0.005},
    "a spine that changes": {
        "spine.stiffness_shift.fore": 0.2, "spine.stiffness_shift.between": -0.3,
        "spine.rest_shift.hind": 0.05, "spine.rest_shift.flight": 0.02,
    },
    "all, with dampers": {
        "legs.extension": 0.01, "fore.leg.stiffening": 0.1, "legs.hip_lever": 0.02,
        "spine.stiffness_shift.hind": 0.2, "spine.rest_shift.between": 0.1,
        "spine.damping": 0.5, "fore.leg.damping": 10.0, "hind.leg.damping": 20.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_energy_is_what_actuators_give_and_dampers_take(flexible: Model, case: str) -> None:
    run = simulate(flexible.with_values(CASES[case]), strides=2)
    summary = summarize(run)
    assert run.outcome.completed
    assert sum(abs(work.net) for work in summary.work.values()) > 0.5
    assert summary.energy["relative_drift"] is not None
    assert summary.energy["relative_drift"] < 1e-12


def test_cost_of_transport_counts_what_is_given_and_not_what_is_taken_back(flexible: Model) -> None:
    """A leg that gets longer by 1 cm gives more than k d^2 / 2, whatever its compression."""
    summary = summarize(simulate(flexible.with_values({"legs.extension": 0.01})))
    given = [work.positive for work in summary.work.values()]
    assert len(given) == 2
    assert min(given) > 6340 * 0.01**2 / 2
    assert [work.net for work in summary.work.values()] == pytest.approx(given)
    weight = 2 * 10.4 * 9.81
    assert summary.cost_of_transport == pytest.approx(sum(given) / (weight * summary.distance))


def test_an_animal_without_actuators_costs_nothing(flexible: Model) -> None:
    summary = summarize(simulate(flexible))
    assert summary.work == {}
    assert summary.cost_of_transport == 0.0
