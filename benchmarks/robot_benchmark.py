"""The articulated robot: against MuJoCo where both do the same work, and against real time."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.timing import in_turn, median, ratio, seconds
from flexspine import Trot, load_robot, trot
from flexspine.engines.mujoco_planar import PinnedMujoco
from flexspine.models.pinned import crouch, swing

# s; pinned and let go, until errors have grown a lot.
SECONDS = 0.5

# s; MuJoCo's steps, the smallest of which tells all errors.
STEPS = (2.5e-4, 1.25e-4, 6.25e-5, 3.125e-5)
FINEST = 1.5625e-5

# What is asked of each controller, and for how long in s.
TROTS = {
    "computed torque": (Trot(seconds=20.0), 3),
    "computed torque, 400 Hz": (Trot(seconds=2.0, rate=400.0), 1),
    "joint springs": (Trot(seconds=20.0, controller="pd"), 1),
    "seven outputs, 400 Hz": (Trot(seconds=2.0, controller="com"), 1),
    "quadratic program, 400 Hz": (Trot(seconds=2.0, controller="qp"), 1),
    "oscillators, 1000 Hz": (Trot(seconds=2.0, controller="cpg"), 1),
}

START = """
import time
begin = time.perf_counter()
from flexspine import Trot, load_robot, trot
run = trot(load_robot("sc618"), Trot(seconds=1.0))
print(time.perf_counter() - begin)
"""


def robot_benchmark() -> dict[str, Any]:
    """Pinned motion beside MuJoCo, trots beside real time, and what a start takes."""
    return {"pinned": _pinned(), "trots": _trots(), "starts": _starts()}


def _pinned() -> dict[str, Any]:
    """The robot swings about a foot for half a second, without dampers."""
    robot = load_robot("sc618")
    robot = robot.with_values({f"{joint}.damping": 0.0 for joint in robot.joints})
    foot, start = next(iter(robot.feet)), crouch(robot)
    engine = PinnedMujoco(robot.linkage, foot)
    end = np.array([SECONDS])

    def theirs(step: float) -> Any:
        count = round(SECONDS / step)
        return engine.run(start, step, count, count).angles[-1]

    ours = partial(swing, robot, foot, start, SECONDS)
    # Errors of the fourth order: what is left of the finest is a fifteenth of its last change.
    limit = theirs(FINEST) + (theirs(FINEST) - theirs(2 * FINEST)) / 15
    own = float(np.abs(ours().angles(end)[0] - limit).max())
    rows = []
    for step in STEPS:
        error = float(np.abs(theirs(step) - limit).max())
        times = in_turn((ours, 5), (partial(theirs, step), 1))
        rows.append(
            {
                "step": step,
                "error": error,
                "mujoco_ms": 1e3 * median(times, 1),
                "flexspine_ms": 1e3 * median(times, 0),
                "ratio": ratio(times, 1, 0),
            }
        )
    return {"error": own, "rows": rows}


def _trots() -> dict[str, float]:
    """How many times faster than real time each controller trots, once compiled."""
    robot, found = load_robot("sc618"), {}
    for name, (asked, repeats) in TROTS.items():
        work = partial(trot, robot, asked)
        work()
        found[name] = asked.seconds / seconds(work, repeats)
    return found


def _starts() -> dict[str, float]:
    """One second of trot from nothing to the end, in s: without compiled code, and with it."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {"FLEXSPINE_CACHE_DIR": folder, "PATH": ""}
        told = [
            float(
                subprocess.run(
                    [sys.executable, "-c", START],
                    env=environment,
                    capture_output=True,
                    text=True,
                    check=True,
                    cwd=Path.cwd(),
                ).stdout
            )
            for _ in range(6)
        ]
    return {"compiling": told[0], "compiled": statistics.median(told[1:])}


def print_robot(console: Console, robot: dict[str, Any]) -> None:
    """Tell it to a person."""
    pinned = robot["pinned"]
    console.print(
        f"sc618 pinned by a foot, {SECONDS:g} s: off by {pinned['error']:.0e} rad; MuJoCo (RK4):"
    )
    for row in pinned["rows"]:
        console.print(
            f"  step {row['step']:.3g} s: off by {row['error']:.0e} rad, {row['mujoco_ms']:.0f} ms "
            f"against {row['flexspine_ms']:.1f} ms, {row['ratio']:.0f} times"
        )
    console.print("Trot of sc618, times faster than real time:")
    for name, faster in robot["trots"].items():
        console.print(f"  {name:<28}{faster:6.1f}")
    starts = robot["starts"]
    console.print(
        f"Its first second from nothing: {starts['compiling']:.1f} s with compilation, "
        f"{starts['compiled']:.1f} s without"
    )
