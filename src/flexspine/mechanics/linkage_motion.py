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

from flexspine.mechanics.elimination import solve
from flexspine.mechanics.linkage import Linkage

Point = tuple[sp.Expr, sp.Expr]

# 1/s; how fast rounding errors of a foot's place die away. Where there are none it does nothing.
SETTLING = 30


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


@dataclass(frozen=True)
class Standing:
    """A foot on the ground that keeps to its ``anchor``."""

    name: str
    anchor: Point


@dataclass(frozen=True)
class MaybeStanding(Standing):
    """A foot of which flags tell what it does, so that one field serves for all that it may do.

    ``stands`` is 1 on the ground and 0 in the air, ``slides`` 1 if it slides forward, -1 back, 0
    if it does not.
    """

    stands: sp.Symbol
    slides: sp.Symbol

    @property
    def sticks(self) -> sp.Expr:
        """1 if it stands and does not slide, 0 otherwise."""
        return self.stands * (1 - self.slides**2)


@dataclass(frozen=True)
class LinkageMotion:
    """A linkage in symbols.

    ``coordinates`` are angles by link and then the base's ``x`` and ``y``; ``rates`` theirs.
    ``values`` gives every other symbol's value for the linkage it was made of, and for its
    ``friction`` on the ground.
    """

    linkage: Linkage
    friction: float = 0.0
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
            bend, rate = self.bend(joint.name), self.bend_rate(joint.name)
            torque = torques.get(joint.name, sp.S.Zero)
            if joint.stiffness:
                rest = self.parameter(f"{joint.name}_rest", joint.rest)
                torque -= self.parameter(f"{joint.name}_stiffness", joint.stiffness) * (bend - rest)
            torque -= self.parameter(f"{joint.name}_damping", joint.damping) * rate
            found[k] += torque
            found[p] -= torque
        return found

    def bend(self, joint: str) -> sp.Expr:
        """The relative angle of a joint."""
        child, parent = self._at(joint)
        return self.coordinates[child] - self.coordinates[parent]

    def bend_rate(self, joint: str) -> sp.Expr:
        """How fast a joint bends."""
        child, parent = self._at(joint)
        return self.rates[child] - self.rates[parent]

    def damper_power(self) -> sp.Expr:
        """What the dampers of all joints take up."""
        return sp.Add(
            *(
                self.parameter(f"{joint.name}_damping", joint.damping)
                * self.bend_rate(joint.name) ** 2
                for joint in self.linkage.joints
            )
        )

    def foot(self, name: str) -> Point:
        """Where a foot is."""
        return self._place(self._arms(name))

    def point(self, name: str, link: str, distance: float) -> Point:
        """Where a point of a link is, at a distance from its start, under a name of its own."""
        links = self.linkage.links
        arms = self.linkage.arms(link, distance)
        named = {j: self.parameter(f"{name}_arm_{links[j].name}", a) for j, a in enumerate(arms)}
        return self._place({j: arm for j, arm in named.items() if arm != 0})

    def _place(self, arms: Mapping[int, sp.Expr]) -> Point:
        x, y = self.coordinates[-2:]
        return (
            sp.Add(x, *(arm * self._of(j)[1] for j, arm in arms.items())),
            sp.Add(y, *(arm * self._of(j)[0] for j, arm in arms.items())),
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

    def foot_velocity(self, name: str) -> Point:
        """How fast a foot moves."""
        rows, _ = self.foot_rows([name])
        x, y = rows * sp.Matrix(self.rates)
        return x, y

    def stance(
        self, feet: Sequence[Standing], torques: Mapping[str, sp.Expr]
    ) -> tuple[dict[sp.Symbol, sp.Expr], list[sp.Expr], dict[str, Point]]:
        """Move with some feet on the ground.

        Returns definitions in order, accelerations of `coordinates` and the forces on the feet.
        """
        rows, bias = self.foot_rows([foot.name for foot in feet])
        count = rows.rows
        order = list(range(len(self.coordinates)))[::-1]
        order = [*order[2:], *sorted(order[:2])]  # from the ends of the tree to the base
        matrix = self.mass_matrix().extract(order, order)
        free = self.forces(torques)
        columns = [[row[i] for i in order] for row in (free, *rows.tolist())]
        definitions, solved = solve(matrix, columns, "whole_")
        back = [order.index(i) for i in range(len(order))]
        alone, *spread = ([column[i] for i in back] for column in solved)
        if not feet:
            return {**self.definitions, **definitions}, alone, {}
        response = sp.Matrix(count, count, lambda i, j: dot(rows.row(i), spread[j]))
        settling = [part for foot in feet for part in self.settling(foot)]
        missing = [settling[i] - bias[i] - dot(rows.row(i), alone) for i in range(count)]
        flagged = any(isinstance(foot, MaybeStanding) for foot in feet)
        if flagged:
            response, missing = self._flagged(feet, response, missing)
        more, (forces,) = solve(response, [missing], "feet_", symmetric=not flagged)
        accelerations = [
            sp.Add(alone[c], *(spread[r][c] * forces[r] for r in range(count)))
            for c in range(len(order))
        ]
        by_foot = {foot.name: (forces[2 * i], forces[2 * i + 1]) for i, foot in enumerate(feet)}
        return {**self.definitions, **definitions, **more}, accelerations, by_foot

    def _flagged(
        self, feet: Sequence[Standing], response: sp.Matrix, missing: Sequence[sp.Expr]
    ) -> tuple[sp.Matrix, list[sp.Expr]]:
        """The equations of forces on feet that may stick, slide or be open.

        A foot that slides forward is pushed back, by the friction that its normal force allows.
        """
        friction, size = self.parameter("friction", self.friction), response.rows
        matrix, right = sp.zeros(size, size), []
        for number, foot in enumerate(feet):
            assert isinstance(foot, MaybeStanding)
            t, n = 2 * number, 2 * number + 1
            for row, holds in ((t, foot.sticks), (n, foot.stands)):
                for column in range(size):
                    matrix[row, column] = holds * response[row, column]
                matrix[row, row] += 1 - holds
                right.append(holds * missing[row])
            matrix[t, n] += (1 - foot.sticks) * foot.slides * friction
        return matrix, right

    def settling(self, foot: Standing) -> Point:
        """The acceleration that takes a foot back to its anchor, from which rounding moved it."""
        (x, y), (x_rate, y_rate) = self.foot(foot.name), self.foot_velocity(foot.name)
        off = x - foot.anchor[0], y - foot.anchor[1]
        return (
            -2 * SETTLING * x_rate - SETTLING**2 * off[0],
            -2 * SETTLING * y_rate - SETTLING**2 * off[1],
        )

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

    def _at(self, joint: str) -> tuple[int, int]:
        """Positions of the links at a joint."""
        return self._sides(next(each.link for each in self.linkage.joints if each.name == joint))

    def _sides(self, link: str) -> tuple[int, int]:
        """Positions of a link and of its parent."""
        number = self.linkage.place[link]
        parent = self.linkage.links[number].parent
        assert parent is not None
        return number, self.linkage.place[parent]


def dot(row: Sequence[sp.Expr], column: Sequence[sp.Expr]) -> sp.Expr:
    """The sum of products."""
    return sp.Add(*(a * b for a, b in zip(row, column, strict=True)))
