"""Linear systems solved on paper: ``L D L^T`` without pivoting, each intermediate a definition.

A positive definite matrix needs no pivoting. Entries that are zero by structure are skipped, which
leaves what is uncoupled uncoupled; the order of the rows decides how much of that there is.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

Column = tuple[sp.Expr, ...]


def solve_symmetric(
    matrix: sp.Matrix, columns: Sequence[Sequence[sp.Expr]], prefix: str = ""
) -> tuple[dict[sp.Symbol, sp.Expr], list[Column]]:
    """Solve ``matrix x = column`` for every column.

    Returns definitions, whose names begin with ``prefix``, in the order in which they may be
    evaluated, and the solutions in terms of them.
    """
    n = matrix.rows
    definitions: dict[sp.Symbol, sp.Expr] = {}

    def define(name: str, expression: sp.Expr) -> sp.Expr:
        if expression.is_Atom:
            return expression
        symbol = sp.Symbol(f"{prefix}{name}", real=True)
        definitions[symbol] = expression
        return symbol

    def label(which: int) -> str:
        return "" if len(columns) == 1 else f"{which + 1}_"

    work = matrix.copy()
    rest = [list(column) for column in columns]
    factors: dict[tuple[int, int], sp.Expr] = {}
    pivots: list[sp.Expr] = []
    for k in range(n):
        pivots.append(define(f"D_{k + 1}", work[k, k]))
        for which, column in enumerate(rest):
            column[k] = define(f"b_{label(which)}{k + 1}", column[k])
        rows = [i for i in range(k + 1, n) if work[i, k] != 0]
        below = {i: define(f"M_{i + 1}_{k + 1}", work[i, k]) for i in rows}
        for i in rows:
            factors[i, k] = define(f"L_{i + 1}_{k + 1}", below[i] / pivots[k])
            for column in rest:
                column[i] = column[i] - factors[i, k] * column[k]
            for j in rows:
                if j <= i:
                    work[i, j] = work[i, j] - factors[i, k] * below[j]
    solutions = []
    for which, column in enumerate(rest):
        solution: list[sp.Expr] = [sp.S.Zero] * n
        for k in reversed(range(n)):
            value = column[k] / pivots[k]
            for i in range(k + 1, n):
                if (i, k) in factors:
                    value -= factors[i, k] * solution[i]
            solution[k] = define(f"a_{label(which)}{k + 1}", value)
        solutions.append(tuple(solution))
    return definitions, solutions
