from __future__ import annotations

import json

import numpy as np
import pytest

from flexspine import Model, load_model, simulate, summarize, to_dataset
from flexspine.gaits.record import run_record


def test_the_peak_is_the_top_of_the_sampled_force(preset: Model) -> None:
    run = simulate(preset)
    data = to_dataset(run, interval=2e-5)
    summary = summarize(run)
    for side in ("fore", "hind"):
        sampled = float(data[f"{side}_grf"].max())
        assert sampled <= summary.peak_grf[side] * (1 + 1e-12)
        assert summary.peak_grf[side] == pytest.approx(sampled, rel=1e-6)
        assert summary.peak_grf_vertical[side] == pytest.approx(
            float(data[f"{side}_grf_y"].max()), rel=1e-6
        )


def test_the_peak_of_a_vertical_hop_is_that_of_an_undamped_spring() -> None:
    """Falling by H on a spring k of rest length l: F = m g + sqrt((m g)^2 + 2 k m g H)."""
    model = load_model(
        "slip", apex={"height": 1.2, "speed": 0.0}, touchdown={"fore": 0.0, "hind": 0.0}
    )
    weight, stiffness, fall = 100 * 10.0, 10_000.0, 0.2
    expected = weight + (weight**2 + 2 * stiffness * weight * fall) ** 0.5
    summary = summarize(simulate(model))
    assert summary.peak_grf["fore"] + summary.peak_grf["hind"] == pytest.approx(expected, rel=1e-12)


def test_duty_factors_come_from_the_events(flexible: Model) -> None:
    run = simulate(flexible)
    times = {name: event.time for event in run.trajectory.events for name in event.names}
    summary = summarize(run)
    assert summary.duty_factor is not None
    for side in ("fore", "hind"):
        stance = times[f"{side} lift-off"] - times[f"{side} touchdown"]
        assert summary.duty_factor[side] == pytest.approx(stance / times["apex"], abs=1e-14)


def test_stride_measures_fit_together(preset: Model) -> None:
    summary = summarize(simulate(preset, strides=2))
    assert summary.period is not None
    assert summary.stride_length is not None
    assert summary.stride_frequency == pytest.approx(1 / summary.period)
    assert summary.distance == pytest.approx(2 * summary.stride_length, abs=1e-9)
    assert summary.mean_speed == pytest.approx(summary.stride_length / summary.period, abs=1e-9)


def test_the_spine_range_holds_the_sampled_angles(flexible: Model) -> None:
    run = simulate(flexible)
    summary = summarize(run)
    angle = to_dataset(run, interval=1e-5).spine_angle.values
    assert summary.spine_range == pytest.approx((angle.min(), angle.max()), abs=1e-8)
    assert summary.spine_range[1] == pytest.approx(2 * 0.10385204124646978, abs=1e-12)


def test_a_record_is_valid_json_without_nan() -> None:
    model = load_model("kamimura2015-flexible", touchdown={"fore": -0.3, "hind": -0.3})
    record = run_record(simulate(model))
    text = json.dumps(record, allow_nan=False)
    assert json.loads(text)["outcome"] == "fell"
    assert record["period"] is None
    assert record["duty_factor"] == {"fore": None, "hind": None}
    assert np.isfinite(record["energy"]["relative_drift"])
