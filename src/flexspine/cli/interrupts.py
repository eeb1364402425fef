"""Interruptions: by whoever presses Ctrl-C, and by a system that ends its jobs."""

from __future__ import annotations

import signal
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


def interruptible() -> None:
    """From here on there is work to undo or to keep: an interruption raises, the first one."""
    for number in SIGNALS:
        signal.signal(number, _interrupt)


def uninterruptible() -> None:
    """From here on it is too late: what is done, or being undone, is not to be left halfway."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    uninterruptible()
    raise KeyboardInterrupt
