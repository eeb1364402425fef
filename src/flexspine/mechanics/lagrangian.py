"""Equations of motion of a mechanical system from its energies.

Euler-Lagrange with Rayleigh dissipation and applied forces by virtual work:
``d/dt(dT/dq') - dT/dq = -dV/dq - dR/dq' + sum F . dp/dq``.

Every expression may use *definitions*: symbols that stand for longer expressions, differentiated
through by the chain rule but never expanded. What is computed once on paper (the bend of the
spine, the load on a leg) is then computed once by the machine as well, which is what keeps the
derived field as short as one simplified by hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import sympy as sp

from flexspine.mechanics.elimination import solve

Definitions = Mapping[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class AppliedForce:
    """A force (components in the inertial frame, N) at a point of the system (m).

    A torque (N m) is a force of one component at an angle (rad).
    """

    components: tuple[sp.Expr, ...]
    point: tuple[sp.Expr, ...]


@dataclass(frozen=True)
class Lagrangian:
    """A mechanical system: coordinates ``q``, their rates ``q'``, energies and applied forces.

    ``kinetic``, ``potential`` in J; ``dissipation`` is Rayleigh's function in W, half the power
    lost. ``definitions`` are in the order in which they may be evaluated.
    """

    coordinates: tuple[sp.Symbol, ...]
    rates: tuple[sp.Symbol, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    dissipation: sp.Expr = sp.S.Zero
    forces: tuple[AppliedForce, ...] = ()
    definitions: Definitions = field(default_factory=dict)

    @cached_property
    def mass_matrix(self) -> sp.Matrix:
        """``M(q)``, the Hessian of ``T`` in the rates, shape (n, n)."""
        n = len(self.coordinates)
        return sp.Matrix(
            n, n, lambda i, j: self._d(self._d(self.kinetic, self.rates[i]), self.rates[j])
        )

    @cached_property
    def velocity_forces(self) -> tuple[sp.Expr, ...]:
        """Centrifugal and Coriolis terms ``h`` of ``M q'' + h = Q``, by Christoffel symbols."""
        mass, q, rates = self.mass_matrix, self.coordinates, self.rates
        n = len(q)

        def term(i: int, j: int, k: int) -> sp.Expr:
            christoffel = (
                self._d(mass[i, j], q[k]) + self._d(mass[i, k], q[j]) - self._d(mass[j, k], q[i])
            ) / 2
            return christoffel * rates[j] * rates[k]

        return tuple(sp.Add(*(term(i, j, k) for j in range(n) for k in range(n))) for i in range(n))

    @cached_property
    def generalized_forces(self) -> tuple[sp.Expr, ...]:
        """``Q = -dV/dq - dR/dq' + sum F . dp/dq``."""
        return tuple(
            -self._d(self.potential, q)
            - self._d(self.dissipation, rate)
            + sp.Add(
                *(
                    component * self._d(point, q)
                    for force in self.forces
                    for component, point in zip(force.components, force.point, strict=True)
                )
            )
            for q, rate in zip(self.coordinates, self.rates, strict=True)
        )

    def accelerations(self) -> tuple[dict[sp.Symbol, sp.Expr], tuple[sp.Expr, ...]]:
        """Solve ``M q'' = Q - h`` symbolically.

        Returns further definitions and, in terms of them, one acceleration per coordinate.
        """
        right = [
            force - bias
            for force, bias in zip(self.generalized_forces, self.velocity_forces, strict=True)
        ]
        definitions, (solution,) = solve(self.mass_matrix, [right])
        return definitions, solution

    def _d(self, expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
        return total_derivative(expression, variable, self.definitions)


def time_derivative(system: Lagrangian, expression: sp.Expr) -> sp.Expr:
    """Return the rate of a function of the coordinates, ``sum d/dq . q'``."""
    return sp.Add(
        *(
            total_derivative(expression, q, system.definitions) * rate
            for q, rate in zip(system.coordinates, system.rates, strict=True)
        )
    )


def total_derivative(expression: sp.Expr, variable: sp.Symbol, definitions: Definitions) -> sp.Expr:
    """Differentiate through definitions by the chain rule, without expanding them."""
    result = sp.diff(expression, variable)
    for symbol in expression.free_symbols & definitions.keys():
        inner = total_derivative(definitions[symbol], variable, definitions)
        if inner != 0:
            result += sp.diff(expression, symbol) * inner
    return result
