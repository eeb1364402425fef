"""Where finished pieces of long work are kept until all is done."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexspine.cli.sweep import unfinished_is_kept


@contextmanager
def kept(out: Path | None, what: str) -> Iterator[Path | None]:
    """A file in ``out`` for what is finished of ``what``, which goes when the block succeeds."""
    if out is None:
        yield None
        return
    file = out / f"{what}.unfinished.jsonl"
    with unfinished_is_kept(out):
        yield file
    file.unlink(missing_ok=True)
