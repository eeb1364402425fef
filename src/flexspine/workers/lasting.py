"""Pieces of work done by processes, each kept on disk as soon as it is finished."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from flexspine._version import __version__
from flexspine.workers.journal import Journal
from flexspine.workers.local import LocalWorkers

Piece = TypeVar("Piece")
Result = TypeVar("Result")


def do_all(
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    *,
    processes: int,
    progress: Callable[[int, int], None] | None,
    store: Path | None,
    description: Mapping[str, Any],
    to_json: Callable[[Result], Any],
    from_json: Callable[[Any], Result],
) -> list[Result]:
    """Do every piece and return the results in order; ``progress`` is told how many are done.

    ``store`` is a file that keeps results; called again with the same ``description``, it does
    only what is missing. Raises `OutputError` for a file of other work.
    """
    journal, done = None, dict[int, Result]()
    if store is not None:
        whole = {"flexspine": __version__, "pieces": len(pieces), **description}
        journal = Journal(store, whole, "results", _is_line)
        done = {line["piece"]: from_json(line["result"]) for line in journal.lines}

    def jobs() -> Iterator[tuple[int, Piece]]:
        return ((number, piece) for number, piece in enumerate(pieces) if number not in done)

    tell = progress or (lambda _done, _whole: None)
    tell(len(done), len(pieces))
    with LocalWorkers(processes) as crew:
        for number, result in crew.map(function, jobs()):
            done[number] = result
            if journal is not None:
                journal.add({"piece": number, "result": to_json(result)})
            tell(len(done), len(pieces))
    return [done[number] for number in range(len(pieces))]


def _is_line(line: Any) -> bool:
    return isinstance(line, dict) and line.keys() >= {"piece", "result"}
