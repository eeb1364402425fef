"""Gaits over speed against SciPy: the same gaits, found and certified to the same error."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import gait_peer
from flexspine import Gait, Stability, examine, find_gaits, floquet_multipliers, load_model
from flexspine.gaits.newton import solve
from flexspine.gaits.problem import Problem
from flexspine.studies.spines import Setting, study_spines

STEP = 0.05
SPEEDS = [round(3.8 + STEP * i, 2) for i in range(16)]
# The gait at 3.8 m/s, to four digits: pitch, pitch rate, speed at the apex and both angles.
START = {"fore_pitch": 0.3995, "fore_pitch_rate": -6.126, "speed": 3.427}
ANGLES = {"touchdown.fore": 0.1607, "touchdown.hind": 0.7603}
ROUNDS = 3


def follow(multipliers: bool) -> list[tuple[Gait, Stability | None]]:
    """Each gait predicted by the cubic through the last two and their derivatives.

    The derivatives cost nothing, as Newton's Jacobian is at hand; the peers use the secant.
    """
    model = load_model("kamimura2015-flexible")
    out: list[tuple[Gait, Stability | None]] = []
    points: list[Any] = []
    slopes: list[Any] = []
    for speed in SPEEDS:
        fixed = {"energy": gait_peer.ENERGY, "height": gait_peer.HEIGHT, "mean_speed": speed}
        problem = Problem(model, fixed, symmetric=True, tolerance=1e-12)
        if len(points) > 1:
            (a, b), (u, v) = points[-2:], slopes[-2:]
            guess = 5 * a - 4 * b + 2 * u + 4 * v
        elif points:
            guess = points[-1] + slopes[-1]
        else:
            start = {**START, **ANGLES}
            guess = np.array([problem.coordinate(n, start[n]) for n in problem.unknowns])
        attempt = solve(problem, guess)
        gait = examine(problem.at(attempt.point))
        assert attempt.solved
        assert gait.flaw is None
        points.append(attempt.point)
        assert attempt.linear is not None
        change = np.zeros(len(attempt.linear.matrix))
        change[-1] = STEP / problem.scale_of("mean_speed")  # the speed is the last equation
        slopes.append(np.linalg.solve(attempt.linear.matrix, change))
        out.append((gait, floquet_multipliers(gait) if multipliers else None))
    return out


def timed(work: Any) -> tuple[float, Any]:
    begin = time.perf_counter()
    result = work()
    return time.perf_counter() - begin, result


def gait_benchmark() -> dict[str, Any]:
    """Milliseconds per gait with and without multipliers, in turns, and how far they agree."""
    guess = (START["fore_pitch"], START["fore_pitch_rate"], ANGLES["touchdown.fore"])
    jobs = {
        (name, with_multipliers): work
        for with_multipliers in (True, False)
        for name, work in (
            ("flexspine", lambda m=with_multipliers: follow(m)),
            *(
                (peer, lambda m=with_multipliers, p=peer: gait_peer.branch(SPEEDS, guess, m, p))
                for peer in gait_peer.PEERS
            ),
        )
    }
    for key in (("flexspine", True), ("flexspine", False)):
        jobs[key]()
    seconds: dict[tuple[str, bool], list[float]] = {key: [] for key in jobs}
    results = {}
    for _ in range(ROUNDS):
        for key, work in jobs.items():
            spent, results[key] = timed(work)
            seconds[key].append(spent / len(SPEEDS))
    mine = results["flexspine", True]
    rows = []
    for with_multipliers in (True, False):
        own = np.array(seconds["flexspine", with_multipliers])
        for peer in gait_peer.PEERS:
            theirs = np.array(seconds[peer, with_multipliers])
            found = results[peer, with_multipliers]
            rows.append(
                {
                    "peer": peer,
                    "multipliers": with_multipliers,
                    "peer_ms": 1e3 * float(np.median(theirs)),
                    "flexspine_ms": 1e3 * float(np.median(own)),
                    "ratio": float(np.median(theirs / own)),
                    "peer_residual": max(gait.residual for gait, _ in found),
                    "flexspine_residual": max(gait.residual for gait, _ in mine),
                    "largest_difference": max(
                        abs(gait.pitch - own_gait.model.apex["fore_pitch"])
                        for (gait, _), (own_gait, _) in zip(found, mine, strict=True)
                    ),
                }
            )
    return {"gaits": len(SPEEDS), "rows": rows, **_whole_works()}


def _whole_works() -> dict[str, Any]:
    """The branches of four stiffnesses and both baselines, and one multi-start search."""
    setting = Setting(compared=())
    study_spines(setting)
    spent, study = timed(lambda: study_spines(setting))
    model = load_model("kamimura2015-flexible")
    fixed = {"energy": 290.0, "height": 0.32, "mean_speed": 4.5}
    searches = {}
    for symmetric in (True, False):
        find_gaits(model, fixed, symmetric=symmetric, starts=5)
        took, found = timed(lambda s=symmetric: find_gaits(model, fixed, symmetric=s, starts=100))
        searches["symmetric" if symmetric else "general"] = {"s": took, "gaits": len(found)}
    count = sum(len(specimen.branch.points) for specimen in study.specimens)
    return {"branches": {"s": spent, "gaits": count}, "search_100_starts": searches}
