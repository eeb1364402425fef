"""The dataset of a robot's run: shapes, units, and numbers that a linkage tells otherwise."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from flexspine import InputError, load_robot
from flexspine.models.bound_robot import Push
from flexspine.models.robot_run import ROBOT_VARIABLES, RobotRun, robot_dataset
from tests.robot_by_scipy import Falling
from tests.robots import TOLERANCE, Steady, above_ground, dropped

Array = NDArray[np.float64]

TORQUES = {"knee_2": 3.0, "hip_1": -4.0, "hip_2": 1.5, "hip_3": 2.0, "knee_4": -2.5}
PUSH = Push(0.18, (3.0, -1.0), "fore_trunk")
FRICTION = 0.5
SECONDS = 0.265
SIZES = {"joint": 9, "motor": 8, "link": 10, "foot_name": 4, "axis": 2}


@pytest.fixture(scope="module")
def run() -> RobotRun:
    """The robot falls on its feet and is pushed."""
    drive = Steady(load_robot("sc618", {"friction": FRICTION}), TORQUES)
    bound, trajectory = dropped(drive, SECONDS, push=PUSH)
    return RobotRun(bound, trajectory, TOLERANCE, {"height": 0.05})


@pytest.fixture(scope="module")
def data(run: RobotRun) -> xr.Dataset:
    return robot_dataset(run)


def test_every_quantity_has_its_place_and_unit(data: xr.Dataset) -> None:
    count = data.sizes["time"]
    assert count == 266
    for name, size in SIZES.items():
        assert data.sizes[name] == size
    for name, (dims, unit, text) in ROBOT_VARIABLES.items():
        if name in ("reference", "reference_rate"):
            continue  # no one said how joints are to move
        assert data[name].dims == dims
        assert (data[name].units, data[name].long_name) == (unit, text)
        assert np.isfinite(data[name]).all()
    assert "reference" not in data
    assert list(data.axis.values) == ["x", "y"]
    assert "spine" in data.joint
    assert "spine" not in data.motor
    assert data.time.units == "s"
    assert data.event_impulse.dims == ("event", "foot_name", "axis")
    assert data.event_impulse.units == "N s"


def test_times_are_those_asked_for(run: RobotRun, data: xr.Dataset) -> None:
    assert np.diff(data.time) == pytest.approx([1e-3] * 265, abs=1e-12)
    assert (float(data.time[0]), float(data.time[-1])) == (0.0, SECONDS)
    coarse = robot_dataset(run, interval=0.1)
    assert coarse.time.values == pytest.approx([0.0, 0.1, 0.2, SECONDS])
    chosen = robot_dataset(run, times=np.array([0.2, 0.05, 0.1]))
    assert chosen.time.values.tolist() == [0.05, 0.1, 0.2]
    for name in ("com", "link_angle", "grf", "kinetic_energy"):
        # NumPy rounds differently in tables of different lengths.
        np.testing.assert_allclose(chosen[name][-1], coarse[name][2], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("interval", [0.0, -1.0, np.nan, np.inf, 1e-12])
def test_intervals_that_make_no_samples_are_refused(run: RobotRun, interval: float) -> None:
    with pytest.raises(InputError, match="interval") as refused:
        robot_dataset(run, interval=interval)
    assert refused.value.remedy


@pytest.mark.parametrize("times", [[-0.1], [0.1, 0.3], [np.nan]])
def test_times_beyond_the_run_are_refused(run: RobotRun, times: list[float]) -> None:
    with pytest.raises(InputError, match="beyond the run"):
        robot_dataset(run, times=np.array(times))


def test_points_are_where_angles_and_lengths_put_them(run: RobotRun, data: xr.Dataset) -> None:
    """Link by link, from the first one's start; feet on their links; masses in the middle."""
    numbers, robot = run.robot.numbers, run.robot
    first, weighted = next(iter(robot.parents)), np.zeros((data.sizes["time"], 2))
    for link, parent in robot.parents.items():
        angle = data.link_angle.sel(link=link).values
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        start = data.link_start.sel(link=link).values
        end = start + numbers[f"{link}.length"] * along
        np.testing.assert_allclose(data.link_end.sel(link=link), end, atol=1e-14)
        if parent is None:
            assert link == first
        else:
            back = data.link_angle.sel(link=parent).values
            way = np.stack([np.cos(back), np.sin(back)], axis=1)
            base = data.link_start.sel(link=parent).values
            np.testing.assert_allclose(start, base + numbers[f"{link}.at"] * way, atol=1e-14)
            (joint,) = [name for name, (each, _) in robot.joints.items() if each == link]
            np.testing.assert_allclose(data.angle.sel(joint=joint), angle - back, atol=1e-14)
        weighted += numbers[f"{link}.mass"] * (start + numbers[f"{link}.com"] * along)
        for foot, its in robot.feet.items():
            if its == link:
                place = start + numbers[f"{foot}.at"] * along
                np.testing.assert_allclose(data.foot.sel(foot_name=foot), place, atol=1e-14)
                weighted += numbers[f"{foot}.mass"] * place
    whole = sum(value for name, value in numbers.items() if name.endswith(".mass"))
    np.testing.assert_allclose(data.com, weighted / whole, atol=1e-14)
    trunk = data.link_angle.sel(link=["hind_trunk", "fore_trunk"]).mean("link")
    np.testing.assert_allclose(data.trunk_pitch, trunk, atol=1e-14)


def test_rates_are_the_slopes_of_what_they_are_rates_of(run: RobotRun) -> None:
    """In flight, by central differences."""
    h = 1e-5
    data = robot_dataset(run, times=np.array([0.04 - h, 0.04, 0.04 + h]))
    for name in ("com", "angle"):
        slope = (data[name][2] - data[name][0]) / (2 * h)
        np.testing.assert_allclose(data[f"{name}_rate"][1], slope, atol=1e-5)
    assert float(data.com_rate[1].sel(axis="y")) == pytest.approx(-9.81 * 0.04, abs=1e-10)


def test_it_starts_as_it_was_let_go(run: RobotRun, data: xr.Dataset) -> None:
    q, rates = above_ground(run.robot)
    linkage = run.robot.linkage
    other = Falling(run.robot)
    for foot in run.robot.feet:
        place, _ = other.foot(foot, q, rates)
        np.testing.assert_allclose(data.foot[0].sel(foot_name=foot), place, atol=1e-14)
    np.testing.assert_allclose(data.com_rate[0], [1.0, 0.0], atol=1e-14)
    assert float(data.kinetic_energy[0]) == pytest.approx(linkage.mass / 2, rel=1e-14)
    height = float(data.com[0].sel(axis="y"))
    spring = 240.0 * 0.05**2 / 2
    weight = linkage.mass * 9.81 * height
    assert float(data.potential_energy[0]) == pytest.approx(weight + spring, rel=1e-13)


def test_the_ground_bears_the_weight_and_what_accelerates(run: RobotRun) -> None:
    """Newton for the whole body, where it touches and where not."""
    h = 1e-6
    for time in (0.05, 0.13, 0.15, 0.21, 0.25):
        data = robot_dataset(run, times=np.array([time - h, time, time + h]))
        assert len(set(data.footing.values)) == 1
        push = data.grf[1].sum("foot_name").values
        gain = (data.com_rate[2] - data.com_rate[0]).values / (2 * h)
        mass = run.robot.linkage.mass
        np.testing.assert_allclose(push, mass * (gain + np.array([0.0, 9.81])), atol=1e-4)


def test_torques_and_energies_are_what_motors_do(data: xr.Dataset) -> None:
    for motor in data.motor.values:
        assert np.all(data.torque.sel(motor=motor) == TORQUES.get(str(motor), 0.0))
    work = sum(
        torque * (data.angle.sel(joint=joint) - data.angle[0].sel(joint=joint))
        for joint, torque in TORQUES.items()
    )
    np.testing.assert_allclose(data.motor_work, work, atol=1e-11)
    np.testing.assert_allclose(data.total_energy, data.kinetic_energy + data.potential_energy)
    balance = data.total_energy + data.dissipated_energy + data.impact_loss - data.motor_work
    np.testing.assert_allclose(balance, balance[0], rtol=1e-10)
    assert float(np.diff(data.dissipated_energy).min()) >= 0


def test_footings_are_named_by_what_each_foot_does(data: xr.Dataset) -> None:
    marks = {0.0: "", 1.0: " >", -1.0: " <"}
    for i in range(data.sizes["time"]):
        parts = [
            f"{foot}{marks[float(data.slides[i].sel(foot_name=foot))]}"
            for foot in data.foot_name.values
            if data.stands[i].sel(foot_name=foot) == 1
        ]
        assert str(data.footing[i].values) == (" + ".join(parts) or "flight")
    assert "flight" in data.footing.values
    assert any(">" in name for name in data.footing.values)
    in_the_air = data.stands == 0
    assert not data.grf.where(in_the_air, 0.0).any()
    down = data.foot.sel(axis="y").where(data.stands == 1, 0.0)
    assert float(np.abs(down).max()) <= 1e-12
    sliding = data.slides != 0
    tangent, normal = data.grf.sel(axis="x"), data.grf.sel(axis="y")
    drag = (tangent + data.slides * FRICTION * normal).where(sliding, 0.0)
    assert float(np.abs(drag).max()) <= 1e-9


def test_impulses_at_events_are_the_change_of_momentum(run: RobotRun, data: xr.Dataset) -> None:
    """That of the centre of mass between just before and just after, less the push.

    The weight takes a share in the nanoseconds between, and bounces too low to count.
    """
    mass, h = run.robot.linkage.mass, 1e-9
    hits = 0
    for i, (time, kind) in enumerate(
        zip(data.event_time.values, data.event_kind.values, strict=True)
    ):
        around = robot_dataset(run, times=np.array([time - h, time + h]))
        change = mass * (around.com_rate[1] - around.com_rate[0]).values
        impulse = data.event_impulse[i].sum("foot_name").values
        pushed = np.array(PUSH.impulse) if kind == "push" else np.zeros(2)
        forces = float(np.abs(around.grf).sum(dim=("foot_name", "axis")).max()) + mass * 9.81
        slack = 2 * h * forces + 1e-11 + mass * 1e-6
        np.testing.assert_allclose(change, impulse + pushed, rtol=0, atol=slack)
        hit = kind.endswith(("touchdown", "push"))
        hits += hit
        assert bool(data.event_impulse[i].any()) == hit
    assert hits >= 8
    assert "push" in data.event_kind.values


def test_the_file_tells_where_it_comes_from(run: RobotRun, data: xr.Dataset) -> None:
    attributes = data.attrs
    assert json.loads(attributes["parameters"])["spine.stiffness"] == 240.0
    assert json.loads(attributes["parameters"])["friction"] == FRICTION
    assert json.loads(attributes["provenance"])["friction"] == "set by user"
    assert json.loads(attributes["settings"]) == {"height": 0.05}
    assert json.loads(attributes["legs"])["hind_1"] == "toe_1"
    assert json.loads(attributes["parents"])["thigh_1"] == "shank_1"
    assert json.loads(attributes["joints"])["spine"] == "fore_trunk"
    assert attributes["outcome"] == run.outcome.name == "completed"
    assert attributes["tolerance"] == TOLERANCE
