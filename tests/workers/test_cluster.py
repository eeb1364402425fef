"""A real scheduler and real workers, in processes of their own on this machine."""

from __future__ import annotations

import itertools
import json
import logging
import math
import operator
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed
import pytest

import flexspine
from flexspine.errors import InputError, MachineError
from flexspine.workers import cluster
from flexspine.workers.cluster import AHEAD, DaskWorkers
from tests.workers.crews import assert_every_piece_is_done_once
from tests.workers.pieces import process_id, threads_inside

ROOT = Path(__file__).parents[2]

# s; a busy machine is slow to start processes.
START = 60.0

# s; by then whoever waits has to know that the scheduler is lost.
SOON = 15.0

# What users would see on stderr has to be empty.
COMMAND = """
import sys, time
from flexspine.workers.cluster import DaskWorkers
try:
    with DaskWorkers(sys.argv[1]) as crew:
        for number, _ in crew.map(time.sleep, ((n, 0.05) for n in range(500))):
            print(number, flush=True)
except BaseException as raised:
    print(type(raised).__name__, raised)
"""


def task_count(dask_scheduler: Any) -> int:
    """Tell how many pieces a scheduler knows of."""
    return len(dask_scheduler.tasks)


class Machines:
    """Starts schedulers and workers, and ends those that are left."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.started: list[subprocess.Popen[bytes]] = []

    def scheduler(self, port: str = "0", **settings: str) -> str:
        file = self.directory / f"{len(self.started)}.json"
        self._start(["scheduler", "--port", port, "--scheduler-file", str(file)], settings)
        # There before it is written to.
        until(lambda: file.exists() and file.read_text().endswith("\n}"))
        return str(json.loads(file.read_text())["address"])

    def worker(self, address: str, threads: int = 1, **settings: str) -> subprocess.Popen[bytes]:
        options = ["--no-nanny", "--nthreads", str(threads)]
        directory = ["--local-directory", str(self.directory)]
        return self._start(["worker", address, *options, *directory], settings)

    def _start(self, words: list[str], settings: dict[str, str]) -> subprocess.Popen[bytes]:
        words = [sys.executable, "-m", "dask", *words, "--host", "127.0.0.1", "--no-dashboard"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), **settings}
        with (self.directory / f"{len(self.started)}.log").open("wb") as log:
            process = subprocess.Popen(words, stdout=log, stderr=log, env=environment)
        self.started.append(process)
        return process

    def end(self) -> None:
        for process in self.started:
            process.kill()
            process.wait()


@contextmanager
def cluster_inside(port: int = 0) -> Iterator[str]:
    """The address of a scheduler with one worker, both in threads of this process."""
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        host="127.0.0.1",
        protocol="tcp://",
        scheduler_port=port,
        dashboard_address=":0",
    ) as made:
        yield made.scheduler_address


def until(happened: Callable[[], Any]) -> None:
    limit = time.monotonic() + START
    while not happened():
        assert time.monotonic() < limit
        time.sleep(0.05)


def pieces(length: float) -> Iterator[tuple[int, float]]:
    return ((number, length) for number in range(500))


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    machines = Machines(tmp_path)
    yield machines
    machines.end()


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    machines = Machines(tmp_path_factory.mktemp("dask"))
    yield machines
    machines.end()


@pytest.fixture(scope="module")
def address(shared: Machines) -> str:
    """A scheduler with one worker of two threads."""
    address = shared.scheduler()
    shared.worker(address, threads=2)
    return address


def test_every_piece_is_done_once_and_few_are_taken_ahead(address: str) -> None:
    with DaskWorkers(address) as crew:
        assert_every_piece_is_done_once(crew, AHEAD * 2)
    assert "IO loop" not in [thread.name for thread in threading.enumerate()]


def test_a_process_does_one_piece_at_a_time(address: str) -> None:
    with DaskWorkers(address) as crew:
        counts = {count for _, count in crew.map(threads_inside, ((n, n) for n in range(20)))}
    assert counts == {1}


def test_what_a_piece_raises_is_raised(address: str) -> None:
    with DaskWorkers(address) as crew:
        with pytest.raises(ValueError, match="domain"):
            list(crew.map(math.sqrt, [(0, 1.0), (1, -1.0)]))
        assert list(crew.map(math.sqrt, [(0, 4.0)])) == [(0, 2.0)]


def test_a_client_stays_open_and_nothing_of_ours_stays_with_it(address: str) -> None:
    levels = {name: logging.getLogger(name).level for name in ("distributed", "tornado")}
    with distributed.Client(address, set_as_default=False) as client:
        with DaskWorkers(client) as crew:
            left_open = crew.map(time.sleep, pieces(0.05))
            next(left_open)
            assert client.run_on_scheduler(task_count) > 0
        until(lambda: client.run_on_scheduler(task_count) == 0)
        assert client.submit(operator.neg, 1).result() == -1
    assert {name: logging.getLogger(name).level for name in levels} == levels
    with pytest.raises(InputError, match="closed"), DaskWorkers(client):
        pass


def test_workers_may_join_and_may_be_killed(shared: Machines, address: str) -> None:
    done: list[int] = []
    taken = itertools.count()
    late: subprocess.Popen[bytes] | None = None
    enough: float = math.inf

    def jobs() -> Iterator[tuple[int, float]]:
        while len(done) < enough:
            yield next(taken), 0.05

    with DaskWorkers(address) as crew:
        for number, doer in crew.map(process_id, jobs()):
            done.append(number)
            late = late or shared.worker(address)
            if doer == late.pid and late.returncode is None:
                late.kill()
                late.wait()
                enough = len(done) + 10
    assert sorted(done) == list(range(next(taken)))


@contextmanager
def at_work(address: str) -> Iterator[subprocess.Popen[str]]:
    """A command that has pieces done by a cluster, the first of which is."""
    words, pipe = [sys.executable, "-c", COMMAND, address], subprocess.PIPE
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True) as command:
        assert command.stdout
        assert command.stdout.readline() == "0\n"
        yield command


def test_an_interruption_ends_quietly(address: str) -> None:
    with at_work(address) as command:
        command.send_signal(signal.SIGINT)
        out, err = command.communicate(timeout=SOON)
    assert err == ""
    assert out.splitlines()[-1].startswith("KeyboardInterrupt")


@pytest.mark.parametrize("lost", [signal.SIGKILL, signal.SIGTERM])
def test_a_lost_scheduler_ends_quietly_and_its_place_can_be_taken(
    machines: Machines, lost: signal.Signals
) -> None:
    address = machines.scheduler()
    machines.worker(address)
    with at_work(address) as command:
        machines.started[0].send_signal(lost)
        out, err = command.communicate(timeout=SOON)
    assert err == ""
    last = out.splitlines()[-1]
    assert last.startswith(f"MachineError the Dask scheduler at {address} was lost")
    assert "finished is kept" in last
    machines.started[0].wait()
    with cluster_inside(int(address.rpartition(":")[2])) as another:
        assert another == address
        with DaskWorkers(address) as crew:
            assert list(crew.map(abs, [(0, -1)])) == [(0, 1)]


def test_no_workers_and_a_piece_that_kills_workers(machines: Machines) -> None:
    address = machines.scheduler(DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
    with DaskWorkers(address, patience=0.5) as crew, pytest.raises(MachineError, match="no work"):
        list(crew.map(abs, [(0, -1)]))
    machines.worker(address)
    with DaskWorkers(address) as crew, pytest.raises(MachineError, match="killed 1 worker"):
        list(crew.map(signal.raise_signal, [(0, signal.SIGKILL)]))


def test_workers_with_another_flexspine_are_named(machines: Machines, tmp_path: Path) -> None:
    home = str(Path(flexspine.__file__).parent)
    for name, path in (("other", [str(tmp_path / "other" / "flexspine"), home]), ("empty", [])):
        package = tmp_path / name / "flexspine"
        package.mkdir(parents=True)
        (package / "__init__.py").write_text(f"__path__ = {path}")
        (package / "_version.py").write_text("__version__ = '9.9.9'")
    address = machines.scheduler()
    wrong = [machines.worker(address, PYTHONPATH=str(tmp_path / n)) for n in ("other", "empty")]
    with distributed.Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=START)
        with pytest.raises(MachineError, match="flexspine is not") as error, DaskWorkers(client):
            pass
        assert "(9.9.9)" in str(error.value)
        assert "(missing or too old)" in str(error.value)
    for process in wrong:
        process.kill()
        process.wait()
    machines.worker(address)
    with DaskWorkers(address) as crew:
        going = crew.map(time.sleep, pieces(0.05))
        assert next(going) == (0, None)
        machines.worker(address, PYTHONPATH=str(tmp_path / "other"))
        with pytest.raises(MachineError, match=r"at tcp://.* \(9\.9\.9\)"):
            list(going)


@pytest.mark.parametrize("listens", [False, True])
def test_no_scheduler_at_an_address(listens: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "REACH", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if not listens:
            server.close()
        with pytest.raises(MachineError, match=f"{address}; start one with 'dask scheduler'"):
            DaskWorkers(address).__enter__()


@pytest.mark.parametrize(
    "text", ["", "host", "127.0.0.1:8786", "http://host:1", "tcp://host", "tcp://host:1/"]
)
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(InputError, match=f"'{text}' is not the address"):
        DaskWorkers(text)


def test_neither_address_nor_client() -> None:
    with pytest.raises(InputError, match="no Dask client"):
        DaskWorkers(8786).__enter__()


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MachineError, match=r"pip install 'flexspine\[cluster\]'"):
        DaskWorkers("tcp://127.0.0.1:1").__enter__()
