"""Plastic impacts of several feet at once, with unilateral normals and Coulomb friction.

Impulses ``L`` change the rates by ``D^-1 J^T L``, feet's velocities by ``W L`` with
``W = J D^-1 J^T``. Each touching foot lets go (``L = 0``, ``v_n+ >= 0``), sticks (``v+ = 0``,
``L_n >= 0``, ``|L_t| <= mu L_n``) or slides (``v_n+ = 0``, ``L_n >= 0``, ``L_t = -mu L_n`` along
``v_t+``). Every combination is a linear system; those whose inequalities hold are solutions.

The kinetic energy never grows: with ``L . v+ <= 0`` and ``v+ = v- + W L`` it changes by
``L . (v+ + v-) / 2 <= -L . W L / 2``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from flexspine.mechanics.linkage import Array, Linkage

# Relative to the largest velocity or impulse: what counts as zero with rounding error.
ZERO = 1e-11

# Relative; motions this close are one, on the border between two combinations.
SAME = 1e-8


class Contact(Enum):
    """What a touching foot does."""

    OPEN = "open"
    STICK = "stick"
    SLIDE_FORWARD = "slide forward"
    SLIDE_BACK = "slide back"


class Verdict(Enum):
    """How many solutions an impact has."""

    ONE = "one"
    NONE = "none"
    SEVERAL = "several"


@dataclass(frozen=True)
class Impact:
    """What an impact of k feet comes to.

    ``rates`` after it, shape (N,), and ``impulses`` on the feet in N s, shape (k, 2), are those of
    the first solution, or of no impact at all if there is none. ``contacts`` tells what each foot
    does. ``solutions`` counts them.
    """

    verdict: Verdict
    contacts: tuple[Contact, ...]
    impulses: Array
    rates: Array
    solutions: int


def impact(
    linkage: Linkage, q: Array, rates: Array, feet: Sequence[str], friction: float | None
) -> Impact:
    """Let feet that touch the ground hit it. ``friction`` None: feet that touch do not slide.

    ``q`` and ``rates`` before have shape (N,). Where the feet cannot be pushed independently, as
    those at both ends of one link, impulses are the least ones.
    """
    jacobian = linkage.foot_jacobian(q, feet)
    spread = np.linalg.solve(linkage.mass_matrix(q), jacobian.T)
    response, before = jacobian @ spread, jacobian @ rates
    combinations = _combinations(len(feet), friction is not None)
    impulses = _solve(combinations, response, before, friction or 0.0)
    after = before + impulses @ response.T
    good = np.flatnonzero(_holds(combinations, impulses, after, before, friction))
    distinct: list[int] = []
    for number in good.tolist():
        apart = (np.abs(after[number] - after[other]).max() for other in distinct)
        if all(distance > SAME * np.abs(before).max() for distance in apart):
            distinct.append(number)
    if not distinct:
        nothing = np.zeros((len(feet), 2))
        return Impact(Verdict.NONE, (Contact.OPEN,) * len(feet), nothing, rates.copy(), 0)
    chosen = distinct[0]
    return Impact(
        verdict=Verdict.ONE if len(distinct) == 1 else Verdict.SEVERAL,
        contacts=tuple(CONTACTS[number] for number in combinations[chosen]),
        impulses=impulses[chosen].reshape(-1, 2),
        rates=rates + spread @ impulses[chosen],
        solutions=len(distinct),
    )


# In the order in which they are looked for.
CONTACTS = (Contact.STICK, Contact.SLIDE_FORWARD, Contact.SLIDE_BACK, Contact.OPEN)
STICK, FORWARD, BACK, OPEN = range(4)


@lru_cache
def _combinations(feet: int, slides: bool) -> NDArray[np.int64]:
    """What all feet may do, shape (combinations, feet), sticking first."""
    each = (STICK, FORWARD, BACK, OPEN) if slides else (STICK, OPEN)
    return np.array(list(product(each, repeat=feet)))


def _solve(
    combinations: NDArray[np.int64], response: Array, before: Array, friction: float
) -> Array:
    """The impulses of every combination, shape (combinations, 2 feet)."""
    count, size = len(combinations), len(before)
    matrix, right = np.zeros((count, size, size)), np.zeros((count, size))
    for foot in range(size // 2):
        t, n = 2 * foot, 2 * foot + 1
        does = combinations[:, foot]
        opens, sticks = does == OPEN, does == STICK
        slides = ~opens & ~sticks
        for row in (t, n):
            matrix[opens, row, row] = 1.0
        for row in (t, n):
            matrix[sticks, row] = response[row]
            right[sticks, row] = -before[row]
        matrix[slides, n] = response[n]
        right[slides, n] = -before[n]
        matrix[slides, t, t] = 1.0
        matrix[slides, t, n] = np.where(does[slides] == FORWARD, friction, -friction)
    try:
        solved = np.linalg.solve(matrix, right[..., None])
    except np.linalg.LinAlgError:
        solved = np.linalg.pinv(matrix) @ right[..., None]
    return np.asarray(solved[..., 0], dtype=float)


def _holds(
    combinations: NDArray[np.int64],
    impulses: Array,
    after: Array,
    before: Array,
    friction: float | None,
) -> NDArray[np.bool_]:
    """Where a combination is what it says, its equations included."""
    tangent, normal = impulses[:, ::2], impulses[:, 1::2]
    speed, rise = after[:, ::2], after[:, 1::2]
    least = ZERO * np.abs(impulses).max(axis=1, keepdims=True)
    still = ZERO * np.abs(before).max()
    grips = np.ones(normal.shape, dtype=bool)
    if friction is not None:
        grips = np.abs(tangent) <= friction * normal + least
    stays = (normal >= -least) & (np.abs(rise) <= still)
    fine = np.select(
        [combinations == OPEN, combinations == STICK, combinations == FORWARD],
        [rise >= -still, stays & grips & (np.abs(speed) <= still), stays & (speed >= -still)],
        stays & (speed <= still),
    )
    result: NDArray[np.bool_] = fine.all(axis=1) & np.isfinite(impulses).all(axis=1)
    return result
