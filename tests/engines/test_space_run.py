"""Walks in space: what drives them, what is measured, and how runs end."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from flexspine import load_robot
from flexspine.control.gains import load_walk
from flexspine.engines import render
from flexspine.engines.render import opengl, rendered
from flexspine.engines.space_dataset import SPACE_VARIABLES, space_dataset
from flexspine.engines.space_measures import space_record, summarize_space
from flexspine.engines.space_run import CpgCourse, SpaceRun, run_in_space
from flexspine.errors import InputError, MachineError, ParameterError
from flexspine.models.space import SpaceRobot
from flexspine.report.film import write_film
from flexspine.report.sagittal import sagittal
from flexspine.report.timeline import phase_spans

Array = NDArray[np.float64]


@cache
def walked(gait: str = "trot", seconds: float = 3.0, seed: int = 0) -> SpaceRun:
    walk = load_walk(gait, "sc618")
    return run_in_space(load_robot("sc618"), walk, seconds, sensing=0.002, seed=seed)


def test_joints_put_feet_where_the_oscillators_have_them() -> None:
    """Thigh and shank from the hip down, by trigonometry of our own."""
    robot, walk = load_robot("sc618"), load_walk("trot", "sc618")
    space = SpaceRobot(robot)
    servo = CpgCourse(space, walk).servo(400)
    gait, motors = walk.gains.gait, list(space.motors)
    stride = gait.speed * gait.duty / gait.frequency
    reach = []
    for leg in space.legs:
        hip, knee = (servo.angles[:, motors.index(f"{leg}_{joint}")] for joint in ("hip", "knee"))
        assert np.all(servo.angles[:, motors.index(f"{leg}_abduction")] == 0)
        x = 0.16 * np.cos(hip) + 0.25 * np.cos(hip + knee)
        z = 0.16 * np.sin(hip) + 0.25 * np.sin(hip + knee)
        ahead = gait.hind_ahead if leg.startswith("hind") else gait.fore_ahead
        # Feet begin below their hips, and then keep between the ends of their strides.
        assert (x[0], z[0]) == pytest.approx((ahead, -gait.height), abs=1e-12)
        assert np.abs(x - ahead).max() < 0.75 * stride
        assert -gait.height - 1e-12 < z.min()
        assert z.max() < gait.clearance - gait.height + 1e-12
        reach.append(z)
        # Rates are the slopes of angles.
        for joint, angle in (("hip", hip), ("knee", knee)):
            rate = servo.rates[:, motors.index(f"{leg}_{joint}")]
            slope = np.gradient(angle, 1 / walk.gains.servo.rate)
            assert np.abs(rate - slope)[2:-2].max() < 0.1 * np.abs(rate).max()
    # Diagonal legs together, the others half a stride later.
    assert reach[0] == pytest.approx(reach[3], abs=1e-9)
    assert reach[1] == pytest.approx(reach[2], abs=1e-9)
    assert np.abs(reach[0] - reach[1]).max() > 0.5 * gait.clearance


def test_a_seed_repeats_bit_for_bit_and_another_differs() -> None:
    again = run_in_space(
        load_robot("sc618"), load_walk("trot", "sc618"), 1.0, sensing=0.002, seed=0
    )
    first, other = walked(seconds=1.0), walked(seconds=1.0, seed=1)
    for name, values in first.samples.items():
        assert np.array_equal(values, again.samples[name]), name
    assert not np.array_equal(first.samples["com"], other.samples["com"])


@pytest.mark.parametrize(("gait", "seconds"), [("trot", 9.0), ("bound", 7.0)])
def test_the_presets_walk_from_standing_without_a_fall(gait: str, seconds: float) -> None:
    run = run_in_space(load_robot("sc618"), load_walk(gait, "sc618"), seconds)
    assert run.outcome.completed
    assert np.all(run.samples["com_rate"][0] == 0)
    summary = summarize_space(run)
    assert summary.speed is not None
    assert 0.3 < summary.speed < 0.5
    away = run.samples["com"][-1] - run.samples["com"][0]
    assert 0.25 < away[0] / seconds < 0.5


def test_energy_is_accounted_for_the_better_the_smaller_the_steps() -> None:
    """Work, losses and energies are summed up independently of each other."""
    off = [
        summarize_space(
            run_in_space(load_robot("sc618"), load_walk("trot", "sc618"), 0.5, step=step)
        ).imbalance
        for step in (2.5e-4, 6.25e-5)
    ]
    assert off[0] < 0.02
    assert off[1] < 0.4 * off[0]


def test_forces_and_motion_obey_newton() -> None:
    """The impulse of all forces on the feet is the change of momentum, weight included."""
    run = walked()
    data = space_dataset(run)
    mass, weight = run.robot.linkage.mass, run.robot.linkage.mass * 9.81
    # Sampled forces miss the peaks of landings: over whole strides the mean has to be right.
    mean = data["grf"].values.sum(axis=1)[len(data["time"]) // 3 :, 2].mean()
    assert mean == pytest.approx(weight, rel=0.05)
    gained = mass * (data["com_rate"].values[-1] - data["com_rate"].values[0])
    assert np.abs(gained[2]) < 0.05 * weight * run.duration


def test_the_dataset_says_all_and_can_be_written(tmp_path: Path) -> None:
    run = walked()
    data = space_dataset(run)
    assert set(SPACE_VARIABLES) == set(data.data_vars)
    for name, (dimensions, unit, text) in SPACE_VARIABLES.items():
        assert data[name].dims == dimensions
        assert (data[name].attrs["units"], data[name].attrs["long_name"]) == (unit, text)
        assert np.all(np.isfinite(data[name].values)), name
    assert data["axis"].values.tolist() == ["x", "y", "z"]
    assert json.loads(data.attrs["contact"])["toe_1"]["stiffness"] == 5e4
    data.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    # Upper ends of shanks are lower ends of thighs; feet hang on shanks.
    links = data["link"].values.tolist()
    thigh, shank = links.index("thigh_3"), links.index("shank_3")
    assert data["link_end"].values[:, thigh] == pytest.approx(data["link_start"].values[:, shank])
    assert np.all(data["peak_normal"].values[1:] >= 0)


def test_whoever_lets_go_falls_and_is_told_so() -> None:
    limp = load_walk("trot", "sc618").with_values({"servo.limit": 0.5})
    run = run_in_space(load_robot("sc618"), limp, 3.0)
    assert run.outcome.name == "fell"
    assert run.duration < 1.0
    summary = summarize_space(run)
    assert summary.speed is None
    record = space_record(run, summary)
    json.dumps(record, allow_nan=False)
    assert record["measures"]["cost_of_transport"] is None


def test_numbers_that_grow_without_bounds_end_a_run_quietly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    wild = load_walk("trot", "sc618").with_values({"servo.damping": 50.0})
    run = run_in_space(load_robot("sc618"), wild, 2.0)
    assert run.outcome.name in ("diverged", "fell")
    assert "".join(capfd.readouterr()) == ""
    assert not list(tmp_path.iterdir())  # MuJoCo keeps a log otherwise


def test_what_cannot_be_asked_for_is_refused() -> None:
    robot, walk = load_robot("sc618"), load_walk("trot", "sc618")
    with pytest.raises(ParameterError, match="seconds = 0"):
        run_in_space(robot, walk, 0.0)
    with pytest.raises(ParameterError, match="sensing = 2"):
        run_in_space(robot, walk, 1.0, sensing=2.0)
    with pytest.raises(ParameterError, match="-1"):
        run_in_space(robot, walk, 1.0, seed=-1)
    with pytest.raises(ParameterError, match="out of reach"):
        run_in_space(robot, walk.with_values({"gait.height": 0.42}), 1.0)


def test_bars_of_stance_change_where_feet_begin_and_cease_to_slide() -> None:
    """In the side view a stretch of one footing is one of standing, or of sliding, of each foot."""
    data = space_dataset(walked())
    flat = sagittal(data)
    slides, stands = data["slides"].values > 0, data["stands"].values > 0
    assert slides.any()
    for span in phase_spans(flat, "footing"):
        for table in (slides, stands):
            part = table[span.first : span.last + 1]
            assert np.all(part == part[0])


def test_the_plane_keeps_the_robot() -> None:
    run = run_in_space(load_robot("sc618"), load_walk("trot", "sc618"), 1.0, plane=True)
    assert run.outcome.completed
    data = space_dataset(run)
    assert np.all(np.abs(data["com"].values[:, 1]) < 1e-12)
    for angle in ("trunk_roll", "trunk_yaw"):
        assert np.all(np.abs(data[angle].values) < 1e-12)


def test_pictures_show_the_robot_where_there_is_opengl(tmp_path: Path) -> None:
    if opengl() is None:
        pytest.skip("neither EGL nor OSMesa is here")
    times = np.array([0.0, 0.5])
    first, second = rendered(walked(), times, (160, 90))
    assert first.shape == (90, 160, 3)
    # The robot is the only thing that is blue or orange.
    robot = np.ptp(first.astype(int), axis=-1) > 40
    assert 0.01 < robot.mean() < 0.4
    assert np.abs(first.astype(int) - second).mean() > 0.3
    both = [tmp_path / "film.gif", tmp_path / "film.mp4"]
    write_film(iter([first, second] * 5), both, fps=10, count=10)
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 10  # type: ignore[attr-defined]
        assert film.info["duration"] == 100
    with pytest.raises(InputError, match=r"film\.avi"):
        write_film(iter([first]), [tmp_path / "film.avi"], fps=10, count=1)
    assert (tmp_path / "film.mp4").stat().st_size > 500
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.gif", "film.mp4"]


def test_without_opengl_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(render, "BACKENDS", ("glfw",))
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(MachineError, match="neither EGL nor OSMesa") as raised:
        list(rendered(walked(), np.zeros(1), (16, 9)))
    assert "libosmesa6" in raised.value.remedy


def test_an_opengl_that_was_asked_for_and_is_not_there_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(MachineError, match="as MUJOCO_GL=glfw asks") as raised:
        list(rendered(walked(), np.zeros(1), (16, 9)))
    assert "unset MUJOCO_GL" in raised.value.remedy
