"""Options on how a gait is stabilised, which several verbs share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from flexspine.cli import completion

if TYPE_CHECKING:
    from flexspine.control.stabilize import Stabilizer
    from flexspine.gaits.gait import Gait

# What is steered where nothing else is said.
USUAL_INPUTS = ("touchdown.fore", "touchdown.hind", "legs.extension")

Steer = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME",
        help="What is steered: a touchdown angle or a parameter; repeat it.",
        show_default=", ".join(USUAL_INPUTS),
        autocompletion=completion.quantities,
    ),
]
Method = Annotated[
    str,
    typer.Option(
        metavar="METHOD",
        help="lqr, or deadbeat, which acts once a stride.",
        autocompletion=completion.among("lqr", "deadbeat"),
    ),
]
Once = Annotated[
    bool, typer.Option("--once", help="Act at the apex after both stances only, not at both.")
]
Effort = Annotated[
    float | None,
    typer.Option(
        help="What steering costs beside deviations, both in natural units.", show_default="0.1"
    ),
]


def stabilizer_of(
    gait: Gait, steer: list[str] | None, method: str, once: bool, effort: float | None
) -> Stabilizer:
    """Design the feedback that the options ask for. Raises as `stabilize`."""
    from flexspine.control.stabilize import EFFORT, stabilize

    return stabilize(
        gait,
        tuple(steer or USUAL_INPUTS),
        method=method,
        twice=not once and method != "deadbeat",
        effort=EFFORT if effort is None else effort,
    )
