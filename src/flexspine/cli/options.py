"""Options that several verbs share."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from flexspine.errors import InputError

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Set a parameter, e.g. spine.stiffness=240."),
]
Apex = Annotated[
    list[str] | None,
    typer.Option("--apex", metavar="NAME=VALUE", help="Set a start value, e.g. height=0.32."),
]
Touchdown = Annotated[
    list[str] | None,
    typer.Option(
        "--touchdown",
        metavar="LEG=ANGLE",
        help="Set a touchdown angle in radians from the vertical, e.g. fore=0.46.",
    ),
]


def assignments(option: str, given: list[str] | None) -> dict[str, Any]:
    """Parse ``NAME=VALUE`` items; a value that is no number stays a text for others to refuse."""
    parsed: dict[str, Any] = {}
    for item in given or []:
        name, equals, value = item.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise InputError(f"{option} '{item}' is not NAME=VALUE", f"write {option} NAME=VALUE")
        parsed[name.strip()] = _number(value.strip())
    return parsed


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
