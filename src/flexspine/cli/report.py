"""``flexspine report``: a directory of results as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexspine._version import SCHEMA_VERSION, __version__
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json
from flexspine.cli.output import print_json, steps
from flexspine.errors import OutputError

PAGE = "report.html"


def report(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="What a command wrote with --out.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html", help="Write this file.", show_default=f"DIR/{PAGE}"),
    ] = None,
    json: Json = False,
) -> int:
    """Write a directory of results as one HTML page.

    It has a summary, parameters, plots, a player, tables and verdicts. The page opens offline in
    any browser and loads nothing.

    Exit code 0: done; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine bound --out run && flexspine report run

        flexspine report run --out run.html
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.report.document import document
    from flexspine.studies.store import write_whole

    interruptible()
    file = directory / PAGE if out is None else out
    if file.suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"cannot write a page as '{file.name}'", "give a name that ends in .html")
    if file.is_dir():
        raise OutputError(f"'{file}' is a directory", "give --out another name")
    with steps() as progress:

        def show(what: str, share: float) -> None:
            progress.begin(what)
            progress.at(share)

        page = document(directory, leave=file, progress=show).encode()
        progress.begin("writing")
        with ResultDirectory(file.parent):
            write_whole(file, page)
    if json:
        record = {"file": str(file), "bytes": len(page)}
        print_json({"schema_version": SCHEMA_VERSION, "flexspine": __version__, **record})
    else:
        print(f"{file} ({len(page) / 1e6:.1f} MB)")
    return 0
