"""Scalar functions of a point of a hybrid system, with their gradients, compiled."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import heyoka as hy
import numpy as np
import sympy as sp

from flexspine.hybrid.compile import Array, compile_expressions
from flexspine.hybrid.lowering import Lowering
from flexspine.hybrid.system import HybridSystem


class Values(NamedTuple):
    """Values (k,) and their gradients: by states (k, n), held (k, m), parameters (k, p)."""

    values: Array
    by_states: Array
    by_held: Array
    by_parameters: Array


class Functions:
    """Compiled ``expressions`` of the states, held variables and parameters of a system."""

    def __init__(
        self,
        system: HybridSystem,
        definitions: Mapping[sp.Symbol, sp.Expr],
        expressions: tuple[sp.Expr, ...],
    ) -> None:
        symbols = (*system.states, *system.held, *system.parameters)
        variables = [hy.expression(f"z{i}") for i in range(len(symbols))]
        lower = Lowering(dict(zip(symbols, variables, strict=True)), (), definitions, 0)
        lowered = [lower(expression) for expression in expressions]
        gradients = [hy.diff(value, z) for value in lowered for z in variables]
        self._function = compile_expressions([*lowered, *gradients], variables)
        self._shape = (len(expressions), len(symbols))
        n, m = len(system.states), len(system.held)
        self._parts = slice(0, n), slice(n, n + m), slice(n + m, None)

    def __call__(self, states: Array, held: Array, parameters: Array) -> Values:
        """Evaluate at one point."""
        answer = self._function(np.concatenate([states, held, parameters]))
        count, _ = self._shape
        gradient = answer[count:].reshape(self._shape)
        by_states, by_held, by_parameters = (gradient[:, part] for part in self._parts)
        return Values(answer[:count], by_states, by_held, by_parameters)

    def many(self, states: Array, held: Array, parameters: Array) -> Array:
        """The values alone at k points, given and returned in columns, shape (expressions, k)."""
        points = np.concatenate([states, held, parameters])
        # Whole registers only: what is left over would be computed by other instructions.
        wide, count = 8 * hy.recommended_simd_size(), points.shape[1]
        filled = np.arange(count + -count % wide).clip(max=count - 1)
        answer: Array = self._function(points.take(filled, axis=1))
        return answer[: self._shape[0], :count]


@lru_cache(maxsize=64)
def section_quantities(system: HybridSystem) -> Functions:
    """The quantities of the system's section, in their order."""
    section = system.section
    definitions = system.mode(section.mode).definitions if section.mode else {}
    return Functions(system, definitions, tuple(section.quantities.values()))


@lru_cache(maxsize=64)
def balance(system: HybridSystem, mode: str) -> Functions:
    """What vanishes at a symmetric point in ``mode``."""
    if system.reversal is None:
        raise ValueError(f"{system.name} has no reversal")
    parts = tuple(system.reversal.balance[mode].values())
    return Functions(system, system.mode(mode).definitions, parts)
