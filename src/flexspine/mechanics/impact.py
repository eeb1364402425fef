"""Plastic impacts of several feet at once.

Impulses ``L`` change the rates by ``D^-1 J^T L``, feet's velocities by ``W L`` with
``W = J D^-1 J^T``. The kinetic energy never grows: with ``L . v+ <= 0`` and ``v+ = v- + W L`` it
changes by ``L . (v+ + v-) / 2 <= -L . W L / 2``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexspine.mechanics.complementarity import Contact, Verdict, resolve
from flexspine.mechanics.linkage import Array, Linkage


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
    found = resolve(jacobian @ spread, jacobian @ rates, friction)
    return Impact(
        verdict=found.verdict,
        contacts=found.contacts,
        impulses=found.pushes,
        rates=rates + spread @ found.pushes.ravel(),
        solutions=found.solutions,
    )
