"""SymPy expressions to heyoka expressions.

What depends on parameters only is folded: it leaves the expression and comes back as one number,
computed once per run. Definitions become shared subexpressions.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import heyoka as hy
import sympy as sp

from flexspine.errors import InputError


class Lowering:
    """Translate the expressions of one mode. Letters that it does not know raise `InputError`.

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
        # Those that nothing has asked for yet; many never are.
        self._waiting = dict(definitions)

    @property
    def coefficients(self) -> list[sp.Expr]:
        """The folded expressions, in terms of parameters."""
        return list(self._index)

    def __call__(self, expression: sp.Expr) -> Any:
        """Lower one expression."""
        whole = sp.sympify(expression)
        self._define(whole)
        return self._lower(whole)

    def _define(self, expression: sp.Expr) -> None:
        """Lower the definitions that an expression needs and that wait."""
        needed = set(_symbols(expression)) & self._waiting.keys()
        if not needed:
            return
        for symbol in reversed(self._waiting):
            if symbol in needed:
                needed |= _symbols(self._waiting[symbol]) & self._waiting.keys()
        for symbol in [each for each in self._waiting if each in needed]:
            meant = self._waiting.pop(symbol)
            if self._is_constant(meant):
                self._constant[symbol] = meant.xreplace(self._constant)
            else:
                self._known[symbol] = self._lower(meant)

    def _lower(self, expression: sp.Expr) -> Any:
        placeholders: dict[sp.Symbol, Any] = {}
        folded = self._fold(expression, placeholders)
        used = {symbol: self._known[symbol] for symbol in _symbols(folded) & self._known.keys()}
        for symbol in _symbols(folded) - used.keys() - placeholders.keys():
            raise InputError(
                f"the equations use '{symbol}', which is no state, no parameter and not defined",
                "add it to the parameters or to the definitions",
            )
        return hy.from_sympy(folded, {**used, **placeholders})

    def _is_constant(self, expression: sp.Expr) -> bool:
        symbols = _symbols(expression)
        return bool(symbols) and symbols <= self._constant.keys()

    def _fold(self, expression: sp.Expr, placeholders: dict[sp.Symbol, Any]) -> sp.Expr:
        if expression.is_Number or not _symbols(expression) & self._constant.keys():
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


@lru_cache(maxsize=1 << 16)
def _symbols(expression: sp.Expr) -> frozenset[sp.Symbol]:
    """The symbols of an expression; SymPy looks for them anew every time."""
    return frozenset(expression.free_symbols)
