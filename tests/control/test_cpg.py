"""Oscillators: phases that get into step, feet without jumps, a robot that steps by them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flexspine import Cpg, Pace, Trot, load_robot, rhythm, robot_dataset, summarize_walk, trot
from flexspine.control.cpg import Beat
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.models.leg_geometry import legs_of

Array = NDArray[np.float64]

ROBOT = load_robot("sc618")
LEGS = legs_of(ROBOT)
NAMES = list(LEGS)


def shares(beat: Beat) -> Array:
    return np.asarray((beat.phases / (2 * np.pi)) % 1, dtype=float)


def test_a_trot_has_diagonal_pairs_in_phase_and_a_bound_those_of_a_hip() -> None:
    for name, together in (("trot", ("hind_1", "fore_2")), ("bound", ("hind_1", "hind_2"))):
        beat = Cpg(rhythm(name, LEGS)).begin()
        first, second = (shares(beat)[NAMES.index(leg)] for leg in together)
        assert first == second
        others = [shares(beat)[i] for i, leg in enumerate(NAMES) if leg not in together]
        assert np.abs(np.array(others) - first) == pytest.approx(0.5)


def test_phases_are_those_of_the_differential_equation() -> None:
    pattern = Cpg(rhythm("trot", LEGS))
    start = np.array([0.3, -2.0, 1.0, 4.0])
    lags = 2 * np.pi * np.array([pattern.rhythm.offsets[leg] for leg in NAMES])

    def slope(_: float, phases: Array) -> list[float]:
        return [
            2 * np.pi * 1.25
            + 5.0 * sum(np.sin(phases[j] + lags[j] - phases[i] - lags[i]) for j in range(4))
            for i in range(4)
        ]

    expected = solve_ivp(slope, (0, 0.5), start, rtol=1e-11, atol=1e-11).y[:, -1]
    beat = pattern.begin(start)
    for number in range(500):
        beat = pattern.advance(beat, number * 1e-3, 1e-3)
    assert beat.phases == pytest.approx(expected, abs=1e-9)


def test_legs_get_into_step_from_any_phases() -> None:
    pattern = Cpg(rhythm("bound", LEGS))
    beat = pattern.begin(np.random.default_rng(1).uniform(0, 6, 4))
    for number in range(4000):
        beat = pattern.advance(beat, number * 2.5e-3, 2.5e-3)
    lead = np.exp(2j * np.pi * (shares(beat) + list(pattern.rhythm.offsets.values())))
    assert np.abs(lead - lead[0]).max() < 1e-9
    assert pattern.rates(beat.phases) == pytest.approx(np.full(4, 2 * np.pi * 1.25))


def test_the_amplitude_rises_and_falls_as_a_critically_damped_spring() -> None:
    """``1 - (1 + 6 t) exp(-6 t)``, and back after the stop; no jump in its rate."""
    pattern = Cpg(rhythm("trot", LEGS)).with_stop(1.0)
    beat, step = pattern.begin(), 1e-3
    for number in range(1000):
        beat = pattern.advance(beat, number * step, step)
    assert beat.amplitude == pytest.approx(1 - 7 * np.exp(-6), rel=1e-9)
    assert beat.amplitude_rate == pytest.approx(36 * np.exp(-6), rel=1e-9)
    for number in range(1000, 4000):
        beat = pattern.advance(beat, number * step, step)
    assert 0 < beat.amplitude < 1e-4


@pytest.mark.parametrize("duty", [0.3, 0.55, 0.8])
def test_feet_move_without_a_jump_and_as_fast_as_they_say(duty: float) -> None:
    pattern = Cpg(replace(rhythm("trot", LEGS), duty=duty))
    step = 1e-4
    beat = Beat(pattern.begin().phases, 0.7, 0.4)
    places, rates = [], []
    for _ in range(9000):  # more than a cycle of 0.8 s
        place, velocity = pattern.feet(beat)
        places.append(place)
        rates.append(velocity)
        phases = beat.phases + pattern.rates(beat.phases) * step
        beat = Beat(phases, beat.amplitude + 0.4 * step, 0.4)
    found, slopes = np.array(places), np.array(rates)
    differences = np.diff(found, axis=0) / step
    assert np.abs(differences - (slopes[1:] + slopes[:-1]) / 2).max() < 1e-5
    assert found[:, :, 1].min() == pytest.approx(-0.33)


def test_a_foot_that_stands_goes_back_by_its_stride_at_constant_speed() -> None:
    cycle = rhythm("trot", LEGS)
    pattern = Cpg(cycle)
    stance = np.linspace(0, 0.599999, 50)
    feet = [pattern.feet(Beat(np.full(4, 2 * np.pi * s), 1.0, 0.0)) for s in stance]
    x = np.array([place[0, 0] for place, _ in feet])
    assert x == pytest.approx(0.14 * (0.5 - stance / 0.6))
    assert all(place[0, 1] == -0.33 for place, _ in feet)
    in_step = pattern.feet(Beat(pattern.begin().phases, 1.0, 0.0))[1]
    assert in_step[0, 0] == pytest.approx(-cycle.speed)


def test_the_robot_steps_by_the_rhythm_and_stops() -> None:
    run = trot(ROBOT, Trot(seconds=1.9, controller="cpg", gait=Pace(stop=0.9)))
    assert run.outcome.completed
    data = robot_dataset(run)
    x, times = data["com"].values[:, 0], data["time"].values
    going = (x[times <= 0.9][-1] - x[times <= 0.5][-1]) / 0.4
    assert 0.15 < going < 0.35
    assert abs(x[-1] - x[times <= 1.7][-1]) < 0.01
    swings = data["reference"].values
    assert np.ptp(swings[times < 0.02], axis=0).max() < 0.02  # a smooth start
    assert summarize_walk(run).imbalance < 1e-8


def test_what_is_no_rhythm_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="pronk"):
        rhythm("pronk", LEGS)
    with pytest.raises(ParameterError, match="duty"):
        replace(rhythm("trot", LEGS), duty=1.5)
    with pytest.raises(ParameterError, match="two legs"):
        rhythm("trot", {name: LEGS[name] for name in ("hind_1", "fore_1")})
