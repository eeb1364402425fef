"""The command line in processes of its own: noting the chunks it begins, or dying at a write."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

# s; what a chunk takes at least, so that there is time to kill who does it.
SLOW = 0.15

# s; a busy machine is slow.
LIMIT = 120.0

# Forked from one that is ready to work: starting from nothing takes ten times as long.
_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(["tests.studies.scout2_loaded"])


def noted(work: tuple[Any, int]) -> Any:
    """Do a chunk, not too fast, and note its number before."""
    from flexspine.studies.tasks import do_chunk

    with Path(os.environ["NOTES"]).open("a") as notes:
        notes.write(f"{work[1]}\n")
    time.sleep(SLOW)
    return do_chunk(work)


def noting() -> None:
    """The command line, noting every chunk."""
    from flexspine.__main__ import main
    from flexspine.studies import sweep as sweeps

    sweeps.do_chunk = noted
    main()


def dying() -> None:
    """The command line, killed at a certain write: ``HOW`` at the ``NUMBER``-th."""
    from flexspine.__main__ import main

    how, left = os.environ["HOW"], int(os.environ["NUMBER"])
    sync, replace = os.fsync, Path.replace

    def at_last() -> bool:
        nonlocal left
        left -= 1
        return left == 0

    def half_written(file: int) -> None:
        if at_last():
            os.ftruncate(file, os.fstat(file).st_size // 2)
            os.kill(os.getpid(), signal.SIGKILL)
        sync(file)

    def renaming(path: Path, target: Path) -> Path:
        if at_last():
            if how == "renamed":
                replace(path, target)
            os.kill(os.getpid(), signal.SIGKILL)
        return replace(path, target)

    if how == "half written":
        os.fsync = half_written
    else:
        Path.replace = renaming  # type: ignore[method-assign]
    main()


def _run(what: Callable[[], None], words: list[str], environment: dict[str, str]) -> None:
    """Be a command of these words, with what it says in files."""
    for stream, file in ((1, "STDOUT"), (2, "STDERR")):
        os.dup2(os.open(environment[file], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
    os.environ.update(environment)
    sys.argv = ["flexspine", *words]
    what()


class Command:
    """``what`` carries out a sweep in a process of its own, as the command line would."""

    def __init__(
        self, what: Callable[[], None], out: Path, plan: Path, processes: int = 1, **more: str
    ) -> None:
        self._files = [out.with_suffix(suffix) for suffix in (".stdout", ".stderr")]
        words = ["sweep", str(plan), "--out", str(out), "--json", "--processes", str(processes)]
        streams = dict(zip(("STDOUT", "STDERR"), map(str, self._files), strict=True))
        environment = {"NOTES": str(out.with_suffix(".notes")), **streams, **more}
        self._process = _FORKS.Process(target=_run, args=(what, words, environment))
        self._process.start()

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        """As of `subprocess.Popen`; None while it is at work."""
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        with suppress(ProcessLookupError):  # it has just ended
            os.kill(self.pid, number)

    def communicate(self) -> tuple[str, str]:
        """Wait for its end; what it has said on stdout and on stderr."""
        self._process.join(LIMIT)
        assert self._process.exitcode is not None, "it does not end"
        output, errors = (file.read_text() for file in self._files)
        return output, errors
