"""Options that several verbs share: their names, what they tell, and how they are read."""

from __future__ import annotations

from math import inf, isfinite
from pathlib import Path
from typing import Annotated, Any

import typer

from flexspine.cli import completion
from flexspine.errors import InputError, OutputError, ParameterError

DEFAULT_PRESET, DEFAULT_ROBOT = completion.DEFAULT_PRESET, completion.DEFAULT_ROBOT


def output_directory(what: str) -> Any:
    """Declare ``--out``, a directory in which a verb writes ``what``."""
    return typer.Option(
        "--out", metavar="DIR", parser=_place, help=f"Write {what} into this directory."
    )


def output_file(about: str, metavar: str = "FILE") -> Any:
    """Declare ``--out``, a file that a verb writes."""
    return typer.Option("--out", metavar=metavar, parser=_place, help=about)


def _place(text: str) -> Path:
    """A place to write to; an empty one would be the working directory, which nobody asked for."""
    if not text.strip():
        raise OutputError("--out is given without a name", "give it a name, or leave it")
    return Path(text)


Preset = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="A preset (see 'flexspine presets') or a TOML file.",
        show_default=DEFAULT_PRESET,
        autocompletion=completion.presets,
    ),
]
RobotName = Annotated[
    str,
    typer.Option(
        "--robot",
        metavar="NAME",
        help="A robot (see 'flexspine presets') or a TOML file that describes one.",
        autocompletion=completion.robots,
    ),
]
GaitFile = Annotated[
    Path | None,
    typer.Option("--gait", metavar="FILE", help="A gait saved by 'flexspine gait --out'."),
]
Walks = Annotated[
    str,
    typer.Option(
        "--gait",
        metavar="NAME",
        help="trot or bound of the robot, one of another robot (sc618-trot), or a TOML file, such "
        "as 'tune' writes.",
        autocompletion=completion.walks,
    ),
]
Locked = Annotated[bool, typer.Option("--locked", help="Lock the spine: one stiff trunk.")]
Plane = Annotated[
    bool, typer.Option("--plane", help="Keep the robot to its plane: no abduction, no roll.")
]
Symmetric = Annotated[
    bool | None,
    typer.Option(
        "--symmetric/--general",
        help="Only gaits that are their own mirror image in time, or gaits of any shape.",
    ),
]
Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")
]
Tolerance = Annotated[
    float | None, typer.Option(help="Tolerance of the integrator.", show_default="1e-12")
]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of all that is drawn at random.")]
Processes = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="Processes on this machine; results do not depend on them.",
        show_default="one a core",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="tcp://HOST:PORT", help="Use the workers of this Dask scheduler instead."),
]
RunDirectory = Annotated[Path | None, output_directory("data, figures and animations")]
Animation = Annotated[
    bool, typer.Option("--animation/--no-animation", help="Make animations with --out.")
]


def _settable(examples: str) -> Any:
    return typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help=f"Set a parameter by its dotted name, e.g. {examples}; repeat it.",
        autocompletion=completion.settings,
    )


Assignments = Annotated[list[str] | None, _settable("spine.stiffness=240")]
RobotAssignments = Annotated[list[str] | None, _settable("spine.stiffness=300, gait.speed=0.4")]
WalkAssignments = Annotated[
    list[str] | None,
    _settable("spine.stiffness=300, gait.speed=0.4, servo.damping=1.5, space.foot_radius=0.03"),
]
Apex = Annotated[
    list[str] | None,
    typer.Option(
        "--apex",
        metavar="NAME=VALUE",
        help="Set a start value, e.g. height=0.32; repeat it.",
        autocompletion=completion.apex,
    ),
]
Touchdown = Annotated[
    list[str] | None,
    typer.Option(
        "--touchdown",
        metavar="LEG=ANGLE",
        help="Set a touchdown angle in rad from the vertical, e.g. fore=0.46; repeat it.",
        autocompletion=completion.touchdown,
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
