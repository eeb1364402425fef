"""Throughput of two processes against one: warm workers, each with the same amount to do."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from benchmarks.timing import ROUNDS, seconds

_work: Callable[[], object] | None = None


def prepare() -> None:
    """Load the model in a worker and run it once."""
    global _work
    from benchmarks.ensemble_runs import PRESET, Runs

    _work = Runs(PRESET).job(1e-12)
    _work()


def ensemble() -> float:
    """Make the strides; returns the CPU seconds it took."""
    assert _work is not None
    return seconds(_work, clock=time.process_time)


def arithmetic() -> float:
    """Work that needs nothing but a core: what the machine itself gives two processes."""
    return seconds(lambda: sum(number & 7 for number in range(10_000_000)), clock=time.process_time)


def gains(workers: list[ProcessPoolExecutor], work: Callable[[], float]) -> tuple[float, float]:
    """Throughput of all workers at once over that of one, by wall time and by CPU time.

    That by CPU time leaves out what other programs take of the cores. One and all take turns;
    the median of the rounds.
    """

    def run(used: list[ProcessPoolExecutor]) -> tuple[float, float]:
        begin = time.perf_counter()
        busy = [pending.result() for pending in [worker.submit(work) for worker in used]]
        return time.perf_counter() - begin, statistics.mean(busy)

    run(workers)
    rounds = [(run(workers[:1]), run(workers)) for _ in range(ROUNDS)]
    wall, busy = (
        statistics.median(len(workers) * one[i] / everyone[i] for one, everyone in rounds)
        for i in range(2)
    )
    return wall, busy


def two_processes() -> dict[str, float]:
    context = get_context("spawn")
    workers = [ProcessPoolExecutor(1, context, prepare) for _ in range(2)]
    try:
        found = {}
        for name, work in (("strides", ensemble), ("arithmetic", arithmetic)):
            found[f"{name}_wall"], found[f"{name}_cpu"] = gains(workers, work)
        return found
    finally:
        for worker in workers:
            worker.shutdown()
