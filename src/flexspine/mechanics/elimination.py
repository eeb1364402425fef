"""Linear systems solved on paper, without pivoting, each intermediate a definition.

A positive definite matrix needs no pivoting. Entries that are zero by structure are skipped, which
leaves what is uncoupled uncoupled; the order of the rows decides how much of that there is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import sympy as sp

Column = tuple[sp.Expr, ...]


def solve(
    matrix: sp.Matrix,
    columns: Sequence[Sequence[sp.Expr]],
    prefix: str = "",
    *,
    symmetric: bool = True,
) -> tuple[dict[sp.Symbol, sp.Expr], list[Column]]:
    """Solve ``matrix x = column`` for every column.

    A ``symmetric`` matrix is worked on below its diagonal only, which halves the work. Returns
    definitions, whose names begin with ``prefix``, in the order in which they may be evaluated,
    and the solutions in terms of them.
    """
    define = _Definitions(prefix)
    labels = [""] if len(columns) == 1 else [f"{which + 1}_" for which in range(len(columns))]
    rest = dict(zip(labels, map(list, columns), strict=True))
    factors = _eliminate(matrix.copy(), rest, define, symmetric)
    solutions = [_substitute(factors, rest[label], label, define) for label in labels]
    return define.found, solutions


class _Definitions:
    """What is defined in the course of it; a symbol or a number needs no definition."""

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix
        self.found: dict[sp.Symbol, sp.Expr] = {}

    def __call__(self, name: str, expression: sp.Expr) -> sp.Expr:
        """Define a name, and return its symbol."""
        if expression.is_Atom:
            return expression
        symbol = sp.Symbol(f"{self.prefix}{name}", real=True)
        self.found[symbol] = expression
        return symbol


class _Factors(NamedTuple):
    """The pivots, and row by row the factor above the diagonal, divided by its pivot."""

    pivots: list[sp.Expr]
    above: list[dict[int, sp.Expr]]


def _eliminate(
    work: sp.Matrix, columns: Mapping[str, list[sp.Expr]], define: _Definitions, symmetric: bool
) -> _Factors:
    """Take row by row off the rows below it, in ``work`` and in all columns, by their labels."""
    n = work.rows
    factors = _Factors([], [])
    for k in range(n):
        pivot = define(f"D_{k + 1}", work[k, k])
        for label, column in columns.items():
            column[k] = define(f"b_{label}{k + 1}", column[k])
        rows = [i for i in range(k + 1, n) if work[i, k] != 0]
        below = {i: define(f"M_{i + 1}_{k + 1}", work[i, k]) for i in rows}
        lower = {i: define(f"L_{i + 1}_{k + 1}", below[i] / pivot) for i in rows}
        across, upper = below, lower
        if not symmetric:
            beside = [j for j in range(k + 1, n) if work[k, j] != 0]
            across = {j: define(f"M_{k + 1}_{j + 1}", work[k, j]) for j in beside}
            upper = {j: define(f"U_{k + 1}_{j + 1}", across[j] / pivot) for j in across}
        factors.pivots.append(pivot)
        factors.above.append(upper)
        for i in rows:
            for column in columns.values():
                column[i] = column[i] - lower[i] * column[k]
            for j in across:
                if j <= i or not symmetric:
                    work[i, j] = work[i, j] - lower[i] * across[j]
    return factors


def _substitute(
    factors: _Factors, column: Sequence[sp.Expr], label: str, define: _Definitions
) -> Column:
    """The solution for one column, from its last entry on."""
    solution: list[sp.Expr] = [sp.S.Zero] * len(column)
    for k in reversed(range(len(column))):
        value = column[k] / factors.pivots[k]
        for i, factor in factors.above[k].items():
            value -= factor * solution[i]
        solution[k] = define(f"a_{label}{k + 1}", value)
    return tuple(solution)
