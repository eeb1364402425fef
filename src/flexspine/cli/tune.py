"""``flexspine tune``: search for the numbers of a walk in space."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.kept import kept
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Assignments,
    Json,
    Processes,
    RobotName,
    Seed,
    numbers,
    output_directory,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.cli.sweep import count_of

if TYPE_CHECKING:
    from flexspine.studies.tuning import Tuning


def tune(
    out: Annotated[Path, output_directory("the gait and its measures")],
    rhythm: Annotated[
        str,
        typer.Option(
            "--gait",
            metavar="NAME",
            help="trot or bound.",
            autocompletion=completion.among("trot", "bound"),
        ),
    ] = "trot",
    speed: Annotated[float, typer.Option(help="The wanted speed, in m/s.")] = 0.4,
    robot: RobotName = DEFAULT_ROBOT,
    set_: Assignments = None,
    seconds: Annotated[
        float | None, typer.Option(help="How long walks are tried, in s.", show_default="8")
    ] = None,
    draws: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="How many walks are drawn at first.", show_default="128"
        ),
    ] = None,
    rounds: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="How often the best are varied.", show_default="6"),
    ] = None,
    seed: Seed = 0,
    processes: Processes = None,
    json: Json = False,
) -> int:
    """Search for the gait and the gains of a walk in space.

    Frequency, posture and gains of walks are drawn over the ranges of their numbers; the best are
    varied by ever smaller amounts, 24 walks a round, all with a little noise on their sensors
    (0.005 rad). Best is who does not fall, keeps the wanted speed, and then takes least energy and
    hits the ground least. The same seed finds the same. Interrupted, the same command goes on.
    Units are SI and radians.

    Exit code 0: done; 1: all walks fell; 2: bad input; 3: MuJoCo is missing or the machine failed;
    130: interrupted.

    Examples:
        flexspine tune --gait trot --speed 0.4 --out tuned

        flexspine run3d --gait tuned/walk.toml
    """
    from flexspine.cli.results import ResultDirectory, write_json
    from flexspine.engines.installed import mujoco_module
    from flexspine.models.robot_file import load_robot
    from flexspine.studies import tuning

    mujoco_module()
    body = load_robot(robot, numbers("--set", set_))
    with ExitStack() as stack:
        directory = stack.enter_context(ResultDirectory(out))
        store = stack.enter_context(kept(out, "tune"))
        progress = stack.enter_context(steps())
        found = tuning.tune(
            body,
            rhythm,
            speed,
            seconds=tuning.SECONDS if seconds is None else seconds,
            draws=tuning.DRAWS if draws is None else draws,
            rounds=tuning.ROUNDS if rounds is None else rounds,
            seed=seed,
            processes=count_of(processes),
            store=store,
            progress=lambda what, share: _show(progress, what, share),
        )
        record = _record(found, speed, seed)
        with directory.stage() as stage:
            (stage / "walk.toml").write_text(tuning.walk_file(found), encoding="utf-8")
            write_json(record, stage / "tune.json")
    if json:
        print_json(record)
    else:
        print(
            f"cost {found.cost:.3f} after {found.tried} walks, of which {found.lasting} lasted; "
            f"{found.summary.speed:.3f} m/s"
        )
        print(f"{out / 'walk.toml'}: flexspine run3d --gait {out / 'walk.toml'}")
    return 0


def _show(progress: Steps, what: str, share: float) -> None:
    progress.begin(what)
    progress.at(share)


def _record(found: Tuning, speed: float, seed: int) -> dict[str, Any]:
    from flexspine.engines.space_measures import space_record

    return {
        **STAMP,
        "wanted_speed": speed,
        "seed": seed,
        "cost": found.cost,
        "history": list(found.history),
        "tried": found.tried,
        "lasting": found.lasting,
        "walk": space_record(found.run, found.summary),
    }
