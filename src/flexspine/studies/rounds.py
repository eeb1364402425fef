"""Rounds of pieces of work that do not depend on each other, kept as they are finished."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from flexspine.workers.crew import Crew, Work
from flexspine.workers.journal import Journal

KEYS = {"round", "piece", "result"}

Progress = Callable[[str, float], None]


class Rounds:
    """Does one round after the other; what a journal has of a round is not done again.

    ``progress`` is told what is being done and which share of the round is.
    """

    def __init__(
        self,
        crew: Crew,
        store: Path | None,
        description: Mapping[str, Any],
        progress: Progress | None,
    ) -> None:
        self._crew, self._count = crew, 0
        self._tell = progress or (lambda _what, _share: None)
        self._journal = store and Journal(store, description, "an optimisation", _is_piece)

    def do(self, what: str, function: Callable[[Work], Any], works: Sequence[Work]) -> list[Any]:
        """Do every piece of a round; results have to be what JSON can hold."""
        number, self._count = self._count, self._count + 1
        lines = self._journal.lines if self._journal else []
        done = {line["piece"]: line["result"] for line in lines if line["round"] == number}
        missing = [(i, work) for i, work in enumerate(works) if i not in done]
        self._tell(what, len(done) / max(len(works), 1))
        for piece, result in self._crew.map(function, missing):
            done[piece] = result
            if self._journal:
                self._journal.add({"round": number, "piece": piece, "result": result})
            self._tell(what, len(done) / len(works))
        return [done[i] for i in range(len(works))]


def _is_piece(line: Any) -> bool:
    return isinstance(line, dict) and line.keys() == KEYS
