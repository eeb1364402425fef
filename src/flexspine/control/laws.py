"""Laws that choose torques at one instant, from what joints are to do and which feet stand."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import daqp
import numpy as np

from flexspine.mechanics.linkage import Array, Linkage
from flexspine.mechanics.stance import equations, tracked

# What daqp calls equations, inequalities, and a problem that it has solved.
EQUATION, INEQUALITY = 5, 0
SOLVED = 1
BOUNDLESS = 1e30

# Of the tracking residual; makes torques unique where several serve as well.
SMALL = 1e-8

# Of daqp's proximal steps, which it needs as forces and most accelerations cost nothing.
PROXIMAL = 1e-6


@dataclass(frozen=True)
class Situation:
    """A robot at one instant, and what is wanted of it.

    ``feet`` are those that are to stand; ``regular`` if they do, none slides and no other foot
    touches the ground. ``joints`` (3, m) are angle, rate and acceleration that are wanted of the
    motors' joints, ``links`` those of the swinging legs' links, ``com`` (3, 2) place, velocity and
    acceleration of the centre of mass. ``limit`` bounds torques, in N m.
    """

    linkage: Linkage
    q: Array
    rates: Array
    feet: tuple[str, ...]
    regular: bool
    joints: Array
    links: Mapping[str, Array]
    com: Array
    trunk: tuple[str, ...]
    friction: float
    limit: float


class Law(ABC):
    """How torques are chosen."""

    name: str
    stiffness: float
    damping: float

    @abstractmethod
    def torques(self, now: Situation) -> Array:
        """The torques (m,). Raises `numpy.linalg.LinAlgError` where there are none."""


@dataclass(frozen=True)
class Tracking(Law):
    """Computed torque: ``e'' + K_d e' + K_p e = 0`` for every motor's joint.

    While feet slide or bounce that is not to be had, and `LeastResidual` takes over.
    ``stiffness`` in 1/s^2, ``damping`` in 1/s.
    """

    stiffness: float = 400.0
    damping: float = 40.0
    name = "tracking"

    def wanted(self, now: Situation) -> Array:
        """The accelerations of the joints, shape (m,)."""
        motors = now.linkage.actuation.T
        angle, rate, acceleration = now.joints
        back = self.stiffness * (angle - motors @ now.q)
        back += self.damping * (rate - motors @ now.rates)
        wanted: Array = acceleration + back
        return wanted

    def torques(self, now: Situation) -> Array:
        """The torques (m,)."""
        if not now.regular:
            return LeastResidual(self.stiffness, self.damping).torques(now)
        return tracked(now.linkage, now.q, now.rates, now.feet, self.wanted(now)).torques


@dataclass(frozen=True)
class LeastResidual(Tracking):
    """Computed torque as nearly as dynamics, contacts, friction and limits of torques allow.

    A quadratic program in accelerations, torques and forces; it has an answer where `Tracking`
    is over- or underdetermined.
    """

    name = "qp"

    def torques(self, now: Situation) -> Array:
        """The torques (m,)."""
        still, right = equations(now.linkage, now.q, now.rates, now.feet)
        count, size = still.shape
        n, m, k = now.linkage.size, len(now.joints[0]), 2 * len(now.feet)
        moves = np.zeros((m, size))
        moves[:, :n] = now.linkage.actuation.T
        cost = moves.T @ moves
        cost[range(n, n + m), range(n, n + m)] += SMALL
        cones = np.zeros((k, size))
        for i in range(k // 2):
            t, f = n + m + 2 * i, n + m + 2 * i + 1
            cones[2 * i, [t, f]] = 1.0, now.friction
            cones[2 * i + 1, [t, f]] = -1.0, now.friction
        bounds = np.zeros((m, size))
        bounds[range(m), range(n, n + m)] = 1.0
        limits = np.full(m, min(now.limit, BOUNDLESS))
        rows = np.concatenate([still, cones, bounds])
        upper = np.concatenate([right, np.full(k, BOUNDLESS), limits])
        lower = np.concatenate([right, np.zeros(k), -limits])
        sense = np.full(len(rows), INEQUALITY, dtype=np.intc)
        sense[:count] = EQUATION
        found, _, flag, _ = daqp.solve(
            cost,
            -moves.T @ self.wanted(now),
            np.ascontiguousarray(rows),
            upper,
            lower,
            sense,
            eps_prox=PROXIMAL,
        )
        if flag != SOLVED:
            raise np.linalg.LinAlgError("no torques within the limits keep the feet on the ground")
        return np.asarray(found[n : n + m], dtype=float)


@dataclass(frozen=True)
class SevenOutputs(Law):
    """Centre of mass, mean pitch of the trunk and the swinging legs; the spine moves as it will.

    With two feet on the ground these seven outputs and equal horizontal forces on both make all
    torques known. ``stiffness`` in 1/s^2, ``damping`` in 1/s.
    """

    stiffness: float = 400.0
    damping: float = 40.0
    name = "com"

    def torques(self, now: Situation) -> Array:
        """The torques (m,)."""
        still, right = equations(now.linkage, now.q, now.rates, now.feet)
        outputs, wanted = self._outputs(now)
        n, m, size = now.linkage.size, len(now.joints[0]), still.shape[1]
        equal = np.zeros((int(len(now.feet) == 2), size))
        for row in equal:
            row[[n + m, n + m + 2]] = 1.0, -1.0
        rows = np.zeros((len(outputs), size))
        rows[:, :n] = outputs
        matrix = np.concatenate([still, rows, equal])
        right = np.concatenate([right, wanted, np.zeros(len(equal))])
        if matrix.shape[0] == matrix.shape[1]:
            found = np.linalg.solve(matrix, right)
        else:
            found = np.linalg.lstsq(matrix, right, rcond=None)[0]
        return np.asarray(found[n : n + m], dtype=float)

    def _outputs(self, now: Situation) -> tuple[Array, Array]:
        """Rows of ``q''`` and what they are to be."""
        linkage, q, rates = now.linkage, now.q, now.rates
        turns = linkage.to_absolute
        pitch = np.mean([turns[linkage.place[link]] for link in now.trunk], axis=0)
        rows = [*linkage.com_jacobian(q), pitch]
        bias = [*linkage.com_bias(q, rates), 0.0]
        place = [*linkage.com(q), pitch @ q]
        aims = [*now.com.T, np.zeros(3)]
        for link, aim in now.links.items():
            row = turns[linkage.place[link]]
            rows.append(row)
            bias.append(0.0)
            place.append(row @ q)
            aims.append(aim)
        matrix, aim = np.array(rows), np.array(aims)
        back = self.stiffness * (aim[:, 0] - place) + self.damping * (aim[:, 1] - matrix @ rates)
        return matrix, aim[:, 2] + back - np.array(bias)


@dataclass(frozen=True)
class JointSprings(Law):
    """Joints drawn to their angles by springs and dampers, in N m/rad and N m s/rad."""

    stiffness: float = 300.0
    damping: float = 4.0
    name = "pd"

    def torques(self, now: Situation) -> Array:
        """The torques (m,)."""
        motors = now.linkage.actuation.T
        angle, rate, _ = now.joints
        return self.pull(angle - motors @ now.q, rate - motors @ now.rates)

    def pull(self, off: Array, off_rate: Array) -> Array:
        """The torques that take away what angles and rates are off, shape (m,)."""
        torques: Array = self.stiffness * off + self.damping * off_rate
        return torques
