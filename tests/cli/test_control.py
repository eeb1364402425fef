"""`flexspine control`, `terrain`, `robustness` and `limits` from end to end."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from tests.cli.conftest import Cli
from tests.cli.test_gait import assert_one_clear_line


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_control_bounds_with_noise_and_writes_what_it_did(cli: Cli, tmp_path: Path) -> None:
    asked = ("control", "--acting", "0.01", "--uniform", "--strides", "40", "--seed", "3")
    done = cli(*asked, "--out", "here", "--no-animation", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["outcome"] == "completed"
    assert record["strides"] == 40
    assert record["spectral_radius"]["without"] == pytest.approx(1.3278, abs=1e-4)
    assert record["spectral_radius"]["with"] < 0.6
    assert record["noise"] == {"sensing": 0.0, "acting": 0.01, "uniform": True}
    files = {path.name for path in (tmp_path / "here").iterdir()}
    assert files >= {"apexes.csv", "control.png", "trajectory.nc", "summary.json", "strip.png"}
    assert "animation.gif" not in files
    assert json.loads((tmp_path / "here" / "summary.json").read_text()) == record
    table = rows(tmp_path / "here" / "apexes.csv")
    assert len(table) == 41
    assert max(float(row["deviation"]) for row in table) == record["largest_deviation"]
    # The recorded strides are the first of the same run.
    with xr.open_dataset(tmp_path / "here" / "trajectory.nc") as data:
        time = float(table[8]["time"])
        assert float(data["time"][-1]) == pytest.approx(time, abs=1e-12)
        assert float(data["com_y"][-1]) == pytest.approx(float(table[8]["height"]), abs=1e-9)
    shown = record.pop("shown")
    assert shown["strides"] == [1, 8]
    assert shown["end"] == pytest.approx(float(table[8]["time"]))
    assert json.loads(cli(*asked, "--json").stdout) == record
    other = json.loads(cli(*asked[:-1], "4", "--json").stdout)
    assert other["distance"] != record["distance"]


def test_of_a_run_that_falls_the_last_strides_are_kept_and_it_is_told(
    cli: Cli, tmp_path: Path
) -> None:
    asked = ("control", "--acting", "0.03", "--seed", "2")
    done = cli(*asked, "--out", "here", "--no-animation")
    assert done.returncode == 1
    assert "fell" in done.stdout
    table = rows(tmp_path / "here" / "apexes.csv")
    made = len(table) - 1
    assert made > 8
    assert f"the last 8 of {made} strides and the end" in done.stdout
    with xr.open_dataset(tmp_path / "here" / "trajectory.nc") as data:
        assert data.attrs["outcome"] == "fell"
        assert float(data["time"][0]) == pytest.approx(float(table[-9]["time"]), abs=1e-12)
        assert float(data["com_y"][0]) == pytest.approx(float(table[-9]["height"]), abs=1e-12)
        hips = [float(data[f"{side}_hip_y"][-1]) for side in ("fore", "hind")]
        assert min(hips) == pytest.approx(0.0, abs=1e-9), "the fall is there"
        assert f"of {made} strides" in data.attrs["shown"]
    assert f"of {made} strides" not in cli(*asked).stdout, "nothing is shown"


def test_control_without_noise_stays_where_it_is(cli: Cli) -> None:
    done = cli("control", "--strides", "20", "--json")
    assert json.loads(done.stdout)["largest_deviation"] < 1e-9


def test_a_push_too_hard_is_told_and_exits_with_1(cli: Cli) -> None:
    done = cli("control", "--push", "15", "--strides", "20")
    assert done.returncode == 1
    assert "fell" in done.stdout
    assert "advice" in done.stdout
    angles = ("--steer", "touchdown.fore", "--steer", "touchdown.hind", "--once")
    done = cli("control", "--push", "1", "--strides", "20", *angles)
    assert done.returncode == 0
    assert "on the energy level" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("control", "--steer", "spam"), "spam"),
        (("control", "--method", "pid"), "pid"),
        (("control", "--effort", "0"), "effort"),
        (("control", "--push", "nan"), "--push"),
        (("control", "--effort", "inf"), "effort"),
        (("control", "--sensing", "1e308"), "sensing"),
        (("control", "--gait", "none.json"), "none.json"),
        (("terrain", "hills"), "hills"),
        (("terrain", "rough", "--with", "heigth=1"), "heigth"),
        (("terrain", "rough", "--with", "height=high"), "height"),
        (("terrain", "none.csv"), "none.csv"),
        (("terrain", "--passive", "--once"), "--passive"),
        (("terrain", "."), "'.' is no file of ground"),
        (("terrain", "rough", "--with", "height=-0.01"), "height = -0.01"),
        (("terrain", "step", "--processes", "-1"), "--processes = -1"),
        (("control", "--steer", "legs.extension", "--steer", "legs.extension"), "twice"),
        (("robustness", "shove"), "shove"),
        (("robustness", "push", "--body", "cat"), "cat"),
        (("robustness", "push", "--body", "flexible", "--gait", "g.json"), "--gait"),
        (("robustness", "push", "--largest", "0", "--runs", "1"), "largest"),
        (("robustness", "push", "--speed", "9"), "mean_speed"),
        (("limits", "--only", "spam"), "spam"),
        (("limits", "--preset", "kamimura2015-rigid"), "spine"),
        (("limits", "--stiffness", "260", "--speed", "inf"), "speed"),
        (("limits", "--stiffness", "nan", "--speed", "4.5"), "stiffness"),
        (("robustness", "push", "--speed", "nan"), "speed"),
        (("robustness", "step", "--largest", "5000", "--runs", "1"), "height = 5000"),
        (("robustness", "push", "--gait", "a/gait-1.json", "--gait", "b/gait-1.json"), "gait-1"),
    ],
)
def test_bad_input_is_one_clear_line_and_nothing_is_written(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], told: str
) -> None:
    done = cli(*arguments, "--out", "here")
    assert_one_clear_line(done, told)
    assert not (tmp_path / "here").exists()


def test_terrain_shows_a_run_and_tells_of_many(cli: Cli, tmp_path: Path) -> None:
    done = cli(
        "terrain", "rough", "--with", "height=0.006", "--strides", "1", "--runs", "12", "--seed",
        "2", "--out", "here", "--json", "--processes", "1",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["ground"] == "rough ground of 0.006 m, 0.3 m apart, seed 2"
    assert record["terrain"] == {"kind": "rough", "numbers": {"height": 0.006, "spacing": 0.3}}
    assert record["shown"]["strides"] == [1, 1]
    assert record["shown"]["told"] is None, "it is the whole"
    many = record["ensemble"]
    assert many["runs"] == sum(many["outcomes"].values()) == 12
    folder = tmp_path / "here"
    table = rows(folder / "runs.csv")
    assert [int(row["seed"]) for row in table] == list(range(2, 14))
    arrived = [row for row in table if row["outcome"] == "completed"]
    assert len(arrived) == many["arrived"]
    assert float(table[0]["distance"]) == pytest.approx(record["distance"])
    assert len(rows(folder / "apexes.csv")) == 2
    ground = rows(folder / "ground.csv")
    heights = np.array([float(row["y"]) for row in ground])
    assert 0.003 < np.abs(heights).max() <= 0.006
    with Image.open(folder / "animation.gif") as picture:
        assert picture.n_frames > 40  # type: ignore[attr-defined]
    assert not (folder / "terrain.unfinished.jsonl").exists()


def test_a_directory_in_the_way_of_a_file_is_told_and_nothing_is_written(
    cli: Cli, tmp_path: Path
) -> None:
    (tmp_path / "here" / "control.png").mkdir(parents=True)
    done = cli("control", "--strides", "2", "--no-animation", "--out", "here")
    assert_one_clear_line(done, "here/control.png")
    assert [entry.name for entry in (tmp_path / "here").iterdir()] == ["control.png"]


def test_terrain_from_a_file_and_without_feedback(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("x,y\n1.0,0\n1.0,-0.03\n")
    done = cli("terrain", "track.csv", "--passive", "--strides", "30")
    assert done.returncode == 1
    assert "track.csv" in done.stdout
    assert "nothing: fixed touchdown angles" in done.stdout
    assert cli("terrain", "track.csv", "--strides", "5").returncode == 0
    done = cli("terrain", "track.csv", "--strides", "5", "--runs", "2")
    assert_one_clear_line(done, "the same in all 2 runs")
    # Without feedback none has to exist.
    assert cli("terrain", "step", "--passive", "--preset", "slip", "--strides", "1").returncode == 0


def test_robustness_of_bodies(cli: Cli, tmp_path: Path) -> None:
    asked = ("robustness", "push", "--runs", "40", "--strides", "5", "--processes", "1")
    done = cli(*asked, "--out", "here", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert list(record["animals"]) == ["published-rigid", "locked-spine", "flexible"]
    for each in record["animals"].values():
        assert each["runs"] == 40
        assert sum(one["survived"] for one in each["bins"]) == each["survived"]
        assert each["mean_speed"] == pytest.approx(4.5)
        assert each["energy"] == pytest.approx(290.0)
        sides = [each["positive"]["outcomes"], each["negative"]["outcomes"]]
        assert sum(sum(side.values()) for side in sides) == 40
    files = {path.name for path in (tmp_path / "here").iterdir()}
    assert files == {"command.txt", "push.json", "push.parquet", "push.png"}
    again = cli(*asked, "--body", "flexible", "--json")
    flexible = json.loads(again.stdout)["animals"]["flexible"]
    assert flexible == record["animals"]["flexible"]


def test_limits_of_a_gait(cli: Cli, tmp_path: Path) -> None:
    done = cli(
        "limits", "--stiffness", "260", "--speed", "4.5", "--speed", "3", "--only", "push_backward",
        "--processes", "1", "--out", "here", "--json",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    cells = json.loads(done.stdout)["cells"]
    assert [bool(cell["limits"]) for cell in cells] == [True] * 3 + [False] * 3
    assert cells[2]["limits"]["push_backward"] > cells[0]["limits"]["push_backward"]
    table = rows(tmp_path / "here" / "limits.csv")
    assert float(table[0]["push_backward"]) == cells[0]["limits"]["push_backward"]
    assert {path.name for path in (tmp_path / "here").iterdir()} == {
        "command.txt", "limits.csv", "limits.json", "limits.png",
    }  # fmt: skip
    done = cli(
        "limits", "--stiffness", "260", "--speed", "3", "--only", "step_up", "--processes", "1"
    )
    assert done.returncode == 1
    assert "second touchdown" in done.stdout
