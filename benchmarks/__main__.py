"""Speed as ratios: `python -m benchmarks` prints tables and writes results/benchmarks.json.

Every ratio is the median over rounds in which both sides take turns, so a drifting machine
weighs on both alike. `python -m benchmarks ensemble` does that section only, and keeps the rest.
"""

from __future__ import annotations

import json
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import heyoka as hy
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks import hand_field, scipy_peer
from benchmarks.ensemble_benchmark import ensemble_benchmark, print_ensemble
from benchmarks.gait_benchmark import gait_benchmark
from benchmarks.robot_benchmark import print_robot, robot_benchmark
from benchmarks.timing import TOLERANCES, in_turn, median, ratio, seconds
from flexspine import FlexspineError, load_model
from flexspine.hybrid.integrate import integrate

OUT = Path("results/benchmarks.json")


def stride_benchmark() -> dict[str, object]:
    """One stride with events, core call, against SciPy at no better achieved error."""
    model = load_model("kamimura2015-flexible")
    start = model.apex_state()

    def core(tolerance: float) -> Callable[[], object]:
        bound = model.bind(tolerance)
        return lambda: integrate(bound, start, crossings=1)

    exact = np.array(scipy_peer.START)

    def my_error(tolerance: float) -> float:
        end = integrate(model.bind(tolerance), start, crossings=1).end.states
        return float(np.max(np.abs(end[1:8] - exact[1:])))

    def peer_error(method: str, tolerance: float) -> float:
        return float(np.max(np.abs(scipy_peer.stride(method, tolerance)[1][1:] - exact[1:])))

    peers = {
        "SciPy DOP853, scalar math (fair)": ("DOP853", 1e-11, scipy_peer.scalar_field),
        "SciPy DOP853, NumPy style": ("DOP853", 1e-11, scipy_peer.numpy_field),
        "SciPy RK45 (ODE45), scalar math": ("RK45", 1e-12, scipy_peer.scalar_field),
    }
    rows_out = []
    for name, (method, tolerance, field) in peers.items():
        error = peer_error(method, tolerance)
        # The loosest tolerance with which flexspine is at least as exact as the peer.
        matched = next((t for t in TOLERANCES if my_error(t) <= error), TOLERANCES[-1])
        rows = in_turn(
            (core(matched), 300),
            (lambda m=method, t=tolerance, f=field: scipy_peer.stride(m, t, f), 3),
            (core(1e-12), 300),
        )
        rows_out.append(
            {
                "peer": name,
                "peer_tolerance": tolerance,
                "peer_error": error,
                "peer_ms": 1e3 * median(rows, 1),
                "flexspine_tolerance": matched,
                "flexspine_error": my_error(matched),
                "flexspine_ms": 1e3 * median(rows, 0),
                "ratio": ratio(rows, 1, 0),
                "ratio_at_default_tolerance": ratio(rows, 1, 2),
            }
        )
    return {"rows": rows_out}


def field_benchmark() -> dict[str, float]:
    """The derived field against one simplified by hand: double stance, 0.05 s, no events."""
    model = load_model("kamimura2015-flexible")
    start = np.array(scipy_peer.START)
    toes = (0.4, -0.1)
    by_hand = hy.taylor_adaptive(
        hand_field.hand_field(), start.tolist(), pars=hand_field.hand_values(toes), tol=1e-12
    )
    bound = model.bind(1e-12)
    mode = bound.mode("DS")
    held = np.zeros(len(model.system.held))
    held[:2] = toes
    with_events = mode.enter(0.0, np.append(start, 0.0), held)
    derived = hy.taylor_adaptive(
        with_events.sys, np.append(start, 0.0).tolist(), pars=with_events.pars.tolist(), tol=1e-12
    )

    def flow(integrator: object, state: np.ndarray) -> Callable[[], object]:
        def work() -> None:
            integrator.time = 0.0
            integrator.state[:] = state
            integrator.propagate_until(0.05)

        return work

    flow(by_hand, start)()
    flow(derived, np.append(start, 0.0))()
    difference = float(np.max(np.abs(by_hand.state - derived.state[:8])))
    rows = in_turn((flow(by_hand, start), 2000), (flow(derived, np.append(start, 0.0)), 2000))
    return {
        "hand_terms": len(by_hand.decomposition) - 2 * 8,
        "derived_terms": len(derived.decomposition) - 2 * 9,
        "largest_difference": difference,
        "hand_us": 1e6 * median(rows, 0),
        "derived_us": 1e6 * median(rows, 1),
        "cost_ratio": ratio(rows, 1, 0),
    }


def start_benchmark() -> dict[str, float]:
    """Whole commands, warm, in seconds (median of five)."""
    python = sys.executable
    command = str(Path(python).with_name("flexspine"))
    commands = {
        "python -c pass": [python, "-c", "pass"],
        "import flexspine": [python, "-c", "import flexspine"],
        "flexspine --help": [command, "--help"],
        "flexspine bound --json": [command, "bound", "--json"],
    }

    def wall(arguments: list[str]) -> float:
        subprocess.run(arguments, capture_output=True, check=True)
        times = [
            seconds(lambda: subprocess.run(arguments, capture_output=True, check=True), 1)
            for _ in range(5)
        ]
        return statistics.median(times)

    return {name: wall(arguments) for name, arguments in commands.items()}


def print_gaits(console: Console, gaits: dict[str, Any]) -> None:
    table = Table(
        title=f"{gaits['gaits']} symmetric gaits over speed (k_t = 260 N m/rad), per gait"
    )
    for heading in ("SciPy peer", "multipliers", "peer ms", "ms", "times faster", "residuals"):
        table.add_column(heading, justify="left" if heading == "SciPy peer" else "right")
    for row in gaits["rows"]:
        table.add_row(
            row["peer"],
            "yes" if row["multipliers"] else "no",
            f"{row['peer_ms']:.1f}",
            f"{row['flexspine_ms']:.2f}",
            f"{row['ratio']:.0f}",
            f"{row['peer_residual']:.0e}, {row['flexspine_residual']:.0e}",
        )
    console.print(table)
    whole = gaits["branches"]
    console.print(
        f"Branches of four stiffnesses and both baselines: {whole['gaits']} gaits with multipliers "
        f"in {whole['s']:.1f} s"
    )
    for kind, search in gaits["search_100_starts"].items():
        console.print(f"Search, {kind}, 100 starts: {search['gaits']} gaits in {search['s']:.2f} s")


def print_strides(console: Console, strides: dict[str, Any]) -> None:
    table = Table(title="One stride with events (k_t = 260 N m/rad, 4.5 m/s), core call")
    for heading in ("peer", "peer error", "peer ms", "flexspine error", "ms", "times faster"):
        table.add_column(heading, justify="left" if heading == "peer" else "right")
    for row in strides["rows"]:
        table.add_row(
            f"{row['peer']}, rtol {row['peer_tolerance']:g}",
            f"{row['peer_error']:.1e}",
            f"{row['peer_ms']:.2f}",
            f"{row['flexspine_error']:.1e}",
            f"{row['flexspine_ms']:.3f}",
            f"{row['ratio']:.0f} ({row['ratio_at_default_tolerance']:.0f} at 1e-12)",
        )
    console.print(table)


def print_field(console: Console, field: dict[str, Any]) -> None:
    console.print(
        f"Derived field: {field['derived_terms']} terms, {field['derived_us']:.1f} us; by hand "
        f"{field['hand_terms']} terms, {field['hand_us']:.1f} us; cost ratio "
        f"{field['cost_ratio']:.2f} (0.05 s of double stance, results differ by "
        f"{field['largest_difference']:.0e})"
    )


def print_starts(console: Console, starts: dict[str, Any]) -> None:
    for name, wall in starts.items():
        console.print(f"{name:<26}{wall:.2f} s")


def main() -> None:
    console = Console()
    sections: dict[str, tuple[Callable[[], dict[str, Any]], Callable[..., None]]] = {
        "stride": (stride_benchmark, print_strides),
        "field": (field_benchmark, print_field),
        "gaits": (gait_benchmark, print_gaits),
        "ensemble": (lambda: ensemble_benchmark(console), print_ensemble),
        "robot": (robot_benchmark, print_robot),
        "start": (start_benchmark, print_starts),
    }
    wanted = sys.argv[1:] or list(sections)
    unknown = [name for name in wanted if name not in sections]
    if unknown:
        sys.exit(f"no section {', '.join(unknown)}: there are {', '.join(sections)}")
    OUT.parent.mkdir(exist_ok=True)
    record = json.loads(OUT.read_text()) if OUT.exists() else {}
    record["machine"] = platform.processor() or platform.machine()
    code = 0
    for name in wanted:
        measure, show = sections[name]
        try:
            record[name] = measure()
        except FlexspineError as failure:  # an engine is missing; other sections do without
            print(f"benchmarks {name}: {failure}", file=sys.stderr)
            code = failure.exit_code
            continue
        show(console, record[name])
    OUT.write_text(json.dumps(record, indent=2) + "\n")
    console.print(f"written to {OUT}")
    sys.exit(code)


if __name__ == "__main__":
    main()
