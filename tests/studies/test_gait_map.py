"""The map of gaits over speed and stiffness has the published forces and ends where they do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexspine import load_model, rerun, sweep
from flexspine.errors import InputError, ParameterError
from flexspine.gaits.gait import examine
from flexspine.studies.gait_map import GaitMap, map_plan, read_map
from tests.conftest import reference_rows

# Of the readings: N and m/s.
PEAK_ERROR, SPEED_ERROR = 8.0, 0.02

# Radius of the published gait at k_t = 260 N m/rad and 4.5 m/s, computed independently.
RADIUS = 1.32785


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Lines at 200, 220, 240 and 260 N m/rad, every 0.25 m/s."""
    path = tmp_path_factory.mktemp("map")
    gait = examine(load_model("kamimura2015-flexible"))
    sweep(map_plan(gait, (200.0, 260.0), (2.5, 4.5), lines=4, points=9), path)
    return path


@pytest.fixture(scope="module")
def drawn(folder: Path) -> GaitMap:
    return read_map(folder)


def test_peak_forces_are_the_published_ones(drawn: GaitMap) -> None:
    readings = [
        tuple(map(float, row[1:])) for row in reference_rows("kamimura2015_fig4.csv") if row[1]
    ]
    compared = 0
    for stiffness, speed, peak in readings:
        if speed not in drawn.speeds:
            continue
        i, j = list(drawn.stiffnesses).index(stiffness), list(drawn.speeds).index(speed)
        neighbours = drawn.peak_grf[i, max(j - 1, 0) : j + 2]
        slope = np.nanmax(np.abs(np.diff(neighbours))) / (drawn.speeds[1] - drawn.speeds[0])
        error = PEAK_ERROR + SPEED_ERROR * slope
        assert drawn.peak_grf[i, j] == pytest.approx(peak, abs=error), (stiffness, speed)
        compared += 1
    assert compared == 9


def test_gaits_end_where_the_published_curves_do(drawn: GaitMap) -> None:
    slowest = dict(zip(drawn.stiffnesses.tolist(), drawn.slowest.tolist(), strict=True))
    assert slowest[260] == pytest.approx(3.73, abs=SPEED_ERROR)
    assert slowest[240] == pytest.approx(3.54, abs=SPEED_ERROR)
    assert np.isnan([slowest[200], slowest[220]]).all()
    for i, line in enumerate(drawn.radius):
        known = np.isfinite(line)
        assert np.array_equal(known, drawn.speeds >= np.nan_to_num(drawn.slowest[i]))
        assert np.array_equal(np.isfinite(drawn.peak_grf[i]), known)
    assert drawn.reasons[0] == ""
    assert drawn.reasons[-1].startswith("second touchdown at mean_speed = 3.73")


def test_the_published_gait_is_on_the_map(drawn: GaitMap) -> None:
    assert drawn.radius[-1, -1] == pytest.approx(RADIUS, abs=5e-6)
    assert drawn.energy == pytest.approx(290, abs=1e-9)
    assert drawn.height == 0.32
    assert drawn.stable == 0
    assert drawn.found == np.isfinite(drawn.radius).sum() == 9 + 9 + 4 + 4


def test_tables_tell_what_there_is(drawn: GaitMap) -> None:
    rows = drawn.rows()
    assert len(rows) == 36
    assert sum(row["peak_grf"] is not None for row in rows) == drawn.found
    extremes = drawn.extremes(drawn.radius)
    assert extremes is not None
    assert extremes["least"]["value"] == np.nanmin(drawn.radius)
    assert extremes["least"]["mean_speed"] == 4.5
    assert [end["slowest"] is None for end in drawn.ends()] == [True, True, False, False]
    assert drawn.extremes(np.full((4, 9), np.nan)) is None


def test_a_map_is_gone_on_with_and_repeated(folder: Path) -> None:
    file = sorted((folder / "rows").rglob("*.parquet"))[-1]
    before = read_map(folder)
    file.unlink()
    with pytest.raises(InputError, match="not finished"):
        read_map(folder)
    gait = examine(load_model("kamimura2015-flexible"))
    plan = map_plan(gait, (200.0, 260.0), (2.5, 4.5), lines=4, points=9)
    assert sweep(plan, folder).made == 1
    assert np.array_equal(read_map(folder).radius, before.radius, equal_nan=True)


def test_a_small_map_comes_out_the_same_again(tmp_path: Path) -> None:
    gait = examine(load_model("kamimura2015-flexible"))
    sweep(map_plan(gait, (258.0, 260.0), (4.45, 4.5), lines=2, points=2), tmp_path)
    assert rerun(tmp_path).same


def test_what_is_no_map_is_refused() -> None:
    gait = examine(load_model("kamimura2015-flexible"))
    for ranges in (((260.0, 200.0), (4.0, 4.5)), ((200.0, 260.0), (-1.0, 4.5))):
        with pytest.raises(ParameterError, match="is no range"):
            map_plan(gait, *ranges)
    with pytest.raises(ParameterError, match="lines = 1"):
        map_plan(gait, lines=1)
    with pytest.raises(ParameterError, match="no gait"):
        map_plan(examine(load_model("scout2", apex={"height": 0.36})))
    with pytest.raises(InputError, match="spine"):
        map_plan(examine(load_model("scout2")))


def test_other_directories_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no manifest"):
        read_map(tmp_path)
