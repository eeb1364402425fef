"""Planar trees of rigid links: kinematics, energies and the terms of their equations of motion.

A link goes from its start to its end in the direction ``u(theta) = (cos theta, sin theta)``; every
link but the first starts at a point of its parent. Then every point of the tree is
``base + sum a_j u(theta_j)`` with constant lever arms ``a_j``, the kinetic energy is
``T = 1/2 sum A_jk cos(theta_j - theta_k) theta_j' theta_k' + ...`` with constant ``A``, and
Euler-Lagrange gives ``sum A_jk cos(theta_j - theta_k) theta_k''
+ sum A_jk sin(theta_j - theta_k) theta_k'^2 + g B_j cos theta_j = Q_j`` without further work.

Coordinates ``q`` are the absolute angle of the first link, the angles of the others relative to
their parents, in the order of the links, and the start of the first link, x and y. Arrays of them
have shape (..., N) with N = links + 2; SI, radians, x forward, y up, counter-clockwise positive.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Link:
    """A rigid link.

    ``com`` is the distance of its centre of mass from its start, on the way to its end, and
    ``inertia`` is about that centre. It starts ``at`` a distance from the start of its ``parent``.
    """

    name: str
    length: float
    mass: float
    com: float
    inertia: float
    parent: str | None = None
    at: float = 0.0


@dataclass(frozen=True)
class Joint:
    """Where a link meets its parent: a torsional spring-damper on the relative angle, a motor."""

    name: str
    link: str
    stiffness: float = 0.0
    damping: float = 0.0
    rest: float = 0.0
    actuated: bool = False


@dataclass(frozen=True)
class Foot:
    """A point of a link that may touch the ground, with a mass of its own."""

    name: str
    link: str
    at: float
    mass: float = 0.0


@dataclass(frozen=True)
class Linkage:
    """A planar tree: its first link is free, all others follow their parents."""

    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    feet: tuple[Foot, ...]
    gravity: float

    @property
    def size(self) -> int:
        """The number N of coordinates."""
        return len(self.links) + 2

    @cached_property
    def place(self) -> Mapping[str, int]:
        """Where the angle of each link, by its name or its joint's, stands in ``q``."""
        links = {link.name: number for number, link in enumerate(self.links)}
        return links | {joint.name: links[joint.link] for joint in self.joints}

    @cached_property
    def _chains(self) -> Array:
        """Absolute angles from the angles in ``q``: 1 for every link on the way, shape (n, n)."""
        chains = np.eye(len(self.links))
        for number, link in enumerate(self.links):
            if link.parent is not None:
                chains[number] += chains[self.place[link.parent]]
        return chains

    @cached_property
    def to_absolute(self) -> Array:
        """Absolute angles and the base from ``q``, shape (N, N)."""
        whole = np.eye(self.size)
        whole[:-2, :-2] = self._chains
        return whole

    @cached_property
    def to_relative(self) -> Array:
        """``q`` from absolute angles and the base, shape (N, N)."""
        turned: Array = np.rint(np.linalg.inv(self.to_absolute))
        return turned

    def arms(self, link: str, distance: float) -> Array:
        """The lever arms of a point on a link, at a distance from its start, shape (n,)."""
        arms = np.zeros(len(self.links))
        number: int | None = self.place[link]
        while number is not None:
            here = self.links[number]
            arms[number] = distance
            distance = here.at
            number = None if here.parent is None else self.place[here.parent]
        return arms

    @cached_property
    def _bodies(self) -> tuple[Array, Array]:
        """Masses (b,) and lever arms (b, n) of the links' centres and the feet."""
        points = [(link.mass, self.arms(link.name, link.com)) for link in self.links]
        points += [(foot.mass, self.arms(foot.link, foot.at)) for foot in self.feet]
        masses, arms = zip(*points, strict=True)
        return np.array(masses), np.array(arms)

    def with_feet(self, link: str) -> tuple[float, float, float]:
        """Mass of a link with its feet, their centre from its start, and inertia about that."""
        body = self.links[self.place[link]]
        parts = [(body.mass, body.com, body.inertia)]
        parts += [(foot.mass, foot.at, 0.0) for foot in self.feet if foot.link == link]
        mass = sum(part for part, _, _ in parts)
        com = sum(part * at for part, at, _ in parts) / mass
        return mass, com, sum(own + part * (at - com) ** 2 for part, at, own in parts)

    @cached_property
    def mass(self) -> float:
        """The whole mass, in kg."""
        return float(self._bodies[0].sum())

    @cached_property
    def moments(self) -> Array:
        """``B``, the first moments of mass about the joints in kg m, shape (n,)."""
        masses, arms = self._bodies
        moments: Array = masses @ arms
        return moments

    @cached_property
    def inertias(self) -> Array:
        """``A``, the second moments of mass in kg m^2, with the links' own, shape (n, n)."""
        masses, arms = self._bodies
        inertias: Array = arms.T @ (masses[:, None] * arms)
        return inertias + np.diag([link.inertia for link in self.links])

    def angles(self, q: Array) -> Array:
        """Absolute angles of all links from +x, shape (..., n)."""
        absolute: Array = q[..., :-2] @ self._chains.T
        return absolute

    def point(self, q: Array, link: str, distance: float) -> Array:
        """Where a point of a link is, shape (..., 2)."""
        return self._point(q, self.arms(link, distance))

    def foot(self, q: Array, name: str) -> Array:
        """Where a foot is, shape (..., 2)."""
        return self._point(q, self._foot_arms[name])

    def feet_at(self, q: Array) -> Array:
        """Where all feet are, shape (feet, 2); ``q`` has shape (N,)."""
        angles, arms = self.angles(q), self._feet_arms(self._foot_arms)
        return np.stack([arms @ np.cos(angles), arms @ np.sin(angles)], axis=1) + q[-2:]

    def com(self, q: Array) -> Array:
        """Where the centre of mass of all is, shape (..., 2)."""
        return self._point(q, self.moments / self.mass)

    def _point(self, q: Array, arms: Array) -> Array:
        """Where a point with these lever arms is."""
        angles = self.angles(q)
        place = q[..., -2:].copy()
        place[..., 0] += np.cos(angles) @ arms
        place[..., 1] += np.sin(angles) @ arms
        return place

    def com_jacobian(self, q: Array) -> Array:
        """The velocity of the centre of mass by ``q'``, shape (..., 2, N)."""
        return self._jacobian(q, self.moments[None] / self.mass)

    def com_bias(self, q: Array, rates: Array) -> Array:
        """The acceleration of the centre of mass without ``q''``, shape (..., 2)."""
        return self._bias(q, rates, self.moments[None] / self.mass)

    def mass_matrix(self, q: Array) -> Array:
        """``D`` of ``D q'' + C q' + G = Q``, shape (..., N, N)."""
        angles, n = self.angles(q), len(self.links)
        apart = angles[..., :, None] - angles[..., None, :]
        matrix = np.zeros((*q.shape[:-1], self.size, self.size))
        matrix[..., :n, :n] = self.inertias * np.cos(apart)
        matrix[..., :n, n] = matrix[..., n, :n] = -self.moments * np.sin(angles)
        matrix[..., :n, n + 1] = matrix[..., n + 1, :n] = self.moments * np.cos(angles)
        matrix[..., n, n] = matrix[..., n + 1, n + 1] = self.mass
        result: Array = self.to_absolute.T @ matrix @ self.to_absolute
        return result

    def velocity_forces(self, q: Array, rates: Array) -> Array:
        """``C q'``, centrifugal and Coriolis forces, shape (..., N)."""
        angles, squares = self.angles(q), self.angles(rates) ** 2
        apart = np.sin(angles[..., :, None] - angles[..., None, :])
        forces = np.empty(q.shape)
        forces[..., :-2] = ((self.inertias * apart) @ squares[..., None])[..., 0] @ self._chains
        forces[..., -2] = -(squares * np.cos(angles)) @ self.moments
        forces[..., -1] = -(squares * np.sin(angles)) @ self.moments
        return forces

    def potential_forces(self, q: Array) -> Array:
        """``G``, the gradient of the potential energy, springs included, shape (..., N)."""
        stiffness, rests, _ = self._springs
        forces: Array = stiffness * (q - rests)
        forces[..., :-2] += self.gravity * self.moments * np.cos(self.angles(q)) @ self._chains
        forces[..., -1] += self.gravity * self.mass
        return forces

    def damping_forces(self, rates: Array) -> Array:
        """What the dampers of the joints take up, ``c q'``, shape (..., N)."""
        forces: Array = self._springs[2] * rates
        return forces

    @cached_property
    def _springs(self) -> Array:
        """Stiffness, rest angle and damping by coordinate, shape (3, N)."""
        table = np.zeros((3, self.size))
        for joint in self.joints:
            table[:, self.place[joint.name]] = joint.stiffness, joint.rest, joint.damping
        return table

    @cached_property
    def actuation(self) -> Array:
        """``B``, which motor acts on which coordinate, in the order of the joints, shape (N, m)."""
        columns = [self.place[joint.name] for joint in self.joints if joint.actuated]
        result: Array = np.eye(self.size)[:, columns]
        return result

    def point_jacobian(self, q: Array, link: str, distance: float) -> Array:
        """The velocity of a point of a link by ``q'``, shape (..., 2, N)."""
        return self._jacobian(q, self.arms(link, distance)[None])

    def foot_jacobian(self, q: Array, feet: Iterable[str]) -> Array:
        """``J``, the velocities of feet by ``q'``: x and y in turn, shape (..., 2 feet, N)."""
        return self._jacobian(q, self._feet_arms(feet))

    def _jacobian(self, q: Array, arms: Array) -> Array:
        """The velocities of points with these lever arms (k, n)."""
        angles, n = self.angles(q), len(self.links)
        rows = np.zeros((*q.shape[:-1], 2 * len(arms), self.size))
        rows[..., ::2, :n] = -arms * np.sin(angles)[..., None, :] @ self._chains
        rows[..., 1::2, :n] = arms * np.cos(angles)[..., None, :] @ self._chains
        rows[..., ::2, n] = rows[..., 1::2, n + 1] = 1.0
        return rows

    def foot_bias(self, q: Array, rates: Array, feet: Iterable[str]) -> Array:
        """``J' q'``, the accelerations of feet without ``q''``, shape (..., 2 feet)."""
        return self._bias(q, rates, self._feet_arms(feet))

    def _bias(self, q: Array, rates: Array, arms: Array) -> Array:
        """The accelerations of points with these lever arms (k, n), without ``q''``."""
        angles, squares = self.angles(q), self.angles(rates) ** 2
        found = np.empty((*q.shape[:-1], 2 * len(arms)))
        found[..., ::2] = -(squares * np.cos(angles)) @ arms.T
        found[..., 1::2] = -(squares * np.sin(angles)) @ arms.T
        return found

    def kinetic_energy(self, q: Array, rates: Array) -> Array:
        """Kinetic energy in J, shape (...)."""
        momentum = (self.mass_matrix(q) @ rates[..., None])[..., 0]
        energy: Array = (rates * momentum).sum(axis=-1) / 2
        return energy

    def potential_energy(self, q: Array) -> Array:
        """Energy of weight, zero at height zero, and of springs, in J, shape (...)."""
        energy: Array = self.mass * self.gravity * self.com(q)[..., 1]
        for joint in self.joints:
            bend = q[..., self.place[joint.name]] - joint.rest
            energy = energy + joint.stiffness * bend**2 / 2
        return energy

    @cached_property
    def _foot_arms(self) -> dict[str, Array]:
        return {foot.name: self.arms(foot.link, foot.at) for foot in self.feet}

    def foot_arms(self, name: str) -> Array:
        """The lever arms of a foot, shape (n,)."""
        return self._foot_arms[name]

    def _feet_arms(self, feet: Iterable[str]) -> Array:
        """The lever arms of some feet, shape (k, n)."""
        arms = [self._foot_arms[name] for name in feet]
        return np.array(arms) if arms else np.zeros((0, len(self.links)))
