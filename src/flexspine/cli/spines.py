"""``flexspine spines``: flexible spines and a locked one, walking in space side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli.basin import Out, how_made, keep_beside
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Json,
    Processes,
    RobotName,
    Scheduler,
    Seed,
    WalkAssignments,
    Walks,
)
from flexspine.cli.output import counting, print_json
from flexspine.cli.run3d import walker_of
from flexspine.cli.sweep import count_of, unfinished_is_kept

if TYPE_CHECKING:
    from flexspine.studies.sweep import Sweep
    from flexspine.studies.walk_map import WalkMap


def spines(
    out: Out,
    robot: RobotName = DEFAULT_ROBOT,
    gait: Walks = "trot",
    set_: WalkAssignments = None,
    stiffness: Annotated[
        list[float] | None,
        typer.Option(
            help="Spine stiffness, in N m/rad; repeat it.",
            show_default="30, 60, 120, 240, 480, 960",
        ),
    ] = None,
    speed: Annotated[
        list[float] | None,
        typer.Option(
            help="Speed of feet under the hips, in m/s; repeat it.",
            show_default="0.6 to 1.6 times the gait's own",
        ),
    ] = None,
    seconds: Annotated[float, typer.Option(help="How long each walks, in s.")] = 10.0,
    seed: Seed = 0,
    processes: Processes = None,
    scheduler: Scheduler = None,
    json: Json = False,
) -> int:
    """Compare flexible spines with a locked one, walking in space.

    The robot walks with each at many speeds. Compared are normal forces, impacts, oscillation of
    the CoM, cost of transport, the speed reached, and who falls. It is a sweep: interrupted or
    killed, the same command goes on; 'flexspine rerun DIR' repeats it. Units are SI and radians.

    Exit code 0: done; 1: all fell; 2: bad input; 3: MuJoCo is missing, or the machine or its
    workers failed; 130: interrupted.

    Examples:
        flexspine spines --out spines

        flexspine spines --gait bound --stiffness 60 --speed 0.7 --out few --json
    """
    from flexspine.engines.installed import mujoco_module
    from flexspine.report.walks_figure import plot_walks
    from flexspine.studies.sweep import sweep as carry_out
    from flexspine.studies.walk_map import STIFFNESSES, read_walks, walk_plan

    mujoco_module()
    plan = walk_plan(
        walker_of(robot, gait, set_),
        tuple(stiffness or STIFFNESSES),
        tuple(speed) if speed else None,
        seconds=seconds,
        seed=seed,
    )
    count = count_of(processes)
    with unfinished_is_kept(out):
        with counting("walks") as progress:
            done = carry_out(plan, out, processes=count, client=scheduler, progress=progress)
        found = read_walks(out)
        record = _record(found, done)
        keep_beside(out, "spines", record, found.rows(), plot_walks(found))
    if json:
        print_json({**record, **how_made(done)})
    else:
        print(_report(record, done))
        print(f"results in {out}")
    return 0 if done.outcomes.get("completed") else 1


def _record(found: WalkMap, done: Sweep) -> dict[str, Any]:
    from flexspine.studies.walk_map import MEASURES

    return {
        **STAMP,
        "robot": found.name,
        "rhythm": found.rhythm,
        "seconds": found.seconds,
        "asked_speeds": found.speeds.tolist(),
        "stiffnesses": found.stiffnesses.tolist(),
        "walks": done.rows,
        "outcomes": dict(done.outcomes),
        "digest": done.digest,
        "fell": {body: int(table.sum()) for body, table in found.fell.items()},
        "compared": {name: found.compared(name) for name in MEASURES},
    }


def _report(record: dict[str, Any], done: Sweep) -> str:
    """A table for a person: the locked spine, and the best stiffness beside it."""
    from flexspine.studies.walk_map import MEASURES

    fell = ", ".join(f"{count} {body}" for body, count in record["fell"].items())
    lines = [f"{record['walks']} walks in {done.seconds:.1f} s; ended early: {fell}"]
    for name, (label, unit, factor) in MEASURES.items():
        lines.append(f"{label}{f' ({unit})' if unit else ''}: locked, best flexible (k_t)")
        for row in record["compared"][name]:
            locked, best = (
                "-" if row[key] is None else f"{factor * row[key]:.3g}"
                for key in ("locked", "best")
            )
            which = "" if row["best"] is None else f" ({row['best_stiffness']:g})"
            lines.append(f"  at {row['asked_speed']:.3g} m/s   {locked:>8}  {best:>8}{which}")
    return "\n".join(lines)
