"""Machine code for first-order deviations: the flow of a mode and the jump at a guard.

A deviation has a part in every state, held variable and parameter. Along the flow it obeys the
variational equations, derived by the chain rule through a mode's definitions; one SIMD lane
carries one deviation. At a guard ``g`` between fields ``f-`` and ``f+`` with reset ``R`` the
instant moves by ``dt = -dg / (grad g . f-)`` and the state by ``dR(d + f- dt) - f+ dt``, which is
the saltation matrix ``DR + (f+ - DR f-) grad g' / (grad g' f-)`` written for one deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import heyoka as hy
import numpy as np
import sympy as sp
from numpy.typing import NDArray

from flexspine.hybrid.cache import mend_cache
from flexspine.hybrid.compile import CompiledSystem, compile_expressions
from flexspine.hybrid.lowering import Lowering
from flexspine.hybrid.system import Guard, Mode

LANES = hy.recommended_simd_size()

# Nodes; longer equations, of dampers and actuators, take seconds longer to compile into the fastest
# code than into compact one, which thousands of strides would have to make good.
LARGE = 6_000


@dataclass(frozen=True)
class TangentFlow:
    """The variational integrator of one mode.

    Its state is the states and their deviations, shape (2 n, LANES); its numbers are the held
    variables, the deviations of these and of some parameters, and the folded coefficients.
    ``rows`` are where those deviations stand among all.
    """

    integrator: Any
    coefficients: Any
    held: slice
    deviations: slice
    folded: slice
    rows: NDArray[np.int64]


@dataclass(frozen=True)
class TangentJump:
    """What one guard does to deviations.

    ``function`` maps (states, held, deviations of states, held and parameters) to: the rate
    ``grad g . f-`` of the guard, ``dt``, and the states, held and the deviations of both after the
    jump. For a mere marker, with ``target`` None, what follows ``dt`` are the deviations of the
    states as they arrive at the guard, each at its own instant.
    """

    function: Any
    target: str | None


class TangentCode:
    """The deviations of one compiled system, modes and jumps compiled on demand."""

    def __init__(self, compiled: CompiledSystem) -> None:
        self.compiled, self.system = compiled, compiled.system
        system = self.system
        self._tangent = {
            s: sp.Symbol(f"d_{s}", real=True)
            for s in (*system.states, *system.held, *system.parameters)
        }
        self._flows: dict[tuple[str, tuple[int, ...]], TangentFlow] = {}
        self._jumps: dict[tuple[str, str], TangentJump] = {}

    def flow(self, mode: str, moved: tuple[int, ...]) -> TangentFlow:
        """Return the variational integrator of a mode.

        ``moved`` are the positions of the parameters whose deviations may differ from zero.
        """
        key = mode, moved
        if key not in self._flows:
            here = self.system.mode(mode)
            reached = _reached(here)
            relevant = tuple(i for i in moved if self.system.parameters[i] in reached)
            if (mode, relevant) not in self._flows:
                self._flows[mode, relevant] = self._compile_flow(here, relevant)
                mend_cache()
            self._flows[key] = self._flows[mode, relevant]
        return self._flows[key]

    def jump(self, mode: str, guard: str) -> TangentJump:
        """Return the compiled jump of deviations at a guard."""
        if (mode, guard) not in self._jumps:
            here = self.system.mode(mode)
            found = next(g for g in here.guards if g.name == guard)
            self._jumps[mode, guard] = self._compile_jump(here, found)
            mend_cache()
        return self._jumps[mode, guard]

    def _compile_flow(self, mode: Mode, moved: tuple[int, ...]) -> TangentFlow:
        system = self.system
        n, m = len(system.states), len(system.held)
        moving = (*system.states, *system.held, *(system.parameters[i] for i in moved))
        chain = Chain({s: self._tangent[s] for s in moving}, mode.definitions)
        states = hy.make_vars(*(f"s{i}" for i in range(n)))
        deviations = hy.make_vars(*(f"d{i}" for i in range(n)))
        numbers = [hy.par[i] for i in range(2 * m + len(moved))]
        known = dict(zip((*system.states, *system.held), (*states, *numbers[:m]), strict=True))
        tangents = (self._tangent[s] for s in moving)
        known |= dict(zip(tangents, (*deviations, *numbers[m:]), strict=True))
        lower = Lowering(known, system.parameters, chain.definitions, len(numbers))
        rates = [lower(mode.field[s]) for s in system.states]
        changes = [lower(chain(mode.field[s])) for s in system.states]
        field = list(zip((*states, *deviations), (*rates, *changes), strict=True))
        integrator = hy.taylor_adaptive_batch(
            field,
            np.zeros((2 * n, LANES)),
            tol=self.compiled.tolerance,
            compact_mode=sum(len(rate) for _, rate in field) > LARGE,
            opt_level=self.compiled.effort,
        )
        # Code that needs few numbers may not reach as far as all held variables.
        reach = len(integrator.pars)
        rows = np.array([*range(n, n + m), *(n + m + i for i in moved)], dtype=np.int64)
        rows = rows[: max(reach - m, 0)]
        return TangentFlow(
            integrator,
            self.compiled.coefficients(lower.coefficients),
            held=slice(0, min(m, reach)),
            deviations=slice(m, m + len(rows)),
            folded=slice(len(numbers), reach),
            rows=rows,
        )

    def _compile_jump(self, mode: Mode, guard: Guard) -> TangentJump:
        system = self.system
        moving = (*system.states, *system.held, *system.parameters)
        variables = [hy.expression(f"z{i}") for i in range(len(system.states) + len(system.held))]
        deviations = [hy.expression(f"d{i}") for i in range(len(moving))]
        now = dict(zip((*system.states, *system.held), variables, strict=True))
        raw = {p: hy.par[i] for i, p in enumerate(system.parameters)}
        chain = Chain(self._tangent, mode.definitions)

        def lowered(by: Iterable[Any]) -> Lowering:
            tangents = dict(zip((self._tangent[s] for s in moving), by, strict=True))
            return Lowering({**now, **raw, **tangents}, (), chain.definitions, 0)

        nothing = hy.expression(0.0)
        as_given = lowered(deviations)
        field = [as_given(mode.field[s]) for s in system.states]
        still = [nothing] * (len(moving) - len(field))
        rate = lowered([*field, *still])(chain(guard.expression))
        shift = -as_given(chain(guard.expression)) / rate
        arriving = [d + f * shift for d, f in zip(deviations, field, strict=False)]
        if not guard.jumps:
            marker = compile_expressions([rate, shift, *arriving], [*variables, *deviations])
            return TangentJump(marker, None)
        at_guard = lowered([*arriving, *deviations[len(field) :]])
        after, change = dict(now), {}
        for symbol in (*system.states, *system.held):
            new = sp.sympify(guard.resets.get(symbol, symbol))
            after[symbol], change[symbol] = as_given(new), at_guard(chain(new))
        target = system.mode(guard.target or mode.name)
        leaving = Lowering({**after, **raw}, (), target.definitions, 0)
        for symbol in system.states:
            change[symbol] = change[symbol] - leaving(target.field[symbol]) * shift
        outputs = [rate, shift, *after.values(), *change.values()]
        return TangentJump(compile_expressions(outputs, [*variables, *deviations]), target.name)


class Chain:
    """First-order change of expressions, through shared definitions.

    ``tangents`` maps symbols to those of their deviations. ``definitions`` are the given ones,
    each followed by its change where that is not zero.
    """

    def __init__(
        self, tangents: Mapping[sp.Symbol, sp.Symbol], definitions: Mapping[sp.Symbol, sp.Expr]
    ) -> None:
        self._tangents = dict(tangents)
        self.definitions: dict[sp.Symbol, sp.Expr] = {}
        for symbol, expression in definitions.items():
            self.definitions[symbol] = expression
            change = self(expression)
            if change != 0:
                tangent = sp.Symbol(f"d_{symbol}", real=True)
                self._tangents[symbol] = tangent
                self.definitions[tangent] = change

    def __call__(self, expression: sp.Expr) -> sp.Expr:
        """Return the change of an expression."""
        expression = sp.sympify(expression)
        moved = sorted(expression.free_symbols & self._tangents.keys(), key=str)
        return sp.Add(*(sp.diff(expression, s) * self._tangents[s] for s in moved))


def _reached(mode: Mode) -> set[sp.Symbol]:
    """Every symbol on which the mode's field depends, through its definitions."""
    reached: set[sp.Symbol] = set()
    pending = {s for rate in mode.field.values() for s in sp.sympify(rate).free_symbols}
    while pending:
        symbol = pending.pop()
        reached.add(symbol)
        definition = mode.definitions.get(symbol)
        if definition is not None:
            pending |= sp.sympify(definition).free_symbols - reached
    return reached


@lru_cache(maxsize=64)
def compile_tangents(compiled: CompiledSystem) -> TangentCode:
    """Return the code for deviations, the same object for the same argument."""
    return TangentCode(compiled)
