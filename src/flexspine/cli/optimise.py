"""``flexspine optimise``: the best gaits at a speed, with constant stiffness and by phase."""

from __future__ import annotations

import re
import sys
from contextlib import ExitStack
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_PRESET,
    Assignments,
    GaitFile,
    Json,
    Preset,
    Processes,
    Seed,
    check_number,
    output_directory,
    span,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.cli.starts import start_of
from flexspine.cli.sweep import count_of
from flexspine.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from flexspine.studies.optimise import Optimisation

RADIUS = "spectral_radius"

UNFINISHED = "optimise.pieces.jsonl"
SAVED = re.compile(r"gait-.*\.json|front\.(csv|parquet)|pareto\.png|optimise\.json")


class Spines(StrEnum):
    """Which fronts are looked for."""

    both = "both"
    constant = "constant"
    by_phase = "by-phase"


def optimise(
    out: Annotated[Path, output_directory("gaits, tables and a figure")],
    speed: Annotated[
        float | None, typer.Option(help="Mean speed, in m/s.", show_default="that of the gait")
    ] = None,
    preset: Preset = None,
    gait: GaitFile = None,
    set_: Assignments = None,
    minimise: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Two of peak_grf, cost_of_transport and spectral_radius; the second one is kept "
            "below limits.",
            show_default="peak_grf, cost_of_transport",
            autocompletion=completion.among("peak_grf", "cost_of_transport", RADIUS),
        ),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH",
            help="The range (SI) of a parameter, or of energy, height, ...; repeat it.",
            show_default="spine.stiffness=100:1000, spine.damping=0.2:2, legs.extension=0:0.05",
            autocompletion=completion.ranges,
        ),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Leave something as it is that varies by default; repeat it.",
            autocompletion=completion.among("spine.stiffness", "spine.damping", "legs.extension"),
        ),
    ] = None,
    shift: Annotated[
        str,
        typer.Option(
            metavar="LOW:HIGH",
            help="Relative range of stiffness in other phases, about that around the apex.",
        ),
    ] = "-0.5:0.5",
    spine: Annotated[Spines, typer.Option(help="Kinds of stiffness.")] = Spines.both,
    points: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Limits of the second objective.", show_default="12"),
    ] = None,
    draws: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="N",
            help="How many random designs whose gaits are started from.",
            show_default="12",
        ),
    ] = None,
    seed: Seed = 0,
    processes: Processes = None,
    json: Json = False,
) -> int:
    """Find the best gaits: fronts of peak force, cost and stability.

    Two of them are weighed against each other, a Pareto front. Energy, apex height and mean speed
    are those of the gait, unless they vary. With stiffness by phase the work of every switch
    counts. Every gait is simulated anew and certified. Interrupted, the same command goes on. Units
    are SI and radians.

    Exit code 0: done; 1: no gait to start from; 2: bad input; 3: the machine or its workers failed;
    130: interrupted.

    Examples:
        flexspine optimise --speed 4.25 --out best

        flexspine optimise --minimise peak_grf --minimise spectral_radius --out 2

        flexspine optimise --vary height=0.3:0.34 --points 4 --out high --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.studies import optimise as study
    from flexspine.studies.front_record import front_record

    interruptible()
    if gait is not None and preset is not None:
        raise InputError("--preset and --gait are both given", "leave one of them")
    if speed is not None:
        check_number("--speed", speed)
    wanted = {Spines.constant: study.SPINES[:1], Spines.by_phase: study.SPINES[1:]}
    ranges, count = _ranges(dict(study.RANGES), vary, keep), count_of(processes)
    shifted = span("--shift", shift)
    start = start_of(DEFAULT_PRESET if preset is None else preset, gait, set_)
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = stack.enter_context(ResultDirectory(out))
        store = out / UNFINISHED
        begun = store.exists()
        try:
            found = study.optimise(
                start,
                speed,
                minimise=minimise or study.MINIMISED,
                ranges=ranges,
                shift=shifted,
                spines=wanted.get(spine, study.SPINES),
                points=study.POINTS if points is None else points,
                draws=study.DRAWS if draws is None else draws,
                seed=seed,
                store=store,
                processes=count,
                progress=partial(_show, progress),
            )
            record = front_record(found)
            with directory.stage(SAVED) as stage:
                _write(stage, found, record, progress)
            store.unlink()
        except KeyboardInterrupt:
            if store.exists():
                print(
                    f"flexspine: what was found is in '{store}'; the same command goes on from it",
                    file=sys.stderr,
                )
            raise
        except (InputError, study.NoGaitError):
            if not begun:  # what was begun before is none of this one's
                store.unlink(missing_ok=True)
            raise
    if json:
        print_json(record)
    else:
        print(_report(record))
        print(f"results in {out}")
    return 0


def _ranges(
    ranges: dict[str, tuple[float, float]], vary: list[str] | None, keep: list[str] | None
) -> dict[str, tuple[float, float]]:
    for name in keep or []:
        if name not in ranges:
            raise UnknownNameError("quantity that varies by default (--keep)", name, ranges)
        del ranges[name]
    for item in vary or []:
        name, equals, ends = item.partition("=")
        if not (name.strip() and equals):
            raise InputError(f"--vary '{item}' is not NAME=LOW:HIGH", "write NAME=LOW:HIGH")
        ranges[name.strip()] = span(f"--vary {name.strip()}", ends)
    return ranges


def _show(progress: Steps, what: str, share: float) -> None:
    progress.begin(what)
    progress.at(share)


def _write(stage: Path, found: Optimisation, record: dict[str, Any], progress: Steps) -> None:
    from flexspine.cli.results import write_json
    from flexspine.gaits.files import save_gait
    from flexspine.report.pareto_figure import plot_fronts
    from flexspine.studies.front_record import front_rows, point_name
    from flexspine.studies.tables import write_table

    progress.begin("writing data")
    rows = front_rows(found)
    for suffix in ("csv", "parquet"):
        write_table(rows, stage / f"front.{suffix}")
    write_json(record, stage / "optimise.json")
    save_gait(found.reference, stage / "gait-reference.json")
    for spine, front in found.fronts.items():
        for number, point in enumerate(front.points):
            save_gait(point.gait, stage / f"gait-{point_name(spine, number)}.json")
    progress.begin("drawing")
    plot_fronts(record).savefig(stage / "pareto.png")


def _report(record: dict[str, Any]) -> str:
    """The fronts for a person, and what the second one buys."""
    first, second = record["minimised"]
    lines = [f"mean speed {record['mean_speed']:.6g} m/s, {first} against {second}"]
    for spine, front in record["fronts"].items():
        lines += ["", f"stiffness {spine}", f"{second:>18}{first:>18}    radius  what varied"]
        for point in front["points"]:
            x, y, radius = (point["objectives"][name] for name in (second, first, RADIUS))
            varied = [f"{_short(name)} {value:.4g}" for name, value in point["varied"].items()]
            lines.append(f"{x:18.6g}{y:18.6g}{radius:10.4g}  {', '.join(varied)}")
        if front["refused"]:
            lines.append(f"{len(front['refused'])} not borne out: {front['refused'][0]}")
    if record["told"]:
        lines += ["", record["told"]]
    return "\n".join(lines)


def _short(name: str) -> str:
    """A parameter's name as far as it takes to know it here."""
    return name.removeprefix("spine.").replace("stiffness_shift", "shift")
