"""Workers on a Dask cluster: processes on any number of machines, found through its scheduler."""

from __future__ import annotations

import asyncio
import logging
import pickle
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from queue import Empty, SimpleQueue
from typing import Any, Self
from uuid import uuid4

from flexspine._version import __version__
from flexspine.errors import InputError, MachineError
from flexspine.workers.crew import Result, Work

# Pieces under way per thread: one being done and one waiting, so that none idles.
AHEAD = 2

ADDRESS = re.compile(r"(tcp|tls)://([^\s:/@\[\]]+|\[[0-9a-fA-F:.]+\]):[1-9][0-9]{0,4}")

# s; a scheduler that does not answer the first call for so long is not there.
REACH = 5.0

# s; one that has answered before may be busy for so long before it counts as lost.
SILENCE = 30.0

# s; how often workers are counted, which also shows a scheduler that has shut down.
REFRESH = 1.0

# s; how long to wait for workers where there are none.
PATIENCE = 60.0

# Results fetched at once: few calls where they are many, and little memory where they are large.
BATCH = 64

# They tell of lost connections at length; here that takes one line.
LOGGERS = ("distributed", "tornado", "asyncio")

# Compiled code belongs to a process, and only one of its threads at a time may run it.
_alone = threading.Lock()


class DaskWorkers:
    """The workers of a Dask cluster, given by its scheduler's address or by a client of it.

    A client that is given stays open. Workers that die are done without, and those that join are
    put to use. Raises `InputError` if ``scheduler`` is no address and no client, and `MachineError`
    if the scheduler is not there or is lost, if there are no workers for ``patience`` s, if any
    has another flexspine, and if a piece of work kills all that try it.
    """

    def __init__(self, scheduler: Any, patience: float = PATIENCE) -> None:
        if isinstance(scheduler, str) and not ADDRESS.fullmatch(scheduler):
            raise InputError(
                f"'{scheduler}' is not the address of a Dask scheduler",
                "give tcp://HOST:PORT, as 'dask scheduler' prints it",
            )
        self._scheduler, self._patience = scheduler, patience
        self._open = ExitStack()
        self._client, self._where = scheduler, ""
        self._threads, self._counted = 0, -REFRESH
        self._absent: float | None = None

    def __enter__(self) -> Self:
        distributed = _distributed()
        with ExitStack() as opening:
            opening.enter_context(_silenced())
            if isinstance(self._scheduler, str):
                self._client = _connect(distributed, self._scheduler)
                opening.callback(self._close)
            elif not isinstance(self._scheduler, distributed.Client):
                message = f"{self._scheduler!r} is no Dask client"
                raise InputError(message, "give one, or the address of a scheduler")
            state = "asynchronous" if self._client.asynchronous else self._client.status
            if state != "running":
                raise InputError(f"the Dask client is {state}", "give one that is connected")
            self._where = self._client.scheduler.address
            self._check_versions()
            self._open = opening.pop_all()
        return self

    def __exit__(self, *exception: object) -> None:
        self._open.close()

    def map(
        self, function: Callable[[Work], Result], jobs: Iterable[tuple[int, Work]]
    ) -> Iterator[tuple[int, Result]]:
        """Do every piece; see `Crew`."""
        name, count, waiting = f"flexspine-{uuid4().hex}", 0, iter(jobs)
        under_way: dict[Any, int] = {}
        done: SimpleQueue[Any] = SimpleQueue()
        # Here as well as below: whoever is interrupted between two results leaves this frame open.
        self._open.callback(self._cancel, under_way)
        try:
            while True:
                room = self._room()
                while len(under_way) < room and (job := next(waiting, None)) is not None:
                    future = self._submit((name, count), function, job[1])
                    under_way[future], count = job[0], count + 1
                    future.add_done_callback(done.put)
                if not under_way:
                    return
                finished = _taken(done)
                results = self._fetch(finished) if finished else []
                if results is None:
                    for future in finished:
                        future.add_done_callback(done.put)
                    continue
                numbers = [under_way.pop(future) for future in finished]
                # What is here need not stay in the memory of the workers.
                finished.clear()
                for number, result in zip(numbers, results, strict=True):
                    yield number, pickle.loads(result)
        finally:
            self._cancel(under_way)

    def _room(self) -> int:
        """Tell how many pieces may be under way with the workers that are there."""
        now = time.monotonic()
        if now >= self._counted + REFRESH:
            threads = self._ask(self._client.nthreads)
            if threads is None:
                raise self._meaning(TimeoutError())
            self._threads, self._counted = sum(threads.values()), now
            if self._threads:
                self._absent = None
            elif self._absent is None:
                self._absent = now
            elif now > self._absent + self._patience:
                raise MachineError(
                    f"no workers at the Dask scheduler {self._where} for {self._patience:g} s",
                    f"start some: dask worker {self._where} --nthreads 1 --nworkers N",
                )
        # Without workers one piece waits on the scheduler for the first of them.
        return max(1, AHEAD * self._threads)

    def _submit(self, key: tuple[str, int], function: Any, work: Any) -> Any:
        # Bytes pass through the scheduler without being looked into.
        piece = pickle.dumps((function, work))
        try:
            return self._client.submit(_do, __version__, piece, key=key, pure=False)
        except Exception as failure:
            raise self._meaning(failure) from None

    def _fetch(self, finished: list[Any]) -> list[bytes] | None:
        """Get results, or None if they do not come now, as their worker died meanwhile."""
        for future in finished:
            if future.status == "error":
                raise self._blame(future.exception())
        fetched: list[bytes] | None = self._ask(lambda: self._client.gather(finished))
        return fetched

    def _ask(self, question: Callable[[], Any]) -> Any:
        """Put a question to the scheduler; None if it takes too long to answer."""

        async def asked() -> Any:
            return await question()

        try:
            return self._client.sync(asked, callback_timeout=SILENCE)
        except TimeoutError:
            return None
        except Exception as failure:
            raise self._meaning(failure) from None

    def _meaning(self, failure: Exception) -> Exception:
        """Tell what to raise for what distributed raised."""
        if not isinstance(failure, OSError | CancelledError) and self._client.status == "running":
            return failure
        return MachineError(
            f"the Dask scheduler at {self._where} was lost; what is finished is kept",
            "once it runs again, the same command goes on",
        )

    def _blame(self, failure: Exception) -> Exception:
        """Tell what to raise for a piece that failed."""
        if isinstance(failure, _distributed().KilledWorker):
            count, last = failure.allowed_failures + 1, failure.last_worker.address
            message = f"a piece of work killed {count} workers, the last of them at {last}"
            return MachineError(message, "look at their logs and at the memory that they have")
        # A flexspine that is not ours fails in ways of its own.
        self._check_versions()
        return failure

    def _check_versions(self) -> None:
        async def asked() -> dict[str, Any]:
            try:
                scheduler = await self._client.run_on_scheduler(_version)
            except (ImportError, AttributeError) as lack:
                scheduler = lack
            workers = await self._client.run(_version, on_error="return")
            return {"the scheduler": scheduler, **workers}

        # Whoever is too busy to tell now is asked again with every piece.
        versions = self._ask(asked) or {}
        others = [
            f"{who} ({version if isinstance(version, str) else 'missing or too old'})"
            for who, version in versions.items()
            if version != __version__ and not isinstance(version, OSError)
        ]
        if others:
            more = f" and {len(others) - 3} more" if len(others) > 3 else ""
            raise MachineError(
                f"flexspine is not {__version__} at {', '.join(others[:3])}{more}",
                f"install flexspine {__version__} there, with its extra 'cluster'",
            )

    def _cancel(self, under_way: dict[Any, int]) -> None:
        pending = [future for future in under_way if not future.cancelled()]
        under_way.clear()
        if pending:
            with suppress(Exception):
                self._client.cancel(pending)

    def _close(self) -> None:
        with suppress(Exception):
            self._client.close(timeout=REACH)


def _version() -> str:
    return __version__


def _do(version: str, piece: bytes) -> bytes:
    """Do a piece of work on a worker, for a flexspine of this version."""
    if version != __version__:
        raise MachineError(
            f"a worker has flexspine {__version__}, and this is {version}",
            f"install flexspine {version} there",
        )
    with _alone:
        function, work = pickle.loads(piece)
        return pickle.dumps(function(work))


def _taken(done: SimpleQueue[Any]) -> list[Any]:
    """Wait for something to be finished, though not long, and take what is."""
    taken: list[Any] = []
    with suppress(Empty):
        taken.append(done.get(timeout=REFRESH))
        while len(taken) < BATCH:
            taken.append(done.get_nowait())
    return taken


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError:
        raise MachineError(
            "the package 'distributed' is not installed", "pip install 'flexspine[cluster]'"
        ) from None


def _connect(distributed: Any, address: str) -> Any:
    try:
        # A thread of its own, as the caller's may have an event loop that runs already.
        with ThreadPoolExecutor(1) as pool:
            pool.submit(asyncio.run, _knock(distributed, address)).result()
        return distributed.Client(address, timeout=REACH, set_as_default=False, name="flexspine")
    except Exception:
        remedy = "start one with 'dask scheduler' and give the address that it prints"
        if address.startswith("tls"):
            remedy += ", and name the certificates in Dask's configuration"
        raise MachineError(f"no Dask scheduler answers at {address}", remedy) from None


async def _knock(distributed: Any, address: str) -> None:
    """See that a scheduler answers, as a client would wait for ever for what is something else."""
    options = distributed.Security().get_connection_args("client")
    scheduler = distributed.rpc(address, timeout=REACH, connection_args=options)
    try:
        identity = await asyncio.wait_for(scheduler.identity(), REACH)
    finally:
        await scheduler.close_rpc()
    if identity["type"] != "Scheduler":
        raise ConnectionError(identity["type"])


@contextmanager
def _silenced() -> Iterator[None]:
    """Keep distributed's loggers quiet for a while."""
    known = [n for n in logging.root.manager.loggerDict if n.partition(".")[0] in LOGGERS]
    loggers = [logging.getLogger(name) for name in {*LOGGERS, *known}]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
