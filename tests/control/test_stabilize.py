"""Feedback at apexes: what it does to deviations, to noise and to energy."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from flexspine import Gait, Model, examine, floquet_multipliers, load_model, stride_map
from flexspine.control.stabilize import ANGLES, EFFORT, Stabilizer, stabilize
from flexspine.control.steered_record import steered_record
from flexspine.control.steering import Fixed, Noise, Steering, steer
from flexspine.errors import FlexspineError, ParameterError, UnknownNameError

Array = NDArray[np.float64]

THRUST = (*ANGLES, "legs.extension")


@cache
def gait() -> Gait:
    """The published one, which is unstable."""
    return examine(load_model("kamimura2015-flexible"))


@cache
def design(*inputs: str, method: str = "lqr", twice: bool = False) -> Stabilizer:
    return stabilize(gait(), inputs, method=method, twice=twice)


def deviations(steering: Steering, start: Array, strides: int) -> Array:
    """Of the apexes from the gait's, in natural units, from a start that is off by ``start``."""
    model = gait().model
    scales = np.array([model.scales[name] for name in model.apex])
    apex = np.array(list(model.apex.values()))
    moved = dict(zip(model.apex, (apex + start * scales).tolist(), strict=True))
    run = steer(model.with_values(apex=moved), steering, strides=strides)
    assert run.outcome.completed
    return (np.array([list(each.values()) for each in run.apexes]) - apex) / scales


def fixed() -> Fixed:
    return Fixed(ANGLES, np.array([gait().model.numbers[name] for name in ANGLES]))


def test_without_feedback_deviations_grow_by_the_spectral_radius() -> None:
    stability = floquet_multipliers(gait())
    start = 1e-9 * stability.vectors[:, 0].real
    sizes = np.linalg.norm(deviations(fixed(), start, 45), axis=1)
    growth = np.exp(np.polyfit(np.arange(10, 46), np.log(sizes[10:]), 1)[0])
    assert growth == pytest.approx(stability.spectral_radius, rel=0.02)


@pytest.mark.parametrize(
    ("inputs", "twice"), [(ANGLES, False), (ANGLES, True), (THRUST, False), (THRUST, True)]
)
def test_feedback_does_to_a_deviation_what_its_map_says(
    inputs: tuple[str, ...], twice: bool
) -> None:
    """Each direction alone, one stride: differences of runs against the designed map."""
    found = design(*inputs, twice=twice)
    whole = np.eye(6)
    for part, gain in zip(found.parts, found.gains, strict=True):
        whole = (part.matrix - part.inputs @ gain) @ whole
    step = 1e-6
    for column, direction in enumerate(np.eye(6)):
        ends = [deviations(found, sign * step * direction, 1)[-1] for sign in (1, -1)]
        slope = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(slope, whole[:, column], rtol=0, atol=1e-6 * np.abs(whole).max())
    assert found.level_spectral_radius < 1


def test_multipliers_of_the_gait_without_gains_are_floquet_multipliers() -> None:
    (part,) = design(*ANGLES).parts
    own = np.sort(np.abs(np.linalg.eigvals(part.matrix)))
    known = np.sort(np.abs(floquet_multipliers(gait()).multipliers))
    assert own == pytest.approx(known, rel=1e-6)


def test_gains_are_those_of_the_discrete_riccati_equation() -> None:
    """With thrust, where no level is left out; SciPy solves the equation in another way."""
    found = design(*THRUST)
    model = gait().model
    linear = stride_map(model, parameters=THRUST)
    scales = np.array([model.scales[name] for name in model.apex])
    inputs = np.array([model.scales.get(name, 1.0) for name in THRUST])
    a = linear.by_state * scales / scales[:, None]
    b = linear.by_parameters * inputs / scales[:, None]
    cost = solve_discrete_are(a, b, np.eye(6), EFFORT * np.eye(3))
    gain = np.linalg.solve(EFFORT * np.eye(3) + b.T @ cost @ b, b.T @ cost @ a)
    np.testing.assert_allclose(found.gains[0], gain, rtol=0, atol=1e-8 * np.abs(gain).max())


def test_deadbeat_feedback_is_done_in_two_strides_with_three_inputs() -> None:
    """Six coordinates by three inputs; what is left is of second order."""
    found = design(*THRUST, method="deadbeat")
    start = 1e-6 * np.array([1.0, -0.5, 0.3, 0.7, -0.2, 0.4])
    left = np.abs(deviations(found, start, 2)).max(axis=1)
    assert left[1] > 1e-8
    assert left[2] < 1e-9


def test_angles_cannot_change_the_energy_and_thrust_can() -> None:
    """A start that is off in speed, so in energy."""
    start = np.array([0.0, 0.0, 0.0, 1e-4, 0.0, 0.0])
    by_angles = deviations(design(*ANGLES, twice=True), start, 60)
    by_thrust = deviations(design(*THRUST, twice=True), start, 60)
    assert np.abs(by_angles[-1]).max() > 1e-5
    assert np.abs(by_thrust[-1]).max() < 1e-12
    one = np.abs(design(*ANGLES).multipliers - 1).min()
    assert one < 1e-9, "the multiplier 1 of energy stays"


@pytest.mark.parametrize("seed", range(6))
def test_the_published_gait_bounds_a_thousand_strides_with_noisy_angles(seed: int) -> None:
    noise = Noise(acting=0.01, uniform=True)
    run = steer(gait().model, design(*THRUST, twice=True), strides=1000, noise=noise, seed=seed)
    assert run.outcome.completed
    assert len(run.trajectory.crossings) == 1000


def test_the_same_seed_repeats_bit_for_bit_and_another_does_not() -> None:
    noise = Noise(sensing=1e-3, acting=1e-3)
    ends = [
        steer(gait().model, design(*THRUST), strides=20, noise=noise, seed=seed)
        .trajectory.end.states.tolist()
        for seed in (1, 1, 2)
    ]  # fmt: skip
    assert ends[0] == ends[1] != ends[2]


def test_a_recorded_run_is_the_same_and_can_be_looked_at() -> None:
    found = design(*THRUST, twice=True)
    runs = [steer(gait().model, found, strides=3, record=record) for record in (False, True)]
    assert len(runs[1].trajectory.arcs) > 10
    ends = [run.trajectory.end.states for run in runs]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-11)


BAD = {
    "unknown input": ({"inputs": ("touchdown.for",)}, UnknownNameError, "touchdown.fore"),
    "nothing to steer": ({"inputs": ()}, ParameterError, "nothing to steer"),
    "twice the same": ({"inputs": (ANGLES[0], ANGLES[0])}, ParameterError, "twice"),
    "unknown method": ({"method": "lqg"}, UnknownNameError, "lqr"),
    "no effort": ({"effort": 0.0}, ParameterError, "effort = 0"),
    "deadbeat twice": ({"method": "deadbeat", "twice": True}, ParameterError, "once a stride"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_designed_is_refused(case: str) -> None:
    options, kind, told = BAD[case]
    with pytest.raises(kind, match=told):
        stabilize(gait(), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("method", ["lqr", "deadbeat"])
def test_inputs_that_reach_nothing_are_refused(method: str) -> None:
    """The gait never has both legs on the ground, so a spine that changes then changes nothing."""
    with pytest.raises(FlexspineError, match=r"legs\.extension"):
        stabilize(gait(), ("spine.rest_shift.both",), method=method)


def test_energy_of_a_steered_run_is_accounted_for() -> None:
    """What thrust gave and dampers took is what the energy changed by."""
    damped = gait().model.with_values({"spine.damping": 0.005})
    run = steer(damped, design(*THRUST, twice=True), strides=20, noise=Noise(acting=0.002), seed=3)
    assert run.outcome.completed
    record = steered_record(run, gait())
    work = sum(record["net_work"].values())
    # By hand from the apexes: kinetic, of weight and of the spine; the legs hold none there.
    start, end = (energy_at(run.model, apex) for apex in (run.apexes[0], run.apexes[-1]))
    assert record["energy_at_start"] == pytest.approx(start, rel=1e-12)
    assert record["energy_at_end"] == pytest.approx(end, rel=1e-12)
    assert record["dissipated"] > 0.1
    assert abs(work) > 1e-3
    assert end - start == pytest.approx(work - record["dissipated"], abs=1e-9)
    assert record["energy_unaccounted"] < 1e-11


def energy_at(model: Model, apex: dict[str, float]) -> float:
    """In flight: both segments have the velocity of the CoM and turn about the joint."""
    n = model.numbers
    mass, inertia, arm = (n[f"fore.{each}"] for each in ("mass", "inertia", "spine_offset"))
    fore, hind = apex["fore_pitch"], apex["hind_pitch"]
    turning = (apex["fore_pitch_rate"] + apex["hind_pitch_rate"]) / 2
    bending = (apex["fore_pitch_rate"] - apex["hind_pitch_rate"]) / 2
    phi = (fore - hind) / 2
    kinetic = mass * apex["speed"] ** 2
    kinetic += (inertia + mass * arm**2 * np.cos(phi) ** 2) * turning**2
    kinetic += (inertia + mass * arm**2 * np.sin(phi) ** 2) * bending**2
    spring = n["spine.stiffness"] * (fore - hind) ** 2 / 2
    return float(kinetic + 2 * mass * n["gravity"] * apex["height"] + spring)


def test_feedback_for_another_kind_of_body_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"'flexible-bounder' cannot steer 'rigid-bounder'"):
        steer(load_model("scout2"), design(*ANGLES), strides=2)


def test_advice_after_a_fall_is_about_the_feedback() -> None:
    run = steer(gait().model, design(*ANGLES), strides=300, noise=Noise(acting=0.5), seed=1)
    record = steered_record(run, gait(), design(*ANGLES))
    assert record["outcome"] == "fell"
    assert "steer otherwise" in record["advice"]


def test_steering_that_gives_too_few_numbers_is_refused() -> None:
    short = Fixed(("touchdown.fore", "touchdown.hind"), np.array([0.46]))
    with pytest.raises(ParameterError, match=r"an array of shape \(1,\), not \(2,\)") as raised:
        steer(load_model("kamimura2015-flexible"), short)
    assert "touchdown.fore, touchdown.hind" in raised.value.remedy
