"""What a hybrid system is: modes with their own field, guards between them, resets, a section.

Expressions are SymPy; `flexspine.hybrid.compile` turns them into machine code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as default
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING

import sympy as sp

from flexspine.hybrid.outcome import Outcome, OutcomeKind

if TYPE_CHECKING:
    from flexspine.hybrid.bound import BoundSystem
    from flexspine.hybrid.trajectory import HybridState

# From where a guard fired to where the run goes on, or how it ends; None: nothing happens.
Decision = Callable[["BoundSystem", "HybridState"], "HybridState | Outcome | None"]


class Arming(Enum):
    """When a guard may fire."""

    CROSSING = "crossing"
    """By falling through zero. A guard that is below zero waits until it has been above."""

    LEVEL = "level"
    """As CROSSING, and at once when its mode is entered with the guard below zero."""


@dataclass(frozen=True)
class Guard:
    """An event: it happens when ``expression`` falls through zero.

    ``target`` is the next mode (None: the same), ``resets`` the new values of states and held
    variables (those not named stay), ``ends`` the outcome if the event ends the run. Instead of
    these, ``decide`` may compute in numbers what happens. Such a guard may be ``costly``, its rate
    worth more than it is to know: then it is not looked for at the instant of another one.
    ``timed`` guards are clocks: however often they fire, and however slowly they are crossed,
    nothing is wrong. What happens at ``quiet`` ones is bookkeeping, no event to tell of.
    """

    name: str
    expression: sp.Expr
    target: str | None = None
    resets: Mapping[sp.Symbol, sp.Expr] = default(default_factory=dict)
    arming: Arming = Arming.CROSSING
    ends: OutcomeKind | None = None
    decide: Decision | None = None
    costly: bool = False
    timed: bool = False
    quiet: bool = False

    @property
    def jumps(self) -> bool:
        """Whether the guard changes the mode or any value, by expressions."""
        return self.target is not None or bool(self.resets)


@dataclass(frozen=True)
class Mode:
    """One continuous regime: the field and the guards that are active in it.

    ``definitions`` are shared subexpressions in order of evaluation, ``field`` gives the rate of
    every state, ``observables`` further quantities to report.
    """

    name: str
    definitions: Mapping[sp.Symbol, sp.Expr]
    field: Mapping[sp.Symbol, sp.Expr]
    guards: tuple[Guard, ...]
    observables: Mapping[str, sp.Expr] = default(default_factory=dict)


@dataclass(frozen=True)
class Section:
    """A Poincare section: the firing of one of ``guards`` while ``requires`` holds.

    ``requires`` are values of held variables, ``resets`` is applied on the section,
    ``coordinates`` name the states that identify a point of it, ``missed`` is the outcome of a
    run that never comes back to it. ``quantities`` are further functions of a point of it, such
    as its energy, in the definitions of ``mode``; ``conserved`` names those of them that no orbit
    changes. ``act`` is what a controller does on the section, after the resets.
    """

    guards: tuple[str, ...]
    requires: Mapping[sp.Symbol, float]
    resets: Mapping[sp.Symbol, float]
    coordinates: Mapping[str, sp.Symbol]
    missed: OutcomeKind
    mode: str = ""
    quantities: Mapping[str, sp.Expr] = default(default_factory=dict)
    conserved: tuple[str, ...] = ()
    act: Decision | None = None


@dataclass(frozen=True)
class Reversal:
    """A time-reversal symmetry, by the points that it leaves where they are.

    An orbit that meets two such points is periodic and its own mirror image; they are half a
    period apart. ``coordinates`` span those of the main section: by name, the states that move
    together and their signs. The next one is on ``middle``; there, ``balance`` vanishes, given by
    mode, each part under the name of a coordinate or parameter that has its unit.
    """

    coordinates: Mapping[str, Mapping[sp.Symbol, int]]
    middle: Section
    balance: Mapping[str, Mapping[str, sp.Expr]]


@dataclass(frozen=True, eq=False)
class HybridSystem:
    """A hybrid system.

    ``states`` flow, ``held`` variables change only at events, ``parameters`` not at all during a
    run. ``mode`` builds the named mode when it is first needed. ``tracked`` names observables
    whose largest values are worth keeping of a run of which nothing else is kept. ``large``
    systems, of a thousand terms and more, are compiled as functions that call each other, which
    takes seconds instead of minutes. One guard firing again and again within ``chatter_window``
    seconds is chatter.
    """

    name: str
    states: tuple[sp.Symbol, ...]
    held: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    modes: tuple[str, ...]
    mode: Callable[[str], Mode]
    section: Section
    reversal: Reversal | None = None
    tracked: tuple[str, ...] = ()
    large: bool = False
    chatter_window: float = 1e-2  # s; no gait comes near it

    @cached_property
    def places(self) -> dict[sp.Symbol, int]:
        """Where each symbol stands among the states, the held variables or the parameters."""
        groups = (self.states, self.held, self.parameters)
        return {symbol: i for group in groups for i, symbol in enumerate(group)}
