"""Workers on this machine: processes of their own, or just this one."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from types import ModuleType
from typing import Any, Self

from flexspine.errors import MachineError
from flexspine.workers.crew import Result, Work

# Pieces under way per process: one being done and one waiting, so that none idles.
AHEAD = 2

# Workers that die this often in a row without finishing a piece die of the piece.
MOST_DEATHS = 3


class LocalWorkers:
    """``count`` processes; one does the work in this process. Workers that die are replaced.

    Raises `MachineError` if they die again and again.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool: ProcessPoolExecutor | None = None

    def map(
        self, function: Callable[[Work], Result], jobs: Iterable[tuple[int, Work]]
    ) -> Iterator[tuple[int, Result]]:
        """Do every piece; see `Crew`."""
        if self._count == 1:
            for number, work in jobs:
                yield number, function(work)
            return
        waiting = iter(jobs)
        under_way: dict[Future[Result], tuple[int, Work]] = {}
        again: list[tuple[int, Work]] = []
        deaths = 0
        while True:
            while len(under_way) < AHEAD * self._count:
                job = again.pop() if again else next(waiting, None)
                if job is None:
                    break
                try:
                    under_way[self._submit(function, job[1])] = job
                except BrokenProcessPool:
                    again.append(job)
                    break
            if not under_way and not again:
                return
            finished, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in finished:
                job = under_way.pop(future)
                try:
                    result = future.result()
                except BrokenProcessPool:
                    again.append(job)
                    continue
                deaths = 0
                yield job[0], result
            if again:
                again += under_way.values()
                under_way.clear()
                deaths += 1
                if deaths > MOST_DEATHS:
                    raise MachineError(
                        f"worker processes died {deaths} times in a row",
                        "look at the memory left, or use fewer processes",
                    )
                self._replace()

    def _submit(self, function: Callable[[Work], Result], work: Work) -> Future[Result]:
        if self._pool is None:
            # A fresh interpreter: compiled code and its threads do not survive a fork.
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self._count, context, initializer=_prepare)
        with _without_main():  # processes start with the first pieces
            return self._pool.submit(function, work)

    def _replace(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._pool is None:
            return
        if exception[0] is not None:
            # Nobody waits for what is still being done.
            for process in list((self._pool._processes or {}).values()):
                process.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._pool = None


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the script that runs: a fresh interpreter would run it again, guarded or not.

    Nothing that is sent to workers lives there.
    """
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _prepare() -> None:
    """Leave interruptions to the process that started this one, and go when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent: Any = multiprocessing.parent_process()
    threading.Thread(target=_leave_with, args=(parent.sentinel,), daemon=True).start()


def _leave_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)
