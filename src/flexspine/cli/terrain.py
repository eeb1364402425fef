"""``flexspine terrain``: run over ground that is not flat, once or many times."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine.cli import completion
from flexspine.cli.control import report
from flexspine.cli.interrupts import interruptible
from flexspine.cli.kept import kept
from flexspine.cli.options import (
    Animation,
    Assignments,
    GaitFile,
    Json,
    Preset,
    Processes,
    RunDirectory,
    Seed,
    numbers,
)
from flexspine.cli.output import print_json, steps
from flexspine.cli.starts import starting_gait
from flexspine.cli.steering_options import Effort, Method, Once, Steer, stabilizer_of
from flexspine.cli.sweep import count_of
from flexspine.errors import InputError

if TYPE_CHECKING:
    from flexspine.control.steering import SteeredRun, Steering
    from flexspine.gaits.gait import Gait
    from flexspine.studies.wayfaring import Wayfaring

# What can be completed; a file goes too.
GROUNDS = ("step", "stairs", "ramp", "slope", "waves", "rough", "blocks")
NUMBERS = ("height", "length", "count", "degrees", "amplitude", "wavelength", "spacing")


def terrain(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="step, stairs, ramp, slope, waves, rough, blocks, or a CSV file with columns x, y "
            "in m.",
            autocompletion=completion.among(*GROUNDS),
        ),
    ] = "rough",
    with_: Annotated[
        list[str] | None,
        typer.Option(
            "--with",
            metavar="NAME=VALUE",
            help="A number of the ground: height, length, amplitude, wavelength, spacing (in m), "
            "count, degrees; repeat it.",
            autocompletion=completion.among(*(f"{name}=" for name in NUMBERS)),
        ),
    ] = None,
    preset: Preset = None,
    gait: GaitFile = None,
    set_: Assignments = None,
    passive: Annotated[
        bool, typer.Option("--passive", help="Run with fixed touchdown angles, without feedback.")
    ] = False,
    steer: Steer = None,
    method: Method = "lqr",
    once: Once = False,
    effort: Effort = None,
    strides: Annotated[int, typer.Option(min=1, metavar="N", help="How many strides to run.")] = 50,
    runs: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="How many runs, each over ground of another seed."),
    ] = 1,
    seed: Seed = 0,
    processes: Processes = None,
    out: RunDirectory = None,
    animation: Animation = True,
    json: Json = False,
) -> int:
    """Run over steps, slopes, waves or rough ground.

    The gait is stabilised as by 'flexspine control'. Heights are measured from the ground below the
    CoM; the seed draws them, and where in a stride the ground begins. Legs keep their length in the
    air, so that whether a toe clears a face depends on where in the stride it stands. With --out
    the first 8 strides are kept in full and drawn, of a run that ended early the last 8; apexes.csv
    has all. With --runs, distances to the first fall are told; interrupted, the same command goes
    on. Units are SI and radians but for a slope's degrees.

    Exit code 0: all strides done, or all of --runs; 1: it fell or stumbled; 2: bad input; 3: the
    machine failed; 130: interrupted.

    Examples:
        flexspine terrain rough --with height=0.008 --out rough

        flexspine terrain step --with height=-0.03 --json

        flexspine terrain waves --with amplitude=0.01 --runs 200 --out waves
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.control.excerpt import excerpt
    from flexspine.control.steered_record import steered_record
    from flexspine.studies.wayfaring import Terrain, distance_to_fall, walk_over

    interruptible()
    if passive and (steer or once or effort is not None or method != "lqr"):
        raise InputError(
            "--passive is given, and how to steer too", "leave --steer, --method, --once, --effort"
        )
    where, workers = Terrain(kind, numbers("--with", with_)), count_of(processes)
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        start = starting_gait(gait, preset, set_, None, progress)
        where.ground(seed, start.stride_length, strides)  # refused before anything is done
        found, steering = None, _passive(start)
        if not passive:
            progress.begin("designing the feedback")
            found = steering = stabilizer_of(start, steer, method, once, effort)
        directory = ResultDirectory.within(stack, out, films=animation)
        progress.begin("running")
        run = walk_over(
            start.model, steering, where, stride=start.stride_length, strides=strides, seed=seed
        )
        record = {
            **steered_record(run, start, found),
            "terrain": {"kind": kind, "numbers": where.all_numbers},
            "passive": passive,
        }
        if runs > 1:
            store = stack.enter_context(kept(out, "terrain"))
            progress.begin(f"running {runs} times")
            ensemble = distance_to_fall(
                start.model, steering, where, stride=start.stride_length, strides=strides,
                runs=runs, seed=seed, processes=workers, store=store,
                progress=lambda done, whole: progress.at(done / whole),
            )  # fmt: skip
            record["ensemble"] = _ensemble_record(ensemble)
        if directory is not None:
            part = excerpt(run)
            record["shown"] = part.record
            with directory.stage_run(part, record, animation, progress) as stage:
                _write_way(run, start, stage)
                if runs > 1:
                    _write_ensemble(ensemble, record, stage)
    if json:
        print_json(record)
    else:
        print(_report(record))
        if out is not None:
            print(f"results in {out}")
    return 0 if runs > 1 or run.outcome.completed else 1


def _passive(gait: Gait) -> Steering:
    import numpy as np

    from flexspine.control.steering import Fixed
    from flexspine.models.legs import ANGLES

    return Fixed(ANGLES, np.array([gait.model.numbers[name] for name in ANGLES]))


def _ensemble_record(found: Wayfaring) -> dict[str, Any]:
    return {
        "runs": len(found.fates),
        "strides": found.strides,
        "first_seed": found.first_seed,
        "outcomes": found.outcomes,
        "arrived": found.arrived,
        "metres_per_fall": found.metres_per_fall(),
        "distance_to_first_fall": {
            f"{share:.0%}": found.quantile(share) for share in (0.1, 0.5, 0.9)
        },
    }


def _write_way(run: SteeredRun, gait: Gait, stage: Path) -> None:
    """All apexes of a run, and the ground that it passed over."""
    from flexspine.control.steered_record import apex_table
    from flexspine.models.dataset import VICINITY
    from flexspine.studies.tables import write_table

    write_table(apex_table(run, gait), stage / "apexes.csv")
    assert run.model.ground is not None
    ends = [float(point.states[0]) for point in (run.trajectory.start, run.trajectory.end)]
    outline = run.model.ground.outline(min(ends) - VICINITY, max(ends) + VICINITY)
    write_table([{"x": x, "y": y} for x, y in outline.tolist()], stage / "ground.csv")


def _write_ensemble(found: Wayfaring, record: dict[str, Any], stage: Path) -> None:
    from flexspine.report.distance_figure import plot_distances
    from flexspine.studies.tables import write_table

    rows = [
        {"seed": found.first_seed + number, **fate._asdict()}
        for number, fate in enumerate(found.fates)
    ]
    write_table(rows, stage / "runs.csv")
    plot_distances(found, record).savefig(stage / "distances.png")


def _report(record: dict[str, Any]) -> str:
    """The run, and many more, in a few lines for a person."""
    many = record.get("ensemble")
    lines = [f"the run of seed {record['seed']}, one of them:"] if many else []
    lines.append(report(record))
    if many:
        ended = ", ".join(f"{count} {name}" for name, count in many["outcomes"].items())
        lines.append(f"{many['runs']} runs of up to {many['strides']} strides: {ended}")
        for share, distance in many["distance_to_first_fall"].items():
            if distance is not None:
                lines.append(f"  {share:>3} had ended    after {distance:.1f} m")
        if many["metres_per_fall"] is not None:
            lines.append(f"  metres per fall  {many['metres_per_fall']:.1f}")
    return "\n".join(lines)
