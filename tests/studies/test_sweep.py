"""Rows of a sweep against single runs and gaits, whatever does the work, and however it is read."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow.parquet as pq
import pytest

from flexspine import (
    Gait,
    Model,
    Sweep,
    examine,
    find_gaits,
    floquet_multipliers,
    load_model,
    rerun,
    simulate,
    summarize,
    sweep,
)
from flexspine.studies import sweep as sweeps
from tests.conftest import reference_rows

FLEXIBLE, LOCKED, SCOUT = "kamimura2015-flexible", "kamimura2015-locked", "scout2"
COMMAND = Path(sys.executable).with_name("flexspine")

Row = dict[str, Any]
Doing = Callable[..., Sweep]

# Two models of different coordinates; some runs fall, some complete.
RUNS = f"""
model = ["{SCOUT}", "{FLEXIBLE}"]
method = "random"
samples = 10
seed = 4
chunk = 4
[options]
strides = 3
[axes]
speed = {{ around = 0.03 }}
fore_pitch_rate = {{ within = 0.5 }}
"fore.leg.stiffness" = {{ around = 0.05 }}
"touchdown.fore" = {{ within = 0.03 }}
"""


@pytest.fixture
def do(tmp_path: Path) -> Doing:
    """Carry out a plan given as a text, in a directory of its own."""
    count = iter(range(100))

    def carry_out(text: str, **options: Any) -> Sweep:
        number = next(count)
        file = tmp_path / f"plan-{number}.toml"
        file.write_text(text)
        return sweep(file, tmp_path / f"out-{number}", **options)

    return carry_out


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    """Those of both models, to be read only."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "plan.toml").write_text(RUNS)
    return sweep(folder / "plan.toml", folder / "out")


def rows_of(done: Sweep, model: str | None = None) -> list[Row]:
    """All rows, or those of one model, in the order of the points."""
    found: list[Row] = pq.read_table(done.path / "rows").to_pylist()
    chosen = [row for row in found if model in (None, row["model"])]
    return sorted(chosen, key=lambda row: (row["model"], row["point"], row.get("gait") or 0))


def files_of(done: Sweep) -> dict[str, bytes]:
    """The content of all its Parquet files, by name."""
    rows = done.path / "rows"
    return {str(f.relative_to(rows)): f.read_bytes() for f in rows.rglob("*") if f.is_file()}


def started(row: Row, base: Model) -> Model:
    """The model of a row, from the columns that tell its point."""
    names = {f"at_{name.replace('.', '_')}": name for name in base.numbers}
    given = {names[key]: value for key, value in row.items() if key in names and value is not None}
    apex = {name: value for name, value in given.items() if name in base.apex}
    angles = {side: given.get(f"touchdown.{side}") for side in ("fore", "hind")}
    return base.with_values(
        {n: v for n, v in given.items() if n not in apex and not n.startswith("touchdown.")},
        apex=apex,
        touchdown={side: angle for side, angle in angles.items() if angle is not None},
    )


def test_rows_of_runs_are_those_of_runs_one_by_one(runs: Sweep) -> None:
    assert runs.rows == 20
    strides = 0
    for row in rows_of(runs):
        run = simulate(started(row, load_model(row["model"])), strides=3)
        assert row["outcome"] == run.outcome.name
        assert row["strides"] == len(run.apexes) - 1
        strides += row["strides"]
        last = {name: row[f"apex_{name}"] for name in run.model.apex}
        assert last == pytest.approx(run.apexes[-1], abs=1e-10)
        for side, peak in summarize(run).peak_grf.items():
            assert row[f"peak_grf_{side}"] == pytest.approx(peak, rel=1e-9)
        assert row["duration"] == pytest.approx(run.trajectory.duration, abs=1e-10)
        assert row["apex_time"] == pytest.approx(run.section_points[-1].time, abs=1e-10)
    assert runs.strides == strides
    assert runs.outcomes.keys() == {"completed", "fell"}
    assert sum(runs.outcomes.values()) == 20


def test_what_a_model_lacks_is_null_in_its_rows(runs: Sweep) -> None:
    lacking = {
        SCOUT: {"fore_pitch", "hind_pitch", "fore_pitch_rate", "hind_pitch_rate"},
        FLEXIBLE: {"pitch", "pitch_rate"},
    }
    for model, names in lacking.items():
        for row in rows_of(runs, model):
            empty = {name for name, value in row.items() if value is None}
            also = {"at_fore_pitch_rate"} if model == SCOUT else set()
            assert empty == {f"apex_{name}" for name in names} | also


def test_every_point_has_its_row_in_the_file_of_its_chunk(runs: Sweep) -> None:
    assert [len(pq.ParquetFile(file).read()) for file in runs.files] == [4, 4, 2, 4, 4, 2]
    for model in (SCOUT, FLEXIBLE):
        assert [row["point"] for row in rows_of(runs, model)] == list(range(10))
        folder = runs.path / "rows" / f"model={model}"
        assert sorted(path.name for path in folder.iterdir()) == [
            f"part-00000{number}.parquet" for number in range(3)
        ]
    assert {path.name for path in runs.path.iterdir()} == {"manifest.json", "rows"}


def test_the_energy_at_the_start_is_that_of_the_apex(runs: Sweep) -> None:
    """m g h + m v^2 / 2 + I w^2 / 2 of a rigid body."""
    body = load_model(SCOUT).numbers
    for row in rows_of(runs, SCOUT):
        energy = (
            body["body.mass"] * (9.81 * body["height"] + row["at_speed"] ** 2 / 2)
            + body["body.inertia"] * body["pitch_rate"] ** 2 / 2
        )
        assert row["energy_start"] == pytest.approx(energy, rel=1e-14)
        assert row["energy_end"] == pytest.approx(energy, rel=1e-10)


def test_published_robots_take_as_long_as_published(do: Doing) -> None:
    """The periods of Scout II, from an independent implementation; angles are given to 1e-4."""
    for row in reference_rows("scout2.csv"):
        speed, rate, hind, fore, period, _ = map(float, row)
        done = do(
            f'model = "{SCOUT}"\n[set]\nheight = 0.35\npitch = 0\nspeed = {speed!r}\n'
            f"touchdown.hind = {np.radians(hind):.17g}\n"
            f"[axes]\npitch_rate = [{np.radians(rate):.17g}]\n"
            f"touchdown.fore = [{np.radians(fore):.17g}]"
        )
        (found,) = rows_of(done)
        assert found["duration"] == pytest.approx(period, abs=2e-5)
        assert found["apex_height"] == pytest.approx(0.35, abs=1e-5)


@pytest.mark.parametrize(
    "axes",
    [
        "speed = {around = 0.02, steps = 24}",
        # Terms without a damper are left out of a system, but not where others of a sweep have one.
        "spine.damping = [0.0, 0.5]\nfore.leg.damping = [3.0]\nspeed = {around = 0.02, steps = 12}",
        "fore.leg.damping = [3.0, 0.0]\nspine.damping = [0.5]\nspeed = {around = 0.02, steps = 12}",
    ],
)
def test_rows_do_not_depend_on_the_chunk_they_are_in(do: Doing, axes: str) -> None:
    """Bit for bit."""
    text = f'model = "{FLEXIBLE}"\nchunk = SIZE\n[options]\nstrides = 2\n[axes]\n{axes}'
    one, some, all_of_them = (rows_of(do(text.replace("SIZE", s))) for s in ("5", "12", "24"))
    assert len(one) == 24
    assert one == some == all_of_them


def gait_of(row: Row, base: Model) -> Gait:
    """The gait that a row tells of, from its apex and its touchdown angles alone."""
    apex = {name: row[f"apex_{name}"] for name in base.apex if f"apex_{name}" in row}
    if "pitch" in base.apex:
        apex |= {"pitch": row["apex_fore_pitch"], "pitch_rate": row["apex_fore_pitch_rate"]}
    angles = {side: row[f"touchdown_{side}"] for side in ("fore", "hind")}
    return examine(base.with_values(apex=apex, touchdown=angles))


def multipliers_of(row: Row) -> np.ndarray:
    return np.array([complex(text) for text in row["floquet_multipliers"].split()])


def assert_is_a_gait(row: Row, base: Model) -> None:
    """What a row says of its gait is true of the orbit from its apex."""
    gait = gait_of(row, base)
    assert gait.flaw is None
    assert row["residual"] <= 1e-11
    found = floquet_multipliers(gait)
    # They are written with 12 digits.
    assert multipliers_of(row) == pytest.approx(found.multipliers, rel=1e-7, abs=1e-7)
    assert row["level_spectral_radius"] == pytest.approx(found.level_spectral_radius, rel=1e-7)
    assert row["stable"] == found.stable
    assert row["mean_speed"] == pytest.approx(gait.mean_speed, abs=1e-11)
    assert row["energy"] == pytest.approx(gait.energy, rel=1e-13)
    assert row["period"] == pytest.approx(gait.period, abs=1e-12)
    assert row["phases"] == "-".join(gait.phases)
    peaks = summarize(simulate(gait.model)).peak_grf
    assert {side: row[f"peak_grf_{side}"] for side in peaks} == pytest.approx(peaks, rel=1e-10)


def test_rows_of_searches_are_the_gaits_that_a_search_finds(do: Doing) -> None:
    """Every point draws its own starts, from the seed, the model's number and its own."""
    done = do(
        f"""
        model = ["{LOCKED}", "{FLEXIBLE}"]
        task = "searches"
        seed = 11
        chunk = 1
        [options]
        starts = 6
        symmetric = true
        [axes]
        spine.stiffness = [260, 240]
        mean_speed = [4.4, 4.5]
        """
    )
    assert done.outcomes["found"] >= 4
    for number, name in enumerate((LOCKED, FLEXIBLE)):
        base = load_model(name)
        rows = rows_of(done, name)
        for point in range(4):
            stiffness, speed = [260.0, 240.0][point // 2], [4.4, 4.5][point % 2]
            parameters = {} if name == LOCKED else {"spine.stiffness": stiffness}
            body = base.with_values(parameters)
            drawn = np.random.SeedSequence((11, number, point)).generate_state(1)
            fixed = {**examine(base).quantities, "mean_speed": speed}
            search = find_gaits(body, fixed, symmetric=True, starts=6, seed=int(drawn[0]))
            mine = [row for row in rows if row["point"] == point]
            if not search.gaits:
                assert [row["outcome"] for row in mine] == ["none"]
                assert "6 starts" in mine[0]["reason"]
                continue
            assert [row["gait"] for row in mine] == list(range(len(search)))
            for row, gait in zip(mine, search, strict=True):
                assert row["outcome"] == "found"
                assert row["reason"] is None
                assert row["at_spine_stiffness"] == parameters.get("spine.stiffness")
                assert row["at_mean_speed"] == speed
                assert row["touchdown_fore"] == gait.touchdown_angles["fore"]
                assert row["peak_grf_fore"] == gait.peak_grf["fore"]
                assert row["family"] == gait.family
                assert row["mean_speed"] == pytest.approx(speed, abs=1e-10)
                assert row["energy"] == pytest.approx(290, rel=1e-11)
                assert_is_a_gait(row, body)


def test_searches_may_fix_touchdown_angles(do: Doing) -> None:
    done = do(
        f"""
        model = "{FLEXIBLE}"
        task = "searches"
        [options]
        starts = 8
        symmetric = true
        fixed = {{ energy = 290, height = 0.32 }}
        [axes]
        touchdown.fore = [0.46]
        """
    )
    rows, base = rows_of(done), load_model(FLEXIBLE)
    assert {row["outcome"] for row in rows} == {"found"}, rows[0]["reason"]
    for row in rows:
        assert row["touchdown_fore"] == pytest.approx(0.46, abs=1e-15)
        assert row["apex_height"] == pytest.approx(0.32, abs=1e-15)
        assert row["energy"] == pytest.approx(290, rel=1e-11)
        assert_is_a_gait(row, base)


def test_a_search_that_finds_nothing_says_why_in_its_row(do: Doing) -> None:
    done = do(
        f'model = "{FLEXIBLE}"\ntask = "searches"\n[options]\nstarts = 2\nsymmetric = true\n'
        "[axes]\nheight = [0.05]"
    )
    (row,) = rows_of(done)
    assert (row["outcome"], row["gait"], row["point"]) == ("none", None, 0)
    assert "2 starts: 2 fell" in row["reason"]
    assert row["mean_speed"] is None
    assert done.outcomes == {"none": 1}


# The bodies of Fig. 4 of Kamimura et al. 2015, and speeds within the error of a reading.
NEARBY = (-0.019, 0.0, 0.019)


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    """Gaits at the speeds of the published readings, of both bodies."""
    folder = tmp_path_factory.mktemp("published")
    speeds = sorted({float(row[2]) for row in reference_rows("kamimura2015_fig4.csv")})
    near = [round(speed + shift, 6) for speed in speeds if speed >= 4 for shift in NEARBY]
    (folder / "plan.toml").write_text(
        f'model = ["kamimura2015-rigid", "{FLEXIBLE}"]\ntask = "gaits"\n'
        f"[axes]\nspine.stiffness = [200, 260]\nmean_speed = {near}"
    )
    return sweep(folder / "plan.toml", folder / "out")


def test_gaits_bear_the_published_peak_forces(published: Sweep) -> None:
    """Read by eye, 8 N and 0.02 m/s either way; energy 290 J and apex height 0.32 m."""
    rows = rows_of(published)
    compared = 0
    for body, stiffness, speed, peak in reference_rows("kamimura2015_fig4.csv"):
        if float(speed) < 4:
            continue
        model = FLEXIBLE if body == "flexible" else "kamimura2015-rigid"
        peaks = [
            row["peak_grf_fore"]
            for row in rows
            if row["model"] == model
            and row["outcome"] == "found"
            and row["at_spine_stiffness"] == (float(stiffness) if stiffness else None)
            and abs(row["at_mean_speed"] - float(speed)) < 0.02
        ]
        assert min(peaks) - 8 <= float(peak) <= max(peaks) + 8
        compared += 1
    assert compared == 8


def test_rows_of_gaits_are_true_of_their_orbits(published: Sweep) -> None:
    rows = [row for row in rows_of(published) if row["outcome"] == "found"]
    assert len(rows) > 24
    for row in rows[::3]:
        base = load_model(row["model"])
        if row["at_spine_stiffness"] is not None:
            base = base.with_values({"spine.stiffness": row["at_spine_stiffness"]})
        assert_is_a_gait(row, base)
        assert row["mean_speed"] == pytest.approx(row["at_mean_speed"], abs=1e-10)
        assert row["energy"] == pytest.approx(290, rel=1e-11)
        assert row["apex_height"] == pytest.approx(0.32, abs=1e-12)


def test_where_a_branch_does_not_lead_is_said_in_the_row(published: Sweep) -> None:
    """The fastest flexible gait at 290 J goes at about 4.56 m/s."""
    lost = [row for row in rows_of(published) if row["outcome"] == "none"]
    assert {row["model"] for row in lost} == {"kamimura2015-rigid", FLEXIBLE}
    assert min(row["at_mean_speed"] for row in lost) > 4.5
    for row in lost:
        assert "mean_speed = 4.5" in row["reason"]
        assert row["peak_grf_fore"] is row["floquet_multipliers"] is row["stable"] is None
    assert [row["gait"] for row in lost] == [None] * len(lost)


@pytest.mark.parametrize("value", [4.5, 4.4])
def test_a_line_of_gaits_may_have_a_single_point(do: Doing, value: float) -> None:
    done = do(f'model = "{FLEXIBLE}"\ntask = "gaits"\n[axes]\nmean_speed = [{value}]')
    (row,) = rows_of(done)
    assert row["outcome"] == "found", row["reason"]
    assert row["mean_speed"] == pytest.approx(value, abs=1e-8)
    assert_is_a_gait(row, load_model(FLEXIBLE))


def test_values_of_gaits_come_in_any_order_and_may_repeat(do: Doing) -> None:
    speeds = [4.5, 4.4, 4.46, 4.4]
    done = do(f'model = "{FLEXIBLE}"\ntask = "gaits"\n[axes]\nmean_speed = {speeds}')
    rows = rows_of(done)
    assert [row["point"] for row in rows] == [0, 1, 2, 3]
    assert [row["mean_speed"] for row in rows] == pytest.approx(speeds, abs=1e-10)


# Rows as Parquet readers give them; each is imported by who uses it.


def plain(row: Row) -> Row:
    """A row without the types of a reader: nothing is None, whether it was null or NaN."""
    return {
        name: None
        if value is None or value != value
        else value.item()
        if isinstance(value, np.generic)
        else value
        for name, value in row.items()
    }


def by_pandas(rows: Path) -> list[Row]:
    import pandas

    table = pandas.read_parquet(rows)
    return [dict(zip(table.columns, line, strict=True)) for line in table.itertuples(index=False)]


def by_polars(rows: Path) -> list[Row]:
    import polars

    table = polars.read_parquet(rows / "**/*.parquet", hive_partitioning=True)
    return table.rows(named=True)


def by_duckdb(rows: Path) -> list[Row]:
    import duckdb

    found = duckdb.sql(f"from read_parquet('{rows}/**/*.parquet', hive_partitioning = true)")
    return [dict(zip(found.columns, line, strict=True)) for line in found.fetchall()]


GAITS = f"""
model = ["{LOCKED}", "{FLEXIBLE}"]
task = "gaits"
[axes]
spine.stiffness = [260]
mean_speed = [4.5, 5.5]
"""


@pytest.mark.parametrize("task", ["runs", "gaits"])
def test_pandas_polars_and_duckdb_read_the_same_rows(do: Doing, runs: Sweep, task: str) -> None:
    """Each against the file itself, as pyarrow reads it alone."""
    done = runs if task == "runs" else do(GAITS)
    expected = [
        {**row, "model": file.parent.name.removeprefix("model=")}
        for file in done.files
        for row in pq.ParquetFile(file).read().to_pylist()
    ]
    assert len(expected) == done.rows
    assert {row["model"] for row in expected} == {model.name for model in done.plan.models}
    for read in (by_pandas, by_polars, by_duckdb):
        found = [plain(row) for row in read(done.path / "rows")]
        assert {frozenset(row) for row in found} == {frozenset(expected[0])}
        order = sorted(found, key=lambda row: (row["model"] == FLEXIBLE, row["point"]))
        assert order == sorted(expected, key=lambda row: (row["model"] == FLEXIBLE, row["point"]))


def test_sql_counts_outcomes_as_the_sweep_does(runs: Sweep) -> None:
    import duckdb

    counts = duckdb.sql(
        f"select outcome, count(*) from read_parquet('{runs.path}/rows/**/*.parquet', "
        "hive_partitioning = true) group by all"
    ).fetchall()
    assert dict(counts) == runs.outcomes


@pytest.mark.parametrize("name", ["a soft spine", "größer", "50%", "a=b"])
def test_a_model_may_have_any_name(do: Doing, tmp_path: Path, name: str) -> None:
    (tmp_path / f"{name}.toml").write_text(f'base = "{FLEXIBLE}"\n')
    done = do(f'model = "{name}.toml"\n[axes]\nspeed = [4.5]')
    for read in (by_pandas, by_polars, by_duckdb):
        assert [row["model"] for row in read(done.path / "rows")] == [name]


# Whoever does the work, and in whatever order.


class Shuffled:
    """A crew that does everything by itself and in any order."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def map(self, function: Any, jobs: Any) -> Iterator[tuple[int, Any]]:
        waiting = list(jobs)
        random.Random(self._seed).shuffle(waiting)
        for number, work in waiting:
            yield number, function(work)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        pass


@pytest.mark.parametrize("seed", [1, 2])
def test_the_order_of_chunks_changes_nothing(
    do: Doing, runs: Sweep, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.setattr(sweeps, "crew_of", lambda *_: Shuffled(seed))
    other = do(RUNS)
    assert other.digest == runs.digest
    assert files_of(other) == files_of(runs)


def test_the_digest_is_of_the_rows(do: Doing, runs: Sweep) -> None:
    others = [RUNS.replace("seed = 4", "seed = 5"), RUNS.replace("strides = 3", "strides = 2")]
    assert len({runs.digest, *(do(text).digest for text in others)}) == 3
    assert do(RUNS).digest == runs.digest


def test_the_manifest_tells_all_that_is_needed_to_repeat_it(runs: Sweep) -> None:
    manifest = json.loads((runs.path / "manifest.json").read_text())
    assert manifest["finished"] is True
    assert manifest["digest"] == runs.digest
    assert (manifest["rows"], manifest["chunks"]) == (20, 6)
    assert manifest["outcomes"] == runs.outcomes
    assert (manifest["plan"]["seed"], manifest["plan"]["options"]["strides"]) == (4, 3)
    bodies = {model["name"]: model for model in manifest["plan"]["models"]}
    assert bodies[FLEXIBLE]["parameters"]["spine.stiffness"] == 260
    assert bodies[SCOUT]["apex"]["height"] == 0.35
    assert manifest["made_with"].keys() >= {"flexspine", "python", "heyoka", "numpy", "processor"}
    assert all(manifest["made_with"].values())


def test_the_plan_may_change_its_place_and_its_models_files(do: Doing, tmp_path: Path) -> None:
    """A manifest is enough to repeat what was made."""
    body = tmp_path / "mine.toml"
    body.write_text(f'base = "{FLEXIBLE}"\n[parameters.spine]\nstiffness = 250.0\n')
    done = do('model = "mine.toml"\n[axes]\nspeed = [4.4, 4.5]')
    body.unlink()
    again = rerun(done.path.rename(tmp_path / "moved"))
    assert again.same
    assert (again.chunks, again.changed) == (1, {})


def test_progress_counts_the_points_that_are_done(do: Doing) -> None:
    told: list[tuple[int, int]] = []
    do(RUNS, progress=lambda done, whole: told.append((done, whole)))
    assert told == [(n, 20) for n in (0, 4, 8, 10, 14, 18, 20)]


def processes_of(parent: int) -> list[int]:
    """A process and all that it started."""
    children: list[int] = []
    for task in Path(f"/proc/{parent}/task").glob("*/children"):
        try:
            children += map(int, task.read_text().split())
        except OSError:
            continue
    return [parent, *(found for child in children for found in processes_of(child))]


def memory_of(parent: int) -> int:
    """What a process and all that it started take, in bytes; what they share counts once."""
    total = 0
    for process in processes_of(parent):
        try:
            lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
        except OSError:  # it has just gone
            continue
        total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) * 1024
    return total


def test_memory_does_not_grow_with_the_number_of_runs(tmp_path: Path) -> None:
    """A file is some 1.3 MB, its rows are more; those of 12 files would show."""
    (tmp_path / "plan.toml").write_text(
        f'model = "{SCOUT}"\nmethod = "random"\nsamples = {18 * 16384}\nchunk = 16384\n'
        # In the ground, where there is nothing to do.
        "[axes]\nheight = {low = 0.05, high = 0.1}\nspeed = {around = 0.5}\n"
        "pitch_rate = {around = 0.5}\npitch = {within = 0.1}"
    )
    process = subprocess.Popen(
        [COMMAND, "sweep", "plan.toml", "--out", "out", "--processes", "2"],
        cwd=tmp_path,
        env=os.environ,
        stdout=subprocess.DEVNULL,
    )
    early = late = 0
    while process.poll() is None:
        used = memory_of(process.pid)
        finished = len(list(tmp_path.glob("out/rows/*/part-*")))
        if finished <= 6:
            early = max(early, used)
        else:
            late = max(late, used)
        time.sleep(0.03)
    assert process.returncode == 0
    assert len(list(tmp_path.glob("out/rows/*/part-*"))) == 18
    assert early > 50_000_000
    assert late < early + 30_000_000
