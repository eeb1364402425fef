"""The flexible bounder's field with both legs in stance, simplified by hand, in heyoka's terms."""

from __future__ import annotations

from typing import Any

import heyoka as hy
from heyoka import cos, par, sin, sqrt

# par: 0 m, 1 g, 2 A, 3 B, 4 k, 5 l, 6 k_t, 7 near, 8 far, 9 fore toe, 10 hind toe, 11 1/m, 12 rest
NAMES = ("x", "y", "p", "q", "vx", "vy", "wp", "wq")


def hand_field() -> list[tuple[Any, Any]]:
    x, y, p, q, vx, vy, wp, wq = hy.make_vars(*NAMES)
    inertia, coupling, stiffness, length = (par[i] for i in (2, 3, 4, 5))
    near, far = par[7], par[8]
    cp, sp, cq, sq = cos(p), sin(p), cos(q), sin(q)
    fore = (x + far * cp + near * cq - par[9], y + far * sp + near * sq)
    hind = (x - near * cp - far * cq - par[10], y - near * sp - far * sq)
    forces = []
    for u, v in (fore, hind):
        load = stiffness * (length / sqrt(u * u + v * v) - 1.0)
        forces.append((load * u, load * v))
    (fx, fy), (hx, hy_) = forces
    bend = p - q
    torque = par[6] * (bend - par[12])
    turn_f = far * (fy * cp - fx * sp) - near * (hy_ * cp - hx * sp)
    turn_h = near * (fy * cq - fx * sq) - far * (hy_ * cq - hx * sq)
    s, c = coupling * sin(bend), coupling * cos(bend)
    r1 = turn_f - torque - s * wq * wq
    r2 = turn_h + torque + s * wp * wp
    ratio = c / inertia
    second = (r2 - ratio * r1) / (inertia - ratio * c)
    first = r1 / inertia - ratio * second
    return [
        (x, vx), (y, vy), (p, wp), (q, wq),
        (vx, (fx + hx) * par[11]), (vy, (fy + hy_) * par[11] - par[1]), (wp, first), (wq, second),
    ]  # fmt: skip


def hand_values(toes: tuple[float, float]) -> list[float]:
    """Parameter values of the published body."""
    m, j, a, h = 10.4, 0.36, 0.138, 0.138
    return [
        2 * m, 9.81, j + m / 2 * a**2, m / 2 * a**2, 6340.0, 0.36, 260.0,
        a / 2, a + h - a / 2, *toes, 1 / (2 * m), 0.0,
    ]  # fmt: skip
