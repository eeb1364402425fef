from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flexspine import Model, load_model, simulate, to_dataset
from flexspine.errors import InputError, ParameterError, StateError


@pytest.mark.parametrize(
    "options",
    [
        {"strides": 2.7},
        {"strides": float("nan")},
        {"strides": True},
        {"strides": "3"},
        {"strides": 0},
        {"duration": "1"},
        {"duration": 0.0},
        {"duration": float("inf")},
        {"strides": 1, "duration": 1.0},
        {"tolerance": "x"},
        {"tolerance": 0.1},
        {"max_steps": 2.5},
        {"max_steps": 0},
        {"toes": {"fore": 0.3}},
        {"state": {"com_z": 1.0}},
        {"state": {"com_y": 0.4}, "toes": {"middle": 0.0}},
        {"state": {"com_y": float("nan")}},
    ],
    ids=str,
)
def test_wrong_arguments_are_refused_by_name(flexible: Model, options: dict[str, Any]) -> None:
    with pytest.raises(InputError) as refused:
        simulate(flexible, **options)
    assert refused.value.remedy


def test_a_leg_that_would_have_to_pull_cannot_be_started_with() -> None:
    model = load_model("slip")
    with pytest.raises(StateError, match="lift-off"):
        simulate(model, state={"com_y": 1.3, "com_x_rate": 1.0}, toes={"fore": 0.3, "hind": -0.3})


def test_a_start_in_the_ground_is_refused(flexible: Model) -> None:
    with pytest.raises(StateError, match="spine joint on the ground"):
        simulate(flexible.with_values(apex={"height": 0.01}))


@pytest.mark.parametrize("kind", [np.float32, np.float64, np.int64, int])
def test_numbers_of_any_kind_will_do(flexible: Model, kind: type) -> None:
    model = flexible.with_values(apex={"speed": kind(4)})
    assert type(model.apex["speed"]) is float
    assert simulate(model).trajectory.events


@pytest.mark.parametrize("times", [[0.1, 5.0], [-0.1], [math.nan], [math.inf]])
def test_no_time_outside_the_run_can_be_sampled(flexible: Model, times: list[float]) -> None:
    with pytest.raises(ParameterError, match="beyond the run"):
        to_dataset(simulate(flexible), times=np.array(times))


def test_no_times_give_no_samples(flexible: Model) -> None:
    assert to_dataset(simulate(flexible), times=np.array([])).sizes["time"] == 0


def test_the_apex_counts_at_the_instant_of_a_touchdown(flexible: Model) -> None:
    """A fore leg that lands exactly at the apex: both happen, whichever rounding puts first."""
    run = simulate(flexible)
    apex = simulate(flexible, duration=run.trajectory.duration)
    data = to_dataset(apex, times=np.array([apex.trajectory.end.time]))
    angle = math.acos(float(data.fore_hip_y[0]) / 0.36)
    # From the first landing on, so that this angle only matters for the second one.
    first = run.trajectory.events[0].after
    state = dict(zip(flexible.state_names, first.states, strict=True))
    state = {name: float(value) for name, value in state.items()}
    for nudge in (-1e-13, 0.0, 1e-13):
        model = flexible.with_values(touchdown={"fore": angle + nudge})
        again = simulate(model, state=state, toes={"fore": float(first.held[0])})
        assert again.outcome.completed
        assert again.trajectory.duration == pytest.approx(
            run.trajectory.duration - run.trajectory.events[0].time, abs=1e-9
        )


def test_a_leg_released_on_landing_is_no_grazing() -> None:
    """Foot behind, leg lengthening: released at once, after which the hip dips and rises again."""
    base = load_model(
        "scout2",
        {"fore.leg.rest_length": 0.8},
        apex={"height": 0.9, "pitch": -1.2, "pitch_rate": -9.0, "speed": 4.0},
    )
    free = simulate(base.with_values(touchdown={"fore": -1.5, "hind": 0.3}), duration=0.2)
    heights = to_dataset(free, interval=1e-5).fore_hip_y.values
    lowest = float(heights.min())
    assert heights[0] > lowest < heights[-1], "or this test means nothing"
    for dip in np.logspace(-7, -2.3, 12):
        angle = -math.acos((lowest + dip) / 0.8)
        run = simulate(base.with_values(touchdown={"fore": angle, "hind": 0.3}), duration=0.2)
        assert run.outcome.name != "grazed", dip
