"""`flexspine trot` from end to end."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
import xarray as xr
from matplotlib.figure import Figure

from flexspine.report import robot_figure
from flexspine.report.robot_figure import plot_robot
from tests.cli.conftest import Cli, run_here

FIELDS = {
    "schema_version", "flexspine", "robot", "outcome", "message", "advice", "duration", "settings",
    "spine", "measures", "tolerance",
}  # fmt: skip

MEASURES = {
    "steps", "distance", "speed", "cost_of_transport", "normal", "peak_force", "friction_demand",
    "sliding", "torque", "impulse", "drift", "error", "mean_error", "height", "pitch", "spine",
    "imbalance",
}  # fmt: skip


def test_a_person_is_told_how_it_went(cli: Cli) -> None:
    done = cli("trot", "--seconds", "3")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[0].startswith("sc618: completed")
    told = {line.split()[0]: line for line in lines[1:]}
    assert "0.3000 m/s" in told["steady"]
    assert "7 steps" in told["steady"]
    for name in (
        "normal",
        "peak",
        "friction",
        "torque",
        "impacts",
        "tracking",
        "foot",
        "spine",
        "energy",
    ):
        assert name in told


def test_json_is_one_object_with_everything_promised(cli: Cli) -> None:
    """Another spine and speed, which the object repeats and the robot obeys."""
    done = cli(
        "trot", "--seconds", "4", "--json",
        "--set", "spine.stiffness=120", "--set", "gait.speed=0.4", "--set", "gait.ramp=3",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record.keys() == FIELDS
    assert record["measures"].keys() == MEASURES
    assert record["schema_version"] == 1
    assert record["outcome"] == "completed"
    assert record["duration"] == 4.0
    assert record["spine"] == {"stiffness": 120.0, "damping": 2.0, "rest": -0.05}
    assert record["settings"]["gait.speed"] == 0.4
    assert record["settings"]["gait.ramp"] == 3
    assert record["settings"]["controller"] == "tracking"
    assert record["measures"]["speed"] == pytest.approx(0.4, rel=0.01)
    assert record["measures"]["spine"].keys() == {"spine"}


def test_results_are_written_and_readable(cli: Cli, tmp_path: Path) -> None:
    done = cli("trot", "--seconds", "0.5", "--out", "deep/trot")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "deep" / "trot"
    assert {path.name for path in folder.iterdir()} == {
        "trajectory.nc", "summary.json", "figure.png", "animation.gif", "animation.mp4",
        "command.txt",
    }  # fmt: skip
    with xr.open_dataset(folder / "trajectory.nc", engine="h5netcdf") as data:
        assert data.attrs["robot"] == "sc618"
        assert float(data["time"][-1]) == 0.5
        assert data["foot"].dims == ("time", "foot_name", "axis")
        assert float(data["foot"][..., 1].max()) > 0.04
    assert json.loads((folder / "summary.json").read_text())["outcome"] == "completed"
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "animation.gif").read_bytes().startswith(b"GIF8")
    assert b"ftyp" in (folder / "animation.mp4").read_bytes()[:16]
    assert "deep/trot" in done.stdout
    again = cli("trot", "--seconds", "0.1", "--out", "deep/trot", "--no-animation")
    assert again.returncode == 0
    assert {path.name for path in folder.iterdir()} == {
        "trajectory.nc", "summary.json", "figure.png", "command.txt",
    }, "an earlier run's pictures are gone"  # fmt: skip


def test_a_clock_and_limits_are_kept_to(cli: Cli) -> None:
    done = cli("trot", "--seconds", "1", "--rate", "400", "--limit", "13", "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["settings"]["rate"] == 400
    assert record["settings"]["limit"] == 13
    assert record["measures"]["torque"] == 13


def test_a_push_is_felt(cli: Cli) -> None:
    """0.5 N s make joints err by far more than landings do, by some 4e-5 rad."""
    record = json.loads(cli("trot", "--seconds", "1.2", "--push", "0.5", "--json").stdout)
    assert record["outcome"] == "completed"
    assert record["measures"]["error"] > 1e-3


def test_a_fall_is_exit_code_1_with_advice(cli: Cli, tmp_path: Path) -> None:
    """Torques that are too weak to bear the weight."""
    asked = ("trot", "--seconds", "3", "--rate", "400", "--limit", "5")
    done = cli(*asked, "--out", "fallen", "--no-animation")
    assert done.returncode == 1
    assert "fell" in done.stdout
    assert "advice" in done.stdout
    assert (tmp_path / "fallen" / "figure.png").exists()
    record = json.loads((tmp_path / "fallen" / "summary.json").read_text())
    assert record["outcome"] == "fell"
    assert record["advice"]
    assert record["duration"] < 3


@pytest.mark.parametrize("values", [["friction=0.01"], ["gait.speed=3"]])
def test_a_walk_that_cannot_go_on_is_exit_code_1(cli: Cli, values: list[str]) -> None:
    sets = [part for value in values for part in ("--set", value)]
    done = cli("trot", "--seconds", "2", "--json", *sets)
    assert done.returncode == 1, done.stderr
    record = json.loads(done.stdout)
    assert record["outcome"] not in ("completed", "")
    assert record["advice"]


BAD = {
    "unknown parameter": (["--set", "spine.stifness=3"], "did you mean 'spine.stiffness'"),
    "unknown gait parameter": (["--set", "gait.sped=3"], "did you mean 'speed'"),
    "unknown controller": (["--controller", "trakcing"], "did you mean 'tracking'"),
    "unknown robot": (["--robot", "sc168"], "did you mean 'sc618'"),
    "missing file": (["--robot", "absent.toml"], "absent.toml"),
    "limit without a clock": (["--limit", "10"], "rate"),
    "no clock": (["--rate", "0"], "rate = 0"),
    "wrong type": (["--set", "friction=low"], "low"),
    "not a number": (["--set", "gait.speed=nan"], "nan"),
    "too high": (["--set", "gait.height=0.6"], "lower the hips"),
    "half a step": (["--set", "gait.ramp=1.5"], "gait.ramp = 1.5"),
    "no time": (["--seconds", "0"], "seconds = 0"),
    "tolerance": (["--tolerance", "7"], "tolerance"),
    "unknown option": (["--speed", "3"], "--speed"),
    "two controllers": (["--compare", "--controller", "pd"], "--controller and --compare"),
    "the usual one": (["--compare", "--controller", "tracking"], "--controller and --compare"),
    "gains of two": (["--compare", "--damping", "3"], "--damping and --compare"),
    "no stiffness": (["--stiffness", "-1"], "stiffness"),
    "a clock of two": (["--compare", "--rate", "400"], "--rate and --compare"),
    "limits of two": (["--compare", "--limit", "10"], "--limit and --compare"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_clear_line(cli: Cli, tmp_path: Path, case: str) -> None:
    arguments, told = BAD[case]
    done = cli("trot", *arguments, "--out", "results")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("flexspine: ")
    assert done.stderr.count("\n") == 1
    assert told in done.stderr
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind"


@pytest.mark.parametrize("case", ["unknown parameter", "limit without a clock", "two controllers"])
def test_bad_input_is_one_object_for_a_machine(cli: Cli, case: str) -> None:
    arguments, told = BAD[case]
    done = cli("trot", *arguments, "--json")
    assert done.returncode == 2
    assert done.stderr == ""
    failure = json.loads(done.stdout)
    assert failure.keys() == {"schema_version", "error", "message", "remedy"}
    assert told in f"{failure['message']}; {failure['remedy']}"


def test_a_directory_that_cannot_be_written_to_is_refused_first(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    for target in ("file", "file/below"):
        done = cli("trot", "--out", target)
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert "--out" in done.stderr
    assert (tmp_path / "file").read_text() == "kept"


def draw_locked(dataset: xr.Dataset) -> Figure:
    """Draw a robot whose spine is locked, under com; others are drawn in tests of figures."""
    controller = json.loads(dataset.attrs["settings"])["controller"]
    locked = "spine" not in dataset["joint"].values
    return plot_robot(dataset) if locked and controller == "com" else Figure()


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """What is printed and written by a comparison, made once for all tests."""
    folder = tmp_path_factory.mktemp("compared")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(robot_figure, "plot_robot", draw_locked)
        done = run_here("trot", "--compare", "--seconds", "0.5", "--out", folder / "spines")
    assert done.returncode == 0, done.stderr
    return done.stdout, folder / "spines"


CASES = ["com flexible", "com locked", "pd flexible", "pd locked"]


def test_spines_are_compared_side_by_side(compared: tuple[str, Path]) -> None:
    told, folder = compared
    lines = told.splitlines()
    assert [case.replace(" ", ", ") in lines[0] for case in CASES] == [True] * 4
    assert lines[1].split() == ["outcome", *["completed"] * 4]
    with (folder / "comparison.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["measure", "unit", *CASES]
    table = {row[0]: row[2:] for row in rows[1:]}
    assert "largest torque" in table
    assert all(len(row) == 4 for row in table.values())
    spine = table["range of the spine's angle"]
    assert spine[1] == spine[3] == "", "a locked spine has no angle"
    assert float(spine[0]) > 0
    assert float(spine[2]) > 0
    record = json.loads((folder / "comparison.json").read_text())
    assert list(record["runs"]) == CASES
    for case, peak in zip(CASES, table["peak force on a foot"], strict=True):
        assert record["runs"][case]["measures"]["peak_force"] == float(peak)
        assert float(peak) > 100
        assert record["runs"][case]["settings"]["controller"] == case.split()[0]
    assert {path.name for path in folder.iterdir()} == {
        "comparison.csv", "comparison.json", "command.txt",
        *(f"{case.replace(' ', '-')}.{kind}" for case in CASES for kind in ("nc", "png")),
    }  # fmt: skip


def test_a_sentence_tells_why_computed_torque_is_not_compared(compared: tuple[str, Path]) -> None:
    """Half of 240 N m/rad over 0.05 rad are 6 N m, and no joint moves."""
    told, folder = compared
    record = json.loads((folder / "comparison.json").read_text())
    assert record["verdict"] in told
    assert "computed torque" in record["verdict"]
    assert record["motion_change"] < 1e-10
    assert record["torque_change"] == pytest.approx(6.0, rel=0.01)
    assert "6 N m" in record["verdict"]
