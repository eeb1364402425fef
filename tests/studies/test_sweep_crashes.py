"""Sweeps that are killed, interrupted, out of space or done twice at once, and gone on with."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow.parquet as pq
import pytest

from flexspine import Sweep, read_plan, sweep
from flexspine.cli import app
from flexspine.errors import InputError, OutputError
from flexspine.studies import sweep as sweeps
from flexspine.studies.store import Store
from tests.studies.commands import Command, dying, noted, noting
from tests.studies.test_sweep import files_of, processes_of, rows_of

PLAN = """
model = "scout2"
method = "random"
samples = 120
chunk = 10
[axes]
speed = { around = 0.02 }
height = { around = 0.02 }
"""
CHUNKS = 12

# s; what a process that has lost its parent may take to leave.
LEAVING = 10.0


class Whole(NamedTuple):
    """A sweep that nobody disturbed."""

    plan: Path
    done: Sweep

    @property
    def files(self) -> dict[str, bytes]:
        """Its Parquet files."""
        return files_of(self.done)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    folder = tmp_path_factory.mktemp("whole")
    (folder / "plan.toml").write_text(PLAN)
    return Whole(folder / "plan.toml", sweep(folder / "plan.toml", folder / "out"))


def parts_in(out: Path) -> list[int]:
    """Numbers of the chunks that are finished."""
    return sorted(int(path.stem.removeprefix("part-")) for path in out.glob("rows/*/part-*"))


def wait_for_parts(process: Command, out: Path, count: int) -> None:
    while len(parts_in(out)) < count:
        assert process.returncode is None, process.communicate()
        time.sleep(0.01)


def notes_of(out: Path) -> list[int]:
    notes = out.with_suffix(".notes")
    return [int(line) for line in notes.read_text().split()] if notes.exists() else []


def living(processes: list[int]) -> list[int]:
    """Those that are still there and have not ended."""
    found = []
    for process in processes:
        try:
            state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        if state not in "ZX":
            found.append(process)
    return found


def assert_all_leave(processes: list[int]) -> None:
    end = time.monotonic() + LEAVING
    while living(processes) and time.monotonic() < end:
        time.sleep(0.05)
    assert living(processes) == []


def assert_finished_chunks_are_whole(out: Path, whole: Whole) -> None:
    """Bit for bit those of an undisturbed sweep, and nothing else is there."""
    files = {str(f.relative_to(out / "rows")): f for f in out.rglob("part-*")}
    for name, file in files.items():
        assert file.read_bytes() == whole.files[name]
        assert len(pq.ParquetFile(file).read()) > 0


def assert_is_whole(out: Path, whole: Whole) -> None:
    """Complete, and file for file that of an undisturbed sweep."""
    done = sweep(whole.plan, out)
    assert done.made == 0
    assert done.digest == whole.done.digest
    assert files_of(done) == whole.files
    points = [row["point"] for row in rows_of(done)]
    assert points == list(range(done.plan.points))
    assert {path.name for path in out.iterdir()} == {"manifest.json", "rows"}


@pytest.mark.parametrize(("processes", "moments"), [(1, (1, 5)), (2, (3,))])
def test_killed_at_any_moment_it_goes_on_and_loses_only_what_was_being_done(
    whole: Whole,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    processes: int,
    moments: tuple[int, ...],
) -> None:
    out, chance = tmp_path / "out", random.Random(processes)
    finished: list[int] = []
    begun: list[int] = []
    for moment in moments:
        process = Command(noting, out, whole.plan, processes)
        wait_for_parts(process, out, moment)
        time.sleep(chance.uniform(0, 0.2))
        family = processes_of(process.pid)
        assert len(family) == 1 if processes == 1 else len(family) >= 1 + processes
        process.send_signal(signal.SIGKILL)
        output, _ = process.communicate()
        assert output == ""
        assert_all_leave(family)
        now, notes = parts_in(out), notes_of(out)
        assert not set(notes[len(begun) :]) & set(finished), "finished chunks are not repeated"
        lost = len(notes) - len(begun) - (len(now) - len(finished))
        # A worker may have begun its next chunk before the last one was written.
        assert 0 <= lost <= (1 if processes == 1 else 2 * processes)
        assert_finished_chunks_are_whole(out, whole)
        finished, begun = now, notes
    monkeypatch.setattr(sweeps, "do_chunk", noted)
    monkeypatch.setenv("NOTES", str(out.with_suffix(".notes")))
    last = sweep(whole.plan, out)  # as many processes as one likes
    assert last.made == CHUNKS - len(finished)
    assert last.digest == whole.done.digest
    assert sorted(notes_of(out)[len(begun) :]) == sorted(set(range(CHUNKS)) - set(finished))
    assert_is_whole(out, whole)


@pytest.mark.parametrize(
    ("how", "number", "kept"),
    [
        ("half written", 1, 0),  # the manifest
        ("half written", 5, 3),
        ("renamed", 5, 4),
        ("not yet renamed", 14, 12),  # the manifest, at the end
    ],
)
def test_killed_while_a_file_is_written_it_leaves_no_half_of_it(
    whole: Whole, tmp_path: Path, how: str, number: int, kept: int
) -> None:
    out = tmp_path / "out"
    process = Command(dying, out, whole.plan, HOW=how, NUMBER=str(number))
    _, errors = process.communicate()
    assert process.returncode == -signal.SIGKILL, errors
    assert parts_in(out) == list(range(kept))
    assert_finished_chunks_are_whole(out, whole)
    done = sweep(whole.plan, out)
    assert done.made == CHUNKS - kept
    assert_is_whole(out, whole)


@pytest.mark.parametrize(
    ("number", "times", "processes"), [(signal.SIGINT, 3, 2), (signal.SIGTERM, 1, 1)]
)
def test_interrupted_it_says_that_the_same_command_goes_on(
    whole: Whole, tmp_path: Path, number: int, times: int, processes: int
) -> None:
    """Also to who presses the keys again and again."""
    out = tmp_path / "out"
    process = Command(noting, out, whole.plan, processes)
    wait_for_parts(process, out, 1)
    family = processes_of(process.pid)
    for _ in range(times):
        process.send_signal(number)
        time.sleep(0.03)
    output, errors = process.communicate()
    assert process.returncode == 130
    assert json.loads(output)["error"] == "interrupted"
    assert errors.splitlines() == [
        f"flexspine: what is finished is in '{out}'; the same command goes on from it",
        "flexspine: interrupted",
    ]
    assert_all_leave(family)
    kept = parts_in(out)
    assert kept
    assert_finished_chunks_are_whole(out, whole)
    done = sweep(whole.plan, out)
    assert done.made == CHUNKS - len(kept)
    assert_is_whole(out, whole)


def test_two_processes_change_nothing_and_one_that_is_killed_is_replaced(
    whole: Whole, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    process = Command(noting, out, whole.plan, 2)
    wait_for_parts(process, out, 1)
    workers = [
        number
        for number in processes_of(process.pid)[1:]
        if b"spawn_main" in Path(f"/proc/{number}/cmdline").read_bytes()
    ]
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGKILL)
    output, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")
    record = json.loads(output)
    assert (record["made"], record["digest"]) == (CHUNKS, whole.done.digest)
    assert (record["rows"], record["outcomes"]) == (whole.done.rows, whole.done.outcomes)
    assert_is_whole(out, whole)


# A full disk.


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 128 kB, or a skipped test where mounting is not allowed."""
    disk, mount = tmp_path / "disk", shutil.which("mount")
    disk.mkdir()
    if mount is None:
        pytest.skip("no mount")
    command = [mount, "-t", "tmpfs", "-o", "size=128k", "flexspine-test", disk]
    if subprocess.run(command, capture_output=True).returncode:
        pytest.skip("mounting is not allowed")
    try:
        yield disk
    finally:
        subprocess.run(["umount", disk], check=True)


def test_a_full_disk_ends_it_and_keeps_what_is_finished(
    whole: Whole, small_disk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, filler = small_disk / "out", small_disk / "filler"
    filler.write_bytes(bytes(80_000))
    command = ["sweep", str(whole.plan), "--out", str(out), "--processes", "1"]
    for _ in range(2):
        assert app.run(command) == 3
        output, errors = capsys.readouterr()
        assert output == ""
        assert errors.startswith("flexspine: ")
        assert errors.count("\n") == 1
        assert "No space left on device" in errors
        assert str(out) in errors
        assert "free some space" in errors
        assert 0 < len(parts_in(out)) < CHUNKS
        assert_finished_chunks_are_whole(out, whole)
        assert list(out.rglob(".partial*")) == []
    filler.unlink()
    assert app.run([*command, "--json"]) == 0
    output, errors = capsys.readouterr()
    assert json.loads(output)["made"] < CHUNKS
    assert errors == ""
    assert_is_whole(out, whole)


@pytest.mark.parametrize(
    ("write", "finished"),
    [(1, []), (2, []), (6, [0, 1, 2, 3]), (14, list(range(CHUNKS)))],
)
def test_no_space_at_any_write_leaves_no_partial_file(
    whole: Whole,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    write: int,
    finished: list[int],
) -> None:
    out, writes = tmp_path / "out", iter(range(1, 100))

    def full(_file: int) -> None:
        if next(writes) == write:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    command = ["sweep", str(whole.plan), "--out", str(out), "--processes", "1", "--json"]
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert app.run(command) == 3
    told = json.loads(capsys.readouterr().out)
    assert told["error"] == "environment"
    assert "No space left on device" in told["message"]
    assert out.name in told["message"]
    assert parts_in(out) == finished
    assert list(out.rglob(".*")) == []
    if write == 1:
        assert not out.exists()
    assert app.run(command) == 0
    assert json.loads(capsys.readouterr().out)["made"] == CHUNKS - len(finished)
    assert_is_whole(out, whole)


# Two at once.


def test_another_process_at_work_is_not_disturbed(
    whole: Whole, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    first = Command(noting, out, whole.plan)
    wait_for_parts(first, out, 1)
    assert app.run(["sweep", str(whole.plan), "--out", str(out)]) == 2
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.startswith(f"flexspine: another process is at work in '{out}'; wait for it")
    output, errors = first.communicate()
    assert (first.returncode, errors) == (0, "")
    assert json.loads(output)["made"] == CHUNKS
    assert_is_whole(out, whole)


def test_a_lock_that_was_left_behind_keeps_nobody_out(whole: Whole, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with Store(out, read_plan(whole.plan)).opened():
        locks = [path for path in out.iterdir() if path.name != "manifest.json"]
        assert len(locks) == 1
    locks[0].touch()  # whoever had it was killed
    assert sweep(whole.plan, out).made == CHUNKS
    assert_is_whole(out, whole)


def test_two_that_wait_for_a_third_do_not_both_begin(
    whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first ends between the moment the second opens the lock and that it takes it."""
    out, plan = tmp_path / "out", read_plan(whole.plan)
    first = Store(out, plan).opened()
    first.__enter__()
    lock = fcntl.flock
    ends = iter([lambda: first.__exit__(None, None, None)])

    def slowly(file: Any, how: int) -> None:
        next(ends, lambda: None)()
        lock(file, how)

    monkeypatch.setattr(fcntl, "flock", slowly)
    with Store(out, plan).opened(), pytest.raises(OutputError, match="at work"):
        Store(out, plan).opened().__enter__()


def test_a_disk_without_locks_is_not_taken_for_another_process(
    whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some network disks have none."""

    def none(_file: Any, _how: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", none)
    with pytest.raises(OutputError, match="No locks available") as refused:
        sweep(whole.plan, tmp_path / "out")
    assert "disk of this machine" in refused.value.remedy


# What is somebody else's.


def test_somebody_elses_files_are_left_alone(whole: Whole, tmp_path: Path) -> None:
    """Whatever they are called."""
    other = tmp_path / "other"
    (other / "deep").mkdir(parents=True)
    names = (".lock", ".partial-mine", "deep/.partial-mine", "deep/part-000001.parquet")
    for name in names:
        (other / name).write_text("precious")
    with pytest.raises(OutputError, match="something else"):
        sweep(whole.plan, other)
    assert {str(f.relative_to(other)) for f in other.rglob("*") if f.is_file()} == set(names)
    assert {(other / name).read_text() for name in names} == {"precious"}


@pytest.mark.parametrize("name", [".lock", ".partial-mine", ".hidden", "notes.txt", "rows"])
def test_a_directory_with_anything_in_it_is_something_else(
    whole: Whole, tmp_path: Path, name: str
) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / name).write_text("precious")
    with pytest.raises(OutputError, match="something else"):
        sweep(whole.plan, tmp_path / "other")
    assert [path.name for path in (tmp_path / "other").iterdir()] == [name]
    assert (tmp_path / "other" / name).read_text() == "precious"


def test_a_manifest_of_another_form_is_not_misread(whole: Whole, tmp_path: Path) -> None:
    with Store(tmp_path / "out", read_plan(whole.plan)).opened():
        pass
    file = tmp_path / "out" / "manifest.json"
    manifest = json.loads(file.read_text())
    file.write_text(json.dumps({**manifest, "schema_version": manifest["schema_version"] + 1}))
    with pytest.raises(InputError, match="schema_version 2"):
        sweep(whole.plan, tmp_path / "out")


def test_notes_next_to_the_rows_do_no_harm(whole: Whole, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert sweep(whole.plan, out).made == CHUNKS
    (out / "notes.txt").write_text("mine")
    (out / "rows" / "model=scout2" / "part-000004.parquet").unlink()
    assert sweep(whole.plan, out).made == 1
    assert (out / "notes.txt").read_text() == "mine"
    assert files_of(sweep(whole.plan, out)) == whole.files


def test_what_made_the_rows_stays_on_record(whole: Whole, tmp_path: Path) -> None:
    """Also where a later version finds nothing left to do."""
    out = tmp_path / "out"
    sweep(whole.plan, out)
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["made_with"]["numpy"] = "1.0.0"
    (out / "manifest.json").write_text(json.dumps(manifest))
    assert sweep(whole.plan, out).made == 0
    assert json.loads((out / "manifest.json").read_text())["made_with"]["numpy"] == "1.0.0"
