from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from flexspine.cli.app import run
from flexspine.cli.interrupts import SIGNALS

COMMAND = Path(sys.executable).with_name("flexspine")

Result = subprocess.CompletedProcess[str]
Cli = Callable[..., Result]


def run_here(*arguments: str | Path) -> Result:
    """Run the command line in this process, where all is compiled."""
    words, out, err = [*map(str, arguments)], StringIO(), StringIO()
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        with redirect_stdout(out), redirect_stderr(err):
            code = run(words)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return Result(words, code, out.getvalue(), err.getvalue())


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Cli:
    """Run the command line in an empty directory."""
    monkeypatch.chdir(tmp_path)
    return run_here


@pytest.fixture
def command(tmp_path: Path) -> Cli:
    """Run the installed command as a user would, in an empty directory."""

    def spawned(*arguments: str | Path, **environment: str) -> Result:
        return subprocess.run(
            [COMMAND, *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            timeout=300,
        )

    return spawned
