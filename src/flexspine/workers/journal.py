"""Long work on disk while it is being done: one JSON line for each finished piece.

The first line describes the work; a last line that was cut off by a crash is dropped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from flexspine.errors import OUT_OF_SPACE, OutputError

Line = dict[str, Any]


class Journal:
    """The file of one work; opening it reads what is there.

    ``kind`` is what it holds, such as ``a branch``; ``is_line`` tells its lines from others.
    Raises `OutputError` for a file that is damaged or of another work.
    """

    def __init__(
        self,
        path: Path,
        description: Mapping[str, Any],
        kind: str,
        is_line: Callable[[Any], bool],
    ) -> None:
        self.path = path
        self.lines: list[Line] = []
        header = json.loads(json.dumps(description))
        try:
            # Whoever was stopped before the first line has left an empty file.
            if path.exists() and path.stat().st_size:
                self._read(header, kind, is_line)
            else:
                path.write_text(json.dumps(header) + "\n", encoding="utf-8")
        except OSError as failure:
            if failure.errno in OUT_OF_SPACE:
                raise
            raise OutputError(
                f"cannot use '{path}' ({failure.strerror})", "give another place"
            ) from None

    def _read(self, header: Line, kind: str, is_line: Callable[[Any], bool]) -> None:
        content = self.path.read_bytes()
        whole, _, rest = content.rpartition(b"\n")
        try:
            first, *lines = [json.loads(line) for line in whole.splitlines()] or [None]
        except ValueError:
            first, lines = None, []
        if first != header or not all(map(is_line, lines)):
            raise OutputError(
                f"'{self.path}' is damaged, or holds {kind} with other settings",
                "give another place, or delete it to begin anew",
            )
        if rest:
            with self.path.open("r+b") as file:
                file.truncate(len(content) - len(rest))
        self.lines = lines

    def add(self, line: Line) -> None:
        """Append a finished piece."""
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
