"""The equations of a mechanical system in writing, as plain text and as LaTeX."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import sympy as sp

from flexspine.mechanics.lagrangian import Lagrangian


@dataclass(frozen=True)
class Heading:
    """A title between equations."""

    text: str


Line = Heading | Any


def written_out(system: Lagrangian) -> list[Line]:
    """Return the Lagrangian and the equations of motion ``M q'' + h = Q`` as titled equations."""
    T, V, R = sp.symbols("T V R")
    lines: list[Line] = [
        Heading("Kinetic and potential energy; the Lagrangian is T - V"),
        _equation(T, system.kinetic),
        _equation(V, system.potential),
    ]
    if system.dissipation != 0:
        lines += [
            Heading("Rayleigh's dissipation function"),
            _equation(R, system.dissipation),
        ]
    if system.definitions:
        lines.append(Heading("with"))
        lines += [_equation(symbol, value) for symbol, value in system.definitions.items()]
    lines.append(Heading("Equations of motion"))
    second = [sp.Symbol(str(rate).replace("dot", "ddot")) for rate in system.rates]
    for i in range(len(second)):
        inertia = sp.Add(*(system.mass_matrix[i, j] * a for j, a in enumerate(second)))
        lines.append(_equation(inertia + system.velocity_forces[i], system.generalized_forces[i]))
    return lines


def as_text(lines: list[Line], unicode: bool = True) -> str:
    """Set the lines as plain text."""

    def typeset(equation: sp.Eq) -> str:
        text: str = sp.pretty(equation, use_unicode=unicode, wrap_line=False)
        return "\n".join(f"    {row}".rstrip() for row in text.splitlines()) + "\n"

    return _joined(lines, lambda title: f"{title}:\n", typeset)


def as_latex(lines: list[Line]) -> str:
    """Set the lines as LaTeX, ready for a document that loads amsmath."""
    return _joined(
        lines,
        lambda title: f"\\paragraph{{{title}}}",
        lambda equation: f"\\[ {sp.latex(equation)} \\]",
    )


def _equation(left: sp.Expr, right: sp.Expr) -> sp.Eq:
    return sp.Eq(left, right, evaluate=False)


def _joined(
    lines: list[Line], heading: Callable[[str], str], equation: Callable[[sp.Eq], str]
) -> str:
    return "\n".join(
        heading(line.text) if isinstance(line, Heading) else equation(line) for line in lines
    )
