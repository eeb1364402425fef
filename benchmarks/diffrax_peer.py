"""The diffrax peer: smooth flows of both legs in stance, batched, jitted, in float64 on one core.

The field is that of `hand_field`, in jax. The state is a tuple of scalars, which XLA turns into
one array per variable: a third faster than one array of all. Solver, step size controller and
batch size are those that come out fastest at the allowed error.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import scipy_peer as body
from benchmarks.timing import loosest, seconds

Array = NDArray[np.float64]

FLAGS = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
SOLVERS = ("Dopri8", "Tsit5", "Dopri5")
# Proportional and integral coefficients: the default, and two that diffrax suggests.
CONTROLLERS = ((0.0, 1.0), (0.1, 0.3), (0.3, 0.4))
BATCHES = (64, 256, 512, 1024, 4096)
TRIAL = 256


def missing() -> str | None:
    """What to say where diffrax is not installed."""
    if find_spec("diffrax") and find_spec("jax"):
        return None
    return "diffrax is not installed (pip install 'flexspine[bench]'): left out"


@dataclass(frozen=True)
class Peer:
    """The fastest settings at the allowed error; ``work`` flows from ``count`` starts."""

    settings: str
    tolerance: float
    error: float
    count: int
    work: Callable[[], object]


def field(toes: tuple[float, float]) -> Callable[[Any, Any, Any], tuple[Any, ...]]:
    import jax.numpy as jnp

    far, near, inertia = body.FAR, body.NEAR, body.EFFECTIVE

    def slopes(_t: Any, z: Any, _numbers: Any) -> tuple[Any, ...]:
        x, y, p, q, vx, vy, wp, wq = z
        sp, cp, sq, cq = jnp.sin(p), jnp.cos(p), jnp.sin(q), jnp.cos(q)
        u, v = x + far * cp + near * cq - toes[0], y + far * sp + near * sq
        load = body.STIFFNESS * (body.LENGTH / jnp.sqrt(u * u + v * v) - 1.0)
        fx, fy = load * u, load * v
        u, v = x - near * cp - far * cq - toes[1], y - near * sp - far * sq
        load = body.STIFFNESS * (body.LENGTH / jnp.sqrt(u * u + v * v) - 1.0)
        hx, hy = load * u, load * v
        torque = body.SPINE * (p - q)
        turn_f = far * (fy * cp - fx * sp) - near * (hy * cp - hx * sp)
        turn_h = near * (fy * cq - fx * sq) - far * (hy * cq - hx * sq)
        s, c = body.COUPLING * (sp * cq - cp * sq), body.COUPLING * (cp * cq + sp * sq)
        r1, r2 = turn_f - torque - s * wq * wq, turn_h + torque + s * wp * wp
        share = 1.0 / (inertia * inertia - c * c)
        return (
            vx, vy, wp, wq,
            (fx + hx) * (1 / body.WHOLE), (fy + hy) * (1 / body.WHOLE) - body.GRAVITY,
            (inertia * r1 - c * r2) * share, (inertia * r2 - c * r1) * share,
        )  # fmt: skip

    return slopes


def program(
    toes: tuple[float, float],
    duration: float,
    solver: str,
    controller: tuple[float, float],
    together: bool,
) -> Any:
    """Compile a function of starts and a tolerance; lanes step ``together`` or each by itself."""
    import diffrax
    import jax
    import jax.numpy as jnp

    term, method = diffrax.ODETerm(field(toes)), getattr(diffrax, solver)()

    def largest(errors: Any) -> Any:
        return jnp.max(jnp.sqrt(jnp.mean(jnp.square(jnp.stack(jax.tree.leaves(errors))), axis=0)))

    def one(start: Any, tolerance: Any) -> Any:
        norm = {"norm": largest} if together else {}
        sizes = diffrax.PIDController(
            rtol=tolerance, atol=tolerance, pcoeff=controller[0], icoeff=controller[1], **norm
        )
        done = diffrax.diffeqsolve(
            term, method, 0.0, duration, None, start, stepsize_controller=sizes,
            saveat=diffrax.SaveAt(t1=True),
        )  # fmt: skip
        return jax.tree.map(lambda values: values[-1], done.ys)

    return jax.jit(one if together else jax.vmap(one, in_axes=(0, None)))


def prepare() -> None:
    """Load jax so that it uses one thread and double precision; it has to be the first to."""
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {FLAGS}".strip()
    os.environ["JAX_PLATFORMS"] = "cpu"
    import jax

    jax.config.update("jax_enable_x64", True)


def fastest(
    starts: Array,
    ends: Array,
    toes: tuple[float, float],
    duration: float,
    allowed: float,
    together: bool,
) -> Peer:
    """Try the settings; ``starts`` (8, k) and the true ``ends`` (8, m) of the first m of them."""
    import jax

    def columns(count: int) -> tuple[Any, ...]:
        picked = np.arange(count) % starts.shape[1]
        return tuple(jax.numpy.asarray(row) for row in starts[:, picked])

    def error_of(call: Any) -> Callable[[float], float]:
        def error(tolerance: float) -> float:
            found = np.stack(call(columns(TRIAL), tolerance))[:, : ends.shape[1]]
            return float(np.max(np.abs(found - ends)))

        return error

    def job(call: Any, count: int, tolerance: float) -> Callable[[], object]:
        given = columns(count)
        return lambda: jax.block_until_ready(call(given, tolerance))

    def pace(call: Any, count: int, tolerance: float) -> float:
        work = job(call, count, tolerance)
        work()
        return min(seconds(work, clock=time.process_time) for _ in range(5)) / count

    trials = []
    for solver, controller in product(SOLVERS, CONTROLLERS):
        call = program(toes, duration, solver, controller, together)
        tolerance, error = loosest(error_of(call), allowed)
        trials.append((pace(call, TRIAL, tolerance), solver, controller, tolerance, error, call))
    _, solver, controller, tolerance, error, call = min(trials, key=lambda trial: trial[0])
    count = min(BATCHES, key=lambda count: pace(call, count, tolerance))
    gains = f"pcoeff {controller[0]:g}, icoeff {controller[1]:g}"
    settings = f"{solver}, rtol = atol = {tolerance:g}, {gains}, batch of {count}"
    return Peer(settings, tolerance, error, count, job(call, count, tolerance))
