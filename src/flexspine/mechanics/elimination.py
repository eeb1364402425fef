"""Linear systems solved on paper, without pivoting, each intermediate a definition.

A positive definite matrix needs no pivoting. Entries that are zero by structure are skipped, which
leaves what is uncoupled uncoupled; the order of the rows decides how much of that there is.
"""

from __future__ import annotations

from collections.abc import Sequence

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
    # Row k of the factor above the diagonal, divided by its pivot.
    above: list[dict[int, sp.Expr]] = []
    pivots: list[sp.Expr] = []
    for k in range(n):
        pivots.append(define(f"D_{k + 1}", work[k, k]))
        for which, column in enumerate(rest):
            column[k] = define(f"b_{label(which)}{k + 1}", column[k])
        rows = [i for i in range(k + 1, n) if work[i, k] != 0]
        below = {i: define(f"M_{i + 1}_{k + 1}", work[i, k]) for i in rows}
        factors = {i: define(f"L_{i + 1}_{k + 1}", below[i] / pivots[k]) for i in rows}
        across = below
        if not symmetric:
            beside = [j for j in range(k + 1, n) if work[k, j] != 0]
            across = {j: define(f"M_{k + 1}_{j + 1}", work[k, j]) for j in beside}
        above.append(
            factors
            if symmetric
            else {j: define(f"U_{k + 1}_{j + 1}", across[j] / pivots[k]) for j in across}
        )
        for i in rows:
            for column in rest:
                column[i] = column[i] - factors[i] * column[k]
            for j in across:
                if j <= i or not symmetric:
                    work[i, j] = work[i, j] - factors[i] * across[j]
    solutions = []
    for which, column in enumerate(rest):
        solution: list[sp.Expr] = [sp.S.Zero] * n
        for k in reversed(range(n)):
            value = column[k] / pivots[k]
            for i, factor in above[k].items():
                value -= factor * solution[i]
            solution[k] = define(f"a_{label(which)}{k + 1}", value)
        solutions.append(tuple(solution))
    return definitions, solutions
