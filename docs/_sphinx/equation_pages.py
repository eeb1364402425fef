"""The equations of every model, as the code derives them, to be included in its page."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from typing import Any

import sympy as sp

from flexspine.mechanics.equations import Heading, written_out
from flexspine.models.actuation import DAMPED
from flexspine.models.bounder import lagrangian, stance_legs
from flexspine.models.registry import KINDS


def equation_pages() -> dict[str, str]:
    """Return the equations in flight, with both legs in stance, by model and phase."""
    pages = {}
    for kind in KINDS.values():
        body = kind.body(DAMPED)
        for phase in ("DF", "DS"):
            system = lagrangian(body, phase, stance_legs(body, phase, DAMPED))
            pages[f"equations/{kind.name}-{phase}.txt"] = typeset(written_out(system))
    return pages


def typeset(lines: Iterable[Any]) -> str:
    """Set titled equations as Markdown, those under one title below each other."""
    parts: list[str] = []
    for titled, group in groupby(lines, lambda line: isinstance(line, Heading)):
        if titled:
            parts += [f"*{line.text}*" for line in group]
        else:
            rows = (f"{sp.latex(each.lhs)} &= {sp.latex(each.rhs)}" for each in group)
            parts.append("$$\n\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}\n$$")
    return "\n\n".join(parts) + "\n"
