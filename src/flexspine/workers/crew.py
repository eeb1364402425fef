"""What every crew of workers offers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, Self, TypeVar

Work = TypeVar("Work")
Result = TypeVar("Result")


class Crew(Protocol):
    """Workers that do numbered pieces of work; a context, at whose end they go.

    ``map`` yields each piece's number with its result, in whatever order they are done, and takes
    new pieces only as old ones are finished, so that no more than a few are ever under way.
    A function and what it is given have to be picklable. What a piece raises is raised by ``map``.
    """

    def map(
        self, function: Callable[[Work], Result], jobs: Iterable[tuple[int, Work]]
    ) -> Iterator[tuple[int, Result]]:
        """Do every piece."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exception: object) -> None: ...


def cores() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS, nor on Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
