"""Linear systems solved on paper, against the same solved in numbers."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flexspine.mechanics.elimination import solve


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("size", [1, 2, 5])
def test_what_is_found_solves_the_system(size: int, symmetric: bool) -> None:
    rng = np.random.default_rng(size)
    numbers = rng.normal(size=(size, size))
    numbers = numbers @ numbers.T + np.eye(size) if symmetric else numbers + 4 * np.eye(size)
    if size > 2:
        numbers[0, 2] = numbers[2, 0] = 0.0  # left out of the elimination
    right = rng.normal(size=(2, size))
    matrix = sp.Matrix(
        size, size,
        lambda i, j: sp.Symbol(f"m_{max(i, j)}_{min(i, j)}" if symmetric else f"m_{i}_{j}")
        if numbers[i, j] else 0,
    )  # fmt: skip
    known = {matrix[i, j]: numbers[i, j] for i in range(size) for j in range(size)}
    columns = [[sp.Float(value, 17) for value in column] for column in right]
    definitions, solutions = solve(matrix, columns, "p_", symmetric=symmetric)
    for symbol, expression in definitions.items():
        known[symbol] = expression.subs(known)
    for column, solution in zip(right, solutions, strict=True):
        found = [float(part.subs(known)) for part in solution]
        assert found == pytest.approx(np.linalg.solve(numbers, column), rel=1e-12)


def test_what_is_uncoupled_stays_so() -> None:
    """An arrow that points to its last row fills nothing."""
    a, b, c, d, e = sp.symbols("a b c d e")
    matrix = sp.Matrix([[a, 0, d], [0, b, e], [d, e, c]])
    definitions, _ = solve(matrix, [[sp.S.One] * 3])
    assert sp.Symbol("M_2_1", real=True) not in definitions
    assert sp.Symbol("L_3_1", real=True) in definitions
