"""The fair peer: one stride of the published flexible gait with SciPy's `solve_ivp`.

The field is simplified by hand and written with scalar `math`, which is several times faster than
the NumPy style most people write; events are SciPy's own, terminal. `numpy_field` is that style,
for comparison.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin, sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

MASS, INERTIA, OFFSET, HIP = 10.4, 0.36, 0.138, 0.138
STIFFNESS, LENGTH, SPINE, GRAVITY = 6340.0, 0.36, 260.0, 9.81
WHOLE = 2 * MASS
EFFECTIVE = INERTIA + MASS / 2 * OFFSET**2
COUPLING = MASS / 2 * OFFSET**2
NEAR, FAR = OFFSET / 2, OFFSET + HIP - OFFSET / 2
ANGLE = {"fore": 0.4612813446910027, "hind": 0.5623577670742721}
START = (
    0.0, 0.32, 0.10385204124646978, -0.10385204124646978,
    4.50071645170713, 0.0, -3.89389870409466, -3.89389870409466,
)  # fmt: skip

Event = Callable[[float, Any], float]
Toes = dict[str, float]


def scalar_field(toes: Toes) -> Callable[[float, Any], tuple[float, ...]]:
    fore, hind = toes.get("fore"), toes.get("hind")

    def field(_t: float, z: Any) -> tuple[float, ...]:
        x, y, p, q, vx, vy, wp, wq = z.tolist()
        sp, cp, sq, cq = sin(p), cos(p), sin(q), cos(q)
        fx_sum = fy_sum = 0.0
        bend = p - q
        torque = SPINE * bend
        on_p, on_q = -torque, torque
        if fore is not None:
            u, v = x + FAR * cp + NEAR * cq - fore, y + FAR * sp + NEAR * sq
            load = STIFFNESS * (LENGTH / sqrt(u * u + v * v) - 1.0)
            fx, fy = load * u, load * v
            fx_sum += fx
            fy_sum += fy
            on_p += FAR * (fy * cp - fx * sp)
            on_q += NEAR * (fy * cq - fx * sq)
        if hind is not None:
            u, v = x - NEAR * cp - FAR * cq - hind, y - NEAR * sp - FAR * sq
            load = STIFFNESS * (LENGTH / sqrt(u * u + v * v) - 1.0)
            fx, fy = load * u, load * v
            fx_sum += fx
            fy_sum += fy
            on_p -= NEAR * (fy * cp - fx * sp)
            on_q -= FAR * (fy * cq - fx * sq)
        s, c = COUPLING * sin(bend), COUPLING * cos(bend)
        r1, r2 = on_p - s * wq * wq, on_q + s * wp * wp
        det = EFFECTIVE * EFFECTIVE - c * c
        return (
            vx, vy, wp, wq, fx_sum / WHOLE, fy_sum / WHOLE - GRAVITY,
            (EFFECTIVE * r1 - c * r2) / det, (EFFECTIVE * r2 - c * r1) / det,
        )  # fmt: skip

    return field


def numpy_field(toes: Toes) -> Callable[[float, Any], Any]:
    """The same field as most people write it: arrays, and a linear solve."""
    reach = {"fore": np.array([FAR, NEAR]), "hind": np.array([-NEAR, -FAR])}

    def field(_t: float, z: Any) -> Any:
        position, angles, velocity, rates = z[:2], z[2:4], z[4:6], z[6:8]
        bend = angles[0] - angles[1]
        c, s = COUPLING * np.cos(bend), COUPLING * np.sin(bend)
        mass = np.array([[EFFECTIVE, c], [c, EFFECTIVE]])
        right = np.array([-s * rates[1] ** 2, s * rates[0] ** 2])
        right += SPINE * bend * np.array([-1.0, 1.0])
        force = np.array([0.0, -WHOLE * GRAVITY])
        for side, toe in toes.items():
            arm = reach[side]
            along = np.array([arm @ np.cos(angles), arm @ np.sin(angles)])
            leg = position + along - np.array([toe, 0.0])
            push = STIFFNESS * (LENGTH / np.linalg.norm(leg) - 1) * leg
            force += push
            right += arm * (push[1] * np.cos(angles) - push[0] * np.sin(angles))
        return np.concatenate([velocity, rates, force / WHOLE, np.linalg.solve(mass, right)])

    return field


def hip_place(side: str, z: Any) -> tuple[float, float]:
    a, b = (FAR, NEAR) if side == "fore" else (-NEAR, -FAR)
    return z[0] + a * cos(z[2]) + b * cos(z[3]), z[1] + a * sin(z[2]) + b * sin(z[3])


def terminal(event: Event) -> Event:
    event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    return event


def _leg_event(side: str, toes: Toes, angle: float) -> Event:
    if side in toes:

        def liftoff(_t: float, z: Any) -> float:
            x, y = hip_place(side, z)
            return LENGTH - sqrt((x - toes[side]) ** 2 + y * y)

        return terminal(liftoff)
    landing = LENGTH * cos(angle)
    return terminal(lambda _t, z: hip_place(side, z)[1] - landing)


def stride(
    method: str,
    tolerance: float,
    field: Callable[[Toes], Any] = scalar_field,
    start: Any = START,
    angles: dict[str, float] = ANGLE,
) -> tuple[float, Any]:
    """One stride from apex to apex; returns period and end state."""
    z, t = np.array(start), 0.0
    toes: Toes = {}
    landed: set[str] = set()
    sides = ("fore", "hind")
    while True:
        events = [_leg_event(side, dict(toes), angles[side]) for side in sides]
        if not toes and len(landed) == 2:
            events.append(terminal(lambda _t, z: z[5]))
        done = solve_ivp(
            field(dict(toes)), (t, 10.0), z, method, rtol=tolerance, atol=tolerance, events=events
        )
        t, z = done.t[-1], done.y[:, -1]
        fired = next(i for i, times in enumerate(done.t_events) if len(times))
        if fired == 2:
            return t, z
        side = sides[fired]
        if side in toes:
            del toes[side]
        else:
            toes[side] = hip_place(side, z)[0] + LENGTH * sin(angles[side])
            landed.add(side)
