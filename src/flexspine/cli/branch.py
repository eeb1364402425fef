"""``flexspine branch``: follow a gait while a quantity or a parameter changes."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    Assignments,
    GaitFile,
    Json,
    Preset,
    Symmetric,
    check_number,
    numbers,
    output_directory,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.cli.starts import starting_gait
from flexspine.errors import InputError, ParameterError, UnknownNameError

if TYPE_CHECKING:
    from flexspine.gaits.family import BranchPoint
    from flexspine.gaits.gait import Gait

TRACE = "branch.trace.jsonl"

# Smaller numbers are told as zero.
ROUNDING = 1e-12


def branch(
    low: Annotated[float, typer.Option("--from", help="Where to stop on the lower side (SI).")],
    high: Annotated[float, typer.Option("--to", help="Where to stop on the upper side (SI).")],
    over: Annotated[
        str,
        typer.Option(
            help="What to follow the gait in: mean_speed, energy, an apex coordinate such as "
            "height, touchdown.fore, touchdown.hind, or a parameter such as spine.stiffness.",
            metavar="NAME",
            autocompletion=completion.quantities,
        ),
    ] = "mean_speed",
    gait: GaitFile = None,
    preset: Preset = None,
    set_: Assignments = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A quantity to keep, as NAME or NAME=VALUE; repeat it.",
            show_default="energy, height and mean_speed, without what is followed",
            autocompletion=completion.quantities,
        ),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A parameter that may change as well, such as legs.extension to make good what "
            "dampers take; repeat it.",
            autocompletion=completion.quantities,
        ),
    ] = None,
    symmetric: Symmetric = None,
    longest_step: Annotated[
        float | None,
        typer.Option(help="Longest step along the branch, in natural units.", show_default="0.05"),
    ] = None,
    out: Annotated[Path | None, output_directory("the branch and a figure")] = None,
    json: Json = False,
) -> int:
    """Follow a gait while a quantity or a parameter changes.

    It is followed both ways until the branch ends or leaves --from to --to. It goes around folds,
    and marks where stability, symmetry or the order of contacts changes. Starts from a saved gait
    or from that of a preset. With --out, an interrupted branch goes on where it was when the same
    command is given again. Units are SI and radians.

    Exit code 0: followed to both ends; 1: no gait to start from; 2: bad input; 3: the machine
    failed; 130: interrupted.

    Examples:
        flexspine branch --from 3.7 --to 4.6 --out branch

        flexspine branch --over spine.stiffness --from 200 --to 300 --json

        flexspine branch --over spine.damping --free legs.extension --from 0 --to 8
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.gaits.continuation import trace_branch
    from flexspine.gaits.gait_record import branch_record
    from flexspine.gaits.tracing import LONGEST_STEP

    interruptible()
    step = LONGEST_STEP if longest_step is None else longest_step
    for option, value in (("--from", low), ("--to", high), ("--longest-step", step)):
        check_number(option, value)
    if step <= 0:
        raise ParameterError(f"--longest-step = {step:g} is not usable", "give a number above zero")
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        start = starting_gait(gait, preset, set_, symmetric, progress)
        begin = _value(start, over)
        fixed = _kept(start, over, keep)
        directory = ResultDirectory.within(stack, out)
        store = None if out is None else out / TRACE
        resumed = store if store is not None and store.exists() else None
        try:
            traced = trace_branch(
                start,
                over,
                bounds=(low, high),
                fixed=fixed,
                free=tuple(free or ()),
                symmetric=symmetric,
                longest_step=step,
                store=store,
                progress=_Counter(progress, over, (low, high), resumed),
            )
            record = branch_record(traced)
            if directory is not None and store is not None:
                with directory.stage() as stage:
                    _write(stage, start, record, progress)
                store.unlink()
        except KeyboardInterrupt:
            if store is not None and store.exists():
                print(
                    f"flexspine: what was found is in '{store}'; the same command goes on from it",
                    file=sys.stderr,
                )
            raise
    if json:
        print_json(record)
    else:
        print(_report(record, f"{over} = {begin:.6g}: {start.family}"))
        if out is not None:
            print(f"results in {out}")
    return 0


class _Counter:
    """Shows how many gaits were found, and which share of the bounds they span."""

    def __init__(
        self, progress: Steps, over: str, bounds: tuple[float, float], resumed: Path | None
    ) -> None:
        self.progress, self.over, self.bounds, self.resumed = progress, over, bounds, resumed
        self.count, self.seen = 0, (float("inf"), float("-inf"))

    def __call__(self, point: BranchPoint) -> None:
        if self.resumed is not None and not self.count:
            print(f"flexspine: going on from '{self.resumed}'", file=sys.stderr)
        self.count += 1
        self.seen = (min(self.seen[0], point.value), max(self.seen[1], point.value))
        self.progress.begin(f"{self.count} gaits, {self.over} = {point.value:.6g}")
        span = self.bounds[1] - self.bounds[0]
        self.progress.at((self.seen[1] - self.seen[0]) / span)


def _value(start: Gait, over: str) -> float:
    """The value of a quantity or parameter. Raises `UnknownNameError`."""
    known = {**start.model.numbers, **start.quantities}
    if over not in known:
        raise UnknownNameError("quantity or parameter", over, known)
    return known[over]


def _quantities(start: Gait) -> dict[str, float]:
    """What can be kept, with its value."""
    angles = {f"touchdown.{side}": angle for side, angle in start.touchdown_angles.items()}
    return {**start.quantities, **start.model.apex, **angles}


def _kept(start: Gait, over: str, keep: list[str] | None) -> dict[str, float] | None:
    """What is kept, at the value it has unless one is given."""
    if not keep:
        return None
    own = _quantities(start)
    kept: dict[str, float] = {}
    for item in keep:
        if "=" in item:
            kept |= numbers("--keep", [item])
        elif item in own:
            kept[item] = own[item]
        else:
            raise UnknownNameError("quantity", item, own)
    if over in kept:
        raise InputError(f"{over} is both kept and followed", f"leave --keep {over}")
    return kept


def _write(stage: Path, start: Gait, record: dict[str, Any], progress: Steps) -> None:
    from flexspine.cli.results import write_json
    from flexspine.gaits.files import save_gait
    from flexspine.report.branch_figure import plot_branch
    from flexspine.studies.tables import write_table

    progress.begin("writing data")
    save_gait(start, stage / "start.json")
    write_json(record, stage / "branch.json")
    # Parameters are left out, as only the one followed changes.
    write_table([_row(point) for point in record["points"]], stage / "branch.csv")
    progress.begin("drawing")
    plot_branch(record).savefig(stage / "branch.png")


def _row(point: dict[str, Any]) -> dict[str, Any]:
    from flexspine.parameters import flattened

    row: dict[str, Any] = {}
    for name, value in point.items():
        if name == "floquet_multipliers":
            for number, (parts, mode) in enumerate(zip(value, point["modes"], strict=True), 1):
                columns = {"re": parts[0], "im": parts[1], "error": mode["error"]}
                row |= {f"multiplier_{number}.{part}": x for part, x in columns.items()}
        elif name == "phases":
            row[name] = "-".join(value)
        elif name not in ("parameters", "modes"):
            row |= flattened({name: value})
    return row


def _report(record: dict[str, Any], start: str) -> str:
    """The branch in a few lines for a person."""
    over, points = record["over"], record["points"]
    along = [point[over] for point in points]
    kept = ", ".join(f"{name} = {value:.9g}" for name, value in record["fixed"].items())
    freed = ", ".join(record["free"])
    lines = [
        f"{points[0]['preset']}: {len(points)} {'symmetric' if record['symmetric'] else 'general'} "
        f"gaits along {over}, from {min(along):.6g} to {max(along):.6g}",
        f"  kept       {kept}",
        *([f"  free       {freed}"] if freed else []),
        f"  start      {start}",
        f"  one end    {record['ends'][0]}",
        f"  other end  {record['ends'][1]}",
        *_table(over, points, record["free"]),
    ]
    if record["landmarks"]:
        lines.append("  landmarks, in order along the branch:")
        lines += [
            f"    {mark['value']:<12.8g}  {mark['kind']:<22}{mark['detail']}"
            for mark in record["landmarks"]
        ]
    return "\n".join(lines)


def _table(over: str, points: list[dict[str, Any]], free: list[str]) -> list[str]:
    """What free parameters, peak forces, cost and stability are along the branch."""
    rows = [(name, [point[name] for point in points]) for name in free]
    peaks = [max(point["peak_grf"].values()) for point in points]
    rows.append(("peak GRF (N)", peaks))
    if any(point["work"] for point in points):
        costs = [point["cost_of_transport"] for point in points]
        rows.append(("cost of transport", costs))
    level = "" if points[0]["energy_identity"] is None else " on the energy level"
    radii = [point["level_spectral_radius"] for point in points]
    rows.append((f"spectral radius{level}", radii))
    width = max(len(name) for name, _ in rows)
    lines = [f"  {'':{width}}  {'one end':>10}  {'other end':>10}  lowest            highest"]
    for name, values in rows:
        turns = (pick(range(len(values)), key=values.__getitem__) for pick in (min, max))
        shown = [f"{0 if abs(value) < ROUNDING else value:.4g}" for value in values]
        told = "".join(f"{f'{shown[i]} at {points[i][over]:.4g}':<18}" for i in turns)
        lines.append(f"  {name:{width}}  {shown[0]:>10}  {shown[-1]:>10}  {told}".rstrip())
    return lines
