"""What touching feet do: unilateral normals and Coulomb friction for several at once.

Pushes ``L`` on the feet change their motion by ``W L``: impulses their velocities, forces their
accelerations. Each foot lets go (``L = 0``, ``v_n >= 0``), sticks (``v = 0``, ``L_n >= 0``,
``|L_t| <= mu L_n``) or slides (``v_n = 0``, ``L_n >= 0``, ``L_t = -mu L_n`` along ``v_t``), where
``v`` is what comes of the push. Every combination is a linear system; those whose inequalities
hold are solutions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from flexspine.mechanics.linkage import Array

# Relative to the largest motion or push: what counts as zero with rounding error.
ZERO = 1e-11

# Relative; feet whose responses have a singular value this small cannot be pushed independently.
DEPENDENT = 1e-11

# Relative; motions this close are one, on the border between two combinations.
SAME = 1e-8


class Contact(Enum):
    """What a touching foot does."""

    OPEN = "open"
    STICK = "stick"
    SLIDE_FORWARD = "slide forward"
    SLIDE_BACK = "slide back"


# In the order in which they are looked for.
CONTACTS = (Contact.STICK, Contact.SLIDE_FORWARD, Contact.SLIDE_BACK, Contact.OPEN)
STICK, FORWARD, BACK, OPEN = range(4)


class Verdict(Enum):
    """How many solutions there are."""

    ONE = "one"
    NONE = "none"
    SEVERAL = "several"


@dataclass(frozen=True)
class Resolution:
    """What k feet do.

    ``pushes`` on them, shape (k, 2), are those of the first solution, or none at all if there is
    none. ``solutions`` counts them.
    """

    verdict: Verdict
    contacts: tuple[Contact, ...]
    pushes: Array
    solutions: int


def resolve(
    response: Array,
    before: Array,
    friction: float | None,
    moving: Sequence[Contact | None] | None = None,
    *,
    count: bool = True,
) -> Resolution:
    """Find what touching feet do, sticking first.

    ``response`` is ``W`` (2k, 2k), ``before`` the feet's motion without pushes (2k,), x and y in
    turn. ``friction`` None: feet that touch do not slide. ``moving`` names the feet that slide
    already, so that friction has its direction (None: at rest). Where feet cannot be pushed
    independently, as those at both ends of one link, pushes are the least ones. Without ``count``
    the first answer will do in which pushes are determined: of feet on one link that stand still
    not all stick then, some slide at no speed.
    """
    feet = len(before) // 2
    combinations = _combinations(tuple(moving or (None,) * feet), friction is not None)
    free = _independent(response)
    if not count and free:
        combinations = combinations[:1]
    matrix, right = _system(combinations, response, before, friction or 0.0)
    if not (count or free):
        sizes = np.linalg.svd(matrix, compute_uv=False)
        kept = sizes[:, -1] > DEPENDENT * sizes[:, 0]
        combinations, matrix, right = combinations[kept], matrix[kept], right[kept]
    if free or not count:
        solved = np.linalg.solve(matrix, right[..., None])
    else:
        solved = np.linalg.pinv(matrix, rcond=DEPENDENT) @ right[..., None]
    pushes = np.asarray(solved[..., 0], dtype=float)
    after = before + pushes @ response.T
    slides_already = np.array([each is not None for each in moving or (None,) * feet], dtype=bool)
    holds = _holds(combinations, pushes, after, before, friction, slides_already)
    distinct: list[int] = []
    for number in np.flatnonzero(holds).tolist():
        apart = (np.abs(after[number] - after[other]).max() for other in distinct)
        if all(distance > SAME * np.abs(before).max() for distance in apart):
            distinct.append(number)
    if not distinct and not count and free:
        return resolve(response, before, friction, moving)
    if not distinct:
        return Resolution(Verdict.NONE, (Contact.OPEN,) * feet, np.zeros((feet, 2)), 0)
    chosen = distinct[0]
    return Resolution(
        verdict=Verdict.ONE if len(distinct) == 1 else Verdict.SEVERAL,
        contacts=tuple(CONTACTS[number] for number in combinations[chosen]),
        pushes=pushes[chosen].reshape(-1, 2),
        solutions=len(distinct),
    )


@lru_cache(maxsize=256)
def _combinations(moving: tuple[Contact | None, ...], slides: bool) -> NDArray[np.int64]:
    """What all feet may do, shape (combinations, feet), sticking first."""
    at_rest = (STICK, FORWARD, BACK, OPEN) if slides else (STICK, OPEN)
    each = [at_rest if way is None else (CONTACTS.index(way), OPEN) for way in moving]
    return np.array(list(product(*each)), dtype=np.int64)


def _independent(response: Array) -> bool:
    """Whether feet can be pushed each for itself."""
    sizes = np.linalg.svd(response, compute_uv=False)
    return not sizes.size or bool(sizes[-1] > DEPENDENT * sizes[0])


def _system(
    combinations: NDArray[np.int64], response: Array, before: Array, friction: float
) -> tuple[Array, Array]:
    """The linear system of every combination: its matrix and its right side."""
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
    return matrix, right


def _holds(
    combinations: NDArray[np.int64],
    pushes: Array,
    after: Array,
    before: Array,
    friction: float | None,
    slides_already: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Where a combination is what it says, its equations included."""
    tangent, normal = pushes[:, ::2], pushes[:, 1::2]
    speed, rise = after[:, ::2], after[:, 1::2]
    least = ZERO * np.abs(pushes).max(axis=1, keepdims=True, initial=0.0)
    still = ZERO * np.abs(before).max(initial=0.0)
    grips = np.ones(normal.shape, dtype=bool)
    if friction is not None:
        grips = np.abs(tangent) <= friction * normal + least
    stays = (normal >= -least) & (np.abs(rise) <= still)
    fine = np.select(
        [combinations == OPEN, combinations == STICK, combinations == FORWARD],
        [
            rise >= -still,
            stays & grips & (np.abs(speed) <= still),
            stays & (slides_already | (speed >= -still)),
        ],
        stays & (slides_already | (speed <= still)),
    )
    result: NDArray[np.bool_] = fine.all(axis=1) & np.isfinite(pushes).all(axis=1)
    return result
