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
from tests.workers.test_cluster import Machines, cluster_inside

__all__ = ["whole"]


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    """A scheduler and two workers, of which tests kill what they like, one after the other."""
    machines = Machines(tmp_path_factory.mktemp("dask"))
    yield machines
    machines.end()


@pytest.fixture(scope="module")
def address(machines: Machines) -> str:
    address = machines.scheduler()
    for _ in range(2):
        machines.worker(address)
    return address


def test_a_worker_killed_among_others_changes_nothing(
    whole: Whole, tmp_path: Path, machines: Machines, address: str
) -> None:
    out = tmp_path / "out"
    killed: list[int] = []

    def kill_one(done: int, _all: int) -> None:
        if done and not killed:
            machines.started[1].kill()
            killed.append(done)

    done = sweep(whole.plan, out, client=address, progress=kill_one)
    assert killed
    assert done.made == CHUNKS
    assert_is_whole(out, whole)


def test_with_another_scheduler_it_goes_on(
    whole: Whole, tmp_path: Path, machines: Machines, address: str
) -> None:
    out = tmp_path / "out"

    def kill_the_scheduler(done: int, _all: int) -> None:
        if done:
            machines.started[0].kill()

    with pytest.raises(MachineError, match="was lost"):
        sweep(whole.plan, out, client=address, progress=kill_the_scheduler)
    kept = parts_in(out)
    assert 0 < len(kept) < CHUNKS
    assert_finished_chunks_are_whole(out, whole)
    with cluster_inside() as another:
        assert sweep(whole.plan, out, client=another).made == CHUNKS - len(kept)
    assert_is_whole(out, whole)
