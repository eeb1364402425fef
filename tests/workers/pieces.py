"""Pieces of work for processes, which import this and nothing that takes long."""

from __future__ import annotations

import os
import signal
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

# Bytes; more than a pipe takes at once.
LARGE = 1_000_000


def process_id(seconds: float) -> int:
    """Take a while, and tell who did it."""
    time.sleep(seconds)
    return os.getpid()


def killed_once(file: Path | None) -> tuple[int, int]:
    """Be killed the first time; then tell who was, and who did it after that."""
    if file is None:
        time.sleep(0.01)
        return 0, 0
    if not file.exists():
        file.write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    return int(file.read_text()), os.getpid()


def killed_always(directory: Path | None) -> None:
    """Leave a file, and be killed."""
    if directory is not None:
        (directory / str(os.getpid())).touch()
        os.kill(os.getpid(), signal.SIGKILL)


def cut_short_once(file: Path | None) -> bytes:
    """Be killed the first time, with the result half sent."""
    if file is not None and not file.exists():
        file.touch()
        # In this worker alone, which has not long to live.
        setattr(Connection, "_send", _send_half)  # noqa: B010
    return bytes(LARGE)


def _send_half(connection: Connection, data: bytes, *_: Any) -> None:
    whole = len(data) < LARGE
    os.write(connection.fileno(), data if whole else data[: LARGE // 2])
    if not whole:
        os.kill(os.getpid(), signal.SIGKILL)


_inside: list[int] = []


def threads_inside(piece: int) -> int:
    """Tell how many threads of this process are here."""
    _inside.append(piece)
    time.sleep(0.02)
    count = len(_inside)
    _inside.remove(piece)
    return count
