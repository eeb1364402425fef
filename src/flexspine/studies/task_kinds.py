"""The tasks of sweeps: what there is to do at a point, and what each can be told."""

from __future__ import annotations

RUNS, SEARCHES, GAITS, WALKS = "runs", "searches", "gaits", "walks"
TASKS = (RUNS, SEARCHES, GAITS, WALKS)

# s; how long a walk is, if it is not told.
WALK_SECONDS = 10.0

# What each task can be told, besides the tolerance.
OPTIONS: dict[str, dict[str, type]] = {
    RUNS: {"strides": int},
    SEARCHES: {"starts": int, "symmetric": bool, "fixed": dict},
    GAITS: {"over": str, "symmetric": bool},
    WALKS: {"seconds": float, "sensing": float},
}
