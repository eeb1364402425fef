"""Workers on this machine, which die, are killed, are interrupted and lose their parent."""

from __future__ import annotations

import itertools
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from flexspine.errors import MachineError
from flexspine.workers.local import MOST_DEATHS, LocalWorkers
from tests.workers.crews import assert_every_piece_is_done_once
from tests.workers.pieces import LARGE, killed_always, killed_once, process_id

ROOT = Path(__file__).parents[2]

# s; a busy machine is slow to start and to end processes.
LIMIT = 60.0

# s; more than anybody waits.
FOREVER = 600.0

# s; far longer than it takes to end processes.
WHILE = 2.0

# s; far longer than it takes to start a few processes, one after the other.
SOON = 6.0

# What users would see on stderr has to be empty.
WAITING = f"""
import time
from flexspine.workers.local import LocalWorkers
try:
    with LocalWorkers(2) as crew:
        for number, _ in crew.map(time.sleep, enumerate([0.2, 0.2] + [{FOREVER}] * 8)):
            print(number, flush=True)
except KeyboardInterrupt:
    print("interrupted")
"""

UNGUARDED = """
print("here")
from flexspine.workers.local import LocalWorkers
with LocalWorkers(2) as crew:
    print(sorted(crew.map(abs, ((number, -number) for number in range(3)))))
"""

CUT_SHORT = """
import sys
from pathlib import Path
from flexspine.workers.local import LocalWorkers
from tests.workers.pieces import cut_short_once
with LocalWorkers(2) as crew:
    for number, result in crew.map(cut_short_once, enumerate([Path(sys.argv[1]), None])):
        print(number, len(result))
"""


def until(happened: Callable[[], Any]) -> None:
    limit = time.monotonic() + LIMIT
    while not happened():
        assert time.monotonic() < limit
        time.sleep(0.02)


def session(leader: int) -> list[int]:
    """The processes that descend from a session's leader, orphans too, and itself."""
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, _, of = file.read_text().rpartition(")")[2].split()[:4]
            if int(of) == leader and state not in "ZX":
                found.append(int(file.parent.name))
    return found


def ignores_interruptions(process: int) -> bool:
    with suppress(OSError):
        status = Path(f"/proc/{process}/status").read_text()
        ignored = status.partition("SigIgn:")[2].split()[0]
        return bool(int(ignored, 16) >> (signal.SIGINT - 1) & 1)
    return False


@contextmanager
def running(script: str) -> Iterator[subprocess.Popen[str]]:
    """A script in a session of its own, of which nothing is left at the end."""
    words, pipe = [sys.executable, "-c", script], subprocess.PIPE
    with subprocess.Popen(
        words, stdout=pipe, stderr=pipe, text=True, start_new_session=True
    ) as command:
        try:
            yield command
        finally:
            for process in session(command.pid):
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)


def at_work(command: subprocess.Popen[str]) -> None:
    """Wait until all that is left to do takes forever."""
    assert command.stdout
    assert sorted(command.stdout.readline() for _ in range(2)) == ["0\n", "1\n"]
    # Two workers, and what multiprocessing has to track its semaphores.
    until(lambda: sum(map(ignores_interruptions, session(command.pid))) == 3)


@pytest.mark.parametrize(("count", "most_ahead"), [(1, 1), (2, 3)])
def test_every_piece_is_done_once_and_few_are_taken_ahead(count: int, most_ahead: int) -> None:
    with LocalWorkers(count) as crew:
        assert_every_piece_is_done_once(crew, most_ahead)


def test_one_process_is_this_one() -> None:
    with LocalWorkers(1) as crew:
        doers = [doer for _, doer in crew.map(process_id, enumerate([0.0] * 3))]
        assert multiprocessing.active_children() == []
    assert doers == [os.getpid()] * 3


def test_two_processes_are_others() -> None:
    doers = set[int]()
    taken = itertools.count()

    def jobs() -> Iterator[tuple[int, float]]:
        while len(doers) < 2:
            yield next(taken), 0.2

    with LocalWorkers(2) as crew:
        for _, doer in crew.map(process_id, jobs()):
            doers.add(doer)
    assert len(doers) == 2
    assert os.getpid() not in doers


@pytest.mark.parametrize("count", [1, 2])
def test_what_a_piece_raises_is_raised(count: int) -> None:
    with LocalWorkers(count) as crew:
        with pytest.raises(ValueError, match="domain"):
            list(crew.map(math.sqrt, enumerate([1.0, -1.0, 4.0])))
        assert list(crew.map(math.sqrt, [(0, 4.0)])) == [(0, 2.0)]


def test_killed_workers_are_replaced_and_no_piece_is_lost(tmp_path: Path) -> None:
    done: dict[int, tuple[int, int]] = {}
    deadly: list[int] = []
    taken = itertools.count()

    def jobs() -> Iterator[tuple[int, Path | None]]:
        # More deaths than one piece may cause, but of different ones.
        while len(deadly) < MOST_DEATHS + 2:
            deadly.append(next(taken))
            yield deadly[-1], tmp_path / str(deadly[-1])
            while deadly[-1] not in done:
                yield next(taken), None

    with LocalWorkers(2) as crew:
        for number, result in crew.map(killed_once, jobs()):
            assert number not in done
            done[number] = result
    assert sorted(done) == list(range(next(taken)))
    for number, (killed, doer) in done.items():
        assert (killed != doer) == (number in deadly)


def test_a_worker_killed_as_it_sends_a_result_is_replaced(tmp_path: Path) -> None:
    words = [sys.executable, "-c", CUT_SHORT, str(tmp_path / "file")]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    out = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=SOON)
    assert sorted(out.stdout.splitlines()) == [f"0 {LARGE}", f"1 {LARGE}"]


def test_a_piece_that_always_kills_its_worker_is_given_up(tmp_path: Path) -> None:
    with LocalWorkers(2) as crew:
        with pytest.raises(MachineError, match=f"{MOST_DEATHS} worker processes died"):
            list(crew.map(killed_always, [(0, tmp_path)]))
        assert len(list(tmp_path.iterdir())) == MOST_DEATHS
        assert list(crew.map(abs, [(0, -1)])) == [(0, 1)]


def test_a_deadly_piece_among_others_is_given_up(tmp_path: Path) -> None:
    done: list[int] = []
    works = [None, None, tmp_path, None, None]
    with LocalWorkers(2) as crew, pytest.raises(MachineError, match="same piece"):
        done.extend(number for number, _ in crew.map(killed_always, enumerate(works)))
    assert 2 not in done
    assert len(done) == len(set(done))
    assert len(list(tmp_path.iterdir())) == MOST_DEATHS


def test_workers_leave_at_the_end() -> None:
    with LocalWorkers(2) as crew:
        assert len(list(crew.map(abs, enumerate(range(5))))) == 5
        assert multiprocessing.active_children()
    assert multiprocessing.active_children() == []


@pytest.mark.parametrize("kind", [RuntimeError, KeyboardInterrupt, GeneratorExit])
def test_workers_leave_an_exception_and_what_they_are_doing(kind: type[BaseException]) -> None:
    start = math.inf

    def leave() -> None:
        nonlocal start
        with LocalWorkers(2) as crew:
            going = crew.map(time.sleep, enumerate([0.0] + [FOREVER] * 8))
            assert next(going) == (0, None)
            assert multiprocessing.active_children()
            start = time.monotonic()
            raise kind

    with pytest.raises(kind):
        leave()
    assert time.monotonic() - start < LIMIT
    assert multiprocessing.active_children() == []


def test_workers_leave_what_they_are_doing_when_no_more_is_wanted() -> None:
    with LocalWorkers(2) as crew:
        for _ in crew.map(time.sleep, enumerate([0.0] + [WHILE] * 8)):
            break
        start = time.monotonic()
    assert time.monotonic() - start < 0.9 * WHILE
    assert multiprocessing.active_children() == []


def test_workers_ignore_interruptions() -> None:
    doers = set[int]()
    interrupted = set[int]()
    count, left = 0, 8
    taken = itertools.count()

    def jobs() -> Iterator[tuple[int, float]]:
        while left > 0:
            yield next(taken), 0.2

    with LocalWorkers(2) as crew:
        for _, doer in crew.map(process_id, jobs()):
            count += 1
            doers.add(doer)
            if len(doers) == 2:
                left -= 1
                for worker in doers - interrupted:
                    os.kill(worker, signal.SIGINT)
                interrupted |= doers
    assert len(doers) == 2
    assert count == next(taken)


def test_an_interruption_of_all_processes_ends_quietly() -> None:
    with running(WAITING) as command:
        at_work(command)
        os.killpg(command.pid, signal.SIGINT)
        out, err = command.communicate(timeout=LIMIT)
        until(lambda: session(command.pid) == [])
    assert (out, err, command.returncode) == ("interrupted\n", "", 0)


@pytest.mark.parametrize("working", [False, True])
def test_workers_go_with_their_parent(working: bool) -> None:
    with running(WAITING) as command:
        if working:
            at_work(command)
        else:
            until(lambda: len(session(command.pid)) > 1)
        command.kill()
        command.wait()
        until(lambda: session(command.pid) == [])


def test_a_script_without_a_guard_runs_once(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED)
    words = [sys.executable, str(script)]
    out = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT)
    assert (out.stdout, out.stderr) == ("here\n[(0, 0), (1, 1), (2, 2)]\n", "")
