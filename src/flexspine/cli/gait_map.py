"""``flexspine map``: peak forces and stability of gaits over mean speed and spine stiffness."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli.basin import Out, how_made, keep_beside
from flexspine.cli.options import (
    DEFAULT_PRESET,
    Assignments,
    GaitFile,
    Json,
    Preset,
    Processes,
    Scheduler,
    span,
)
from flexspine.cli.output import counting, print_json
from flexspine.cli.starts import start_of
from flexspine.cli.sweep import count_of, unfinished_is_kept
from flexspine.errors import InputError

if TYPE_CHECKING:
    from flexspine.studies.gait_map import GaitMap
    from flexspine.studies.sweep import Sweep


def gait_map(
    out: Out,
    preset: Preset = None,
    gait: GaitFile = None,
    set_: Assignments = None,
    stiffness: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Spine stiffnesses, in N m/rad.")
    ] = "180:320",
    speeds: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Mean speeds, in m/s.")
    ] = "2.4:4.7",
    lines: Annotated[
        int | None,
        typer.Option(min=2, metavar="N", help="How many stiffnesses.", show_default="29"),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(min=2, metavar="N", help="How many speeds for each.", show_default="93"),
    ] = None,
    processes: Processes = None,
    scheduler: Scheduler = None,
    json: Json = False,
) -> int:
    """Map peak force and stability over speed and spine stiffness.

    Energy and apex height are those of the gait. It is carried to each stiffness and followed from
    there over all speeds; what that does not reach stays blank. Interrupted or killed, the same
    command goes on; 'flexspine rerun DIR' repeats it.

    Exit code 0: done; 1: the start is no gait, or there is none on the map; 2: bad input; 3: the
    machine or its workers failed; 130: interrupted.

    Examples:
        flexspine map --out map

        flexspine map --stiffness 200:280 --lines 17 --points 25 --out small --json
    """
    from flexspine.report.map_figure import plot_map
    from flexspine.studies.gait_map import LINES, POINTS, map_plan, read_map
    from flexspine.studies.sweep import sweep as carry_out

    if gait is not None and preset is not None:
        raise InputError("--preset and --gait are both given", "leave one of them")
    ranges, count = (span("--stiffness", stiffness), span("--speeds", speeds)), count_of(processes)
    start = start_of(DEFAULT_PRESET if preset is None else preset, gait, set_)
    plan = map_plan(
        start,
        *ranges,
        lines=LINES if lines is None else lines,
        points=POINTS if points is None else points,
    )
    with unfinished_is_kept(out):
        with counting("gaits") as progress:
            done = carry_out(plan, out, processes=count, client=scheduler, progress=progress)
        found = read_map(out)
        record = _record(found, done)
        keep_beside(out, "map", record, found.rows(), plot_map(found) if found.found else None)
    if json:
        print_json({**record, **how_made(done)})
    elif found.found:
        print(_report(record, done))
        print(f"results in {out}")
    if not found.found:
        print(
            f"flexspine: no gait found on the map ({found.reasons[0]}); the gait to follow has "
            f"{start.mean_speed:.4g} m/s, map speeds and stiffnesses nearer to it",
            file=sys.stderr,
        )
    return 0 if found.found else 1


def _record(found: GaitMap, done: Sweep) -> dict[str, Any]:
    return {
        **STAMP,
        "preset": found.model.name,
        "apex": dict(found.model.apex),
        "touchdown_angles": dict(found.model.touchdown),
        "energy": found.energy,
        "height": found.height,
        "points": done.rows,
        "gaits": found.found,
        "stable": found.stable,
        "digest": done.digest,
        "peak_grf": found.extremes(found.peak_grf),
        "level_spectral_radius": found.extremes(found.radius),
        "lines": found.ends(),
    }


def _report(record: dict[str, Any], done: Sweep) -> str:
    """The map in a few lines for a person."""
    lines = [
        f"{record['preset']}: {record['gaits']} gaits at {record['points']} points, "
        f"{record['stable']} of them stable, in {done.seconds:.1f} s"
    ]
    for name, label in (
        ("peak_grf", "peak GRF (N per leg pair)"),
        ("level_spectral_radius", "spectral radius"),
    ):
        if record[name] is None:
            continue
        ends = [
            f"{what} {end['value']:.4g} at k_t = {end['spine_stiffness']:g} N m/rad, "
            f"{end['mean_speed']:.4g} m/s"
            for what, end in record[name].items()
        ]
        lines.append(f"  {label}: {'; '.join(ends)}")
    return "\n".join(lines)
