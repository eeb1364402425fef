"""``flexspine limits``: the largest noise, push and step that stabilised gaits survive."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.kept import kept
from flexspine.cli.options import (
    Assignments,
    GaitFile,
    Json,
    Preset,
    Processes,
    output_directory,
)
from flexspine.cli.output import counting, print_json, steps
from flexspine.cli.starts import starting_gait
from flexspine.cli.sweep import count_of
from flexspine.errors import UnknownNameError

if TYPE_CHECKING:
    from flexspine.studies.limits import Cell

# What an earlier run may have left, and this one not.
FIGURE = re.compile(r"limits\.png")

STIFFNESSES = (200.0, 220.0, 240.0, 260.0)
SPEEDS = (3.0, 3.5, 4.0, 4.25, 4.5)

# The limits there are.
KNOWN = (
    "acting_noise", "sensing_noise", "push_forward", "push_backward", "step_up", "step_down",
)  # fmt: skip


def limits(
    preset: Preset = None,
    gait: GaitFile = None,
    set_: Assignments = None,
    stiffness: Annotated[
        list[float] | None,
        typer.Option(
            help="Spine stiffness, in N m/rad; repeat it.", show_default="200, 220, 240, 260"
        ),
    ] = None,
    speed: Annotated[
        list[float] | None,
        typer.Option(help="Mean speed, in m/s; repeat it.", show_default="3, 3.5, 4, 4.25, 4.5"),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LIMIT",
            help=f"{', '.join(KNOWN)}; repeat it.",
            show_default="all",
            autocompletion=completion.among(*KNOWN),
        ),
    ] = None,
    processes: Processes = None,
    out: Annotated[Path | None, output_directory("a table and a figure")] = None,
    json: Json = False,
) -> int:
    """Find the largest noise, push and step that gaits survive.

    A gait is carried to every stiffness and speed at its energy and apex height, and stabilised by
    touchdown angles alone, once or at both flight apexes, and by thrust too. Survived are: noise,
    1000 strides for six seeds; a push (N s), 50 strides; a step (m), 50 strides, at eight places in
    the first: between these a lower one may trip. Sizes are found by doubling and bisection, to a
    tenth of themselves. Interrupted, the same command goes on. Units are SI.

    Exit code 0: done; 1: no gait was found or stabilised; 2: bad input; 3: the machine failed; 130:
    interrupted.

    Examples:
        flexspine limits --out limits

        flexspine limits --stiffness 260 --speed 4.5 --only acting_noise --json
    """
    from flexspine.cli.results import ResultDirectory, write_json
    from flexspine.studies.limits import LIMITS, find_limits

    interruptible()
    names = [limit.name for limit in LIMITS]
    for name in only or []:
        if name not in names:
            raise UnknownNameError("limit", name, names)
    workers = count_of(processes)
    with ExitStack() as stack:
        directory = ResultDirectory.within(stack, out)
        store = stack.enter_context(kept(out, "limits"))
        with steps() as progress:
            start = starting_gait(gait, preset, set_, None, progress)
        with counting("gaits and designs") as count:
            cells = find_limits(
                start.model,
                tuple(stiffness or STIFFNESSES),
                tuple(speed or SPEEDS),
                limits=[limit for limit in LIMITS if limit.name in (only or names)],
                processes=workers,
                store=store,
                progress=count,
            )
        record = {
            **STAMP,
            "preset": start.model.name,
            "energy": start.energy,
            "height": start.model.apex["height"],
            "cells": [vars(cell) for cell in cells],
        }
        some = any(cell.limits for cell in cells)
        if directory is not None:
            with directory.stage(FIGURE) as stage:
                write_json(record, stage / "limits.json")
                _write(stage, cells, some)
    if json:
        print_json(record)
    else:
        print(_report(cells))
        if out is not None:
            print(f"results in {out}")
    return 0 if some else 1


def _write(stage: Path, cells: list[Cell], some: bool) -> None:
    from flexspine.studies.tables import write_table

    rows = [_row(cell) for cell in cells]
    known = dict.fromkeys(name for row in rows for name in row)
    write_table([{name: row.get(name) for name in known} for row in rows], stage / "limits.csv")
    if some:
        from flexspine.report.limits_figure import plot_limits

        plot_limits(cells).savefig(stage / "limits.png")


def _row(cell: Cell) -> dict[str, Any]:
    row = {**vars(cell), **cell.limits}
    del row["limits"]
    return row


def _report(cells: list[Cell]) -> str:
    """A table for a person."""
    lines = []
    for cell in cells:
        head = f"k_t = {cell.stiffness:g} N m/rad, {cell.speed:g} m/s, {cell.design}: "
        if cell.reason is not None:
            lines.append(head + cell.reason)
            continue
        found = ", ".join(
            f"{name.replace('_', ' ')} {_shown(name, size)}" for name, size in cell.limits.items()
        )
        lines.append(head + found)
    return "\n".join(lines)


def _shown(name: str, size: float) -> str:
    if name.endswith("noise"):
        return f"{100 * size:.2g} %"
    return f"{size:.2g} N s" if name.startswith("push") else f"{1000 * size:.2g} mm"
