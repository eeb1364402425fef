"""Options that several verbs share."""

from __future__ import annotations

from math import inf, isfinite
from pathlib import Path
from typing import Annotated, Any

import typer

from flexspine.errors import InputError, ParameterError

DEFAULT_PRESET = "kamimura2015-flexible"
DEFAULT_ROBOT = "sc618"

Preset = Annotated[
    str | None,
    typer.Option(
        help=f"A preset (see 'flexspine presets') or a TOML file (default {DEFAULT_PRESET})."
    ),
]
RobotName = Annotated[
    str,
    typer.Option("--robot", help=f"A robot ({DEFAULT_ROBOT}) or a TOML file that describes one."),
]
GaitFile = Annotated[
    Path | None,
    typer.Option("--gait", metavar="FILE", help="A gait saved by 'flexspine gait --out'."),
]
Symmetric = Annotated[
    bool | None,
    typer.Option(
        "--symmetric/--general",
        help="Only gaits that are their own mirror image in time, or gaits of any shape.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Tolerance = Annotated[
    float | None, typer.Option(help="Tolerance of the integrator (default 1e-12).")
]
RunDirectory = Annotated[
    Path | None, typer.Option(help="Write data, figures and animations into this directory.")
]
Animation = Annotated[
    bool, typer.Option("--animation/--no-animation", help="Make animations with --out.")
]
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


def numbers(option: str, given: list[str] | None) -> dict[str, float]:
    """Parse ``NAME=VALUE`` items whose values have to be numbers. Raises `InputError`."""
    parsed = assignments(option, given)
    for name, value in parsed.items():
        check_number(f"{option} {name}", value)
    return parsed


def check_number(what: str, value: Any) -> None:
    """Raise `ParameterError` for a text, an infinity and NaN."""
    from flexspine.parameters import is_number, shortened

    if not (is_number(value) and isfinite(value)):
        raise ParameterError(f"{what} = {shortened(value)} is not usable", "give a number")


def span(option: str, text: str) -> tuple[float, float]:
    """Parse ``LOW:HIGH``."""
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        low, high = inf, -inf
    if not -inf < low < high < inf:
        raise InputError(
            f"{option} '{text}' is not LOW:HIGH", "write two numbers, the lower one first"
        )
    return low, high


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
