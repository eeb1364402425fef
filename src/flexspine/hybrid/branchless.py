"""Expressions without branches, so that lanes stay together, and the polynomials of their steps."""

from __future__ import annotations

from typing import Any

import heyoka as hy

# Newton's iterations on a cubic; what it finds is a first guess only.
GUESSES = 4


def negated(condition: Any) -> Any:
    """1 where a condition (1 or 0) does not hold, 0 where it does."""
    return 1.0 - condition


def larger(one: Any, other: Any) -> Any:
    """The larger of two values."""
    return hy.select(hy.gt(one, other), one, other)


def cubic_root(g0: Any, r0: Any, g1: Any, r1: Any) -> Any:
    """Where a guard that falls below zero does so, as a share of the step, roughly.

    Newton's iteration on the cubic through values and rates at both ends, from the right end,
    where it is below zero for sure.
    """
    square, cube = 3.0 * (g1 - g0) - 2.0 * r0 - r1, 2.0 * (g0 - g1) + r0 + r1
    share = hy.expression(1.0)
    for _ in range(GUESSES):
        value = g0 + share * (r0 + share * (square + share * cube))
        slope = r0 + share * (2.0 * square + 3.0 * share * cube)
        share = share - value / slope
        share = hy.select(hy.gt(share, 0.0), share, hy.expression(0.0))
        share = hy.select(hy.lt(share, 1.0), share, hy.expression(1.0))
    return share


def horner(series: list[list[Any]], time: Any) -> list[Any]:
    """The values of Taylor series at a time."""
    values = []
    for coefficients in series:
        value = coefficients[-1]
        for coefficient in reversed(coefficients[:-1]):
            value = value * time + coefficient
        values.append(value)
    return values
