"""`flexspine bound` from end to end."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr

from tests.cli.conftest import Cli

FIELDS = {
    "schema_version",
    "flexspine",
    "outcome",
    "message",
    "phases",
    "period",
    "distance",
    "mean_speed",
    "peak_grf",
    "peak_grf_vertical",
    "duty_factor",
    "stride_length",
    "stride_frequency",
    "froude",
    "spine_range",
    "energy",
    "apexes",
    "parameters",
    "touchdown_angles",
}


def test_json_is_one_object_with_everything_promised(cli: Cli) -> None:
    done = cli("bound", "--json")
    assert done.returncode == 0
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record.keys() >= FIELDS
    assert record["schema_version"] == 1
    assert record["outcome"] == "completed"
    assert record["phases"] == ["DF", "FS", "DF", "HS", "DF"]
    assert record["period"] == pytest.approx(0.252732108498, abs=5e-13)
    assert record["peak_grf"]["fore"] == pytest.approx(530.460494, abs=5e-7)
    assert record["peak_grf"].keys() == record["duty_factor"].keys() == {"fore", "hind"}
    assert record["energy"]["initial"] == pytest.approx(290)
    assert record["energy"]["relative_drift"] < 1e-11
    assert list(record["apexes"][0]) == [
        "height", "fore_pitch", "hind_pitch", "speed", "fore_pitch_rate", "hind_pitch_rate",
    ]  # fmt: skip
    assert len(record["apexes"]) == 2
    assert record["touchdown_angles"].keys() == {"fore", "hind"}


@pytest.mark.parametrize("name", ["kamimura2015-rigid", "kamimura2015-locked"])
def test_a_rigid_body_has_one_pitch_and_no_spine(cli: Cli, name: str) -> None:
    record = json.loads(cli("bound", "--preset", name, "--json").stdout)
    assert list(record["apexes"][0]) == ["height", "pitch", "speed", "pitch_rate"]
    assert record["spine_range"] is None


def test_values_can_be_set_one_by_one(cli: Cli) -> None:
    done = cli(
        "bound", "--json", "--set", "spine.stiffness=240", "--set", "gravity=9.8",
        "--apex", "height=0.33", "--touchdown", "fore=0.46",
    )  # fmt: skip
    record = json.loads(done.stdout)
    assert record["apexes"][0]["height"] == 0.33
    assert record["touchdown_angles"]["fore"] == 0.46
    assert record["parameters"]["spine.stiffness"] == 240
    assert record["parameters"]["gravity"] == 9.8
    assert record["parameters"]["fore.mass"] == 10.4


def test_a_fall_is_exit_code_1_with_advice(cli: Cli) -> None:
    done = cli("bound", "--touchdown", "fore=-0.3", "--touchdown", "hind=-0.3", "--json")
    assert done.returncode == 1
    record = json.loads(done.stdout)
    assert record["outcome"] == "fell"
    assert record["advice"]
    shown = cli("bound", "--touchdown", "fore=-0.3", "--touchdown", "hind=-0.3")
    assert shown.returncode == 1
    assert "fell" in shown.stdout


def test_a_time_can_be_given_instead_of_strides(cli: Cli) -> None:
    record = json.loads(cli("bound", "--seconds", "0.1", "--json").stdout)
    assert record["duration"] == 0.1
    assert record["period"] is None


def test_results_are_written_and_readable(cli: Cli, tmp_path: Path) -> None:
    done = cli("bound", "--seconds", "0.05", "--out", "deep/results")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "deep" / "results"
    assert {path.name for path in folder.iterdir()} == {
        "trajectory.nc", "trajectory.csv", "events.csv", "summary.json",
        "figure.png", "strip.png", "animation.gif", "animation.mp4", "command.txt",
    }  # fmt: skip
    with xr.open_dataset(folder / "trajectory.nc", engine="h5netcdf") as data:
        assert data.attrs["preset"] == "kamimura2015-flexible"
    assert json.loads((folder / "summary.json").read_text())["outcome"] == "completed"
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "animation.gif").read_bytes().startswith(b"GIF8")
    assert b"ftyp" in (folder / "animation.mp4").read_bytes()[:16]
    assert "deep/results" in done.stdout


def test_a_missing_ffmpeg_is_told_before_anything_is_simulated(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/no/such/ffmpeg")
    done = cli("bound", "--seconds", "0.01", "--out", "run")
    assert done.returncode == 3
    assert "--no-animation" in done.stderr
    assert not (tmp_path / "run").exists()
    assert cli("bound", "--seconds", "0.01", "--out", "run", "--no-animation").returncode == 0


def test_a_run_that_fell_is_written_too(cli: Cli, tmp_path: Path) -> None:
    done = cli("bound", "--touchdown", "fore=-0.3", "--out", "fallen", "--no-animation")
    assert done.returncode == 1
    assert (tmp_path / "fallen" / "figure.png").exists()


BAD = {
    "unknown preset": (["--preset", "kamimra2015-flexible"], "kamimura2015-flexible"),
    "unknown parameter": (["--set", "spine.stifness=3"], "spine.stiffness"),
    "wrong type": (["--set", "fore.mass=heavy"], "heavy"),
    "negative mass": (["--set", "fore.mass=-1"], "fore.mass"),
    "missing file": (["--preset", "absent.toml"], "absent.toml"),
    "in the ground": (["--apex", "height=0.01"], "ground"),
    "not a number": (["--set", "fore.mass=nan"], "nan"),
    "infinite": (["--apex", "height=inf"], "inf"),
    "unknown coordinate": (["--apex", "heigt=1"], "height"),
    "beyond the horizontal": (["--touchdown", "fore=1.6"], "horizontal"),
    "unknown leg": (["--touchdown", "for=0.3"], "fore"),
    "no assignment": (["--set", "spine.stiffness"], "NAME=VALUE"),
    "unknown option": (["--strid", "3"], "--strid"),
    "no whole number": (["--strides", "two"], "--strides"),
    "no strides": (["--strides", "0"], "--strides"),
    "both lengths": (["--strides", "2", "--seconds", "1"], "one of them"),
    "negative time": (["--seconds", "-1"], "--seconds"),
    "tolerance": (["--tolerance", "7"], "tolerance"),
    "a group": (["--set", "spine=3"], "spine.stiffness"),
    "a huge start": (["--apex", "speed=1e200"], "speed"),
    "no interval": (["--interval", "inf"], "interval"),
    "two lines": (["--preset", "a\nb.toml"], "a"),
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
def test_bad_input_is_one_clear_line(cli: Cli, tmp_path: Path, case: str, as_json: bool) -> None:
    arguments, told = BAD[case]
    done = cli("bound", *arguments, "--out", "results", *(["--json"] if as_json else []))
    assert done.returncode == 2
    if as_json:
        assert done.stderr == ""
        failure = json.loads(done.stdout)
        assert failure.keys() == {"schema_version", "error", "message", "remedy"}
        assert told in failure["message"] + failure["remedy"]
    else:
        assert done.stdout == ""
        assert done.stderr.startswith("flexspine: ")
        assert done.stderr.count("\n") == 1
        assert told in done.stderr
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind"


def test_malformed_toml_is_one_clear_line(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("model = [")
    done = cli("bound", "--preset", "bad.toml")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "not valid TOML" in done.stderr


def test_a_directory_that_cannot_be_written_to_is_refused_first(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    for target in ("file", "file/below"):
        done = cli("bound", "--out", target)
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert "--out" in done.stderr
    assert (tmp_path / "file").read_text() == "kept"


def test_a_wrong_interval_leaves_older_results_alone(cli: Cli, tmp_path: Path) -> None:
    assert cli("bound", "--out", "results", "--no-animation").returncode == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "results").iterdir()}
    assert cli("bound", "--out", "results", "--interval", "0").returncode == 2
    assert {path.name: path.read_bytes() for path in (tmp_path / "results").iterdir()} == before


def begin_long_run(folder: Path) -> subprocess.Popen[str]:
    """Start a run whose animations take a while."""
    return subprocess.Popen(
        [
            Path(sys.executable).with_name("flexspine"),
            "bound",
            "--strides",
            "10",
            "--out",
            "results",
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_an_interrupt_is_exit_code_130_and_leaves_nothing(tmp_path: Path) -> None:
    process = begin_long_run(tmp_path)
    for _ in range(6000):
        if list(tmp_path.glob("results/.partial-*/*.png")):
            break
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors == "flexspine: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def wait_until_it_minds_signals(process: subprocess.Popen[str]) -> None:
    """Until it has a handler of its own for SIGTERM, which Python has none for."""
    for _ in range(2000):
        status = Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
        caught = int(status.partition("SigCgt:")[2].split()[0], 16)
        if caught >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.005)
    pytest.fail("it never minds signals")


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.2, 0.35, 0.5])
def test_an_interrupt_while_starting_is_no_traceback(tmp_path: Path, delay: float) -> None:
    process = begin_long_run(tmp_path)
    wait_until_it_minds_signals(process)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors == "flexspine: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_pictures_of_an_earlier_run_do_not_stay(cli: Cli, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    for name in ("animation.gif", "animation.mp4", "mine.gif"):
        (folder / name).write_text("older")
    done = cli("bound", "--seconds", "0.05", "--out", "results", "--no-animation")
    assert done.returncode == 0
    assert {path.name for path in folder.iterdir() if path.read_bytes() == b"older"} == {"mine.gif"}
    assert not list(folder.glob("animation.*"))


def test_a_reader_that_goes_away_brings_no_complaint(tmp_path: Path) -> None:
    command = Path(sys.executable).with_name("flexspine")
    done = subprocess.run(
        f"'{command}' equations flexible-bounder | head -1",
        shell=True,
        executable="/bin/bash",
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stderr == ""
    assert done.stdout.count("\n") == 1
