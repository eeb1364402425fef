"""A robot on flat ground once more, by other means.

Pinocchio knows its masses and forces, SciPy's DOP853 integrates, and what touching feet do is a
linear complementarity problem (Stewart and Trinkle) that Lemke's pivots solve. Nothing here comes
from the package but the robot's numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from flexspine import Robot
from tests.mechanics.test_linkage import Engine

Array = NDArray[np.float64]

# s; the first step after an event, and the longest.
SHORTEST, LONGEST = 1e-9, 1e-3

# What a guard has to have been above to fire when it falls through zero.
ARMED = {"touchdown": 1e-14, "stops sliding": 5e-13, "": 1e-6}

# m/s; slower feet are at rest after an impact.
REST = 1e-11

# m/s; a foot that slides the wrong way by this much does not slide.
CREEP = 1e-12

# m; feet that would bounce less high stay on the ground, as is agreed.
BOUNCE = 1e-14


def lemke(matrix: Array, vector: Array) -> Array:
    """The z >= 0 with w = M z + q >= 0 and w . z = 0."""
    n = len(vector)
    if vector.min() >= 0:
        return np.zeros(n)
    table = np.hstack([np.eye(n), -matrix, -np.ones((n, 1)), vector[:, None]])
    basis = list(range(n))
    row, entering = int(np.argmin(vector)), 2 * n
    for _ in range(100 * n):
        leaving = basis[row]
        table[row] /= table[row, entering]
        for other in range(n):
            if other != row:
                table[other] -= table[other, entering] * table[row]
        basis[row] = entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = table[:, -1]
            return z[n : 2 * n]
        entering = leaving + n if leaving < n else leaving - n
        column = table[:, entering]
        candidates = np.flatnonzero(column > 1e-12)
        assert candidates.size, "no way out"
        ratios = table[candidates, -1] / column[candidates]
        least = candidates[ratios <= ratios.min() + 1e-13 * (1 + abs(ratios.min()))]
        row = next((i for i in least if basis[i] == 2 * n), int(least[0]))
    raise AssertionError("it goes round in circles")


def pushes(response: Array, before: Array, friction: float, sliding: list[int]) -> Array:
    """Pushes (k, 2) on feet of which some slide already (1, -1), others (0) are at rest."""
    feet = len(sliding)
    columns: list[Array] = []
    for foot, way in enumerate(sliding):
        normal = np.zeros(2 * feet)
        normal[2 * foot : 2 * foot + 2] = -friction * way, 1.0
        columns.append(normal)
    rest = [foot for foot, way in enumerate(sliding) if way == 0]
    for sign in (1.0, -1.0):
        for foot in rest:
            tangent = np.zeros(2 * feet)
            tangent[2 * foot] = sign
            columns.append(tangent)
    to_push = np.array(columns).T
    rows = np.zeros_like(to_push)
    for foot in range(feet):
        rows[2 * foot + 1, foot] = 1.0
    rows[:, feet:] = to_push[:, feet:]
    k, size = len(rest), len(columns)
    matrix = np.zeros((size + k, size + k))
    matrix[:size, :size] = rows.T @ response @ to_push
    vector = np.concatenate([rows.T @ before, np.zeros(k)])
    for number, foot in enumerate(rest):
        one, other, speed = feet + number, feet + k + number, size + number
        matrix[one, speed] = matrix[other, speed] = 1.0
        matrix[speed, [foot, one, other]] = friction, -1.0, -1.0
    return (to_push @ lemke(matrix, vector)[:size]).reshape(-1, 2)


class Happening(NamedTuple):
    """What happened, when, the state right after, and the feet on the ground: 0, 1 or -1."""

    name: str
    time: float
    q: Array
    rates: Array
    feet: dict[str, int]


class Falling:
    """A robot whose motors, if they do anything, have constant torques by joint."""

    def __init__(self, robot: Robot, torques: Mapping[str, float] | None = None) -> None:
        self.engine, self.numbers = Engine(robot.linkage), robot.numbers
        self.feet, self.friction = list(robot.feet), robot.numbers["friction"]
        self.places = {}
        links = list(robot.parents)
        for joint, (link, _) in robot.joints.items():
            self.places[joint] = links.index(link)
        self.torques = dict(torques or {})

    def foot(self, name: str, q: Array, rates: Array) -> tuple[Array, Array]:
        """Place and velocity."""
        place, jacobian, _ = self.engine.foot(name, q, rates)
        return place, jacobian @ rates

    def applied(self, q: Array, rates: Array) -> Array:
        """All forces but those of the ground."""
        found = -self.engine.forces(q, rates)
        for joint, place in self.places.items():
            bend = q[place] - self.numbers[f"{joint}.rest"]
            found[place] -= self.numbers[f"{joint}.stiffness"] * bend
            found[place] -= self.numbers[f"{joint}.damping"] * rates[place]
            found[place] += self.torques.get(joint, 0.0)
        return found

    def motion(self, q: Array, rates: Array, feet: Mapping[str, int]) -> tuple[Array, Array]:
        """Accelerations and forces on feet that stick (0) or slide, by Newton's equations."""
        n, k = len(q), len(feet)
        matrix = np.zeros((n + 2 * k, n + 2 * k))
        right = np.zeros(n + 2 * k)
        matrix[:n, :n], right[:n] = self.engine.mass_matrix(q), self.applied(q, rates)
        for number, (name, way) in enumerate(feet.items()):
            _, jacobian, bias = self.engine.foot(name, q, rates)
            x, y = n + 2 * number, n + 2 * number + 1
            matrix[:n, [x, y]] = -jacobian.T
            matrix[y, :n], right[y] = jacobian[1], -bias[1]
            if way:
                matrix[x, x], matrix[x, y] = 1.0, way * self.friction
            else:
                matrix[x, :n], right[x] = jacobian[0], -bias[0]
        solved = np.linalg.solve(matrix, right)
        return solved[:n], solved[n:].reshape(-1, 2)

    def jacobian(self, q: Array, names: list[str]) -> Array:
        return np.vstack([self.engine.foot(name, q, np.zeros_like(q))[1] for name in names])

    def hit(self, q: Array, rates: Array, names: list[str]) -> Array:
        """The rates after feet have hit the ground."""
        jacobian = self.jacobian(q, names)
        spread = np.linalg.solve(self.engine.mass_matrix(q), jacobian.T)
        found = pushes(jacobian @ spread, jacobian @ rates, self.friction, [0] * len(names))
        return rates + spread @ found.ravel()

    def next(self, q: Array, rates: Array, names: list[str]) -> tuple[Array, dict[str, int]]:
        """The rates and what feet do that touch the ground; lowest bounces are none."""
        jacobian = self.jacobian(q, names)
        bias = np.concatenate([self.engine.foot(name, q, rates)[2] for name in names])
        down: list[int] = []
        while True:
            after = (jacobian @ rates).reshape(-1, 2)
            rising = [i for i in range(len(names)) if i not in down and after[i, 1] > REST]
            feet, accelerations = self._pressed(
                q, rates, {name: after[i, 0] for i, name in enumerate(names) if i not in rising}
            )
            gain = (jacobian @ accelerations + bias)[1::2]
            low = [i for i in rising if after[i, 1] ** 2 <= -2 * gain[i] * BOUNCE]
            if not low:
                return rates, feet
            down += low
            kept = [2 * i + 1 for i, name in enumerate(names) if i in low or name in feet]
            kept += [2 * i for i, name in enumerate(names) if feet.get(name, 1) == 0]
            kept += [2 * i for i in low if abs(after[i, 0]) <= REST]
            rows = jacobian[kept]
            spread = np.linalg.solve(self.engine.mass_matrix(q), rows.T)
            rates = rates - spread @ np.linalg.solve(rows @ spread, rows @ rates)

    def _pressed(
        self, q: Array, rates: Array, speeds: Mapping[str, float]
    ) -> tuple[dict[str, int], Array]:
        """What feet do that the weight presses to the ground, by their speeds on it."""
        ways = [0 if abs(speed) <= REST else int(np.sign(speed)) for speed in speeds.values()]
        inertia, applied = self.engine.mass_matrix(q), self.applied(q, rates)
        free = np.linalg.solve(inertia, applied)
        if not speeds:
            return {}, free
        jacobian = self.jacobian(q, list(speeds))
        spread = np.linalg.solve(inertia, jacobian.T)
        bias = np.concatenate([self.engine.foot(name, q, rates)[2] for name in speeds])
        before = jacobian @ free + bias
        forces = pushes(jacobian @ spread, before, self.friction, ways)
        gained = (before + jacobian @ spread @ forces.ravel()).reshape(-1, 2)
        size = np.abs(before).max()
        feet = {}
        for name, way, force, gain in zip(speeds, ways, forces, gained, strict=True):
            if force[1] > 0 and gain[1] <= 1e-9 * size:
                slips = abs(gain[0]) > 1e-9 * size
                feet[name] = way if way or not slips else int(np.sign(gain[0]))
        return feet, free + spread @ forces.ravel()

    def run(self, q: Array, rates: Array, seconds: float) -> list[Happening]:
        """All that happens to a robot that starts in the air."""
        time, feet, found = 0.0, {}, []
        while time < seconds:
            event = self._flow(time, q, rates, feet, seconds)
            if event is None:
                break
            time, q, rates, kind, foot = event
            if kind == "touchdown":
                names = [name for name in self.feet if name in feet or name == foot]
                rates = self.hit(q, rates, names)
                rates, feet = self.next(q, rates, names)
            elif kind == "lift-off":
                feet = {name: way for name, way in feet.items() if name != foot}
            elif kind == "stops sliding":
                rates, feet = self.next(q, rates, list(feet))
            else:
                feet = {**feet, foot: 1 if kind.endswith("forward") else -1}
            feet = {name: feet[name] for name in self.feet if name in feet}
            found.append(Happening(f"{foot} {kind}", time, q, rates, feet))
        return found

    def guards(
        self, feet: Mapping[str, int], q: Array, rates: Array
    ) -> dict[tuple[str, str], float]:
        """What stays above zero as long as feet go on like this, by kind of event and foot."""
        found = {}
        _, forces = self.motion(q, rates, feet)
        by_foot = dict(zip(feet, forces, strict=True))
        for name in self.feet:
            place, velocity = self.foot(name, q, rates)
            if name not in feet:
                found["touchdown", name] = float(place[1])
                continue
            tangent, normal = by_foot[name]
            found["lift-off", name] = float(normal)
            if feet[name]:
                found["stops sliding", name] = float(feet[name] * velocity[0]) + CREEP
            else:
                found["begins to slide forward", name] = float(self.friction * normal + tangent)
                found["begins to slide back", name] = float(self.friction * normal - tangent)
        return found

    def _flow(
        self, time: float, q: Array, rates: Array, feet: Mapping[str, int], seconds: float
    ) -> tuple[float, Array, Array, str, str] | None:
        n = len(q)

        def field(_: float, y: Array) -> Array:
            return np.concatenate([y[n:], self.motion(y[:n], y[n:], feet)[0]])

        def at(y: Array) -> dict[tuple[str, str], float]:
            return self.guards(feet, y[:n], y[n:])

        start = np.concatenate([q, rates])
        stepper = DOP853(field, time, start, seconds, first_step=SHORTEST, rtol=1e-12, atol=1e-12)
        armed = {key for key, value in at(start).items() if value > _threshold(key)}
        while stepper.status == "running":
            stepper.max_step = min(LONGEST, max(SHORTEST, 0.5 * (stepper.t - time)))
            stepper.h_abs = min(stepper.h_abs, stepper.max_step)
            stepper.step()
            dense = stepper.dense_output()
            values = at(stepper.y)
            crossed = []
            for key in armed:
                if values[key] <= 0:
                    root = brentq(self._guard(dense, at, key), stepper.t_old, stepper.t,
                                  xtol=1e-16, rtol=1e-15)  # fmt: skip
                    crossed.append((root, *key))
            if crossed:
                moment, kind, foot = min(crossed)
                y = dense(moment)
                return moment, y[:n].copy(), y[n:].copy(), kind, foot
            armed |= {key for key, value in values.items() if value > _threshold(key)}
        return None

    @staticmethod
    def _guard(
        dense: Callable[[float], Array],
        at: Callable[[Array], dict[tuple[str, str], float]],
        key: tuple[str, str],
    ) -> Callable[[float], float]:
        return lambda time: at(dense(time))[key]


def _threshold(key: tuple[str, str]) -> float:
    return ARMED.get(key[0], ARMED[""])
