"""A linkage with some feet pinned to the ground: accelerations and ground reaction forces.

``D q'' + h = Q + J^T F`` with ``J q'' = -J' q'``, where ``h = C q' + G`` and the dampers; ``F`` are
the forces on the feet, x and y in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexspine.mechanics.linkage import Array, Linkage


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
    jacobian = linkage.foot_jacobian(q, feet) if feet else np.zeros((0, n))
    matrix = np.block([[linkage.mass_matrix(q), -jacobian.T], [jacobian, _nothing(feet, feet)]])
    applied = linkage.actuation @ torques - passive_forces(linkage, q, rates)
    solved = np.linalg.solve(matrix, np.concatenate([applied, -_bias(linkage, q, rates, feet)]))
    return Motion(solved[:n], solved[n:].reshape(-1, 2))


def tracked(
    linkage: Linkage, q: Array, rates: Array, feet: Sequence[str], wanted: Array
) -> Tracked:
    """Find the torques with which the motors' angles accelerate as ``wanted``, shape (m,).

    Regular with no foot, one foot or two feet of different hips, unless the toes and a passive
    joint are in line. Raises `numpy.linalg.LinAlgError` elsewhere.
    """
    n, motors = linkage.size, linkage.actuation
    m, k = motors.shape[1], 2 * len(feet)
    jacobian = linkage.foot_jacobian(q, feet) if feet else np.zeros((0, n))
    if np.linalg.matrix_rank(np.concatenate([jacobian, motors.T])) < k + m:
        raise np.linalg.LinAlgError("the feet hold what the motors are to move")
    matrix = np.block(
        [
            [linkage.mass_matrix(q), -jacobian.T, -motors],
            [jacobian, np.zeros((k, k + m))],
            [motors.T, np.zeros((m, k + m))],
        ]
    )
    right = [-passive_forces(linkage, q, rates), -_bias(linkage, q, rates, feet), wanted]
    solved = np.linalg.solve(matrix, np.concatenate(right))
    return Tracked(solved[:n], solved[n : n + k].reshape(-1, 2), solved[n + k :])


def _bias(linkage: Linkage, q: Array, rates: Array, feet: Sequence[str]) -> Array:
    return linkage.foot_bias(q, rates, feet) if feet else np.zeros(0)


def _nothing(rows: Sequence[str], columns: Sequence[str]) -> Array:
    return np.zeros((2 * len(rows), 2 * len(columns)))
