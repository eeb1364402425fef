"""Physics that every preset must obey; a new preset is tested by being there."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from flexspine import Model, simulate, summarize, to_dataset
from flexspine.models.simulation import Run
from tests.models.test_published_gaits import liftoff_angles


def test_energy_is_conserved_over_ten_strides(preset: Model) -> None:
    run = simulate(preset, strides=10)
    drift = summarize(run).energy["relative_drift"]
    assert drift is not None
    assert drift < 1e-11
    assert run.outcome.completed, "every preset starts from a gait that lasts ten strides"


def test_a_stride_runs_backwards_along_itself(preset: Model) -> None:
    """Reverse all velocities, land with the angles of the lift-offs, and the run retraces itself.

    Source: time reversal of conservative spring legs; the retraced path is compared at 50 times.
    """
    forward = simulate(preset)
    end = forward.apexes[-1]
    rates = {name: -value for name, value in end.items() if name == "speed" or "rate" in name}
    backward = simulate(preset.with_values(apex={**end, **rates}, touchdown=liftoff_angles(preset)))
    assert backward.phases == forward.phases[::-1]
    period = forward.trajectory.duration
    assert backward.trajectory.duration == pytest.approx(period, abs=1e-11)
    times = np.linspace(0, period, 50)
    there = to_dataset(forward, times=times)
    back = to_dataset(backward, times=np.clip(period - times, 0, backward.trajectory.duration))
    for name in forward.model.state_names:
        if "energy" in name or name == "com_x":
            continue
        sign = -1 if name.endswith("_rate") else 1
        np.testing.assert_allclose(
            sign * back[name].values[::-1], there[name].values, atol=1e-10, err_msg=name
        )


def test_no_leg_pulls_on_the_ground(preset: Model) -> None:
    assert_pushing(simulate(preset, strides=3))


def test_no_damped_leg_pulls_on_the_ground(preset: Model) -> None:
    damped = preset.with_values({"fore.leg.damping": 60.0, "hind.leg.damping": 90.0})
    run = simulate(damped, strides=3)
    assert_pushing(run)
    data = to_dataset(run)
    lost = data.dissipated_energy.values
    assert np.all(np.diff(lost) >= -1e-12)
    assert lost[-1] > 1


def test_energy_balance_closes_with_dampers(preset: Model) -> None:
    """What the dampers took, integrated from their power, is what the energies lack."""
    damped = preset.with_values({"fore.leg.damping": 60.0, "hind.leg.damping": 90.0})
    drift = summarize(simulate(damped, strides=3)).energy["relative_drift"]
    assert drift is not None
    assert drift < 1e-11


def assert_pushing(run: Run) -> None:
    data = to_dataset(run, interval=2e-4)
    for side in ("fore", "hind"):
        assert float(data[f"{side}_grf_y"].min()) >= -1e-9
        assert float(data[f"{side}_grf"].min()) >= -1e-9
        assert float(data[f"{side}_grf"].max()) > 1


def test_momentum_changes_by_the_impulse_of_gravity_and_ground(preset: Model) -> None:
    """Newton's second law for the CoM, which the equations of motion never state."""
    run = simulate(preset)
    mass = total_mass(preset)
    gravity = preset.parameters.gravity
    edges = np.array([0.0, *(event.time for event in run.trajectory.events)])
    impulse = np.zeros(2)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for left, right in pairwise(edges):
        times = left + (right - left) * (nodes + 1) / 2
        data = to_dataset(run, times=times)
        for axis, name in enumerate(("grf_x", "grf_y")):
            force = data[f"fore_{name}"].values + data[f"hind_{name}"].values
            impulse[axis] += float(weights @ force) * (right - left) / 2
    impulse[1] -= mass * gravity * run.trajectory.duration
    names = run.model.state_names
    rows = [names.index("com_x_rate"), names.index("com_y_rate")]
    change = run.trajectory.end.states[rows] - run.trajectory.start.states[rows]
    np.testing.assert_allclose(mass * change, impulse, atol=1e-8 * mass)


def total_mass(model: Model) -> float:
    parameters = model.parameters
    if hasattr(parameters, "body"):
        return float(parameters.body.mass)
    return float(parameters.fore.mass + parameters.hind.mass)


def test_the_stance_toe_stays_where_it_landed(preset: Model) -> None:
    run = simulate(preset)
    data = to_dataset(run, interval=1e-3)
    for side, phases in (("fore", ("FS", "DS")), ("hind", ("HS", "DS"))):
        stance = np.isin(data.phase.values, phases)
        toe = data[f"{side}_toe_x"].values[stance]
        assert np.ptp(toe) == 0
        hip = data[f"{side}_hip_x"].values[stance], data[f"{side}_hip_y"].values[stance]
        length = np.hypot(hip[0] - toe, hip[1])
        np.testing.assert_allclose(data[f"{side}_leg_length"].values[stance], length, atol=1e-14)


def test_the_same_run_twice_is_the_same_to_the_bit(preset: Model) -> None:
    first, second = simulate(preset, strides=3), simulate(preset, strides=3)
    assert np.array_equal(first.trajectory.end.states, second.trajectory.end.states)
    assert [e.time for e in first.trajectory.events] == [e.time for e in second.trajectory.events]


def test_recording_does_not_change_a_run(preset: Model) -> None:
    from flexspine.hybrid.integrate import integrate

    recorded = simulate(preset, strides=2)
    plain = integrate(preset.bind(recorded.tolerance), preset.apex_state(), crossings=2)
    np.testing.assert_allclose(plain.end.states, recorded.trajectory.end.states, rtol=0, atol=1e-11)
    assert plain.modes == recorded.phases
    assert plain.arcs == ()
