"""The bounder in MuJoCo is the same trunk on springs: momentum, energy, closed forms, refusals."""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import Ground, MachineError, Model, load_model, simulate
from flexspine.engines.mujoco_bounder import MujocoBounder
from flexspine.errors import ParameterError
from flexspine.models.dataset import sample

Array = NDArray[np.float64]

STEP, SHARE = 1e-4, 1e-5

# Nothing of it is as at the other end.
UNEVEN = {
    "fore.mass": 8.0, "fore.inertia": 0.25, "fore.spine_offset": 0.12, "hind.hip_offset": 0.16,
    "spine.damping": 2.0, "spine.rest_angle": 0.05, "fore.leg.stiffness": 7000.0,
    "hind.leg.rest_length": 0.35, "fore.leg.damping": 40.0, "hind.leg.damping": 60.0,
}  # fmt: skip

AT_REST = ("fore_pitch", "hind_pitch", "speed", "fore_pitch_rate", "hind_pitch_rate")


def uneven() -> Model:
    return load_model("kamimura2015-flexible", UNEVEN)


def ahead(engine: MujocoBounder, seconds: float) -> MujocoBounder:
    """Go on from where it is, by whole steps, and work out all that follows."""
    while engine.data.time < seconds:
        engine.advance(engine.step)
    mujoco.mj_forward(engine.model, engine.data)
    return engine


def energy_of(model: Model, toe: float) -> tuple[float, float]:
    """Kinetic and potential energy at the apex, part by part; ``toe`` is the mass of one.

    Points are summed from their places about the joint; legs do not turn, toes move as hips.
    """
    p: Any = model.parameters
    apex, parts, toes = model.apex, [], []
    kinetic = potential = 0.0
    for side, way in (("fore", 1), ("hind", -1)):
        half, angle, rate = getattr(p, side), apex[f"{side}_pitch"], apex[f"{side}_pitch_rate"]
        place = way * np.array([cos(angle), sin(angle)])
        along = np.array([place, rate * np.array([-place[1], place[0]])])
        parts.append((half.mass, half.spine_offset * along))
        toes.append((half, (half.spine_offset + half.hip_offset) * along))
        kinetic += half.inertia * rate**2 / 2
    mean = sum(mass * point for mass, point in parts) / model.mass
    com = np.array([[0, apex["height"]], [apex["speed"], 0]])
    for mass, point in parts:
        y, velocity = (point - mean + com)[0, 1], (point - mean + com)[1]
        kinetic += mass * velocity @ velocity / 2
        potential += mass * p.gravity * y
    for (half, point), angle in zip(toes, model.touchdown.values(), strict=True):
        y, velocity = (point - mean + com)[0, 1], (point - mean + com)[1]
        kinetic += toe * velocity @ velocity / 2
        potential += toe * p.gravity * (y - half.leg.rest_length * cos(angle))
    bend = apex["fore_pitch"] - apex["hind_pitch"] - p.spine.rest_angle
    return kinetic, potential + p.spine.stiffness * bend**2 / 2


@pytest.mark.parametrize("share", [1e-2, 1e-5, 1e-9])
def test_energies_are_ours_and_the_toes(share: float) -> None:
    """A quadratic form in the rates, so that masses and inertias are too."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        apex = dict(zip(AT_REST, rng.uniform(-1, 1, 5) * (0.5, 0.5, 5, 5, 5), strict=True))
        model = uneven().with_values(apex=apex)
        engine = MujocoBounder(model, STEP, share)
        mujoco.mj_forward(engine.model, engine.data)
        potential, kinetic = engine.data.energy
        expected = energy_of(model, share * model.mass)
        assert (kinetic, potential) == pytest.approx(expected, rel=1e-12)
        ours = sample(simulate(model, duration=1e-3), np.zeros(1))
        still = ours["gravity_energy"] + ours["spine_energy"]
        assert kinetic == pytest.approx(ours["kinetic_energy"][0], rel=10 * share + 1e-12)
        assert potential == pytest.approx(still[0], rel=10 * share + 1e-12)


def test_momentum_is_kept_in_flight_while_servos_swing_the_legs(flexible: Model) -> None:
    """Their torques act between leg and trunk: only gravity acts from without."""
    engine = ahead(MujocoBounder(flexible, STEP, SHARE), 0.08)
    while engine._legs[0].stands:
        engine.advance(engine.step)
    fore, toe = (engine.model.body(name).id for name in ("fore", "fore_toe"))
    whole, moved = [], []
    for seconds in engine.data.time + np.linspace(0, 0.01, 100):
        data = ahead(engine, seconds).data
        mujoco.mj_subtreeVel(engine.model, data)
        mass = engine.model.body_subtreemass[fore]
        linear = mass * (data.subtree_linvel[fore] + [0, 9.81 * data.time, 0])
        whole.append([*linear[:2], data.subtree_angmom[fore][2]])
        moved.append(engine.model.body_mass[toe] * data.subtree_linvel[toe][:2])
    thrown = np.linalg.norm(np.ptp(moved, axis=0))
    keeping_up = engine.model.body_mass[toe] * flexible.apex["speed"]
    assert thrown >= 10 * keeping_up
    assert np.ptp(whole, axis=0).max() <= 1e-3 * thrown


def test_legs_in_flight_are_held_at_their_touchdown_angles(flexible: Model) -> None:
    engine = MujocoBounder(flexible, STEP, SHARE)
    for seconds, side in ((0.009, "fore"), (0.15, "fore"), (0.15, "hind")):
        data = ahead(engine, seconds).data
        leg = data.body(f"{side}_toe").xpos - data.body(f"{side}_leg").xpos
        angle = flexible.touchdown[side]
        assert leg[:2] == pytest.approx([0.36 * sin(angle), -0.36 * cos(angle)], abs=1e-5)


def test_a_standing_leg_pushes_along_itself_by_its_spring_and_damper() -> None:
    """What the ground gives to the pin is what shortening and its rate ask for."""
    model = uneven()
    engine = ahead(MujocoBounder(model, STEP, 1e-6), 0.04)
    data, leg = engine.data, model.parameters.fore.leg  # type: ignore[attr-defined]
    assert engine._legs[0].stands
    assert data.nefc == 3, "one pin, in three directions"
    way = data.body("fore_leg").xpos - data.body("fore_toe").xpos
    length = np.linalg.norm(way)
    speed = np.zeros(6)
    body = mujoco.mjtObj.mjOBJ_XBODY, engine.model.body("fore_leg").id
    mujoco.mj_objectVelocity(engine.model, data, *body, speed, 0)
    force = leg.stiffness * (leg.rest_length - length) - leg.damping * speed[3:] @ way / length
    assert force > 100
    assert data.efc_force == pytest.approx(force * way / length, abs=1e-4 * force)
    # An impedance of 0.9999 and, over three directions, 2 / 3 of the toe's inverse mass.
    pin = 1.5e4 * 1e-6 * model.mass / (2 * STEP) ** 2
    assert data.efc_pos == pytest.approx(-data.efc_force / pin, abs=0.02 * force / pin)


def test_pinned_toes_neither_slip_nor_sink(flexible: Model) -> None:
    engine = ahead(MujocoBounder(flexible, 2.5e-5, SHARE), 0.0105)
    toe = engine.data.body("fore_toe")
    landed = toe.xpos.copy()
    for seconds in np.linspace(0.011, 0.088, 20):
        ahead(engine, seconds)
        assert np.abs(toe.xpos - landed).max() <= 2e-6
    assert landed[1] == pytest.approx(0, abs=1e-6)


def test_hips_at_the_com_make_a_mass_on_a_spring() -> None:
    """Dropped on both legs upright, with k = k_f + k_h: both land and leave at once."""
    drop, g = 0.05, 9.81
    model = load_model(
        "kamimura2015-flexible",
        {f"{side}.{what}_offset": 0.0 for side in ("fore", "hind") for what in ("spine", "hip")},
    ).with_values(
        apex=dict.fromkeys(AT_REST, 0.0) | {"height": 0.36 + drop},
        touchdown={"fore": 0.0, "hind": 0.0},
    )
    rate, sag, landing = sqrt(2 * 6340 / 20.8), 20.8 * g / (2 * 6340), sqrt(2 * g * drop)
    down = landing / g
    up = down + (2 * pi - 2 * atan2(landing / rate, sag)) / rate
    deepest = sag + sqrt(sag**2 + (landing / rate) ** 2)
    motion = MujocoBounder(model, 2e-5, SHARE).run(up + down)
    names = ["fore touchdown", "hind touchdown", "fore lift-off", "hind lift-off"]
    assert [contact.name for contact in motion.contacts] == names
    times = [contact.time for contact in motion.contacts]
    assert times == pytest.approx([down, down, up, up], abs=3e-6)
    assert motion.peaks == pytest.approx([6340 * deepest] * 2, rel=3e-5)
    assert motion.times[-1] == pytest.approx(up + down, abs=1e-11)
    assert motion.com[-1] == pytest.approx([0, 0.36 + drop], abs=1e-5)


def test_a_leg_that_lifts_off_low_waits_until_its_hip_has_risen(flexible: Model) -> None:
    """The published gait's fore leg leaves the ground below the height at which it would land."""
    motion = MujocoBounder(flexible, STEP, SHARE).run(0.2527)
    names = [contact.name for contact in motion.contacts]
    assert names == ["fore touchdown", "fore lift-off", "hind touchdown", "hind lift-off"]
    rows = np.searchsorted(motion.times, [contact.time for contact in motion.contacts])
    hips = motion.com[:, 1] + 0.207 * np.sin(motion.pitches[:, 0])
    hips += 0.069 * np.sin(motion.pitches[:, 1])
    reach = 0.36 * cos(flexible.touchdown["fore"])
    assert hips[rows[0]] == pytest.approx(reach, abs=1e-9)
    assert hips[rows[1]] < reach - 1e-3
    assert np.abs(motion.forces[rows]).max() <= 0.1
    assert motion.forces.min() >= -0.1, "legs do not pull"


def test_a_run_can_be_done_again(flexible: Model) -> None:
    engine = MujocoBounder(flexible, STEP, SHARE)
    first, second = engine.run(0.12), engine.run(0.12)
    assert np.array_equal(first.com, second.com)
    assert np.array_equal(first.forces, second.forces)
    assert first.contacts == second.contacts
    assert first.com[0] == pytest.approx([0, 0.32], abs=1e-15)


def test_a_run_that_diverges_says_so_by_nan_and_leaves_no_log(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    flexible: Model,
) -> None:
    monkeypatch.chdir(tmp_path)
    motion = MujocoBounder(flexible.with_values({"spine.stiffness": 1e9}), STEP, SHARE).run(0.1)
    assert np.isnan(motion.com[-1]).all()
    assert np.isfinite(motion.com[0]).all()
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["kamimura2015-rigid", "kamimura2015-locked", "scout2"])
def test_other_bodies_are_refused(name: str) -> None:
    with pytest.raises(ParameterError, match=r"MuJoCo is given flexible ones only; choose"):
        MujocoBounder(load_model(name), STEP, SHARE)


@pytest.mark.parametrize(
    "name", ["legs.extension", "fore.leg.stiffening", "legs.hip_lever", "spine.rest_shift.fore"]
)
def test_actuators_are_refused(name: str, flexible: Model) -> None:
    with pytest.raises(ParameterError, match="has actuators, MuJoCo is given springs"):
        MujocoBounder(flexible.with_values({name: 0.01}), STEP, SHARE)


def test_ground_that_is_not_flat_is_refused(flexible: Model) -> None:
    with pytest.raises(ParameterError, match="only on flat ground"):
        MujocoBounder(flexible.on(Ground.step(0.01)), STEP, SHARE)


@pytest.mark.parametrize(
    ("step", "share"), [(0.0, SHARE), (-1e-4, SHARE), (0.01, SHARE), (STEP, 0.0), (STEP, 0.5)]
)
def test_steps_and_shares_without_sense_are_refused(
    step: float, share: float, flexible: Model
) -> None:
    with pytest.raises(ParameterError, match=r"(step|share) = .* is not usable"):
        MujocoBounder(flexible, step, share)


def test_a_missing_mujoco_is_told(monkeypatch: pytest.MonkeyPatch, flexible: Model) -> None:
    monkeypatch.setattr(mujoco, "__version__", "4.0.0")
    with pytest.raises(MachineError, match=r"mujoco 4\.0\.0 is installed"):
        MujocoBounder(flexible, STEP, SHARE)
