"""Sweeps on Dask workers of this machine that are killed, and whose scheduler is killed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from flexspine import sweep
from flexspine.errors import MachineError
from tests.studies.test_sweep_crashes import (
    CHUNKS,
    Whole,
    assert_finished_chunks_are_whole,
    assert_is_whole,
    parts_in,
    whole,
)
from tests.workers.test_cluster import Machines

__all__ = ["whole"]


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    machines = Machines(tmp_path)
    yield machines
    machines.end()


def test_a_worker_killed_among_others_changes_nothing(
    whole: Whole, tmp_path: Path, machines: Machines
) -> None:
    address = machines.scheduler()
    workers = [machines.worker(address) for _ in range(2)]
    out = tmp_path / "out"
    killed: list[int] = []

    def kill_one(done: int, _all: int) -> None:
        if done and not killed:
            workers[0].kill()
            killed.append(done)

    done = sweep(whole.plan, out, client=address, progress=kill_one)
    assert killed
    assert done.made == CHUNKS
    assert_is_whole(out, whole)


def test_with_another_scheduler_it_goes_on(
    whole: Whole, tmp_path: Path, machines: Machines
) -> None:
    address = machines.scheduler()
    machines.worker(address)
    out = tmp_path / "out"

    def kill_the_scheduler(done: int, _all: int) -> None:
        if done:
            machines.started[0].kill()

    with pytest.raises(MachineError, match="was lost"):
        sweep(whole.plan, out, client=address, progress=kill_the_scheduler)
    kept = parts_in(out)
    assert 0 < len(kept) < CHUNKS
    assert_finished_chunks_are_whole(out, whole)
    another = machines.scheduler()
    machines.worker(another)
    assert sweep(whole.plan, out, client=another).made == CHUNKS - len(kept)
    assert_is_whole(out, whole)
