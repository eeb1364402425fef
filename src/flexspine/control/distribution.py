"""How motors share a load between the feet: the family of torques, and the best of them.

Motors ``t`` and feet ``F`` have to bring about ``B t + J^T F = D q'' + h``, at rest
``B t + J^T F = G``. With feet enough that leaves a family ``t = t_1 + N a``, out of which a small
quadratic program takes what presses the feet as wanted, or needs the least torque, or is farthest
from slipping, while no foot pulls or slips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import daqp
import numpy as np
from scipy.linalg import null_space
from scipy.optimize import linprog

from flexspine.errors import UnknownNameError
from flexspine.mechanics.linkage import Array, Linkage
from flexspine.mechanics.stance import passive_forces

# Relative; what counts as zero among singular values and residuals.
ZERO = 1e-9

# What daqp calls things: proximal steps where a problem has flat directions, ...
AUTOMATIC = -1.0
SOLVED = 1
INEQUALITY = 0


class Aim(Enum):
    """What to ask of the distribution of a load; see `ForceFamily.choose`."""

    SPLIT = "split"
    """Normal forces closest to a wanted split; equal ones if none is given."""

    TORQUE = "torque"
    """The least sum of squared torques."""

    FRICTION = "friction"
    """The largest margin to slipping, in N, of the foot that has the least."""


class Verdict(Enum):
    """How many distributions there are for what is wanted."""

    UNIQUE = "unique"
    FAMILY = "family"
    NONE = "no solution"
    NOT_STANDING = "no solution in which no foot pulls or slips"


@dataclass(frozen=True)
class Distribution:
    """One way to share a load between the feet.

    ``torques`` (m,) of the motors in N m and ``forces`` on k feet (k, 2) in N, x forward and y up;
    None where ``verdict`` tells that there are none. ``dimension`` counts the numbers that were
    free. ``margin`` is how many newtons the foot that is closest to slipping is away from it.
    """

    verdict: Verdict
    dimension: int
    torques: Array | None = None
    forces: Array | None = None
    margin: float | None = None


@dataclass(frozen=True)
class ForceFamily:
    """All torques and foot forces ``first + directions a`` that bring about a motion.

    ``first`` has shape (m + 2 k,) and ``directions`` (m + 2 k, d): the torques of the m motors in
    N m, and then the forces on the k feet in N, x and y of each in turn. ``motors`` is m.
    ``exists`` is False where nothing brings the motion about.
    """

    motors: int
    first: Array
    directions: Array
    exists: bool

    @property
    def dimension(self) -> int:
        """How many numbers are free."""
        return int(self.directions.shape[1])

    def choose(
        self, aim: Aim, friction: float, split: Sequence[float] | None = None
    ) -> Distribution:
        """Return the best member in which no foot pulls or slips, if there is one.

        ``friction`` is the coefficient of Coulomb friction. ``split`` (k,) are the feet's shares of
        the load for `Aim.SPLIT`, which sum to 1; None: equal ones. Of several members that press
        alike the one with least torque is taken.
        """
        if not self.exists:
            return Distribution(Verdict.NONE, 0)
        if not self.dimension:
            inside = self._margins(friction, np.zeros(0)).min() >= 0
            return self._made(Verdict.UNIQUE if inside else Verdict.NOT_STANDING, friction)
        best = self._best(aim, friction, split)
        if best is None:
            return Distribution(Verdict.NOT_STANDING, self.dimension)
        return self._made(Verdict.FAMILY, friction, best)

    def normal_range(self, foot: int, friction: float) -> tuple[float, float] | None:
        """Return the least and the largest normal force in N that torques can put on a foot.

        ``foot`` is its place in the list of feet, ``friction`` the coefficient of Coulomb friction.
        While no foot pulls or slips; None if that is not to be had.
        """
        slopes, offsets = self._cones(friction)
        row = self.motors + 2 * foot + 1
        if not self.dimension:
            alone = float(self.first[row])
            return (alone, alone) if self.exists and offsets.min() >= 0 else None
        found = []
        for sign in (1.0, -1.0):
            solved = linprog(
                sign * self.directions[row], A_ub=-slopes, b_ub=offsets, bounds=(None, None)
            )
            if not (self.exists and solved.success):
                return None
            force = float(self.first[row] + self.directions[row] @ solved.x)
            found.append(max(force, 0.0))  # what is below is rounding
        return found[0], found[1]

    def _best(self, aim: Aim, friction: float, split: Sequence[float] | None) -> Array | None:
        """The numbers to choose, None if no foot may pull or slip in any way."""
        slopes, offsets = self._cones(friction)
        torques = self.directions[: self.motors], self.first[: self.motors]
        if aim is Aim.TORQUE:
            return _least(*torques, slopes, offsets)
        if aim is Aim.FRICTION:
            margin = _largest_margin(slopes, offsets)
            if margin is None:
                return None
            return _least(*torques, slopes, offsets - margin + ZERO * max(abs(margin), 1.0))
        normals = self.directions[self.motors + 1 :: 2], self.first[self.motors + 1 :: 2]
        shares = np.full(len(normals[1]), 1 / len(normals[1])) if split is None else split
        # The load is what the feet carry together, whatever is chosen.
        wanted = np.asarray(shares, dtype=float) * normals[1].sum()
        first = _least(normals[0], normals[1] - wanted, slopes, offsets)
        if first is None:
            return None
        # Among those that press alike, the least torque.
        free = _flat(normals[0])
        if not free.shape[1]:
            return first
        slack = ZERO * np.abs(normals[1]).max()
        more = _least(
            torques[0] @ free,
            torques[1] + torques[0] @ first,
            slopes @ free,
            offsets + slopes @ first + slack,
        )
        return first if more is None else first + free @ more

    def _cones(self, friction: float) -> tuple[Array, Array]:
        """Rows ``slopes a + offsets >= 0``: no foot slips to either side, so none pulls."""
        rows = []
        for tangent in range(self.motors, len(self.first), 2):
            for sign in (1.0, -1.0):
                row = np.zeros(len(self.first))
                row[tangent], row[tangent + 1] = sign, friction
                rows.append(row)
        cones = np.array(rows)
        return cones @ self.directions, cones @ self.first

    def _margins(self, friction: float, chosen: Array) -> Array:
        slopes, offsets = self._cones(friction)
        margins: Array = slopes @ chosen + offsets
        return margins

    def _made(self, verdict: Verdict, friction: float, chosen: Array | None = None) -> Distribution:
        chosen = np.zeros(self.dimension) if chosen is None else chosen
        found = self.first + self.directions @ chosen
        return Distribution(
            verdict=verdict,
            dimension=self.dimension,
            torques=found[: self.motors],
            forces=found[self.motors :].reshape(-1, 2),
            margin=float(self._margins(friction, chosen).min()),
        )


def force_family(
    linkage: Linkage,
    q: Array,
    feet: Sequence[str],
    *,
    rates: Array | None = None,
    accelerations: Array | None = None,
    locked: Sequence[str] = (),
) -> ForceFamily:
    """Find all torques and foot forces that keep a robot at rest, or bring about a motion.

    ``linkage`` is that of a `Robot`, ``feet`` names those that stand. ``q``, ``rates`` and
    ``accelerations`` have shape (N,), in the order of the linkage, SI; without the latter two the
    robot is at rest. ``locked`` joints hold themselves. Raises `UnknownNameError` for a foot or a
    joint that is not there.

    >>> from flexspine import force_family, load_robot, standing
    >>> robot = load_robot("sc618")
    >>> family = force_family(robot.linkage, standing(robot, 0.33), [*robot.feet])
    >>> family.dimension
    4
    """
    known = [foot.name for foot in linkage.feet]
    for foot in feet:
        if foot not in known:
            raise UnknownNameError("foot", foot, known)
    for joint in locked:
        if joint not in linkage.place:
            raise UnknownNameError("joint", joint, [each.name for each in linkage.joints])
    motors = linkage.actuation.shape[1]
    holds = np.eye(linkage.size)[:, [linkage.place[name] for name in locked]]
    matrix = np.concatenate([linkage.actuation, linkage.foot_jacobian(q, feet).T, holds], axis=1)
    needed = passive_forces(linkage, q, np.zeros_like(q) if rates is None else rates)
    if accelerations is not None:
        needed = needed + linkage.mass_matrix(q) @ accelerations
    solved = np.linalg.lstsq(matrix, needed, rcond=ZERO)[0]
    directions = null_space(matrix, rcond=ZERO)
    wrong = np.abs(matrix @ solved - needed).max()
    rows = motors + 2 * len(feet)
    return ForceFamily(
        motors=motors,
        first=solved[:rows],
        directions=directions[:rows],
        exists=bool(wrong <= ZERO * np.abs(needed).max()),
    )


def _flat(matrix: Array) -> Array:
    """Directions that change nothing; the columns of ``matrix`` are of unit length or shorter."""
    _, sizes, axes = np.linalg.svd(matrix)
    axes = axes[int((sizes > ZERO).sum()) :]
    return np.asarray(axes.T, dtype=float)


def _least(matrix: Array, start: Array, slopes: Array, offsets: Array) -> Array | None:
    """Numbers ``a`` that make ``|matrix a + start|`` least while ``slopes a + offsets >= 0``."""
    found, _, flag, _ = daqp.solve(
        matrix.T @ matrix,
        matrix.T @ start,
        np.ascontiguousarray(slopes),
        np.full(len(offsets), 1e30),
        -offsets,
        np.full(len(offsets), INEQUALITY, dtype=np.intc),
        eps_prox=AUTOMATIC,
    )
    return np.asarray(found, dtype=float) if flag == SOLVED else None


def _largest_margin(slopes: Array, offsets: Array) -> float | None:
    """The largest ``s`` with ``slopes a + offsets >= s`` for some ``a``; None below zero."""
    rows = np.concatenate([-slopes, np.ones((len(offsets), 1))], axis=1)
    count = slopes.shape[1]
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=rows,
        b_ub=offsets,
        bounds=[(None, None)] * (count + 1),
    )
    if not found.success or -found.fun < 0:
        return None
    return float(-found.fun)
