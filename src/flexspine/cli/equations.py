"""``flexspine equations``: the derived Lagrangian and equations of motion, for teaching."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json
from flexspine.cli.output import print_json, steps

if TYPE_CHECKING:
    from flexspine.models.bounder import Body
    from flexspine.parameters import Quantity


class Format(StrEnum):
    """How to set the equations."""

    text = "text"
    latex = "latex"
    both = "both"


class Phase(StrEnum):
    """Which legs stand on the ground."""

    DF = "DF"
    FS = "FS"
    HS = "HS"
    DS = "DS"


def equations(
    model: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A model such as flexible-bounder, or a preset.",
            autocompletion=completion.models,
        ),
    ],
    phase: Annotated[Phase, typer.Option(help="The contact phase.")] = Phase.DS,
    format_: Annotated[Format, typer.Option("--format", help="How to set them.")] = Format.both,
    json: Json = False,
) -> None:
    """Print the Lagrangian and the equations of motion of a model.

    Exit code 0: done; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine equations flexible-bounder

        flexspine equations rigid-bounder --phase FS --format latex
    """
    from flexspine.errors import UnknownNameError
    from flexspine.mechanics.equations import as_latex, as_text, written_out
    from flexspine.models.actuation import DAMPED
    from flexspine.models.bounder import lagrangian, stance_legs
    from flexspine.models.presets import load_model, preset_names
    from flexspine.models.registry import KINDS
    from flexspine.parameters import quantities

    interruptible()
    try:
        kind = KINDS[model] if model in KINDS else load_model(model).kind
    except UnknownNameError:
        raise UnknownNameError("model or preset", model, [*KINDS, *preset_names()]) from None
    with steps() as progress:
        progress.begin("deriving")
        body = kind.body(DAMPED)
        stance = stance_legs(body, phase.value, DAMPED)
        lines = written_out(lagrangian(body, phase.value, stance))
        letters = _letters(body, quantities(kind.parameters))
    if json:
        print_json(
            {
                **STAMP,
                "model": kind.name,
                "phase": phase.value,
                "letters": letters,
                "text": as_text(lines),
                "latex": as_latex(lines),
            }
        )
        return
    title = f"{kind.name}, phase {phase.value}: {kind.title} ({kind.source})"
    if format_ is not Format.latex:
        unicode = (sys.stdout.encoding or "").lower().startswith("utf")
        print(title, as_text(lines, unicode), sep="\n\n")
        print("Letters:\n")
        for letter, meaning in letters.items():
            print(f"    {letter:<10}{meaning}")
        print()
    if format_ is not Format.text:
        print(f"% {title}", as_latex(lines), sep="\n")


def _letters(body: Body, about: Iterator[Quantity]) -> dict[str, str]:
    """What the letters of a model without actuators stand for."""
    from flexspine.models.actuation import ACTUATORS
    from flexspine.models.bounder import FORE, HIND, HIP

    letters = {
        str(body.parameters[item.name]): f"{item.meaning} ({item.name}, {item.unit})"
        for item in about
        if item.name not in ACTUATORS
    }
    letters |= {"x, y": "position of the CoM (m)"}
    for angle, _ in body.coordinates.values():
        letters[str(angle)] = "pitch, nose up positive (rad)"
    for leg in (FORE, HIND):
        x, y = HIP[leg.side]
        letters[f"{x}, {y}"] = f"position of the {leg.side} hip (m)"
        letters[str(leg.toe)] = f"position of the {leg.side} toe (m)"
    return letters
