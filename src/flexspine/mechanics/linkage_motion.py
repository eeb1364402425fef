"""The motion of a planar linkage in symbols: accelerations, and forces on feet that stay put.

States are the absolute angles of all links and the base, with their rates. Only pairs of links on
one way to the base are coupled; eliminated from the ends of the tree inwards, nothing else becomes
so, which keeps the equations short. All numbers of the robot are symbols, so that what is compiled
serves every robot of the same build.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import sympy as sp

from flexspine.mechanics.elimination import solve_symmetric
from flexspine.mechanics.linkage import Linkage

Point = tuple[sp.Expr, sp.Expr]


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


@dataclass(frozen=True)
class LinkageMotion:
    """A linkage in symbols.

    ``coordinates`` are angles by link and then the base's ``x`` and ``y``; ``rates`` theirs.
    ``values`` gives every other symbol's value for the linkage it was made of.
    """

    linkage: Linkage
    values: dict[sp.Symbol, float] = field(default_factory=dict)

    @cached_property
    def coordinates(self) -> tuple[sp.Symbol, ...]:
        """Absolute angles by link, x, y."""
        return (*(_symbol(f"angle_{link.name}") for link in self.linkage.links), *self._base("x y"))

    @cached_property
    def rates(self) -> tuple[sp.Symbol, ...]:
        """Their rates."""
        return tuple(_symbol(f"{symbol.name}_rate") for symbol in self.coordinates)

    @cached_property
    def definitions(self) -> dict[sp.Symbol, sp.Expr]:
        """Sines, cosines and squares of rates, shared by all that follows."""
        found: dict[sp.Symbol, sp.Expr] = {}
        for link, angle, rate in zip(
            self.linkage.links, self.coordinates, self.rates, strict=False
        ):
            found[_symbol(f"sin_{link.name}")] = sp.sin(angle)
            found[_symbol(f"cos_{link.name}")] = sp.cos(angle)
            found[_symbol(f"square_{link.name}")] = rate**2
        return found

    def parameter(self, name: str, value: float) -> sp.Expr:
        """A number of the robot as a symbol; zero stays zero, as that is a matter of build."""
        if value == 0:
            return sp.S.Zero
        symbol = _symbol(name)
        self.values[symbol] = float(value)
        return symbol

    def mass_matrix(self) -> sp.Matrix:
        """Of the accelerations of `coordinates`, shape (N, N)."""
        links, n = self.linkage.links, len(self.linkage.links)
        matrix = sp.zeros(n + 2, n + 2)
        for j in range(n):
            for k in range(j + 1):
                inertia = self._inertia(j, k)
                matrix[j, k] = matrix[k, j] = inertia * (1 if j == k else self._turn(j, k)[0])
            moment = self.parameter(f"moment_{links[j].name}", self.linkage.moments[j])
            sine, cosine, _ = self._of(j)
            matrix[j, n] = matrix[n, j] = -moment * sine
            matrix[j, n + 1] = matrix[n + 1, j] = moment * cosine
        matrix[n, n] = matrix[n + 1, n + 1] = self.parameter("mass", self.linkage.mass)
        return matrix

    def forces(self, torques: Mapping[str, sp.Expr]) -> list[sp.Expr]:
        """All but inertia: of motion, weight, springs, dampers and motors by joint, shape (N,)."""
        links, n = self.linkage.links, len(self.linkage.links)
        gravity = self.parameter("gravity", self.linkage.gravity)
        found: list[sp.Expr] = [sp.S.Zero] * (n + 2)
        for j in range(n):
            _, cosine, _ = self._of(j)
            moment = self.parameter(f"moment_{links[j].name}", self.linkage.moments[j])
            found[j] -= gravity * moment * cosine
            for k in range(n):
                if j != k:
                    found[j] -= self._inertia(j, k) * self._turn(j, k)[1] * self._of(k)[2]
            sine, cosine, square = self._of(j)
            found[n] += moment * cosine * square
            found[n + 1] += moment * sine * square
        found[n + 1] -= gravity * self.parameter("mass", self.linkage.mass)
        for joint in self.linkage.joints:
            k, p = self._sides(joint.link)
            bend = self.coordinates[k] - self.coordinates[p]
            rate = self.rates[k] - self.rates[p]
            torque = torques.get(joint.name, sp.S.Zero)
            if joint.stiffness:
                rest = self.parameter(f"{joint.name}_rest", joint.rest)
                torque -= self.parameter(f"{joint.name}_stiffness", joint.stiffness) * (bend - rest)
            torque -= self.parameter(f"{joint.name}_damping", joint.damping) * rate
            found[k] += torque
            found[p] -= torque
        return found

    def foot(self, name: str) -> Point:
        """Where a foot is."""
        arms = self._arms(name)
        x, y = self.coordinates[-2:]
        return (
            x + sum((arm * self._of(j)[1] for j, arm in arms.items()), sp.S.Zero),
            y + sum((arm * self._of(j)[0] for j, arm in arms.items()), sp.S.Zero),
        )

    def foot_rows(self, feet: Sequence[str]) -> tuple[sp.Matrix, list[sp.Expr]]:
        """``J`` of some feet and ``J' q'``, x and y in turn."""
        n = len(self.linkage.links)
        rows, bias = sp.zeros(2 * len(feet), n + 2), []
        for number, name in enumerate(feet):
            x, y = 2 * number, 2 * number + 1
            rows[x, n] = rows[y, n + 1] = sp.S.One
            pull = [sp.S.Zero, sp.S.Zero]
            for j, arm in self._arms(name).items():
                sine, cosine, square = self._of(j)
                rows[x, j], rows[y, j] = -arm * sine, arm * cosine
                pull = [pull[0] - arm * cosine * square, pull[1] - arm * sine * square]
            bias += pull
        return rows, bias

    def stance(
        self, feet: Sequence[str], torques: Mapping[str, sp.Expr]
    ) -> tuple[dict[sp.Symbol, sp.Expr], list[sp.Expr], list[sp.Expr]]:
        """Move with some feet that stay where they are.

        Returns definitions in order, accelerations of `coordinates` and the forces on the feet, x
        and y in turn.
        """
        rows, bias = self.foot_rows(feet)
        order = list(range(len(self.coordinates)))[::-1]
        order = [*order[2:], *sorted(order[:2])]  # from the ends of the tree to the base
        matrix = self.mass_matrix().extract(order, order)
        free = self.forces(torques)
        columns = [[free[i] for i in order]]
        columns += [[rows[r, i] for i in order] for r in range(rows.rows)]
        definitions, solved = solve_symmetric(matrix, columns, "whole_")
        back = [order.index(i) for i in range(len(order))]
        alone, *spread = ([column[i] for i in back] for column in solved)
        if not feet:
            return {**self.definitions, **definitions}, alone, []
        count = rows.rows
        response = sp.Matrix(
            count, count, lambda i, j: sum(rows[i, c] * spread[j][c] for c in range(len(order)))
        )
        needed = [
            -bias[i] - sum(rows[i, c] * alone[c] for c in range(len(order))) for i in range(count)
        ]
        more, (forces,) = solve_symmetric(response, [needed], "feet_")
        accelerations = [
            alone[c] + sum(spread[r][c] * forces[r] for r in range(count))
            for c in range(len(order))
        ]
        return {**self.definitions, **definitions, **more}, accelerations, list(forces)

    def _base(self, names: str) -> tuple[sp.Symbol, ...]:
        return tuple(_symbol(name) for name in names.split())

    def _of(self, number: int) -> tuple[sp.Symbol, sp.Symbol, sp.Symbol]:
        """Sine, cosine and squared rate of a link."""
        name = self.linkage.links[number].name
        return _symbol(f"sin_{name}"), _symbol(f"cos_{name}"), _symbol(f"square_{name}")

    def _turn(self, j: int, k: int) -> tuple[sp.Expr, sp.Expr]:
        """Cosine and sine of the angle from one link to another."""
        (s, c, _), (t, d, _) = self._of(j), self._of(k)
        return c * d + s * t, s * d - c * t

    def _inertia(self, j: int, k: int) -> sp.Expr:
        low, high = sorted((j, k))
        links = self.linkage.links
        return self.parameter(
            f"inertia_{links[low].name}_{links[high].name}", self.linkage.inertias[j, k]
        )

    def _arms(self, foot: str) -> dict[int, sp.Expr]:
        found = self.linkage.foot_arms(foot)
        links = self.linkage.links
        named = {j: self.parameter(f"{foot}_arm_{links[j].name}", a) for j, a in enumerate(found)}
        return {j: arm for j, arm in named.items() if arm != 0}

    def _sides(self, link: str) -> tuple[int, int]:
        """Positions of a link and of its parent."""
        number = self.linkage.place[link]
        parent = self.linkage.links[number].parent
        assert parent is not None
        return number, self.linkage.place[parent]
