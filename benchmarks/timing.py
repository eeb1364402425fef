"""Times taken in turns, so that a drifting machine weighs on all sides alike."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

ROUNDS = 7
TOLERANCES = [m * 10.0**-e for e in range(8, 13) for m in (10, 5, 3, 2)]


Clock = Callable[[], float]


def seconds(
    work: Callable[[], object], repeats: int = 1, clock: Clock = time.perf_counter
) -> float:
    begin = clock()
    for _ in range(repeats):
        work()
    return (clock() - begin) / repeats


def in_turn(
    *jobs: tuple[Callable[[], object], int], clock: Clock = time.perf_counter
) -> list[list[float]]:
    """Time the jobs round by round; returns one row of seconds per round."""
    for work, _ in jobs:
        work()
    return [[seconds(work, repeats, clock) for work, repeats in jobs] for _ in range(ROUNDS)]


def ratio(rows: list[list[float]], slow: int, fast: int) -> float:
    return statistics.median(row[slow] / row[fast] for row in rows)


def median(rows: list[list[float]], column: int) -> float:
    return statistics.median(row[column] for row in rows)


def loosest(error: Callable[[float], float], allowed: float) -> tuple[float, float]:
    """The loosest tolerance whose error is allowed, and that error."""
    for tolerance in TOLERANCES:
        reached = error(tolerance)
        if reached <= allowed:
            return tolerance, reached
    raise ValueError(f"no tolerance reaches {allowed:g}, the last one {reached:.1e}")


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process, and the threads it starts, on one core where the system allows it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
