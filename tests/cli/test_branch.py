"""`flexspine branch` from end to end."""

from __future__ import annotations

import csv
import json
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from flexspine import examine, load_model, trace_branch
from flexspine.report.branch_figure import plot_branch
from tests.cli.conftest import COMMAND, Cli, run_here
from tests.cli.test_gait import FIELDS, Found, assert_one_clear_line
from tests.report.layout import assert_no_text_overlaps

RANGE = ("--from", "3.7", "--to", "4.6")


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """The branch of the published gait over speed."""
    folder = tmp_path_factory.mktemp("branch")
    done = run_here("branch", *RANGE, "--out", folder, "--json")
    return Found(done, json.loads(done.stdout), folder)


def test_json_is_one_object_with_everything_promised(traced: Found) -> None:
    assert traced.done.returncode == 0
    assert traced.done.stderr == ""
    record = traced.record
    assert record["over"] == "mean_speed"
    assert record["fixed"] == pytest.approx({"energy": 290, "height": 0.32})
    assert len(record["points"]) > 20
    for point in record["points"]:
        assert point.keys() >= FIELDS
        assert 3.7 <= point["mean_speed"] <= 4.6
        assert point["energy"] == pytest.approx(290, abs=1e-9)
        assert point["residual"] < 1e-11
    assert any(point["mean_speed"] == pytest.approx(4.5) for point in record["points"])


def test_the_branch_ends_where_a_leg_touches_down_twice(traced: Found) -> None:
    ends, marks = traced.record["ends"], traced.record["landmarks"]
    assert ends[0].startswith("second touchdown at mean_speed = 3.73")
    assert "fore leg" in ends[0]
    assert marks[0]["kind"] == "second touchdown"
    assert marks[0]["value"] == pytest.approx(3.73, abs=0.01)
    fold = next(mark for mark in marks if mark["kind"] == "fold")
    fastest = max(point["mean_speed"] for point in traced.record["points"])
    assert fold["value"] == pytest.approx(fastest, abs=1e-3)
    assert all(mark["gait"].keys() >= FIELDS for mark in marks)


def test_everything_is_written(traced: Found, cli: Cli) -> None:
    folder, record = traced.folder, traced.record
    assert {path.name for path in folder.iterdir()} == {
        "branch.json", "branch.csv", "branch.png", "start.json", "command.txt",
    }  # fmt: skip
    assert json.loads((folder / "branch.json").read_text()) == record
    assert (folder / "branch.png").read_bytes().startswith(b"\x89PNG")
    with (folder / "branch.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(record["points"])
    for row, point in zip(rows, record["points"], strict=True):
        assert None not in row
        assert float(row["mean_speed"]) == point["mean_speed"]
        assert float(row["touchdown_angles.fore"]) == point["touchdown_angles"]["fore"]
        assert float(row["multiplier_1.re"]) == point["floquet_multipliers"][0][0]
        assert row["phases"].split("-") == point["phases"]
    assert cli("bound", "--gait", folder / "start.json", "--json").returncode == 0


def test_the_figure_says_what_it_shows(traced: Found) -> None:
    figure = plot_branch(traced.record)
    forces, radius, angles = figure.axes
    assert "(N per leg pair)" in forces.get_ylabel()
    assert "spectral radius" in radius.get_ylabel()
    assert "(°)" in angles.get_ylabel()
    assert angles.get_xlabel() == "mean speed (m/s)"
    title = " ".join(text.get_text() for text in figure.texts)
    for told in ("kamimura2015-flexible", "energy 290 J", "height 0.32 m", "260 N m/rad", "6340"):
        assert told in title
    key = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    for mark in traced.record["landmarks"]:
        assert mark["kind"] in key
    assert [text.get_text().strip(" ▾") for text in forces.texts] == [
        "ends: second touchdown", "ends: grazing",
    ]  # fmt: skip


def test_a_summary_for_people(cli: Cli) -> None:
    done = cli("branch", "--from", "4.45", "--to", "4.5")
    assert done.returncode == 0
    assert done.stderr == ""
    for told in ("reached mean_speed = 4.45", "reached mean_speed = 4.5", "period doubling"):
        assert told in done.stdout


def test_a_saved_gait_is_followed_in_a_parameter(cli: Cli, traced: Found, tmp_path: Path) -> None:
    done = cli(
        "branch", "--gait", traced.folder / "start.json", "--over", "spine.stiffness",
        "--from", "259", "--to", "261", "--keep", "energy", "--keep", "height=0.32",
        "--keep", "mean_speed", "--general", "--json", "--out", "results",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert not record["symmetric"]
    assert record["points"][0]["parameters"]["spine.stiffness"] == 259
    assert record["points"][-1]["spine.stiffness"] == 261
    assert (tmp_path / "results" / "branch.png").exists()


DAMPED = (
    "--over", "spine.damping", "--free", "legs.extension", "--from", "0", "--to", "0.3",
)  # fmt: skip


@pytest.fixture(scope="module")
def damped(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """The published gait over damping, kept going by legs that get longer."""
    folder = tmp_path_factory.mktemp("damped")
    done = run_here("branch", *DAMPED, "--out", folder, "--json")
    return Found(done, json.loads(done.stdout), folder)


def test_a_free_parameter_is_told_for_every_gait(damped: Found) -> None:
    assert damped.done.returncode == 0, damped.done.stderr
    assert damped.record["free"] == ["legs.extension"]
    with (damped.folder / "branch.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(damped.record["points"]) > 6
    for row, point in zip(rows, damped.record["points"], strict=True):
        assert point["legs.extension"] == point["parameters"]["legs.extension"]
        assert float(row["legs.extension"]) == point["legs.extension"]
        assert point["energy"] == pytest.approx(290, abs=1e-9)
        work = sum(float(row[f"work.{side}_leg_work.positive"]) for side in ("fore", "hind"))
        by_hand = work / (2 * 10.4 * 9.81 * float(row["stride_length"]))
        assert float(row["cost_of_transport"]) == pytest.approx(by_hand, abs=1e-15)
    thrusts = [point["legs.extension"] for point in damped.record["points"]]
    assert thrusts[0] == 0
    assert thrusts == sorted(thrusts)


def test_the_figure_has_panels_for_what_is_free_and_what_is_spent(damped: Found) -> None:
    figure = plot_branch(damped.record)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert len(labels) == 5
    assert "leg extension (mm)" in labels
    assert "cost of transport" in labels
    drawn = figure.axes[labels.index("leg extension (mm)")].lines[0].get_ydata()
    last = damped.record["points"][-1]
    assert drawn[-1] == pytest.approx(1000 * last["legs.extension"])
    assert_no_text_overlaps(figure)


def test_the_summary_tells_what_a_free_parameter_and_its_cost_come_to(
    cli: Cli, damped: Found
) -> None:
    done = cli("branch", *DAMPED)
    assert done.returncode == 0, done.stderr
    rows = {line[:22].strip(): line.split() for line in done.stdout.splitlines()}
    last = damped.record["points"][-1]
    assert "  free       legs.extension\n" in done.stdout
    assert rows["legs.extension"][1:3] == ["0", f"{last['legs.extension']:.4g}"]
    assert rows["cost of transport"][3:5] == ["0", f"{last['cost_of_transport']:.4g}"]
    assert "peak GRF (N)" in done.stdout
    assert "spectral radius" in done.stdout


def test_an_interrupted_branch_goes_on_with_its_free_parameter(
    cli: Cli, damped: Found, tmp_path: Path
) -> None:
    trace = tmp_path / "results" / "branch.trace.jsonl"
    trace.parent.mkdir()
    count = 0

    def stop(_: object) -> None:
        nonlocal count
        count += 1
        if count == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trace_branch(
            examine(load_model("kamimura2015-flexible")), "spine.damping", bounds=(0, 0.3),
            free=("legs.extension",), store=trace, progress=stop,
        )  # fmt: skip
    done = cli("branch", *DAMPED, "--out", "results")
    assert done.returncode == 0
    assert "going on from" in done.stderr
    whole, resumed = damped.folder / "branch.json", trace.parent / "branch.json"
    assert resumed.read_bytes() == whole.read_bytes()


def test_a_changed_animal_starts_from_its_own_gait(cli: Cli) -> None:
    done = cli(
        "branch", "--set", "spine.stiffness=255", "--from", "4.499", "--to", "4.501", "--json"
    )
    assert done.returncode == 0, done.stderr
    point = json.loads(done.stdout)["points"][0]
    assert point["parameters"]["spine.stiffness"] == 255
    # That of the preset has 0.4613 rad, the others differ by 0.09 rad and more.
    assert point["touchdown_angles"]["fore"] == pytest.approx(0.4613, abs=0.01)


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
def test_an_animal_without_a_gait_is_exit_code_1(cli: Cli, tmp_path: Path, as_json: bool) -> None:
    done = cli(
        "branch", "--preset", "slip", "--set", "body.mass=1", *RANGE, "--out", "results",
        *(["--json"] if as_json else []),
    )  # fmt: skip
    assert done.returncode == 1
    told = json.loads(done.stdout)["remedy"] if as_json else done.stderr
    assert "--gait" in told
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """What the branch said when it was interrupted on the way, and what it left; tests copy it."""
    folder = tmp_path_factory.mktemp("interrupted")
    process = subprocess.Popen(
        [COMMAND, "branch", *RANGE, "--out", "results"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    trace = folder / "results" / "branch.trace.jsonl"
    for _ in range(6000):
        if trace.exists() and trace.stat().st_size > 8_000:
            break
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert [path.name for path in (folder / "results").iterdir()] == [trace.name]
    return errors, folder / "results"


def test_an_interrupted_branch_goes_on_where_it_was(
    cli: Cli, tmp_path: Path, traced: Found, interrupted: tuple[str, Path]
) -> None:
    errors, left = interrupted
    assert "branch.trace.jsonl" in errors
    assert errors.endswith("flexspine: interrupted\n")
    results = shutil.copytree(left, tmp_path / "results")
    done = cli("branch", *RANGE, "--out", "results")
    assert done.returncode == 0
    assert "going on from 'results/branch.trace.jsonl'" in done.stderr
    whole = traced.folder
    assert {path.name for path in results.iterdir()} == {path.name for path in whole.iterdir()}
    assert (results / "branch.json").read_bytes() == (whole / "branch.json").read_bytes()


def test_an_interrupted_branch_is_not_mixed_with_another(
    cli: Cli, tmp_path: Path, interrupted: tuple[str, Path]
) -> None:
    _, left = interrupted
    trace = shutil.copytree(left, tmp_path / "results") / "branch.trace.jsonl"
    before = trace.read_bytes()
    done = cli("branch", "--from", "3.7", "--to", "4.61", "--out", "results")
    assert_one_clear_line(done, "other settings")
    assert trace.read_bytes() == before


OVER_DAMPING = ["--over", "spine.damping", "--from", "0", "--to", "1"]

BAD = {
    "unknown preset": ([*RANGE, "--preset", "kamimra2015-flexible"], "kamimura2015-flexible"),
    "unknown parameter": ([*RANGE, "--set", "spine.stifness=3"], "spine.stiffness"),
    "unknown quantity": ([*RANGE, "--over", "spine.stifness"], "'spine.stifness'"),
    "unknown kept": ([*RANGE, "--keep", "heigt"], "height"),
    "kept and followed": ([*RANGE, "--keep", "mean_speed"], "--keep mean_speed"),
    "too few kept": ([*RANGE, "--keep", "height"], "too few"),
    "not a number": ([*RANGE, "--keep", "energy=nan"], "energy"),
    "unknown free": ([*RANGE, "--free", "legs.extensin"], "'legs.extension'"),
    "free and followed": ([*OVER_DAMPING, "--free", "spine.damping"], "name it once"),
    "free twice": ([*OVER_DAMPING, *["--free", "legs.extension"] * 2], "name it once"),
    "two free": (
        [*OVER_DAMPING, "--free", "legs.extension", "--free", "legs.stiffening"], "fewer",
    ),
    "damped and nothing free": (OVER_DAMPING, "such as legs.extension"),
    "a damped animal": ([*RANGE, "--set", "spine.damping=1"], "flexspine gait --free"),
    "no end": (["--from", "3.7"], "--to"),
    "turned around": (["--from", "4.6", "--to", "3.7"], "low before high"),
    "without the gait": (["--from", "3.7", "--to", "4"], "4.5"),
    "no step": ([*RANGE, "--longest-step", "0"], "--longest-step"),
    "absent gait": ([*RANGE, "--gait", "absent.json"], "absent.json"),
    "two animals": ([*RANGE, "--gait", "absent.json", "--preset", "slip"], "--preset"),
    "a changed gait": ([*RANGE, "--gait", "absent.json", "--set", "gravity=9"], "--set"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_clear_line(cli: Cli, tmp_path: Path, case: str) -> None:
    arguments, told = BAD[case]
    assert_one_clear_line(cli("branch", *arguments, "--out", "results"), told)
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind"


def test_a_file_whose_gait_does_not_close_is_refused(
    cli: Cli, traced: Found, tmp_path: Path
) -> None:
    saved = json.loads((traced.folder / "start.json").read_text())
    saved["apex"]["speed"] += 0.01
    (tmp_path / "off.json").write_text(json.dumps(saved))
    assert_one_clear_line(cli("branch", "--gait", "off.json", *RANGE), "misses its start")
