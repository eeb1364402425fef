"""The entry point: ``flexspine`` and ``python -m flexspine``."""

import os
import signal
import sys
from types import FrameType


def main() -> None:
    """Run the command line and leave with its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    from flexspine.cli.app import run

    sys.exit(run(sys.argv[1:]))


def _leave(_number: int, _frame: FrameType | None) -> None:
    """Leave at once; an exception would be lost or garbled inside a library's import."""
    os.write(2, b"flexspine: interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    main()
