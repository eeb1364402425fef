"""What every verb says and how: JSON alone on stdout, messages on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from flexspine._version import SCHEMA_VERSION
from flexspine.cli.interrupts import uninterruptible
from flexspine.errors import FlexspineError

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, TaskID

# The words of the command line that runs, without the name of the program.
WORDS: ContextVar[tuple[str, ...]] = ContextVar("WORDS", default=())


def print_json(record: dict[str, Any]) -> None:
    """Print one JSON object, whole; a NaN in it is a mistake of ours and raises."""
    text = json.dumps(record, allow_nan=False)
    uninterruptible()  # or a second object would tell so
    print(text)


def fail(failure: FlexspineError, as_json: bool) -> int:
    """Tell an error in one line, or as JSON, and return its exit code."""
    if as_json:
        print_json(
            {
                "schema_version": SCHEMA_VERSION,
                "error": failure.code,
                "message": failure.message,
                "remedy": failure.remedy,
            }
        )
    else:
        print("flexspine:", " ".join(str(failure).split()), file=sys.stderr)
    return failure.exit_code


class Steps:
    """Progress through named steps, shown only where a person watches."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        self._progress, self._task = progress, task

    def begin(self, what: str) -> None:
        """Start a step."""
        self._progress.update(self._task, description=what, completed=0.0)

    def at(self, share: float) -> None:
        """Report how much of the step is done, from 0 to 1."""
        self._progress.update(self._task, completed=share)


@contextmanager
def steps() -> Iterator[Steps]:
    """Show progress on stderr while the block runs; nothing when stderr is not a terminal."""
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with _shown(*columns) as bar:
        yield Steps(bar, bar.add_task("", total=1.0))


@contextmanager
def counting(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show how many of how many are done on stderr, with rate and time left."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _rate(),
        TimeRemainingColumn(),
    )
    with _shown(*columns) as bar:
        task = bar.add_task(what, total=None)

        def show(done: int, whole: int) -> None:
            bar.update(task, completed=done, total=whole)

        yield show


@contextmanager
def _shown(*columns: ProgressColumn) -> Iterator[Progress]:
    """Show progress where a person watches, whatever the environment says of colours."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(
        *columns,
        console=Console(stderr=True),
        transient=True,
        redirect_stdout=sys.stdout.isatty(),  # what is piped is never to end up on stderr
        disable=not sys.stderr.isatty(),
    ) as bar:
        yield bar


def _rate() -> ProgressColumn:
    """How many are done a second, once something was done."""
    from rich.progress import ProgressColumn, Task
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(f"{task.speed:,.0f}/s" if task.speed else "")

    return Rate()
