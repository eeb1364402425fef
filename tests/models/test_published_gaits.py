"""The gaits of the published setting, and what is known of them from outside this code.

Start values, period and peak force were computed by two independent implementations; see the
notes of the presets.
"""

from __future__ import annotations

import numpy as np
import pytest

from flexspine import load_model, simulate, summarize
from flexspine.models.model import Model

KAMIMURA = ["kamimura2015-flexible", "kamimura2015-rigid", "kamimura2015-locked"]

# Start values as published with the gaits, not as read from the presets.
STARTS = {
    "kamimura2015-flexible": (
        {
            "height": 0.32,
            "fore_pitch": 0.10385204124646978,
            "hind_pitch": -0.10385204124646978,
            "speed": 4.50071645170713,
            "fore_pitch_rate": -3.89389870409466,
            "hind_pitch_rate": -3.89389870409466,
        },
        {"fore": 0.4612813446910027, "hind": 0.5623577670742721},
    ),
    "kamimura2015-rigid": (
        {
            "height": 0.32,
            "pitch": 0.0,
            "speed": 4.574492551159989,
            "pitch_rate": -1.9920339704090326,
        },
        {"fore": 0.6473813436953212, "hind": 0.640034412942317},
    ),
    "kamimura2015-locked": (
        {
            "height": 0.32,
            "pitch": 0.0,
            "speed": 4.532394313920368,
            "pitch_rate": -4.452150384149655,
        },
        {"fore": 0.5184284266253418, "hind": 0.5590421483860446},
    ),
}


@pytest.mark.parametrize("name", KAMIMURA)
def test_the_presets_start_from_the_published_gaits(name: str) -> None:
    model = load_model(name)
    apex, touchdown = STARTS[name]
    assert dict(model.apex) == apex
    assert dict(model.touchdown) == touchdown


@pytest.mark.parametrize("name", KAMIMURA)
def test_a_published_gait_returns_after_one_stride(name: str) -> None:
    run = simulate(load_model(name))
    assert run.phases == ("DF", "FS", "DF", "HS", "DF")
    start, end = run.apexes
    for coordinate, value in start.items():
        assert end[coordinate] == pytest.approx(value, abs=1e-10), coordinate


@pytest.mark.parametrize("name", KAMIMURA)
def test_a_published_gait_has_its_energy_and_speed(name: str) -> None:
    summary = summarize(simulate(load_model(name)))
    assert summary.energy["initial"] == pytest.approx(290, abs=1e-9)
    assert summary.mean_speed == pytest.approx(4.5, abs=1e-10)


def test_the_flexible_gait_has_the_period_and_peak_force_given(flexible: Model) -> None:
    summary = summarize(simulate(flexible))
    assert summary.period == pytest.approx(0.252732108498, abs=5e-13)
    assert summary.peak_grf["fore"] == pytest.approx(530.460494, abs=5e-7)
    assert summary.peak_grf["hind"] == pytest.approx(530.460494, abs=5e-7)


def test_touchdown_and_liftoff_angles_of_a_symmetric_gait_mirror_each_other(
    flexible: Model,
) -> None:
    angles = liftoff_angles(flexible)
    assert angles["fore"] == pytest.approx(-flexible.touchdown["hind"], abs=1e-10)
    assert angles["hind"] == pytest.approx(-flexible.touchdown["fore"], abs=1e-10)


def liftoff_angles(model: Model) -> dict[str, float]:
    """The angle of each leg when it leaves the ground in the first stride."""
    run = simulate(model)
    found = {}
    for arc in run.trajectory.arcs:
        last = run.trajectory.observe(arc, arc(np.array([arc.end])))
        for side, phases in (("fore", ("FS", "DS")), ("hind", ("HS", "DS"))):
            if arc.mode in phases:
                found[side] = float(last[f"{side}_leg_angle"][0])
    return found


def test_an_unstable_gait_falls_when_its_spectral_radius_says(flexible: Model) -> None:
    """Rounding (1e-14) grows by 1.33 a stride: visible after ln(1e12)/ln(1.33) = 97 strides."""
    radius = 1.33
    run = simulate(flexible, strides=200)
    assert run.outcome.name == "fell"
    start = np.array(list(run.apexes[0].values()))
    deviation = [np.max(np.abs(np.array(list(a.values())) - start)) for a in run.apexes]
    n = np.arange(len(deviation))
    growing = [i for i in n if 1e-10 < deviation[i] < 1e-3]
    slope = np.polyfit(growing, np.log([deviation[i] for i in growing]), 1)[0]
    assert np.exp(slope) == pytest.approx(radius, abs=0.01)
    strides_survived = len(run.apexes) - 1
    foreseen = np.log(0.1 / 1e-14) / np.log(radius)
    assert 0.75 * foreseen < strides_survived < 1.25 * foreseen


def test_the_locked_gait_is_stable() -> None:
    """The published setting's locked body at 4.5 m/s is stable: a small push stays small."""
    model = load_model("kamimura2015-locked")
    pushed = model.with_values(apex={"pitch_rate": model.apex["pitch_rate"] + 1e-5})
    run = simulate(pushed, strides=300)
    assert run.outcome.completed
    last = run.apexes[-1]
    assert last["pitch_rate"] == pytest.approx(model.apex["pitch_rate"], abs=1e-3)
