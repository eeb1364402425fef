"""``flexspine trot``: the articulated robot trots from standing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Animation,
    Json,
    RobotAssignments,
    RobotName,
    RunDirectory,
    Tolerance,
    numbers,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from flexspine.control.spine_comparison import SpineComparison
    from flexspine.control.walk_measures import WalkSummary
    from flexspine.control.walk_plan import Pace
    from flexspine.models.robot_run import RobotRun

OF_GAIT = "gait."

# What a trot writes, in which an earlier one's pictures would pass for its own.
PICTURES = re.compile(r"(figure|animation|comparison|(com|pd)-.*)\.(png|mp4|gif|csv|nc)")


def trot(
    robot: RobotName = DEFAULT_ROBOT,
    set_: RobotAssignments = None,
    seconds: Annotated[float, typer.Option(help="How long to trot, in s.")] = 20.0,
    controller: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="tracking (computed torque of all joints), qp (the same within friction "
            "and limits), com (centre of mass, pitch, swing legs; the spine moves), pd (springs "
            "and dampers at the joints) or cpg (the same, drawn after coupled oscillators).",
            show_default="tracking",
            autocompletion=completion.among("tracking", "qp", "com", "pd", "cpg"),
        ),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            help="Choose torques this often, in Hz, and hold them; tracking and pd do without.",
            show_default="qp and com 400, cpg 1000",
        ),
    ] = None,
    limit: Annotated[
        float | None, typer.Option(help="Largest torque of a motor, in N m; needs --rate.")
    ] = None,
    stiffness: Annotated[
        float | None,
        typer.Option(
            help="Of the law: in 1/s^2, for pd and cpg in N m/rad.",
            show_default="400, for pd and cpg 300",
        ),
    ] = None,
    damping: Annotated[
        float | None,
        typer.Option(
            help="Of the law: in 1/s, for pd and cpg in N m s/rad.",
            show_default="40, for pd and cpg 4",
        ),
    ] = None,
    push: Annotated[
        float, typer.Option(help="A push forward on the hind trunk half-way, in N s.")
    ] = 0.0,
    compare: Annotated[
        bool,
        typer.Option(
            "--compare", help="Flexible and locked spine side by side, by controllers com and pd."
        ),
    ] = False,
    tolerance: Tolerance = None,
    out: RunDirectory = None,
    animation: Animation = True,
    json: Json = False,
) -> int:
    """Let the articulated robot trot in the plane, from standing.

    Units are SI and radians.

    Exit code 0: it stayed up; 1: it did not; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine trot --out trot

        flexspine trot --set spine.stiffness=120 --set gait.speed=0.4 --json

        flexspine trot --compare --out spines
    """
    from flexspine.cli.results import ResultDirectory, write_robot_run
    from flexspine.control.laws import Tracking
    from flexspine.control.spine_comparison import compare_spines
    from flexspine.control.trot import Trot
    from flexspine.control.trot import trot as run_trot
    from flexspine.control.walk_measures import summarize_walk
    from flexspine.control.walk_record import walk_record
    from flexspine.models.robot_file import load_robot
    from flexspine.models.robot_run import robot_dataset
    from flexspine.models.simulation import DEFAULT_TOLERANCE

    interruptible()
    given = numbers("--set", set_)
    own = {name: value for name, value in given.items() if not name.startswith(OF_GAIT)}
    made = load_robot(robot, own)
    asked = Trot(
        seconds=seconds,
        controller=Tracking.name if controller is None else controller,
        gait=_gait({n.removeprefix(OF_GAIT): v for n, v in given.items() if n not in own}),
        rate=rate,
        limit=limit,
        stiffness=stiffness,
        damping=damping,
        push=push,
    )
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = ResultDirectory.within(stack, out, films=animation and not compare)
        if compare:
            _refuse_besides_compare(
                {
                    "--controller": controller,
                    "--rate": rate,
                    "--limit": limit,
                    "--stiffness": stiffness,
                    "--damping": damping,
                    "--tolerance": tolerance,
                }
            )
            progress.begin("trotting, six times")
            found = compare_spines(made, asked, progress.at)
            if directory is not None:
                with directory.stage(PICTURES) as stage:
                    _write_comparison(stage, found, progress)
            _tell(found, json, out)
            return 0 if all(run.outcome.completed for run in found.runs.values()) else 1
        progress.begin("trotting")
        run = run_trot(
            made,
            asked,
            tolerance=DEFAULT_TOLERANCE if tolerance is None else tolerance,
            progress=progress.at,
        )
        summary = summarize_walk(run)
        record = walk_record(run, summary)
        if directory is not None:
            with directory.stage(PICTURES) as stage:
                write_robot_run(stage, robot_dataset(run), record, animation, progress)
    if json:
        print_json(record)
    else:
        print(_report(run, summary))
        if out is not None:
            print(f"results in {out}")
    return 0 if run.outcome.completed else 1


def _gait(given: Mapping[str, float]) -> Pace:
    """The gait with some numbers changed. Raises `UnknownNameError`."""
    from dataclasses import fields

    from flexspine.control.walk_plan import Pace

    known = [each.name for each in fields(Pace)]
    for name in given:
        if name not in known:
            raise UnknownNameError("gait parameter", name, known)
    changes: dict[str, Any] = dict(given)
    if "ramp" in given and given["ramp"].is_integer():
        changes["ramp"] = int(given["ramp"])
    return Pace(**changes)


def _refuse_besides_compare(given: Mapping[str, object]) -> None:
    for option, value in given.items():
        if value is not None:
            raise InputError(
                f"{option} and --compare are both given",
                f"leave {option}, as controllers com and pd are compared",
            )


# Name, label and unit of what is compared.
ROWS = (
    ("speed", "speed", "m/s"),
    ("peak_force", "peak force on a foot", "N"),
    ("impulse", "largest impulse of an impact", "N s"),
    ("cost_of_transport", "cost of transport", ""),
    ("error", "largest tracking error", "rad"),
    ("mean_error", "tracking error (rms)", "rad"),
    ("torque", "largest torque", "N m"),
)


def _table(found: SpineComparison) -> list[tuple[str, str, list[float | None]]]:
    """Rows of the comparison: what, unit, a number for every case."""
    table: list[tuple[str, str, list[float | None]]] = [
        (label, unit, [getattr(summary, key) for summary in found.summaries.values()])
        for key, label, unit in ROWS
    ]
    ranges = [next(iter(summary.spine.values()), None) for summary in found.summaries.values()]
    spans = [None if each is None else each[1] - each[0] for each in ranges]
    return [*table, ("range of the spine's angle", "rad", [*spans])]


def _write_comparison(stage: Path, found: SpineComparison, progress: Steps) -> None:
    import csv

    from flexspine.cli.results import write_json
    from flexspine.models.files import write_netcdf
    from flexspine.models.robot_run import robot_dataset
    from flexspine.report.robot_figure import plot_robot

    for case, run in found.runs.items():
        name = "-".join(case)
        progress.begin(f"drawing {name}")
        dataset = robot_dataset(run)
        write_netcdf(dataset, stage / f"{name}.nc")
        plot_robot(dataset).savefig(stage / f"{name}.png")

    with (stage / "comparison.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["measure", "unit", *(" ".join(case) for case in found.summaries)])
        for label, unit, values in _table(found):
            writer.writerow([label, unit, *("" if value is None else value for value in values)])
    write_json(_comparison_record(found), stage / "comparison.json")


def _comparison_record(found: SpineComparison) -> dict[str, Any]:
    from flexspine._version import STAMP
    from flexspine.control.walk_record import walk_record

    return {
        **STAMP,
        "runs": {
            f"{controller} {body}": walk_record(run, found.summaries[controller, body])
            for (controller, body), run in found.runs.items()
        },
        "motion_change": found.motion_change,
        "torque_change": found.torque_change,
        "verdict": found.verdict,
    }


def _tell(found: SpineComparison, json: bool, out: Path | None) -> None:
    if json:
        print_json(_comparison_record(found))
        return
    heads = [f"{controller}, {body}" for controller, body in found.summaries]
    print(f"{'':<36}" + "".join(f"{head:>16}" for head in heads))
    outcomes = [run.outcome.name for run in found.runs.values()]
    print(f"{'outcome':<36}" + "".join(f"{name:>16}" for name in outcomes))
    for label, unit, values in _table(found):
        shown = ["-" if value is None else f"{value:.4g}" for value in values]
        name = f"{label} ({unit})" if unit else label
        print(f"{name:<36}" + "".join(f"{text:>16}" for text in shown))
    print(found.verdict)
    if out is not None:
        print(f"results in {out}")


def _report(run: RobotRun, summary: WalkSummary) -> str:
    """The walk in a few lines for a person."""
    lines = [f"{run.robot.name}: {run.outcome.name} ({run.outcome.message})"]
    if not run.outcome.completed:
        lines.append(f"  advice           {run.outcome.advice}")
    if summary.speed is not None:
        lines.append(
            f"  steady speed     {summary.speed:.4f} m/s; {summary.distance:.3f} m in "
            f"{summary.steps} steps, the start included"
        )
    low, high = summary.normal
    lines += [
        f"  normal forces    {max(low, 0.0) + 0.0:.1f} to {high:.1f} N on feet that are to stand",
        f"  peak force       {summary.peak_force:.1f} N on any foot",
        f"  friction demand  {summary.friction_demand:.3f}, sliding "
        f"{100 * summary.sliding:.2f} % of the time",
        f"  torque           up to {summary.torque:.2f} N m",
        f"  impacts          up to {summary.impulse:.4f} N s a foot",
        f"  tracking error   up to {summary.error:.2e} rad",
        f"  foot drift       up to {summary.drift:.1e} m",
    ]
    for name, (least, most) in summary.spine.items():
        lines.append(f"  {name:<16} {least:+.4f} to {most:+.4f} rad")
    if summary.cost_of_transport is not None:
        lines.append(f"  cost of transport {summary.cost_of_transport:.3f}")
    lines.append(f"  energy           balance closed to {summary.imbalance:.1e} J")
    return "\n".join(lines)
