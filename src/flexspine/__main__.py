"""The entry point: ``flexspine`` and ``python -m flexspine``."""

# Nothing else is imported before signals are minded.

import os
import signal
import sys
from types import FrameType

from flexspine._version import SCHEMA_VERSION

# What --json tells of it, before there is a command that could.
INTERRUPTED = (
    b'{"schema_version": %d, "error": "interrupted", "message": "interrupted", '
    b'"remedy": "run it again"}\n' % SCHEMA_VERSION
)


def main() -> None:
    """Run the command line and leave with its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    from flexspine.cli.app import run

    sys.exit(run(sys.argv[1:]))


def _leave(_number: int, _frame: FrameType | None) -> None:
    """Leave at once; an exception would be lost or garbled inside a library's import."""
    os.write(2, b"flexspine: interrupted\n")
    if "--json" in sys.argv:
        os.write(1, INTERRUPTED)
    os._exit(130)


if __name__ == "__main__":
    main()
