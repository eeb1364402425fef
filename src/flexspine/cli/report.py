"""``flexspine report``: a directory of results as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexspine._version import STAMP
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json
from flexspine.cli.output import print_json, steps


def report(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="What a command wrote with --out.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html", help="Write this file.", show_default="DIR/report.html"),
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
    from flexspine.report.document import write_report

    interruptible()
    with steps() as progress:

        def show(what: str, share: float) -> None:
            progress.begin(what)
            progress.at(share)

        file = write_report(directory, out, progress=show)
    size = file.stat().st_size
    if json:
        record = {"file": str(file), "bytes": size}
        print_json({**STAMP, **record})
    else:
        print(f"{file} ({size / 1e6:.1f} MB)")
    return 0
