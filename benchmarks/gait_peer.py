"""The fair peers of the gait search: symmetric gaits of the published flexible body with SciPy.

The field is that of `scipy_peer`, integrated by DOP853 with terminal events; `scipy.optimize.root`
(hybr) solves the three half-stride equations, a full stride confirms the gait. Two peers:

- `differences`: hybr makes its own Jacobian, multipliers are central differences of full strides.
  What a careful user writes in an afternoon.
- `tangents`: Jacobian and multipliers from variational equations written and simplified by hand for
  this body and these phases, one guard a phase, the rise to the apex without any, nothing
  evaluated twice, and the multipliers from half a stride, as the other half is the first one run
  backwards and mirrored with the lift-off angle held fixed. The most that SciPy can do here.

Setting: k_t = 260 N m/rad, 290 J, apex at 0.32 m, the fore leg lands first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import atan2, cos, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

from benchmarks.scipy_peer import (
    COUPLING,
    EFFECTIVE,
    FAR,
    GRAVITY,
    LENGTH,
    NEAR,
    SPINE,
    STIFFNESS,
    WHOLE,
    Event,
    hip_place,
    scalar_field,
    stride,
    terminal,
)

ENERGY, HEIGHT = 290.0, 0.32
TOLERANCE = 5e-13  # leaves a residual of about 1e-11 after a stride
TANGENT_TOLERANCE = 1e-7  # leaves errors of about 1e-7 in the multipliers
STEP = 1e-10  # the xtol of hybr; larger ones leave residuals of 1e-10
SHIFT = 1e-5  # central differences with it leave errors of about 1e-7 in the multipliers
PEERS = ("differences", "tangents")
CONFIRMED = 1e-9  # the largest residual after a stride that passes for a gait

FLIGHT = scalar_field({})
SECTION = [1, 2, 3, 4, 6, 7]  # y, both pitches, xdot, both pitch rates
TURNING = [2, 3, 6, 7]  # both pitches and their rates
# Fore for hind and backwards in time: pitches trade places and signs, their rates trade places.
MIRROR = np.zeros((6, 6))
MIRROR[range(6), [0, 2, 1, 3, 5, 4]] = 1.0, -1.0, -1.0, 1.0, 1.0, 1.0


class Gait(NamedTuple):
    """A symmetric gait at its apex, and the largest change of the section after one stride."""

    pitch: float
    pitch_rate: float
    fore_angle: float
    hind_angle: float
    speed: float
    residual: float


class Half(NamedTuple):
    """Half a stride: its end states, the lengths of its phases and the lift-off angle."""

    start: Any
    end: Any
    fall: float
    stance: float
    rise: float
    liftoff: float


class Tangent(NamedTuple):
    """Derivatives of half a stride by (y, pitches, xdot, pitch rates, fore angle)."""

    end: Any
    time: Any
    liftoff: Any


def apex_state(pitch: float, rate: float) -> Any:
    """The symmetric apex of the given energy and height."""
    turning = (EFFECTIVE + COUPLING * cos(2 * pitch)) * rate * rate
    rest = ENERGY - WHOLE * GRAVITY * HEIGHT - 2 * SPINE * pitch * pitch - turning
    return np.array([0.0, HEIGHT, pitch, -pitch, sqrt(2 * rest / WHOLE), 0.0, rate, rate])


def _until(field: Any, z: Any, event: Event) -> tuple[float, Any]:
    done = solve_ivp(
        field, (0.0, 1.0), z, "DOP853", rtol=TOLERANCE, atol=TOLERANCE, events=terminal(event)
    )
    if done.status != 1:
        raise ValueError("a phase of the half stride does not end")
    return done.t[-1], done.y[:, -1]


def _during(field: Any, z: Any, span: float, tolerance: float) -> Any:
    return solve_ivp(field, (0.0, span), z, "DOP853", rtol=tolerance, atol=tolerance).y[:, -1]


def half_stride(start: Any, angle: float) -> Half:
    """Fall, fore stance and rise to the next apex."""
    landing = LENGTH * cos(angle)
    fall, z = _until(FLIGHT, start, lambda _t, z: hip_place("fore", z)[1] - landing)
    toe = hip_place("fore", z)[0] + LENGTH * sin(angle)

    def shortened(_t: float, z: Any) -> float:
        x, y = hip_place("fore", z)
        return LENGTH - sqrt((x - toe) ** 2 + y * y)

    stance, z = _until(scalar_field({"fore": toe}), z, shortened)
    x, y = hip_place("fore", z)
    rise = z[5] / GRAVITY
    if rise <= 0.0:
        raise ValueError("no apex after the fore stance")
    end = _during(FLIGHT, z, rise, TOLERANCE)
    return Half(start, end, fall, stance, rise, atan2(x - toe, y))


def _turning_tangent(_t: float, z: Any) -> Any:
    """Pitches in flight, and the variational equations of four directions."""
    p, q, wp, wq = z[:4].tolist()
    bend = p - q
    s, c = COUPLING * sin(bend), COUPLING * cos(bend)
    r1, r2 = -SPINE * bend - s * wq * wq, SPINE * bend + s * wp * wp
    det = EFFECTIVE * EFFECTIVE - c * c
    a, b = EFFECTIVE / det, c / det
    ap, aq = a * r1 - b * r2, a * r2 - b * r1
    d1, d2 = s * aq - SPINE - c * wq * wq, s * ap + SPINE + c * wp * wp
    pp, qq = a * d1 - b * d2, a * d2 - b * d1
    d3, d4 = -2 * s * wq, 2 * s * wp
    jacobian = np.array([
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 0.0, 1.0),
        (pp, -pp, -b * d4, a * d3),
        (qq, -qq, a * d4, -b * d3),
    ])  # fmt: skip
    return np.concatenate(((wp, wq, ap, aq), (jacobian @ z[4:].reshape(4, 4)).ravel()))


def _stance_tangent(_t: float, z: Any) -> Any:
    """Fore stance with x from the toe, and the variational equations of seven directions."""
    x, y, p, q, vx, vy, wp, wq = z[:8].tolist()
    sp, cp, sq, cq = sin(p), cos(p), sin(q), cos(q)
    xp, yp, xq, yq = -FAR * sp, FAR * cp, -NEAR * sq, NEAR * cq  # the hip, by the pitches
    u, v = x + yp + yq, y - xp - xq
    ratio = LENGTH / sqrt(u * u + v * v)
    load, k = STIFFNESS * (ratio - 1.0), STIFFNESS * ratio**3 / LENGTH**2
    fx, fy = load * u, load * v
    kxx, kxy, kyy = load - k * u * u, -k * u * v, load - k * v * v
    px, py = kxx * xp + kxy * yp, kxy * xp + kyy * yp
    qx, qy = kxx * xq + kxy * yq, kxy * xq + kyy * yq
    bend = p - q
    s, c = COUPLING * sin(bend), COUPLING * cos(bend)
    r1 = fx * xp + fy * yp - SPINE * bend - s * wq * wq
    r2 = fx * xq + fy * yq + SPINE * bend + s * wp * wp
    det = EFFECTIVE * EFFECTIVE - c * c
    a, b = EFFECTIVE / det, c / det
    ap, aq = a * r1 - b * r2, a * r2 - b * r1
    d1, d2 = s * aq - SPINE - c * wq * wq, s * ap + SPINE + c * wp * wp
    d3, d4 = -2 * s * wq, 2 * s * wp
    both = xp * qx + yp * qy
    pp, pq = xp * px + yp * py - fx * yp + fy * xp + d1, both - d1
    qp, qq = both + d2, xq * qx + yq * qy - fx * yq + fy * xq - d2
    w = 1.0 / WHOLE
    jacobian = np.array([
        (kxx * w, kxy * w, px * w, qx * w, 0.0, 0.0, 0.0, 0.0),
        (kxy * w, kyy * w, py * w, qy * w, 0.0, 0.0, 0.0, 0.0),
        (a * px - b * qx, a * py - b * qy, a * pp - b * qp, a * pq - b * qq,
         0.0, 0.0, -b * d4, a * d3),
        (a * qx - b * px, a * qy - b * py, a * qp - b * pp, a * qq - b * pq,
         0.0, 0.0, a * d4, -b * d3),
    ])  # fmt: skip
    turn = (jacobian @ z[8:].reshape(8, 7)).ravel()
    return np.concatenate(((vx, vy, wp, wq, fx * w, fy * w - GRAVITY, ap, aq), z[36:], turn))


def _fly(z: Any, columns: Any, span: float) -> tuple[Any, Any]:
    """State and directions after a flight; the centre of mass needs no integrator."""
    turned = np.concatenate((z[TURNING], np.eye(4).ravel()))
    turned = _during(_turning_tangent, turned, span, TANGENT_TOLERANCE)
    out, after = z.copy(), columns.copy()
    out[:2] += span * z[4:6]
    out[1] -= GRAVITY / 2 * span * span
    out[5] -= GRAVITY * span
    out[TURNING] = turned[:4]
    after[:2] += span * columns[4:6]
    after[TURNING] = turned[4:].reshape(4, 4) @ columns[TURNING]
    return out, after


def _hip_slopes(z: Any) -> tuple[Any, Any]:
    """Derivatives of the fore hip's place by the coordinates."""
    p, q = z[2:4].tolist()
    return (
        np.array([1.0, 0.0, -FAR * sin(p), -NEAR * sin(q)]),
        np.array([0.0, 1.0, FAR * cos(p), NEAR * cos(q)]),
    )


def half_tangent(half: Half, angle: float) -> Tangent:
    """Variational equations along half a stride.

    The leg's force is zero at both of its events, so the directions pass them unchanged and only
    the toe and the lift-off angle notice that the event comes sooner or later.
    """
    columns = np.zeros((8, 7))
    columns[SECTION, range(6)] = 1.0
    by_angle = np.eye(7)[6]
    z, columns = _fly(half.start, columns, half.fall)
    across, up = _hip_slopes(z)
    later = -(up @ columns[:4] + LENGTH * sin(angle) * by_angle) / (up @ z[4:])
    toe = across @ columns[:4] + across @ z[4:] * later + LENGTH * cos(angle) * by_angle
    columns[0] -= toe
    reach = hip_place("fore", z)[0] + LENGTH * sin(angle)
    z[0] -= reach
    both = np.concatenate((z, columns.ravel()))
    both = _during(_stance_tangent, both, half.stance, TANGENT_TOLERANCE)
    z, columns = both[:8], both[8:].reshape(8, 7)
    across, up = _hip_slopes(z)
    u, v = hip_place("fore", z)
    along, aside = (u * across + v * up) / LENGTH, (v * across - u * up) / LENGTH**2
    later = -(along @ columns[:4]) / (along @ z[4:])
    liftoff = aside @ columns[:4] + aside @ z[4:] * later
    z, columns = _fly(z, columns, half.rise)
    columns[0] += toe
    time = columns[5] / GRAVITY
    return Tangent(columns + np.outer(FLIGHT(0.0, z), time), time, liftoff)


def stride_multipliers(tangent: Tangent) -> Any:
    """Eigenvalues of the stride map of a symmetric gait, touchdown angles held fixed."""
    first, by_angle = tangent.end[SECTION, :6], tangent.end[SECTION, 6]
    back = first - np.outer(by_angle, tangent.liftoff[:6] / tangent.liftoff[6])
    return np.linalg.eigvals(MIRROR @ np.linalg.solve(back, MIRROR @ first))


def differenced_multipliers(start: Any, angles: dict[str, float]) -> Any:
    """Eigenvalues of the stride map by central differences of full strides."""
    jacobian = np.zeros((6, 6))
    for column, place in enumerate(SECTION):
        ends = []
        for sign in (1, -1):
            moved = start.copy()
            moved[place] += sign * SHIFT
            ends.append(stride("DOP853", TOLERANCE, start=moved, angles=angles)[1][SECTION])
        jacobian[:, column] = (ends[0] - ends[1]) / (2 * SHIFT)
    return np.linalg.eigvals(jacobian)


def gait(
    speed: float, guess: Sequence[float], multipliers: bool = True, peer: str = "tangents"
) -> tuple[Gait, Any | None]:
    """The gait of this mean speed near a guess of (pitch, pitch rate, fore angle)."""
    halves: dict[bytes, Half] = {}

    def half(unknowns: Any) -> Half:
        key = unknowns.tobytes()
        if key not in halves:
            pitch, rate, angle = unknowns.tolist()
            halves[key] = half_stride(apex_state(pitch, rate), angle)
        return halves[key]

    def equations(unknowns: Any) -> Any:
        run = half(unknowns)
        x, _, p, q, _, _, wp, wq = run.end
        return np.array([p + q, wp - wq, x / (run.fall + run.stance + run.rise) - speed])

    slopes: dict[bytes, Any] = {}

    def jacobian(unknowns: Any) -> Any:
        key = unknowns.tobytes()
        if key in slopes:
            return slopes[key]
        pitch, rate, angle = unknowns.tolist()
        run = half(unknowns)
        tangent = half_tangent(run, angle)
        xdot = run.start[4]
        turning = EFFECTIVE + COUPLING * cos(2 * pitch)
        by_pitch = 2 * COUPLING * sin(2 * pitch) * rate * rate - 4 * SPINE * pitch
        directions = np.zeros((7, 3))
        directions[:, 0] = 0, 1, -1, by_pitch / (WHOLE * xdot), 0, 0, 0
        directions[:, 1] = 0, 0, 0, -2 * turning * rate / (WHOLE * xdot), 1, 1, 0
        directions[6, 2] = 1
        x, _, p, q, _, _, wp, wq = tangent.end
        span = run.fall + run.stance + run.rise
        mean = (x - run.end[0] / span * tangent.time) / span
        slopes[key] = np.array([p + q, wp - wq, mean]) @ directions
        return slopes[key]

    slope = jacobian if peer == "tangents" else None
    found = root(equations, guess, jac=slope, method="hybr", options={"xtol": STEP})
    if not found.success:
        raise ValueError(found.message)
    pitch, rate, angle = found.x.tolist()
    run = half(found.x)
    angles = {"fore": angle, "hind": run.liftoff}
    _, end = stride("DOP853", TOLERANCE, start=run.start, angles=angles)
    residual = float(np.max(np.abs((end - run.start)[SECTION])))
    if residual > CONFIRMED:
        raise ValueError(f"the stride does not repeat: {residual:.1e}")
    out = Gait(pitch, rate, angle, run.liftoff, float(run.start[4]), residual)
    if not multipliers:
        return out, None
    if peer == "differences":
        return out, differenced_multipliers(run.start, angles)
    return out, stride_multipliers(half_tangent(run, angle))


def branch(
    speeds: Iterable[float],
    start_guess: Sequence[float],
    multipliers: bool = True,
    peer: str = "tangents",
) -> list[tuple[Gait, Any | None]]:
    """The gaits of these mean speeds in turn, each predicted by the secant of the last two."""
    out: list[tuple[Gait, Any | None]] = []
    known: list[tuple[float, Any]] = []
    for speed in speeds:
        guess = np.array(known[-1][1] if known else start_guess, dtype=float)
        if len(known) > 1:
            (s0, u0), (s1, u1) = known[-2:]
            guess += (speed - s1) / (s1 - s0) * (u1 - u0)
        out.append(gait(speed, guess, multipliers, peer))
        known.append((speed, np.array(out[-1][0][:3])))
    return out
