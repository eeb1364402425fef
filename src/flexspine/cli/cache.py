"""``flexspine cache``: compiled code kept between starts."""

from __future__ import annotations

import typer

from flexspine._version import STAMP
from flexspine.cli.options import Json
from flexspine.cli.output import print_json

app = typer.Typer(help="Clear the compiled code that is kept between starts.", no_args_is_help=True)


@app.command("clear")
def clear(json: Json = False) -> None:
    """Delete all compiled code; the next run compiles again.

    Exit code 0: done; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine cache clear
    """
    from flexspine.hybrid.cache import clear_cache

    directory, freed = clear_cache()
    if json:
        print_json({**STAMP, "directory": str(directory), "freed_bytes": freed})
    else:
        print(f"cleared {directory} ({freed / 1e6:.1f} MB)")


@app.callback()
def _group() -> None:
    pass
