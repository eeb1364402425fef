"""Basins of attraction: starts on the energy level come to a stable gait at its own rate."""

from __future__ import annotations

from collections.abc import Mapping
from math import radians
from pathlib import Path

import numpy as np
import pytest

from flexspine import Plan, load_model, read_plan, rerun, simulate, sweep
from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.gaits.gait import Gait, examine
from flexspine.studies.basin import Basin, basin_plan, example_gaits, read_basins
from flexspine.studies.gait_map import map_plan
from tests.conftest import reference_rows

# Apex speed (m/s), pitch rate (deg/s), touchdown angles (deg), period (s), |lambda|.
SCOUT = [[float(cell) for cell in row] for row in reference_rows("scout2.csv")]
OF_ROW = {(4, 140): "scout2", (4, 300): "scout2-4mps-300dps"}
OF_ROW |= {(2, 220): "scout2-2mps-220dps", (1, 140): "scout2-1mps-140dps"}

# As the source gives them: kg and kg m^2.
MASS, INERTIA = 20.865, 1.3

SLICE = {"pitch": 0.8, "pitch_rate": 8.0}


@pytest.fixture(scope="module")
def gaits() -> dict[str, Gait]:
    return example_gaits()


def found(
    path: Path,
    gaits: Mapping[str, Gait],
    over: Mapping[str, float],
    strides: int,
    points: int = 6,
    keep_energy: bool = True,
) -> list[Basin]:
    plan = basin_plan(gaits, over, points=points, strides=strides, keep_energy=keep_energy)
    sweep(plan, path)
    return read_basins(path)


def farthest(basin: Basin) -> float:
    assert basin.lasted.all()
    return float(basin.deviation.max())


@pytest.mark.parametrize("row", SCOUT, ids=lambda row: f"{row[0]:g}mps-{row[1]:g}")
def test_the_examples_are_the_gaits_of_the_reference(
    gaits: dict[str, Gait], row: list[float]
) -> None:
    speed, rate, hind, fore, period, _ = row
    gait = gaits[OF_ROW[int(speed), int(rate)]]
    apex = {"height": 0.35, "pitch": 0.0, "speed": speed, "pitch_rate": radians(rate)}
    assert gait.model.apex == pytest.approx(apex, abs=1e-12)
    assert gait.touchdown_angles == pytest.approx(
        {"fore": radians(fore), "hind": radians(hind)}, abs=1e-6
    )
    assert gait.period == pytest.approx(period, abs=1e-5)


@pytest.mark.parametrize("row", SCOUT, ids=lambda row: f"{row[0]:g}mps-{row[1]:g}")
def test_small_deviations_grow_or_shrink_by_the_spectral_radius(
    gaits: dict[str, Gait], row: list[float], tmp_path: Path
) -> None:
    """Over a ring of starts, so that rotating deviations do not hide how they change."""
    name, radius = OF_ROW[int(row[0]), int(row[1])], row[5]
    size, early, late = (1e-3, 8, 24) if radius < 1 else (1e-7, 8, 64 if radius < 1.2 else 16)
    sizes = []
    for strides in (early, late):
        small = {"pitch": size, "pitch_rate": 5 * size}
        (basin,) = found(tmp_path / f"{strides}", {name: gaits[name]}, small, strides)
        sizes.append(farthest(basin))
        assert basin.radius == pytest.approx(radius, abs=5e-5)
    assert (sizes[1] / sizes[0]) ** (1 / (late - early)) == pytest.approx(radius, rel=0.03)


def test_starts_have_the_energy_of_the_gait(gaits: dict[str, Gait], tmp_path: Path) -> None:
    name = "scout2-1mps-140dps"
    (basin,) = found(tmp_path, {name: gaits[name]}, SLICE, strides=1, points=9)
    assert basin.energy == pytest.approx(
        MASS * (9.81 * 0.35 + 1 / 2) + INERTIA * radians(140) ** 2 / 2, rel=1e-12
    )
    _, rates = basin.values
    square = 1 - INERTIA / MASS * (rates**2 - radians(140) ** 2)
    assert 2 < (square > 0).sum() < 8
    assert np.array_equal(basin.possible, np.broadcast_to(square > 0, (9, 9)))
    import pyarrow.parquet as pq

    (file,) = sorted((tmp_path / "rows").rglob("*.parquet"))
    rows = pq.ParquetFile(file).read().to_pylist()
    for row in rows:
        own = square[rates == row["at_pitch_rate"]][0]
        assert row["at_speed"] == pytest.approx(np.sqrt(max(own, 0)), abs=1e-12)
        if own > 0:
            assert row["energy_start"] == pytest.approx(basin.energy, rel=1e-13)


def test_only_starts_with_its_energy_come_to_a_gait(gaits: dict[str, Gait], tmp_path: Path) -> None:
    about = {"height": 0.002, "pitch": 0.005}
    for kept in (True, False):
        (basin,) = found(
            tmp_path / str(kept), {"scout2": gaits["scout2"]}, about, 60, keep_energy=kept
        )
        assert basin.lasted.all()
        assert basin.settled.all() == kept
        assert basin.settled.any() == kept


def test_the_basin_of_the_stable_gait_is_wide_and_no_other_gait_has_one(
    gaits: dict[str, Gait], tmp_path: Path
) -> None:
    basins = found(tmp_path, gaits, SLICE, strides=60, points=10)
    assert [basin.name for basin in basins] == list(gaits)
    stable, *others = basins
    pitches, rates = stable.values
    inner = np.ix_(np.abs(pitches) < 0.2, np.abs(rates - radians(140)) < 3)
    assert stable.settled[inner].size == 8
    assert stable.settled[inner].all()
    assert not any(basin.lasted.any() for basin in others)
    row = stable.row()
    assert row["lasted"] == row["settled"] + row["not_settled"]
    assert row["not_settled"] == sum(other.starts for other in stable.others)
    for other in stable.others:
        run = simulate(stable.model.with_values(apex=other.apex), strides=1)
        assert run.apexes[-1] == pytest.approx(other.apex, abs=1e-8)


def test_a_basin_is_gone_on_with_and_repeated(gaits: dict[str, Gait], tmp_path: Path) -> None:
    plan = basin_plan({"scout2": gaits["scout2"]}, SLICE, points=4, strides=2)
    assert sweep(plan, tmp_path).made == 1
    (tmp_path / "summary.json").write_text("{}")
    assert sweep(plan, tmp_path).made == 0
    assert rerun(tmp_path).same


def test_plans_of_the_examples_do_not_change_from_time_to_time(gaits: dict[str, Gait]) -> None:
    assert basin_plan(example_gaits()).key == basin_plan(gaits).key


BAD = {
    "one coordinate": ({"pitch": 0.1}, ParameterError, "slice"),
    "no such": ({"pitch": 0.1, "hight": 0.1}, UnknownNameError, "height"),
    "no room": ({"pitch": 0.0, "height": 0.1}, ParameterError, "pitch"),
    "endless": ({"pitch": float("inf"), "height": 0.1}, ParameterError, "pitch"),
    "speed": ({"pitch": 0.1, "speed": 0.1}, ParameterError, "keeps the energy"),
    "parameter": ({"pitch": 0.1, "touchdown.fore": 0.1}, UnknownNameError, "touchdown.fore"),
    "too far": ({"pitch": 0.1, "pitch_rate": 1e4}, ParameterError, "go less far"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_slice_is_refused(case: str) -> None:
    over, error, told = BAD[case]
    gait = examine(load_model("scout2"))
    with pytest.raises(error, match=told):
        basin_plan({"scout2": gait}, over, points=4)


def test_what_is_no_gait_is_refused() -> None:
    off = examine(load_model("scout2", apex={"height": 0.36}))
    with pytest.raises(ParameterError, match="no gait"):
        basin_plan({"off": off})
    with pytest.raises(ParameterError, match="no gait"):
        basin_plan({})


@pytest.mark.parametrize("method", ["random", "sobol"])
def test_samples_of_a_file_keep_the_energy_too(tmp_path: Path, method: str) -> None:
    file = tmp_path / "plan.toml"
    file.write_text(
        f'model = "scout2"\nmethod = "{method}"\nsamples = 8\n'
        '[axes]\nheight = {within = 0.01}\nspeed = {keeps = "energy"}\n'
    )
    plan = read_plan(file)
    assert Plan.revive(plan.record()).key == plan.key
    points = plan.at(0)
    assert list(points) == ["height", "speed"]
    squares = 16 - 2 * 9.81 * (points["height"] - 0.35)
    assert points["speed"] == pytest.approx(np.sqrt(squares), abs=1e-13)


KEEPS = {
    "another coordinate": ('height = {keeps = "energy"}', "'height'"),
    "another quantity": ('speed = {keeps = "height"}', "'speed'"),
    "nothing else": ('speed = {keeps = "energy"}', "no axis varies"),
    "a search": ('height = [0.35]\nspeed = {keeps = "energy"}', "for runs"),
}


@pytest.mark.parametrize("case", KEEPS)
def test_what_cannot_keep_the_energy_is_refused(tmp_path: Path, case: str) -> None:
    axes, told = KEEPS[case]
    task = "searches" if case == "a search" else "runs"
    file = tmp_path / "plan.toml"
    file.write_text(f'model = "scout2"\ntask = "{task}"\n[axes]\n{axes}\n')
    with pytest.raises(InputError, match=told):
        read_plan(file)


def test_other_directories_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no manifest"):
        read_basins(tmp_path)
    gait = examine(load_model("kamimura2015-flexible"))
    plan = map_plan(gait, (255, 260), (4.45, 4.5), lines=2, points=2)
    sweep(plan, tmp_path)
    with pytest.raises(InputError, match="holds no basin"):
        read_basins(tmp_path)
