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


def equations(linkage: Linkage, q: Array, rates: Array, feet: Sequence[str]) -> tuple[Array, Array]:
    """Motion with feet that stay where they are, as equations: rows and right sides.

    Rows have shape (N + 2k, N + m + 2k), for accelerations (N,), torques (m,) and forces, x and y
    of each foot in turn; the first N of them are the equations of motion.
    """
    n, jacobian = linkage.size, linkage.foot_jacobian(q, feet)
    motors = linkage.actuation
    m, k = motors.shape[1], len(jacobian)
    rows = np.zeros((n + k, n + m + k))
    rows[:n, :n], rows[:n, n : n + m] = linkage.mass_matrix(q), -motors
    rows[:n, n + m :], rows[n:, :n] = -jacobian.T, jacobian
    bias = linkage.foot_bias(q, rates, feet)
    return rows, -np.concatenate([passive_forces(linkage, q, rates), bias])


def constrained(
    linkage: Linkage, q: Array, rates: Array, feet: Sequence[str], torques: Array
) -> Motion:
    """Move with feet that stay where they are; ``torques`` (m,) of the motors.

    Raises `numpy.linalg.LinAlgError` where the feet are not independent.
    """
    n, (rows, right) = linkage.size, equations(linkage, q, rates, feet)
    motors = slice(n, n + len(torques))
    known = right - rows[:, motors] @ torques
    solved = _solve(np.delete(rows, motors, axis=1), known)
    return Motion(solved[:n], solved[n:].reshape(-1, 2))


def tracked(
    linkage: Linkage, q: Array, rates: Array, feet: Sequence[str], wanted: Array
) -> Tracked:
    """Find the torques with which the motors' angles accelerate as ``wanted``, shape (m,).

    Regular with no foot, one foot or two feet of different hips, unless the toes and a passive
    joint are in line. Raises `numpy.linalg.LinAlgError` elsewhere.
    """
    n, m = linkage.size, len(wanted)
    if 2 * len(feet) + m > n:
        raise np.linalg.LinAlgError(TOO_MUCH)
    rows, right = equations(linkage, q, rates, feet)
    tracking = np.zeros((m, rows.shape[1]))
    tracking[:, :n] = linkage.actuation.T
    matrix, needed = np.concatenate([rows, tracking]), np.concatenate([right, wanted])
    solved = _solve(matrix, needed)
    missed = np.abs(matrix @ solved - needed)[n:].max(initial=0.0)
    if not missed <= UNSOLVED * (1 + np.abs(needed[n:]).max(initial=0.0)):
        raise np.linalg.LinAlgError(TOO_MUCH)
    return Tracked(solved[:n], solved[n + m :].reshape(-1, 2), solved[n : n + m])


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


def _solve(matrix: Array, right: Array) -> Array:
    """What a square matrix makes this right side of."""
    try:
        solved = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        raise np.linalg.LinAlgError(TOO_MUCH) from None
    return np.asarray(solved, dtype=float)
