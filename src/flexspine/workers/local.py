"""Workers on this machine: processes of their own, or just this one."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from types import ModuleType
from typing import Any, Self

from flexspine.errors import MachineError
from flexspine.workers.crew import Result, Work

# A piece of which this many workers have died is what they die of.
MOST_DEATHS = 4

# s; what a worker that has nothing to do may take to leave.
LEAVING = 5.0


@dataclass
class _Piece:
    """A piece of work, and how many workers died while they did it."""

    number: int
    work: Any
    deaths: int = 0


@dataclass
class _Worker:
    """A process, the only other end of its connection, and what it does."""

    process: Any
    connection: Connection
    piece: _Piece | None = None


class LocalWorkers:
    """``count`` processes; one does the work in this process. Workers that die are replaced.

    Raises `MachineError` if a piece kills one after the other.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._workers: list[_Worker] = []

    def map(
        self, function: Callable[[Work], Result], jobs: Iterable[tuple[int, Work]]
    ) -> Iterator[tuple[int, Result]]:
        """Do every piece; see `Crew`."""
        if self._count == 1:
            for number, work in jobs:
                yield number, function(work)
            return
        try:
            yield from self._share(function, (_Piece(number, work) for number, work in jobs))
        finally:
            self._stop(self._busy)

    def _share(
        self, function: Callable[[Work], Result], waiting: Iterator[_Piece]
    ) -> Iterator[tuple[int, Result]]:
        """Let the processes do every piece."""
        again: list[_Piece] = []

        def fill() -> None:
            while len(self._busy) < self._count:
                piece = again.pop() if again else next(waiting, None)
                if piece is None:
                    break
                self._give(function, piece)

        fill()
        while self._busy:
            busy = self._busy
            ready = multiprocessing.connection.wait([worker.connection for worker in busy])
            for worker in [each for each in busy if each.connection in ready]:
                piece, worker.piece = worker.piece, None
                assert piece is not None
                try:
                    done, result = worker.connection.recv()
                except (EOFError, OSError):
                    self._bury(worker, piece)
                    again.append(piece)
                    fill()
                    continue
                if not done:
                    raise result
                fill()  # before anybody looks at the result, so that no worker idles
                yield piece.number, result

    @property
    def _busy(self) -> list[_Worker]:
        return [worker for worker in self._workers if worker.piece is not None]

    def _give(self, function: Callable[[Any], Any], piece: _Piece) -> None:
        """Let a worker that is free do a piece, a new one if there is none."""
        free = [worker for worker in self._workers if worker.piece is None]
        worker = free[0] if free else self._start()
        worker.piece = piece
        try:
            worker.connection.send((function, piece.work))
        except OSError:
            return  # it has just died, as will be seen when its answer is waited for

    def _start(self) -> _Worker:
        # A fresh interpreter: compiled code and its threads do not survive a fork.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs,), daemon=True)
        with _without_main(), _uninterrupted():
            process.start()
        theirs.close()  # so that a worker that dies, even halfway through an answer, is noticed
        self._workers.append(_Worker(process, ours))
        return self._workers[-1]

    def _bury(self, worker: _Worker, piece: _Piece) -> None:
        """Do without a worker that died."""
        self._workers.remove(worker)
        worker.connection.close()
        worker.process.join()
        piece.deaths += 1
        if piece.deaths == MOST_DEATHS:
            raise MachineError(
                f"{MOST_DEATHS} worker processes died of the same piece of work",
                "look at the memory left, or use fewer processes",
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._stop(self._workers)

    def _stop(self, workers: list[_Worker]) -> None:
        """Let workers go, at once if they are doing what nobody waits for."""
        leaving = [*workers]
        self._workers = [worker for worker in self._workers if worker not in leaving]
        for worker in leaving:
            if worker.piece is not None:
                worker.process.terminate()
            worker.connection.close()
        for worker in leaving:
            worker.process.join(LEAVING)
            worker.process.kill()
            worker.process.join()


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


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Start processes that leave interruptions to this one, from their first moment on."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(connection: Connection) -> None:
    """Do pieces until there are no more, or until the process that sends them is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent: Any = multiprocessing.parent_process()
    threading.Thread(target=_leave_with, args=(parent.sentinel,), daemon=True).start()
    while True:
        try:
            function, work = connection.recv()
        except (EOFError, OSError):
            return
        try:
            answer = True, function(work)
        except Exception as failure:
            failure.add_note(traceback.format_exc())
            answer = False, failure
        try:
            connection.send(answer)
        except OSError:
            return
        except Exception as failure:  # what cannot be sent has to be told as well
            message = f"an answer of a worker cannot be sent ({failure})"
            connection.send((False, MachineError(message, "tell the authors")))


def _leave_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)
