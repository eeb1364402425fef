"""``flexspine equations``: the derived Lagrangian and equations of motion, for teaching."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import Annotated

import typer

from flexspine.cli.options import Json
from flexspine.cli.output import SCHEMA_VERSION, print_json


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
    model: Annotated[str, typer.Argument(help="A model such as flexible-bounder, or a preset.")],
    phase: Annotated[Phase, typer.Option(help="The contact phase.")] = Phase.DS,
    format_: Annotated[Format, typer.Option("--format", help="How to set them.")] = Format.both,
    json: Json = False,
) -> None:
    """Print a model's Lagrangian and the equations of motion derived from it.

    Examples:
        flexspine equations flexible-bounder

        flexspine equations rigid-bounder --phase FS --format latex
    """
    from flexspine.mechanics.equations import as_latex, as_text, written_out
    from flexspine.models.bounder import lagrangian, stance_legs
    from flexspine.models.presets import load_model, preset_names
    from flexspine.models.registry import KINDS, find_kind

    known = model not in KINDS and (model in preset_names() or model.endswith(".toml"))
    kind = load_model(model).kind if known else find_kind(model)
    body = kind.body(True)
    lines = written_out(lagrangian(body, stance_legs(body, phase.value, damped=True)))
    if json:
        print_json(
            {
                "schema_version": SCHEMA_VERSION,
                "model": kind.name,
                "phase": phase.value,
                "text": as_text(lines),
                "latex": as_latex(lines),
            }
        )
        return
    title = f"{kind.name}, phase {phase.value}: {kind.title} ({kind.source})"
    if format_ is not Format.latex:
        unicode = (sys.stdout.encoding or "").lower().startswith("utf")
        print(title, as_text(lines, unicode), sep="\n\n")
    if format_ is not Format.text:
        print(f"% {title}", as_latex(lines), sep="\n")
