"""A linkage with some feet pinned to the ground: accelerations and ground reaction forces.

``D q'' + h = Q + J^T F`` with ``J q'' = -J' q'``, where ``h = C q' + G`` and the dampers; ``F`` are
the forces on the feet, x and y in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexspine.mechanics.complementarity import Contact, Resolution, resolve
from flexspine.mechanics.linkage import Array, Linkage

TOO_MUCH = "the feet hold what the motors are to move"

# Relative; what is left of equations that cannot be solved is of order one.
UNSOLVED = 1e-6


class Motion(NamedTuple):
    """Accelerations (N,) and forces on k feet, shape (k, 2) in N."""

    accelerations: Array
    forces: Array


class Tracked(NamedTuple):
    """Accelerations (N,), forces on k feet, shape (k, 2) in N, and torques (m,) in N m."""

    accelerations: Array
    forces: Array
    torques: Array


def passive_forces(linkage: Linkage, q: Array, rates: Array) -> Array:
    """``h``: what the motion, weight, springs and dampers need, shape (..., N)."""
    still: Array = linkage.potential_forces(q) + linkage.damping_forces(rates)
    return linkage.velocity_forces(q, rates) + still


def constrained(
    linkage: Linkage, q: Array, rates: Array, feet: Sequence[str], torques: Array
) -> Motion:
    """Move with feet that stay where they are; ``torques`` (m,) of the motors.

    Raises `numpy.linalg.LinAlgError` where the feet are not independent.
    """
    n = linkage.size
    jacobian = linkage.foot_jacobian(q, feet)
    applied = linkage.actuation @ torques - passive_forces(linkage, q, rates)
    solved = _solve(linkage, q, jacobian, applied, -linkage.foot_bias(q, rates, feet))
    return Motion(solved[:n], solved[n:].reshape(-1, 2))


def tracked(
    linkage: Linkage, q: Array, rates: Array, feet: Sequence[str], wanted: Array
) -> Tracked:
    """Find the torques with which the motors' angles accelerate as ``wanted``, shape (m,).

    Regular with no foot, one foot or two feet of different hips, unless the toes and a passive
    joint are in line. Raises `numpy.linalg.LinAlgError` elsewhere.
    """
    n, motors, k = linkage.size, linkage.actuation.T, 2 * len(feet)
    held = np.concatenate([linkage.foot_jacobian(q, feet), motors])
    needed = np.concatenate([-linkage.foot_bias(q, rates, feet), wanted])
    if len(held) > n:
        raise np.linalg.LinAlgError(TOO_MUCH)
    solved = _solve(linkage, q, held, -passive_forces(linkage, q, rates), needed)
    if not np.abs(held @ solved[:n] - needed).max() <= UNSOLVED * (1 + np.abs(needed).max()):
        raise np.linalg.LinAlgError(TOO_MUCH)
    return Tracked(solved[:n], solved[n : n + k].reshape(-1, 2), solved[n + k :])


def supported(
    linkage: Linkage,
    q: Array,
    rates: Array,
    feet: Sequence[str],
    torques: Array,
    friction: float,
    moving: Sequence[Contact | None],
) -> tuple[Resolution, Array]:
    """Find what feet on the ground do next: which of them lift off, stick or begin to slide.

    ``moving`` names those that slide already. The pushes are forces in N; with them come the
    accelerations that they lead to, shape (N,).
    """
    jacobian = linkage.foot_jacobian(q, feet)
    applied = linkage.actuation @ torques - passive_forces(linkage, q, rates)
    columns = np.concatenate([jacobian.T, applied[:, None]], axis=1)
    solved = np.linalg.solve(linkage.mass_matrix(q), columns)
    spread, free = solved[:, :-1], solved[:, -1]
    before = jacobian @ free + linkage.foot_bias(q, rates, feet)
    found = resolve(jacobian @ spread, before, friction, moving, count=False)
    return found, free + spread @ found.pushes.ravel()


def stopped(linkage: Linkage, q: Array, rates: Array, rows: Array) -> Array:
    """The rates (N,) after what ``rows`` move, shape (k, N), has been stopped at once."""
    spread = np.linalg.solve(linkage.mass_matrix(q), rows.T)
    pushes = np.linalg.lstsq(rows @ spread, rows @ rates, rcond=None)[0]
    return np.asarray(rates - spread @ pushes, dtype=float)


def _solve(linkage: Linkage, q: Array, held: Array, applied: Array, needed: Array) -> Array:
    """Accelerations with ``held q'' = needed`` and the forces along ``held`` for them."""
    count = len(held)
    matrix = np.block([[linkage.mass_matrix(q), -held.T], [held, np.zeros((count, count))]])
    try:
        solved = np.linalg.solve(matrix, np.concatenate([applied, needed]))
    except np.linalg.LinAlgError:
        raise np.linalg.LinAlgError(TOO_MUCH) from None
    return np.asarray(solved, dtype=float)
