"""``flexspine basin``: which starts about a gait keep bounding, and which come to it."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from json import dumps as json_text
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Assignments, Json, Processes, Scheduler, output_directory
from flexspine.cli.output import counting, print_json, steps
from flexspine.cli.starts import start_of
from flexspine.cli.sweep import count_of, unfinished_is_kept
from flexspine.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flexspine.gaits.gait import Gait
    from flexspine.studies.basin import Basin
    from flexspine.studies.sweep import Sweep

# The preset whose gaits are drawn if none is given.
EXAMPLE = "scout2"

Out = Annotated[Path, output_directory("rows, tables and the figure")]


def basin(
    out: Out,
    preset: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A preset (see 'flexspine presets') or a TOML file; repeat it.",
            show_default="scout2 and, for contrast, three unstable gaits of that robot",
            autocompletion=completion.presets,
        ),
    ] = None,
    gait: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="A gait saved by 'flexspine gait --out'; repeat it."),
    ] = None,
    set_: Assignments = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME:AMOUNT",
            help="An apex coordinate to vary and how far each way (SI), e.g. height:0.1; give two.",
            show_default="pitch:0.8 and pitch_rate:8, or fore_pitch:0.3 and hind_pitch:0.3 of a "
            "body that bends",
        ),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(min=2, metavar="N", help="How many values of each.", show_default="100"),
    ] = None,
    strides: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="How many strides a run has to make.", show_default="100"
        ),
    ] = None,
    keep_energy: Annotated[
        bool,
        typer.Option(
            "--keep-energy/--any-energy",
            help="Adjust the apex speed so that every start has the energy of the gait.",
        ),
    ] = True,
    processes: Processes = None,
    scheduler: Scheduler = None,
    json: Json = False,
) -> int:
    """See which starts about a gait last, and which come to it.

    Starts lie on a slice through the apex of the gait. Runs keep their energy, so that one with
    another energy could come to a neighbouring gait only: the apex speed makes up for what varies.
    Units are SI and radians. Interrupted or killed, the same command goes on; 'flexspine rerun DIR'
    repeats it.

    Exit code 0: done; 1: a start is no gait, or none was found; 2: bad input; 3: the machine or its
    workers failed; 130: interrupted.

    Examples:
        flexspine basin --out basin

        flexspine basin --preset scout2 --over height:0.1 --over pitch:0.5 --out b2

        flexspine gait --speed 4.25 --symmetric --out found

        flexspine basin --gait found/gait-1.json --strides 20 --out near --json
    """
    from flexspine.report.basin_figure import plot_basin
    from flexspine.studies.basin import POINTS, STRIDES, basin_plan, read_basins
    from flexspine.studies.sweep import sweep as carry_out

    ways, count = _slice(over), count_of(processes)
    plan = basin_plan(
        _gaits(preset, gait, set_),
        ways,
        points=POINTS if points is None else points,
        strides=STRIDES if strides is None else strides,
        keep_energy=keep_energy,
    )
    with unfinished_is_kept(out):
        with counting("starts") as progress:
            done = carry_out(plan, out, processes=count, client=scheduler, progress=progress)
        basins = read_basins(out)
        record = _record(basins, done)
        keep_beside(out, "basin", record, [each.row() for each in basins], plot_basin(basins))
    if json:
        print_json({**record, **how_made(done)})
    else:
        print(_report(basins, done))
        print(f"results in {out}")
    return 0


def keep_beside(
    out: Path,
    name: str,
    record: dict[str, Any],
    rows: Sequence[Mapping[str, Any]],
    figure: Figure | None,
) -> None:
    """Write ``summary.json``, a table and a figure beside the rows, each whole or not at all."""
    import pyarrow as pa
    import pyarrow.csv

    from flexspine.studies.store import write_whole

    text = json_text(record, indent=2, allow_nan=False) + "\n"
    write_whole(out / "summary.json", text.encode())
    table, picture = io.BytesIO(), io.BytesIO()
    pyarrow.csv.write_csv(pa.Table.from_pylist([dict(row) for row in rows]), table)
    write_whole(out / f"{name}.csv", table.getvalue())
    if figure is not None:
        figure.savefig(picture, format="png")
        write_whole(out / f"{name}.png", picture.getvalue())


def how_made(done: Sweep) -> dict[str, Any]:
    """What differs from one time to the next."""
    return {"out": str(done.path), "made": done.made, "seconds": done.seconds}


def _gaits(
    presets: list[str] | None, files: list[Path] | None, set_: list[str] | None
) -> dict[str, Gait]:
    """The gaits by name: those given, or the examples."""
    from flexspine.studies.basin import example_gaits

    if not presets and not files and not set_:
        interruptible()
        with steps() as progress:
            progress.begin("looking for gaits")
            return example_gaits()
    found: dict[str, Gait] = {}
    places: list[tuple[str, Path | None]] = [(name, None) for name in presets or []]
    places += [(file.stem, file) for file in files or []]
    for name, file in places or [(EXAMPLE, None)]:
        gait = start_of(name, file, set_)
        label = gait.model.name if file is None else name
        if label in found:
            raise InputError(f"two gaits have the name '{label}'", "give each once, or rename one")
        found[label] = gait
    return found


def _slice(over: list[str] | None) -> dict[str, float] | None:
    """Parse ``NAME:AMOUNT`` items."""
    if not over:
        return None
    found: dict[str, float] = {}
    for item in over:
        name, colon, amount = item.rpartition(":")
        try:
            number = float(amount)
        except ValueError:
            number = nan
        if not (name and colon and isfinite(number)):
            raise InputError(f"--over '{item}' is not NAME:AMOUNT", "write e.g. --over pitch:0.5")
        if name in found:
            raise InputError(f"--over {name} is given twice", "vary two different coordinates")
        found[name] = number
    if len(found) != 2:
        raise InputError(
            f"{len(found)} of --over make no slice", "give it twice, for two coordinates"
        )
    return found


def _record(basins: Sequence[Basin], done: Sweep) -> dict[str, Any]:
    from flexspine.studies.axes import free_axes

    first = basins[0]
    return {
        **STAMP,
        "over": {axis.name: axis.within for axis in free_axes(done.plan.axes)},
        "strides": first.wanted,
        "energy_kept": first.energy_kept,
        "digest": done.digest,
        "basins": [
            {
                **basin.row(),
                "others": [
                    {"apex": dict(o.apex), "starts": o.starts, "level_spectral_radius": o.radius}
                    for o in basin.others
                ],
            }
            for basin in basins
        ],
    }


def _report(basins: Sequence[Basin], done: Sweep) -> str:
    """What came of every gait's starts, in a table."""
    wanted = basins[0].wanted
    lines = [
        f"{done.rows} starts, {wanted} strides wanted, {done.strides} done in {done.seconds:.1f} s",
        "",
        "     spectral              fell in the   lasted  came to    not, or",
        "       radius    starts   first stride      all   the gait    not yet",
    ]
    for basin in basins:
        row = basin.row()
        lines.append(
            f"{row['level_spectral_radius']:13.4f}{row['starts']:10}"
            f"{row['fell_in_the_first_stride']:15}{row['lasted']:9}{row['settled']:11}"
            f"{row['not_settled']:11}  {basin.name}"
        )
    return "\n".join(lines)
