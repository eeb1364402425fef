"""`flexspine run3d`, `tune` and `export` from end to end."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
import xarray as xr
from PIL import Image

from flexspine.engines import render
from flexspine.studies import tuning
from tests.cli.conftest import Cli
from tests.cli.test_gait import assert_one_clear_line

# Of flexspine's colours, the robot's trunk at both ends.
BLUE, ORANGE = (0, 114, 178), (213, 94, 0)


def test_a_run_in_space_is_written_and_told(cli: Cli, tmp_path: Path) -> None:
    done = cli("run3d", "--seconds", "0.4", "--set", "gait.speed=0.3", "--out", "here", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["outcome"] == "completed"
    assert record["gains"]["gait.speed"] == 0.3
    assert record["contact"]["toe_1"] == {
        "stiffness": 5e4, "damping": 1e3, "dragged": pytest.approx(0.0104, rel=0.05),
        "creep": pytest.approx(1.9e-6, rel=0.05),
    }  # fmt: skip
    assert json.loads((tmp_path / "here" / "summary.json").read_text()) == record
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == [
        "animation.gif", "animation.mp4", "command.txt", "figure.png", "summary.json",
        "trajectory.nc",
    ]  # fmt: skip
    with xr.open_dataset(tmp_path / "here" / "trajectory.nc", engine="h5netcdf") as data:
        assert data["com"].shape == (161, 3)
        assert data.attrs["model"] == "articulated robot in space"
    with Image.open(tmp_path / "here" / "figure.png") as figure:
        pixels = np.asarray(figure.convert("RGB")).reshape(-1, 3)
    for color in (BLUE, ORANGE):
        assert (np.abs(pixels.astype(int) - color).max(axis=1) < 3).sum() > 300
    with Image.open(tmp_path / "here" / "animation.gif") as film:
        assert film.n_frames == 11  # type: ignore[attr-defined]


def test_a_person_is_told_speed_forces_contact_and_energy(cli: Cli) -> None:
    done = cli("run3d", "--seconds", "1.5", "--plane")
    assert done.returncode == 0
    for words in ("steady speed", "impacts", "lost a stride", "50000 N/m depth", "closed to"):
        assert words in done.stdout


def test_a_film_without_a_place_is_refused(cli: Cli) -> None:
    assert_one_clear_line(cli("run3d", "--render"), "--render")


def test_a_fall_is_exit_code_1_with_advice(cli: Cli, tmp_path: Path) -> None:
    weak = ("--set", "servo.limit=0.5")
    done = cli("run3d", "--seconds", "2", *weak, "--out", "here", "--no-animation")
    assert done.returncode == 1
    assert "fell" in done.stdout
    assert "advice" in done.stdout
    assert (tmp_path / "here" / "figure.png").exists()


def test_a_locked_spine_has_one_joint_less(cli: Cli, tmp_path: Path) -> None:
    assert (
        cli("run3d", "--locked", "--seconds", "0.5", "--no-animation", "--out", "a").returncode == 0
    )
    with xr.open_dataset(tmp_path / "a" / "trajectory.nc", engine="h5netcdf") as data:
        assert "spine" not in data["joint"].values
        assert data.sizes["link"] == 9


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("run3d", "--gait", "amble"), "amble"),
        (("run3d", "--gait", "none.toml"), "none.toml"),
        (("run3d", "--robot", "cat"), "cat"),
        (("run3d", "--set", "gait.sped=1"), "gait.speed"),
        (("run3d", "--set", "spine.stifness=1"), "spine.stiffness"),
        (("run3d", "--set", "gait.duty=7"), "duty"),
        (("run3d", "--set", "gait.height=0.6"), "out of reach"),
        (("run3d", "--seconds", "0"), "seconds"),
        (("run3d", "--seconds", "nan"), "seconds"),
        (("run3d", "--sensing", "-1"), "sensing"),
        (("run3d", "--set", "hip_2.stiffness=3"), "hip_2.stiffness"),
        (("run3d", "--seed", "-1"), "--seed"),
        (("run3d", "--locked", "--set", "spine.stiffness=3"), "--locked"),
        (("tune", "--gait", "canter"), "canter"),
        (("tune", "--speed", "inf"), "speed"),
    ],
)
def test_bad_input_is_one_clear_line_and_nothing_is_written(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], told: str
) -> None:
    done = cli(*arguments, "--out", "here")
    assert_one_clear_line(done, told)
    assert not (tmp_path / "here").exists()


def test_without_mujoco_it_says_what_to_install(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for verb in (("run3d",), ("tune",), ("export", "mjcf")):
        done = cli(*verb, "--out", "here")
        assert done.returncode == 3
        assert "pip install 'mujoco>=3.17,<4'" in done.stderr
        assert done.stderr.count("\n") == 1
    assert not (tmp_path / "here").exists()


def test_without_opengl_the_film_alone_is_missing(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(render, "BACKENDS", ("glfw",))
    done = cli("run3d", "--seconds", "0.2", "--render", "--no-animation", "--out", "here")
    assert done.returncode == 3
    assert "neither EGL nor OSMesa" in done.stderr
    assert done.stderr.count("\n") == 1
    names = ["command.txt", "figure.png", "summary.json", "trajectory.nc"]
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == names


def test_a_search_writes_a_walk_that_runs(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With 4 walks in a round, where help promises the usual number."""
    usual = tuning.tune.__kwdefaults__
    assert f"{usual['children']} walks a round" in " ".join(cli("tune", "--help").stdout.split())
    monkeypatch.setattr(tuning.tune, "__kwdefaults__", {**usual, "children": 4})
    few = ("--seconds", "1", "--draws", "2", "--rounds", "1", "--processes", "1", "--seed", "1")
    done = cli("tune", "--out", "here", *few, "--json")
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record["tried"] == 2 + 4
    assert record["cost"] == min(record["history"])
    names = ["command.txt", "tune.json", "walk.toml"]
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == names
    again = cli("run3d", "--gait", "here/walk.toml", "--seconds", "1", "--json")
    assert json.loads(again.stdout)["gains"] == record["walk"]["gains"]


def test_exported_robots_are_loaded_by_mujoco(cli: Cli, tmp_path: Path) -> None:
    assert (
        cli("export", "mjcf", "--out", "there/a.xml", "--set", "spine.stiffness=99").returncode == 0
    )
    assert [path.name for path in (tmp_path / "there").iterdir()] == ["a.xml"]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "there" / "a.xml"))
    assert (model.nv, model.nu) == (19, 12)
    assert model.jnt_stiffness[model.joint("spine").id] == 99
    done = cli("export", "mjcf", "--plane", "--locked")
    assert mujoco.MjModel.from_xml_string(done.stdout).nv == 11
    done = cli("export", "mjcf", "--pinned", "toe_1")
    assert mujoco.MjModel.from_xml_string(done.stdout).nv == 10
    assert_one_clear_line(cli("export", "mjcf", "--pinned", "nose"), "nose")
    assert_one_clear_line(cli("export", "mjcf", "--pinned", "toe_1", "--plane"), "--pinned")
