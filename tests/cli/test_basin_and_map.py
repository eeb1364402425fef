"""`flexspine basin` and `flexspine map` from end to end."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from flexspine import examine, load_model, save_gait
from flexspine.cli import app
from tests.cli.conftest import COMMAND, Cli

ONE = ("--processes", "1")
SMALL_BASIN = ("basin", "--preset", "scout2", "--points", "5", "--strides", "60", *ONE)
SMALL_MAP = (
    "map",
    "--stiffness",
    "240:260",
    "--speeds",
    "3.5:4.5",
    "--lines",
    "2",
    "--points",
    "3",
)
SMALL_MAP = (*SMALL_MAP, *ONE)

BESIDE = {"manifest.json", "rows", "summary.json"}


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def summary(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "summary.json").read_text()))


def test_a_basin_is_kept_with_its_figure(
    cli: Cli, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    done = cli(*SMALL_BASIN, "--out", "results", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record["made"] == 1
    assert (record["strides"], record["energy_kept"]) == (60, True)
    assert record["over"] == {"pitch": 0.8, "pitch_rate": 8.0}
    (basin,) = record["basins"]
    # The reference has 0.7301.
    assert basin["level_spectral_radius"] == pytest.approx(0.7301, abs=5e-5)
    assert basin["starts"] == 25
    assert 0 < basin["settled"] <= basin["lasted"] < 25
    out = tmp_path / "results"
    assert names(out) == {*BESIDE, "basin.csv", "basin.png"}
    assert (out / "basin.png").read_bytes().startswith(b"\x89PNG")
    assert summary(out).items() <= record.items()
    (row,) = csv.DictReader((out / "basin.csv").read_text().splitlines())
    assert (row["name"], int(row["lasted"])) == ("scout2", basin["lasted"])
    before = (out / "summary.json").read_bytes()
    assert app.run([*SMALL_BASIN, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "0.7301" in printed
    assert "scout2" in printed
    assert (out / "summary.json").read_bytes() == before
    assert app.run(["rerun", str(out), *ONE]) == 0
    assert names(out) == {*BESIDE, "basin.csv", "basin.png"}


def test_a_map_is_kept_with_its_figure(
    cli: Cli, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    done = cli(*SMALL_MAP, "--out", "results", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert (record["points"], record["gaits"], record["stable"]) == (6, 4, 0)
    assert record["level_spectral_radius"]["least"] == pytest.approx(
        {"value": 1.32785, "spine_stiffness": 260, "mean_speed": 4.5}, abs=5e-6
    )
    assert [line["slowest"] for line in record["lines"]] == pytest.approx([3.54, 3.73], abs=0.02)
    out = tmp_path / "results"
    assert names(out) == {*BESIDE, "map.csv", "map.png"}
    assert (out / "map.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((out / "map.csv").read_text().splitlines()))
    assert [row["stable"] for row in rows] == ["", "false", "false"] * 2
    # Read from the published figure, 8 N either way and 0.02 m/s on a slope of 800 N s/m.
    assert float(rows[-1]["peak_grf"]) == pytest.approx(528, abs=8 + 0.02 * 800)
    assert app.run([*SMALL_MAP, "--out", str(out)]) == 0
    assert "4 gaits at 6 points, 0 of them stable" in capsys.readouterr().out
    assert app.run(["rerun", str(out), *ONE]) == 0


def test_gaits_of_files_and_changed_animals_are_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.json"
    save_gait(examine(load_model("scout2")), file)
    small = ("--points", "2", "--strides", "1", *ONE, "--json")
    both = ["basin", "--gait", str(file), "--preset", "slip", "--over", "height:0.01"]
    both += ["--over", "pitch:0.01", *small, "--out", str(tmp_path / "both")]
    assert app.run(both) == 0
    record = json.loads(capsys.readouterr().out)
    assert [basin["name"] for basin in record["basins"]] == ["slip", "mine"]
    heavier = ["basin", "--set", "body.mass=21", *small, "--out", str(tmp_path / "heavier")]
    assert app.run(heavier) == 0
    record = json.loads(capsys.readouterr().out)
    # A gait of another animal has the energy of the first, and a radius of its own.
    (basin,) = record["basins"]
    assert basin["energy"] == pytest.approx(242.4408, abs=1e-4)
    assert basin["level_spectral_radius"] != pytest.approx(0.7301, abs=1e-4)


def test_a_map_without_a_gait_is_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "none"
    nowhere = ["map", "--speeds", "9:10", "--lines", "2", "--points", "2", *ONE, "--json"]
    assert app.run([*nowhere, "--out", str(out)]) == 1
    told = capsys.readouterr()
    assert json.loads(told.out)["gaits"] == 0
    assert "no gait found" in told.err
    assert "4.5 m/s" in told.err
    assert names(out) == {*BESIDE, "map.csv"}


@pytest.mark.parametrize("verb", ["basin", "map"])
def test_a_start_that_is_no_gait_is_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    file = tmp_path / "off.toml"
    file.write_text('base = "scout2"\n[apex]\nheight = 0.36\n')
    assert app.run([verb, "--preset", str(file), "--out", str(tmp_path / "out")]) == 1
    told = capsys.readouterr().err
    assert "is no gait" in told
    assert "--gait" in told
    assert names(tmp_path) == {"off.toml"}


def test_an_interrupted_basin_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of two gaits, of which the second takes longer; interrupted after the first."""
    command = ["basin", "--preset", "slip", "--preset", "scout2", "--over", "height:0.005"]
    command += ["--over", "pitch:0.01", "--points", "16", *ONE]
    process = subprocess.Popen(
        [COMMAND, *command, "--out", "results"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    out = tmp_path / "results"
    for _ in range(3000):
        if any((out / "rows").rglob("part-*.parquet")):
            break
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "the same command goes on" in errors
    assert names(out) == {"manifest.json", "rows"}
    assert app.run([*command, "--out", str(out), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["made"] == 1
    slip, scout = record["basins"]
    assert slip["settled"] == 0
    assert scout["settled"] == scout["starts"] == 256


SLICED = ["--preset", "scout2", "--over", "pitch:0.1", "--over"]
BAD = {
    "one coordinate": (["basin", "--over", "pitch:1"], "twice"),
    "no amount": (["basin", *SLICED, "height"], "'height'"),
    "no number": (["basin", *SLICED, "height:x"], "'height:x'"),
    "twice": (["basin", *SLICED, "pitch:0.2"], "pitch is given twice"),
    "backward": (["basin", *SLICED, "height:-1"], "height"),
    "the speed": (["basin", *SLICED, "speed:0.1"], "--any-energy"),
    "unknown coordinate": (["basin", *SLICED, "hight:1"], "'height'"),
    "too far": (["basin", *SLICED, "pitch_rate:1e5"], "go less far"),
    "unknown preset": (["basin", "--preset", "scot2"], "'scout2'"),
    "twice the same": (["basin", "--preset", "scout2", "--preset", "scout2"], "'scout2'"),
    "absent gait": (["basin", "--gait", "absent.json"], "absent.json"),
    "a changed gait": (["basin", "--gait", "absent.json", "--set", "gravity=9"], "--set"),
    "one point": (["basin", "--points", "1"], "--points"),
    "no process": (["basin", "--processes", "0"], "--processes"),
    "no spine": (["map", "--preset", "scout2"], "'spine.stiffness'"),
    "no range": (["map", "--stiffness", "200"], "--stiffness"),
    "below zero": (["map", "--speeds=-1:4"], "mean_speed"),
    "two animals": (["map", "--preset", "slip", "--gait", "absent.json"], "--preset"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_clear_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    arguments, told = BAD[case]
    assert app.run([*arguments, "--out", str(tmp_path / "results")]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("flexspine: ")
    assert output.err.count("\n") == 1
    assert told in output.err
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind"


def test_another_configuration_is_not_mixed_in(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path)
    tiny = ("basin", "--preset", "scout2", "--points", "2", *ONE)
    assert app.run([*tiny, "--strides", "4", "--out", out]) == 0
    before = summary(tmp_path)
    assert app.run([*tiny, "--strides", "5", "--out", out]) == 2
    assert app.run([*SMALL_MAP, "--out", out]) == 2
    assert "another configuration" in capsys.readouterr().err
    assert summary(tmp_path) == before
