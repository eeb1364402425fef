"""``flexspine sweep`` and ``flexspine rerun``: many runs or gaits, kept as they come."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexspine._version import STAMP
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json, Processes, Scheduler, output_directory
from flexspine.cli.output import counting, print_json

if TYPE_CHECKING:
    from flexspine.studies.sweep import Sweep


def sweep(
    plan: Annotated[Path, typer.Argument(metavar="FILE.toml", help="What to do.")],
    out: Annotated[Path, output_directory("the rows")],
    processes: Processes = None,
    scheduler: Scheduler = None,
    json: Json = False,
) -> int:
    r"""Run simulations, searches or walks over a grid or a sample.

    The file names models and axes, a task (runs, searches, gaits, walks) and its options. Rows land
    in Parquet files in DIR/rows, a chunk at a time. Interrupted or killed, the same command goes
    on.

    Exit code 0: done; 1: searches or gaits of which none was found; 2: bad input; 3: the machine or
    its workers failed; 130: interrupted.

    Examples:
        printf 'model = "scout2"\naxes.height = [0.34, 0.35]\n' > plan.toml

        flexspine sweep plan.toml --out rows
    """
    from flexspine.studies.sweep import sweep as carry_out
    from flexspine.studies.task_kinds import RUNS, WALKS
    from flexspine.studies.tasks import FOUND

    with unfinished_is_kept(out), counting("points") as progress:
        done = carry_out(
            plan, out, processes=count_of(processes), client=scheduler, progress=progress
        )
    code = 0 if done.plan.task in (RUNS, WALKS) or done.outcomes.get(FOUND) else 1
    if json:
        print_json(_record(done))
        return code
    counts = ", ".join(f"{count} {name}" for name, count in done.outcomes.items())
    strides = f", {done.strides} strides" if done.strides else ""
    print(f"{done.rows} rows ({counts}){strides} in {done.seconds:.1f} s")
    print(f"rows in {out / 'rows'}")
    return code


def rerun(
    directory: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="What 'sweep', 'basin', 'map' or 'spines' wrote with --out."
        ),
    ],
    processes: Processes = None,
    scheduler: Scheduler = None,
    json: Json = False,
) -> int:
    """Repeat a sweep and say whether it is the same, bit for bit.

    It is done again from its manifest; nothing is written.

    Exit code 0: the same; 1: not the same; 2: bad input; 3: the machine or its workers failed; 130:
    interrupted.

    Examples:
        flexspine basin --points 20 --strides 5 --out basin

        flexspine rerun basin
    """
    from flexspine.studies.sweep import rerun as repeat

    interruptible()
    with counting("chunks") as progress:
        found = repeat(
            directory, processes=count_of(processes), client=scheduler, progress=progress
        )
    if json:
        print_json(
            {
                **STAMP,
                "same": found.same,
                "chunks": found.chunks,
                "differing": list(found.differing),
                "missing": list(found.missing),
                "changed": {n: {"was": b, "is": a} for n, (b, a) in found.changed.items()},
            }
        )
    elif found.same:
        print(f"the same: all {found.chunks} chunks")
    else:
        lost = f", {len(found.missing)} are missing" if found.missing else ""
        print(f"not the same: {len(found.differing)} of {found.chunks} chunks differ{lost}")
        for file in found.differing.values():
            print(f"  {file}")
        for name, (before, now) in found.changed.items():
            print(f"  {name} was {before}, is {now}")
    return 0 if found.same else 1


def count_of(processes: int | None) -> int:
    """How many processes to use: by default one for each core that this process may use."""
    from flexspine.models.simulation import check_count
    from flexspine.workers.crew import cores

    if processes is None:
        return cores()
    return check_count("--processes", processes)


@contextmanager
def unfinished_is_kept(out: Path) -> Iterator[None]:
    """Let work be interrupted, and tell then where it goes on from."""
    interruptible()
    try:
        yield
    except KeyboardInterrupt:
        print(
            f"flexspine: what is finished is in '{out}'; the same command goes on from it",
            file=sys.stderr,
        )
        raise


def _record(done: Sweep) -> dict[str, object]:
    return {
        **STAMP,
        "out": str(done.path),
        "task": done.plan.task,
        "models": [model.name for model in done.plan.models],
        "points": done.plan.points * len(done.plan.models),
        "chunks": done.plan.chunks,
        "made": done.made,
        "rows": done.rows,
        "outcomes": dict(done.outcomes),
        "strides": done.strides,
        "digest": done.digest,
        "seconds": done.seconds,
    }
