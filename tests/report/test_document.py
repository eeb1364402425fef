"""A page shows what its directory holds, with the same numbers, and needs nothing beside it."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xarray as xr
from matplotlib.figure import Figure

import flexspine
from flexspine import Ground, load_model, load_robot, simulate, to_dataset
from flexspine.control.gains import load_walk
from flexspine.control.trot import Trot, trot
from flexspine.engines.space_dataset import space_dataset
from flexspine.engines.space_measures import space_record, summarize_space
from flexspine.engines.space_run import run_in_space
from flexspine.gaits.record import run_record
from flexspine.models.files import write_netcdf
from flexspine.models.robot_run import robot_dataset
from flexspine.report.document import document
from flexspine.report.page.holdings import MOST_ROWS
from flexspine.report.page.panels import MOST_POINTS, thinned
from tests.report.pages import Page, assert_needs_nothing_else

SWEEP = """model = "scout2"
method = "random"
samples = 6
[options]
strides = 2
[axes]
speed = { around = 0.02 }
"""


def write(folder: Path, dataset: xr.Dataset | None = None, **records: Any) -> Path:
    folder.mkdir(exist_ok=True)
    if dataset is not None:
        write_netcdf(dataset, folder / "trajectory.nc")
    for name, record in records.items():
        (folder / f"{name}.json").write_text(json.dumps(record))
    return folder


@pytest.fixture(scope="module")
def bounder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = simulate(load_model("kamimura2015-flexible", {"spine.stiffness": 250}), strides=2)
    folder = write(
        tmp_path_factory.mktemp("results") / "bound", to_dataset(run), summary=run_record(run)
    )
    (folder / "animation.gif").write_bytes(b"GIF89a")
    return folder


@pytest.fixture(scope="module")
def space(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = run_in_space(load_robot("sc618"), load_walk("trot", "sc618"), 1.0)
    record = space_record(run, summarize_space(run))
    return write(tmp_path_factory.mktemp("results") / "run3d", space_dataset(run), summary=record)


@pytest.fixture(scope="module")
def bounding(bounder: Path) -> Page:
    return Page(document(bounder))


@pytest.fixture(scope="module")
def in_space(space: Path) -> Page:
    return Page(document(space))


def load(folder: Path) -> xr.Dataset:
    return xr.load_dataset(folder / "trajectory.nc", engine="h5netcdf")


def record_of(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return found


def frames_of(page: Page) -> np.ndarray:
    return np.array(page.data["run-0-reel"]["frames"])


def line_of(page: Page, panel: str, line: str) -> np.ndarray:
    (shown,) = [each for each in page.data["run-0-panels"]["panels"] if each["title"] == panel]
    (found,) = [each for each in shown["lines"] if each["name"] == line]
    return np.array([found["x"], found["y"]])


def assert_drawn(shown: np.ndarray, expected: xr.DataArray | np.ndarray) -> None:
    """Finer than any screen: to a hundred-thousandth of the range."""
    np.testing.assert_allclose(
        shown, expected, rtol=0, atol=1e-5 * float(np.ptp(np.asarray(expected)))
    )


def test_a_bounder_is_told_with_the_numbers_of_its_record(bounding: Page, bounder: Path) -> None:
    assert_needs_nothing_else(bounding)
    record = record_of(bounder)
    assert record["outcome"] in bounding.text
    wanted = [record[name] for name in ("duration", "mean_speed", "stride_length")]
    wanted += [*record["peak_grf"].values(), *record["duty_factor"].values()]
    assert set(wanted) <= bounding.numbers
    assert "animation.gif" in bounding.text


def test_parameters_have_unit_value_and_provenance(bounding: Page, bounder: Path) -> None:
    given = json.loads(load(bounder).attrs["parameters"])
    assert set(given.values()) <= bounding.numbers
    assert "spine.stiffness 250 N m/rad" in bounding.text
    assert bounding.text.count("set by user") == 1
    assert "not printed; standard value" in bounding.text
    assert "Doubt: The lengths printed in the tables" in bounding.text
    assert "k_t in the flight around the apex default" in bounding.text


def test_plots_show_the_data(bounding: Page, bounder: Path) -> None:
    data = load(bounder)
    time, force = line_of(bounding, "Vertical force, per pair of legs", "fore")
    assert_drawn(time, data.time)
    assert_drawn(force, data.fore_grf_y)
    bend = line_of(bounding, "Pitch and spine", "spine (fore minus hind)")[1]
    assert_drawn(np.radians(bend), data.spine_angle)


def test_the_player_shows_where_the_animal_is(bounding: Page, bounder: Path) -> None:
    data, film = load(bounder), bounding.data["run-0-reel"]
    frames = frames_of(bounding)
    time = frames[:, 0]
    assert time[0] == 0
    assert time[-1] == pytest.approx(float(data.time[-1]), abs=1e-6)
    assert np.ptp(np.diff(time)) < 3e-6
    for column, name in ((2, "com_x"), (3, "com_y")):
        expected = np.interp(time, data.time, data[name])
        np.testing.assert_allclose(frames[:, column], expected, atol=1e-4)
    kinds = [part[0] for part in film["parts"]]
    assert kinds.count("foot") == 2
    # Time, level, CoM and words come first; of a foot five numbers, of others two a point.
    sizes = [2 * part[3] + 3 * (part[0] == "foot") for part in film["parts"]]
    assert {len(frame) for frame in film["frames"]} == {5 + sum(sizes)}
    feet = [5 + sum(sizes[:i]) for i, kind in enumerate(kinds) if kind == "foot"]
    for place, side in zip(feet, ("fore", "hind"), strict=True):
        stands = frames[:, place + 2] == 1
        force = np.interp(time, data.time, data[f"{side}_grf_y"])
        assert np.all(stands[force > 20])
        np.testing.assert_allclose(frames[stands, place + 4], force[stands], atol=0.01)
        toe = np.interp(time, data.time, data[f"{side}_toe_x"])
        inside = force > 20
        np.testing.assert_allclose(frames[inside, place], toe[inside], atol=1e-4)
        np.testing.assert_allclose(frames[inside, place + 1], 0.0, atol=1e-4)


def test_uneven_ground_is_in_the_player(tmp_path: Path) -> None:
    ground = Ground.rough(0.004, seed=3)
    data = to_dataset(simulate(load_model("kamimura2015-flexible").on(ground)))
    page = Page(document(write(tmp_path / "rough", data)))
    drawn = np.reshape(page.data["run-0-reel"]["ground"], (-1, 2))
    np.testing.assert_allclose(drawn, np.column_stack([data.ground_x, data.ground_y]), atol=1e-4)


def test_a_robot_in_space_is_shown_from_the_right(in_space: Page, space: Path) -> None:
    assert_needs_nothing_else(in_space)
    data, record = load(space), record_of(space)
    assert record["measures"]["peak_normal"] in in_space.numbers
    assert set(record["gains"].values()) <= in_space.numbers
    frames = frames_of(in_space)
    height = np.interp(frames[:, 0], data.time, data["com"].sel(axis="z"))
    np.testing.assert_allclose(frames[:, 3], height, atol=1e-4)
    for leg, foot in json.loads(data.attrs["legs"]).items():
        force = line_of(in_space, "Normal force", leg.replace("_", " "))[1]
        expected = data["grf"].sel(foot_name=foot, axis="z")
        assert_drawn(force, expected)
    assert "N/m of the ground under a foot" in in_space.text
    assert "Hz of strides flexspine tune --gait trot" in in_space.text


def test_a_robot_in_the_plane_has_joints_with_references(tmp_path: Path) -> None:
    data = robot_dataset(trot(load_robot("sc618"), Trot(seconds=0.6)))
    page = Page(document(write(tmp_path / "trot", data)))
    assert_needs_nothing_else(page)
    joint = np.degrees(data["angle"].sel(joint="knee_3"))
    assert_drawn(line_of(page, "Knees", "knee 3")[1], joint)
    (knees,) = [each for each in page.data["run-0-panels"]["panels"] if each["title"] == "Knees"]
    assert [line["dash"] for line in knees["lines"]].count("dot") == 4
    assert "kg of the foot, a point the source" in page.text
    assert "spine.damping 2 N m s/rad on its rate chosen, see doubts" in page.text
    assert "gait.stance 0.4 s" in page.text


def test_a_run_that_ended_early_is_told_with_advice(tmp_path: Path) -> None:
    run = simulate(load_model("scout2").with_values(apex={"speed": 0.3}), strides=20)
    assert not run.outcome.completed
    page = Page(document(write(tmp_path / "early", to_dataset(run), summary=run_record(run))))
    assert run.outcome.message in page.text
    assert f"Advice: {run.outcome.advice}" in page.text


def test_no_peak_is_lost_in_a_long_line() -> None:
    time = np.linspace(0, 20, 20001)
    values = np.sin(time)
    values[12345] = 77.0
    values[333] = -55.0
    x, y = thinned(time, values)
    assert len(x) == len(y) <= MOST_POINTS
    assert (x[0], x[-1]) == (0, 20)
    assert x == sorted(x)
    assert (x[int(np.argmax(y))], max(y)) == (12.345, 77.0)
    assert (x[int(np.argmin(y))], min(y)) == (0.333, -55.0)


def test_a_small_change_is_drawn_smoothly() -> None:
    time = np.linspace(0, 1, 500)
    values = 4.5 + 1e-7 * np.sin(time)
    assert_drawn(np.array(thinned(time, values)[1]), values)


def test_text_never_becomes_markup(tmp_path: Path, bounder: Path) -> None:
    evil = "</script><script>alert(1)</script><img src=http://example.org/x>\"'&"
    data = load(bounder).assign_attrs(title=evil, preset=evil, citation=evil, message=evil)
    data.attrs["outcome"] = "fell"
    record = {**record_of(bounder), "message": evil, "advice": evil, "outcome": "fell", evil: 4.0}
    folder = write(tmp_path / "evil", data, summary=record)
    (folder / f"{evil.replace('/', '-')}.csv").write_text(f'"{evil[:20]}"\n<b>1</b>\n')
    (folder / "walk.toml").write_text(evil)
    page = Page(document(folder))
    assert_needs_nothing_else(page)
    # Data of the player and the plots, Plotly, and four of ours.
    assert len(page.of("script")) == 7
    assert not page.of("img")
    assert not page.of("b")
    assert evil in page.text


def test_tables_are_capped_and_shown_once(tmp_path: Path, bounder: Path) -> None:
    rows = [{"speed": 0.1 * i, "name": f"row {i}"} for i in range(250)]
    folder = tmp_path / "tables"
    shutil.copytree(bounder, folder)
    pq.write_table(pa.Table.from_pylist(rows), folder / "gaits.parquet")
    with (folder / "gaits.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, ["speed", "name"])
        writer.writeheader()
        writer.writerows(rows)
    page = Page(document(folder))
    assert f"250 rows, of which the first {MOST_ROWS} are shown" in page.text
    assert page.text.count("row 199") == 1
    assert "row 200" not in page.text


def test_verdicts_have_claims_numbers_and_runs(tmp_path: Path) -> None:
    verdicts = [
        {"claim": 1, "statement": "lower peaks", "verdict": "holds", "finding": "by 3 %",
         "numbers": {"ratio": 0.97}, "command": None,
         "runs": [{"mean_speed": 4.25, "gait": "gait-a.json"}]},
        {"claim": 11, "statement": "errors decay", "verdict": "depends on", "finding": "at times",
         "numbers": {}, "command": "flexspine trot --seconds 20", "runs": []},
    ]  # fmt: skip
    setting = {"energy": 290.0, "speeds": [2.4, 4.7]}
    record = {"schema_version": 1, "setting": setting, "verdicts": verdicts}
    folder = write(tmp_path / "study", study=record)
    Figure().savefig(folder / "peaks.png")
    page = Page(document(folder))
    assert_needs_nothing_else(page)
    for told in (
        "2 claims are judged: 1 holds, 1 depends on", "gait-a.json at 4.25 m/s", "0.97",
        "flexspine trot --seconds 20", "total energy 290 J", "2.4 to 4.7 m/s", "peaks.png",
    ):  # fmt: skip
        assert told in page.text, told
    assert not any("Plotly" in script for script in page.scripts)


def test_a_sweep_is_told_from_its_manifest(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text(SWEEP)
    flexspine.sweep(tmp_path / "plan.toml", tmp_path / "many")
    page = Page(document(tmp_path / "many"))
    assert_needs_nothing_else(page)
    assert "flexspine rerun many" in page.text
    assert "rows/ 6 rows." in page.text
    (parts,) = (tmp_path / "many" / "rows").rglob("*.parquet")
    assert set(pq.read_table(parts)["peak_grf_fore"].to_pylist()) <= page.numbers


def test_the_same_results_give_the_same_page(bounder: Path) -> None:
    assert document(bounder) == document(bounder)
