"""Thousands of strides at once, against peers that do the same to the same error on one core.

Every side starts from the same scattered starts. Errors are the largest of any state at the end
of one stride, or of a smooth flow as long, against the same at a tolerance far below. Times are
CPU seconds of this process, which other programs on the machine disturb less.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks import diffrax_peer, scipy_peer, smooth_flow
from benchmarks.ensemble_runs import PRESET, RUNS, SPREAD, STRIDES, Array, Runs
from benchmarks.smooth_flow import TIGHT, TOES
from benchmarks.timing import in_turn, loosest, median, one_core, ratio
from benchmarks.two_processes import two_processes

ALLOWED = 1e-10
DEFAULT = 1e-12
WIDTHS = (4, 8, 16, 24)
STATES = 8  # those that all sides have
CHECKED = 8  # starts whose strides are compared with the true ones, and which SciPy runs
ALONE = 256  # the same for smooth flows, and the strides that are run one by one
FLOWS = 2400  # smooth flows in batches

PEERS = {
    "SciPy DOP853, scalar math (fair)": ("DOP853", scipy_peer.scalar_field),
    "SciPy RK45 (ODE45), scalar math": ("RK45", scipy_peer.scalar_field),
    "SciPy DOP853, NumPy style": ("DOP853", scipy_peer.numpy_field),
}


@dataclass(frozen=True)
class Side:
    """One side of the comparison: work that makes ``count`` strides or flows."""

    kind: str
    name: str
    settings: str
    tolerance: float
    error: float
    count: int
    work: Callable[[], object]


def ensemble_benchmark(console: Console) -> dict[str, Any]:
    with one_core():
        found = _on_one_core(console)
    return {**found, "two_processes": two_processes()}


def _on_one_core(console: Console) -> dict[str, Any]:
    note = diffrax_peer.missing()
    if note:
        console.print(note, markup=False)
    else:
        diffrax_peer.prepare()
    runs = Runs(PRESET)
    true = runs.alone(TIGHT, CHECKED)()[:STATES]
    matched, _ = loosest(lambda t: _distance(runs.ends(t, CHECKED), true), ALLOWED)
    duration = runs.recorded(DEFAULT).duration
    sides = [_ensemble(runs, matched, true), _ensemble(runs, DEFAULT, true)]
    sides += [_one_by_one(runs, matched, true), _one_by_one(runs, DEFAULT, true)]
    sides += _scipy_sides(runs, true)
    if not note:
        sides += _diffrax_sides(runs, duration)
    sides += _floor_sides(runs, matched, duration) + _floor_sides(runs, DEFAULT, duration)
    other = Runs("scout2")
    sides.append(_ensemble(other, DEFAULT, other.alone(TIGHT, CHECKED)()))
    timed = in_turn(*((side.work, 1) for side in sides), clock=time.process_time)
    return {
        "allowed_error": ALLOWED,
        "matched_tolerance": matched,
        "default_tolerance": DEFAULT,
        "stride_s": duration,
        "spread_of_starts": SPREAD,
        "rows": _fastest_floors(_rows(sides, timed)),
    }


def _rows(sides: list[Side], timed: list[list[float]]) -> list[dict[str, Any]]:
    """What is written: the first two sides are the ensemble, matched and at the default."""
    paces = [[row[i] / side.count for i, side in enumerate(sides)] for row in timed]
    rows = []
    for i, side in enumerate(sides):
        row: dict[str, Any] = {
            "kind": side.kind,
            "name": side.name,
            "settings": side.settings,
            "tolerance": side.tolerance,
            "error": side.error,
            "us_per_stride": 1e6 * median(paces, i),
        }
        if side.kind == "floor":
            same = 0 if side.tolerance == sides[0].tolerance else 1
            row["ensemble_over_floor"] = ratio(paces, same, i)
        elif side.kind not in ("ensemble", "other"):
            row["over_ensemble_matched"] = ratio(paces, i, 0)
            row["over_ensemble_default"] = ratio(paces, i, 1)
        rows.append(row)
    return rows


def _fastest_floors(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of each floor the fastest width."""
    best: dict[Any, dict[str, Any]] = {}
    for number, row in enumerate(rows):
        key = (row["name"], row["tolerance"]) if row["kind"] == "floor" else number
        if key not in best or row["us_per_stride"] < best[key]["us_per_stride"]:
            best[key] = row
    return list(best.values())


def _distance(ends: Array, true: Array) -> float:
    return float(np.max(np.abs(ends[: len(true), : true.shape[1]] - true)))


def _ensemble(runs: Runs, tolerance: float, true: Array) -> Side:
    error = _distance(runs.ends(tolerance, CHECKED), true)
    settings = f"tolerance {tolerance:g}, {RUNS} runs of {STRIDES} strides"
    kind, name = "ensemble", "flexspine, ensemble"
    if runs.preset != PRESET:
        kind, name = "other", f"flexspine, ensemble of {runs.preset}"
    return Side(kind, name, settings, tolerance, error, RUNS * STRIDES, runs.job(tolerance))


def _one_by_one(runs: Runs, tolerance: float, true: Array) -> Side:
    work = runs.alone(tolerance, ALONE)
    settings = f"tolerance {tolerance:g}, integrate"
    return Side(
        "alone", "flexspine, one by one", settings, tolerance, _distance(work(), true), ALONE, work
    )


def _scipy_sides(runs: Runs, true: Array) -> list[Side]:
    """Each method at the loosest tolerance that is exact enough."""
    starts = runs.states[:STATES, :CHECKED].T.copy()
    sides = []
    for name, (method, field) in PEERS.items():

        def ends(tolerance: float, method: str = method, field: Any = field) -> Array:
            strides = (scipy_peer.stride(method, tolerance, field, start) for start in starts)
            return np.array([end for _, end in strides]).T

        tolerance, error = loosest(lambda t, ends=ends: _distance(ends(t), true), ALLOWED)
        settings = f"rtol = atol = {tolerance:g}, terminal events"
        work = partial(ends, tolerance)
        sides.append(Side("scipy", name, settings, tolerance, error, CHECKED, work))
    return sides


def _diffrax_sides(runs: Runs, duration: float) -> list[Side]:
    starts = runs.states[:STATES]
    true = smooth_flow.reference(smooth_flow.by_hand(duration), starts[:, :ALONE])
    sides = []
    for name, together in (("vmapped", False), ("one step size per batch", True)):
        peer = diffrax_peer.fastest(starts, true, TOES, duration, ALLOWED, together)
        name = f"diffrax, {name}, no events"
        sides.append(
            Side("diffrax", name, peer.settings, peer.tolerance, peer.error, peer.count, peer.work)
        )
    return sides


def _floor_sides(runs: Runs, tolerance: float, duration: float) -> list[Side]:
    """Each flow without events in every width; the fastest of them is the floor."""
    stride = runs.recorded(tolerance)
    flows = {
        "both legs in stance": smooth_flow.own(stride.bound, duration),
        "both legs in stance, field by hand": smooth_flow.by_hand(duration),
        "in the modes of the gait": smooth_flow.mode_by_mode(stride),
    }
    sides = []
    for name, parts in flows.items():
        starts = runs.states[: len(parts[0].field), :FLOWS]
        true = smooth_flow.reference(parts, starts[:, :ALONE])
        for width in WIDTHS:
            work = smooth_flow.flow(parts, starts, width, tolerance)
            settings = f"tolerance {tolerance:g}, batch of {width}"
            error = _distance(work(), true)
            sides.append(Side("floor", name, settings, tolerance, error, FLOWS, work))
    return sides


def print_ensemble(console: Console, found: dict[str, Any]) -> None:
    matched, default = found["matched_tolerance"], found["default_tolerance"]
    peers = Table(title=f"Thousands of strides of {found['stride_s']:.4f} s on one core")
    floors = Table(title="Smooth flows as long as a stride, without events")
    for heading in ("", "error", "us", f"over ours at {matched:g}", f"at {default:g}"):
        peers.add_column(heading, justify="right" if peers.columns else "left")
    for heading in ("heyoka in batches", "error", "us", "ours takes"):
        floors.add_column(heading, justify="right" if floors.columns else "left")
    for row in found["rows"]:
        begin = (
            f"{row['name']}\n  [dim]{row['settings']}[/dim]",
            f"{row['error']:.0e}",
            f"{row['us_per_stride']:.1f}",
        )
        if row["kind"] == "floor":
            floors.add_row(*begin, f"{row['ensemble_over_floor']:.2f} x")
        elif "over_ensemble_matched" in row:
            over = (row["over_ensemble_matched"], row["over_ensemble_default"])
            peers.add_row(*begin, *(f"{value:.{0 if value > 20 else 1}f} x" for value in over))
        else:
            peers.add_row(*begin)
    console.print(peers)
    console.print(floors)
    both = found["two_processes"]
    console.print(
        f"Two processes make {both['strides_wall']:.2f} times the strides of one, "
        f"{both['strides_cpu']:.2f} times by their CPU time (plain arithmetic: "
        f"{both['arithmetic_wall']:.2f} and {both['arithmetic_cpu']:.2f} times)"
    )
