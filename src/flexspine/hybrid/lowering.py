"""SymPy expressions to heyoka expressions.

What depends on parameters only is folded: it leaves the expression and comes back as one number,
computed once per run. Definitions become shared subexpressions.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import heyoka as hy
import sympy as sp


class Lowering:
    """Translate the expressions of one mode.

    ``variables`` maps the symbols that change in time (states, held variables) to heyoka
    expressions; ``parameters`` are the symbols to fold. Folded values take ``par[first], ...``;
    ``coefficients`` are their expressions, in that order.
    """

    def __init__(
        self,
        variables: Mapping[sp.Symbol, Any],
        parameters: tuple[sp.Symbol, ...],
        definitions: Mapping[sp.Symbol, sp.Expr],
        first: int,
    ) -> None:
        self._known: dict[sp.Symbol, Any] = dict(variables)
        self._constant: dict[sp.Symbol, sp.Expr] = {symbol: symbol for symbol in parameters}
        self._first = first
        self._index: dict[sp.Expr, int] = {}
        for symbol, expression in definitions.items():
            if self._is_constant(expression):
                self._constant[symbol] = expression.xreplace(self._constant)
            else:
                self._known[symbol] = self(expression)

    @property
    def coefficients(self) -> list[sp.Expr]:
        """The folded expressions, in terms of parameters."""
        return list(self._index)

    def __call__(self, expression: sp.Expr) -> Any:
        """Lower one expression."""
        placeholders: dict[sp.Symbol, Any] = {}
        folded = self._fold(sp.sympify(expression), placeholders)
        return hy.from_sympy(folded, {**self._known, **placeholders})

    def _is_constant(self, expression: sp.Expr) -> bool:
        return bool(expression.free_symbols) and expression.free_symbols <= self._constant.keys()

    def _fold(self, expression: sp.Expr, placeholders: dict[sp.Symbol, Any]) -> sp.Expr:
        if expression.is_Number:
            return expression
        if self._is_constant(expression):
            full = expression.xreplace(self._constant)
            index = self._index.setdefault(full, len(self._index))
            symbol = sp.Symbol(f"_coefficient_{index}")
            placeholders[symbol] = hy.par[self._first + index]
            return symbol
        if expression.is_Add or expression.is_Mul:
            constant = [arg for arg in expression.args if self._is_constant(arg)]
            numbers = [arg for arg in expression.args if arg.is_Number]
            rest = [arg for arg in expression.args if arg not in constant and arg not in numbers]
            parts = [self._fold(arg, placeholders) for arg in rest]
            if constant:
                parts.append(self._fold(expression.func(*numbers, *constant), placeholders))
            else:
                parts += numbers
            return expression.func(*parts)
        if expression.args:
            return expression.func(*(self._fold(arg, placeholders) for arg in expression.args))
        return expression
