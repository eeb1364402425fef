"""Machine code for a hybrid system: one Taylor integrator and one event kernel per mode.

Each mode is compiled when it is first entered, with its own field, so that flight does not pay
for the legs. The event kernel evaluates, at one state, every guard with its rate and what every
jump would lead to: the state after it and the guards of the mode it leads into.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np
import sympy as sp
from numpy.typing import NDArray

from flexspine.errors import InputError
from flexspine.hybrid.cache import mend_cache, open_cache
from flexspine.hybrid.lowering import Lowering
from flexspine.hybrid.system import Arming, Guard, HybridSystem, Mode

Array = NDArray[np.float64]

# LLVM's level of optimization, 0 to 3.
EFFORT_VARIABLE = "FLEXSPINE_OPTIMIZATION"

# Higher levels take up to twice as long and gain nothing here.
EFFORT = 1

# What large systems evaluate now and then only takes longer to optimize than it ever runs.
SELDOM = 0


class Due(NamedTuple):
    """A guard that may fire at the instant at which its mode is entered.

    ``was_active``: in the mode before, too. ``by_level``: armed by level.
    """

    position: int
    name: str
    was_active: bool
    by_level: bool


@dataclass(frozen=True)
class Jump:
    """Where one guard leads, and where the kernel's answer for it stands.

    A guard that does not act is a mere marker, such as a section may use.
    ``value`` and ``rate`` are the guard itself; ``states`` and ``held`` the point after the jump,
    ``guards`` the guards of the target mode there, value and rate in turn, of which ``due`` may
    fire at the same instant. Where a guard that is decided in numbers leads is not known before.
    """

    guard: Guard
    acts: bool
    target: str
    value: int
    rate: int
    states: slice
    held: slice
    guards: slice
    due: tuple[Due, ...]


class CompiledMode:
    """The machine code of one mode.

    ``state`` and ``numbers`` are the integrator's own memory: its state and its parameters, which
    are the held variables and then the coefficients: parameters, or what was folded of them.
    ``endless``: its steps may be of any length.
    ``owner`` is the `flexspine.hybrid.bound.BoundMode` whose coefficients stand there now.
    """

    def __init__(
        self,
        mode: Mode,
        integrator: Any,
        coefficients: Any,
        kernel: Any,
        jumps: tuple[Jump, ...],
        endless: bool,
    ) -> None:
        self.mode = mode
        self.integrator = integrator
        self.coefficients = coefficients
        self.kernel = kernel
        self.jumps = jumps
        self.guards = slice(0, 2 * len(_in_kernel(mode)))
        self.by_name = {jump.guard.name: jump for jump in jumps}
        self.due_here = _due(mode, mode)
        decided = {guard.name for guard in mode.guards if guard.decide is not None}
        self.decided_here = tuple(
            Due(i, guard.name, True, guard.arming is Arming.LEVEL)
            for i, guard in enumerate(_in_kernel(mode))
            if guard.name in decided
        )
        self.n_inputs, self.n_answers = kernel.nparams, kernel.nouts
        self.state: Array = integrator.state
        self.numbers: Array = integrator.pars
        self.owner: object = None
        self.endless = endless


class CompiledSystem:
    """A hybrid system with its modes compiled on demand, for one tolerance."""

    def __init__(self, system: HybridSystem, tolerance: float) -> None:
        self.system = system
        self.tolerance = tolerance
        self.effort = effort()
        self._seldom = SELDOM if system.large else self.effort
        self._modes: dict[str, CompiledMode] = {}
        self._observables: dict[str, Any] = {}
        self._lowerings: dict[str, Lowering] = {}
        self._states = {symbol: hy.make_vars(f"s{i}") for i, symbol in enumerate(system.states)}
        self._variables = list(self._states.values())
        self._held = {symbol: hy.par[i] for i, symbol in enumerate(system.held)}
        first = len(system.held)
        self._raw = {symbol: hy.par[first + i] for i, symbol in enumerate(system.parameters)}
        open_cache()

    def mode(self, name: str) -> CompiledMode:
        """Return the named mode, compiled."""
        if name not in self._modes:
            self._modes[name] = self._compile(self.system.mode(name))
            mend_cache()
        return self._modes[name]

    def observables(self, name: str) -> tuple[tuple[str, ...], Any]:
        """Return the names of a mode's observables and the compiled function of them."""
        if name not in self._observables:
            mode = self.system.mode(name)
            lower = self._plain(mode)
            function = compile_expressions(
                [lower(expr) for expr in mode.observables.values()],
                self._variables,
                compact=self.system.large,
                level=self._seldom,
            )
            self._observables[name] = (tuple(mode.observables), function)
        names, function = self._observables[name]
        return names, function

    def _compile(self, mode: Mode) -> CompiledMode:
        system = self.system
        lower = self._plain(mode) if system.large else self._folding(mode)
        field = [(self._states[s], lower(mode.field[s])) for s in system.states]
        events = [
            hy.t_event(lower(guard.expression), direction=hy.event_direction.negative)
            for guard in mode.guards
        ]
        start = [0.0] * len(system.states)
        integrator = hy.taylor_adaptive(
            field,
            start,
            tol=self.tolerance,
            t_events=events,
            compact_mode=system.large,
            opt_level=self.effort,
        )
        kernel, jumps = self._event_kernel(mode)
        # Folding a large system takes longer than it saves.
        coefficients = _as_they_are if system.large else self.coefficients(lower.coefficients)
        endless = not system.large and _is_polynomial(mode)
        return CompiledMode(mode, integrator, coefficients, kernel, jumps, endless)

    def coefficients(self, expressions: list[sp.Expr]) -> Any:
        """Compile the folded expressions as a function of the parameters."""
        variables = {s: hy.expression(f"p{i}") for i, s in enumerate(self.system.parameters)}
        lower = Lowering(variables, (), {}, 0)
        return compile_expressions([lower(e) for e in expressions], list(variables.values()))

    def _event_kernel(self, mode: Mode) -> tuple[Any, tuple[Jump, ...]]:
        system = self.system
        n, m = len(system.states), len(system.held)
        outputs = self._guards_and_rates(mode, {**self._states, **self._held})
        places = {guard.name: i for i, guard in enumerate(_in_kernel(mode))}
        jumps: list[Jump] = []
        for guard in mode.guards:
            i = places.get(guard.name, 0)
            target = system.mode(guard.target or mode.name)
            at = len(outputs)
            if guard.jumps:
                point, pairs = self.after(mode, guard)
                outputs += [*point, *pairs]
            jumps.append(
                Jump(
                    guard=guard,
                    acts=guard.jumps or guard.ends is not None or guard.decide is not None,
                    target=target.name,
                    value=2 * i,
                    rate=2 * i + 1,
                    states=slice(at, at + n),
                    held=slice(at + n, at + n + m),
                    guards=slice(at + n + m, len(outputs)),
                    due=_due(target, mode),
                )
            )
        kernel = compile_expressions(outputs, self._variables, level=self._seldom)
        return kernel, tuple(jumps)

    def after(self, mode: Mode, guard: Guard) -> tuple[list[Any], list[Any]]:
        """States and held variables after a jump, and the guards of its target there with rates.

        Held variables and then parameters are ``par[...]``, here and in `with_rates`.
        """
        point, target = self._landed(mode, guard)
        return list(point.values()), self._guards_and_rates(target, point)

    def values_after(self, mode: Mode, guard: Guard, tracked: list[int]) -> list[Any]:
        """Some of what the system tracks, by position, right after a jump."""
        point, target = self._landed(mode, guard)
        expressions = [target.observables[self.system.tracked[i]] for i in tracked]
        return self._and_rates(target, expressions, point)[::2]

    def _landed(self, mode: Mode, guard: Guard) -> tuple[dict[sp.Symbol, Any], Mode]:
        """Where a jump leads: states and held variables there, and the mode."""
        lower = self._plain(mode)
        resets = {symbol: lower(value) for symbol, value in guard.resets.items()}
        target = self.system.mode(guard.target or mode.name)
        return {**self._states, **self._held, **resets}, target

    def with_rates(self, mode: Mode, expressions: list[sp.Expr]) -> tuple[list[Any], list[Any]]:
        """Expressions and their rates along a mode's field, in turn, and the states in them."""
        now = {**self._states, **self._held}
        return self._and_rates(mode, expressions, now), self._variables

    def _guards_and_rates(self, mode: Mode, at: Mapping[sp.Symbol, Any]) -> list[Any]:
        return self._and_rates(mode, [guard.expression for guard in _in_kernel(mode)], at)

    def _and_rates(
        self, mode: Mode, expressions: list[sp.Expr], at: Mapping[sp.Symbol, Any]
    ) -> list[Any]:
        """Each expression's value and rate along the field, at these values of the variables."""
        lower = self._plain(mode)
        field = [lower(mode.field[symbol]) for symbol in self._states]
        pairs: list[Any] = []
        for expression in expressions:
            value = lower(expression)
            slope = hy.sum(
                [hy.diff(value, s) * f for s, f in zip(self._variables, field, strict=True)]
            )
            pairs += [value, slope]
        moved = {v: at[s] for s, v in (self._states | self._held).items() if at[s] != v}
        return list(hy.subs(pairs, moved)) if moved else pairs

    def _folding(self, mode: Mode) -> Lowering:
        """A mode's lowering in which what depends on parameters only becomes one number each."""
        variables, first = {**self._states, **self._held}, len(self.system.held)
        return Lowering(variables, self.system.parameters, mode.definitions, first)

    def _plain(self, mode: Mode) -> Lowering:
        """A mode's lowering that folds nothing; kernels are called too seldom to gain from it."""
        if mode.name not in self._lowerings:
            variables = {**self._states, **self._held, **self._raw}
            self._lowerings[mode.name] = Lowering(variables, (), mode.definitions, 0)
        return self._lowerings[mode.name]


def compile_expressions(
    outputs: list[Any], variables: list[Any], *, compact: bool = False, level: int | None = None
) -> Any:
    """Compile expressions; a function of nothing or to nothing gets one zero to work on."""
    return hy.cfunc(
        outputs or [hy.expression(0.0)],
        vars=variables or [hy.expression("unused")],
        compact_mode=compact,
        opt_level=effort() if level is None else level,
    )


def effort() -> int:
    """LLVM's level of optimization: ``$FLEXSPINE_OPTIMIZATION``, or the usual one.

    Raises `InputError` for what is no level.
    """
    asked = os.environ.get(EFFORT_VARIABLE, "")
    if asked not in ("", "0", "1", "2", "3"):
        raise InputError(f"{EFFORT_VARIABLE} = '{asked}' is no level", "set it to 0, 1, 2 or 3")
    return int(asked or EFFORT)


def _is_polynomial(mode: Mode) -> bool:
    """Whether a field is polynomial in the states, so that its series may come to an end."""
    moving = set(mode.field)
    for symbol, expression in mode.definitions.items():
        if expression.free_symbols & moving:
            moving.add(symbol)
    reached = [sp.sympify(rate) for rate in mode.field.values()]
    for expression in reached:
        named = [mode.definitions[s] for s in expression.free_symbols if s in mode.definitions]
        reached += [each for each in named if each not in reached]
    return all(expression.is_polynomial(*moving) for expression in reached)


def _as_they_are(parameters: Array) -> Array:
    return parameters


def _in_kernel(mode: Mode) -> list[Guard]:
    """The guards that the event kernel answers for."""
    return [guard for guard in mode.guards if not guard.costly]


def _due(mode: Mode, before: Mode) -> tuple[Due, ...]:
    active = {guard.name for guard in before.guards}
    return tuple(
        Due(i, guard.name, guard.name in active, guard.arming is Arming.LEVEL)
        for i, guard in enumerate(_in_kernel(mode))
        if guard.jumps or guard.ends
    )


@lru_cache(maxsize=64)
def compile_system(system: HybridSystem, tolerance: float) -> CompiledSystem:
    """Return the compiled form of a system, the same object for the same arguments."""
    return CompiledSystem(system, tolerance)
