"""``flexspine export``: what we know, in the files of others."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Assignments,
    Json,
    Locked,
    Plane,
    RobotName,
    numbers,
    output_file,
)
from flexspine.cli.output import print_json, steps
from flexspine.cli.run3d import refuse_without_effect
from flexspine.errors import InputError

app = typer.Typer(help="Write the robot for other tools, as MJCF.", no_args_is_help=True)


@app.callback()
def _group() -> None:
    pass


@app.command("mjcf")
def mjcf(
    robot: RobotName = DEFAULT_ROBOT,
    set_: Assignments = None,
    plane: Plane = False,
    pinned: Annotated[
        str | None,
        typer.Option(
            metavar="FOOT",
            help="The robot of 'verify pinned', held by this foot.",
            autocompletion=completion.feet,
        ),
    ] = None,
    locked: Locked = False,
    hold: Annotated[
        bool,
        typer.Option("--hold", help="Springs at the motors keep it standing; else it sinks down."),
    ] = False,
    out: Annotated[
        Path | None, output_file("Write this file, not the terminal.", metavar="FILE.xml")
    ] = None,
    json: Json = False,
) -> int:
    """Write the robot as MJCF, for other tools (extra engine).

    Units are SI and radians; x forward, y left, z up (of --pinned: x forward, y up). Motors turn
    hinges by the torque that they are told, and are limp before. 'python -m mujoco.viewer
    --mjcf=FILE.xml' shows it.

    Exit code 0: done; 2: bad input; 3: MuJoCo is missing or the machine failed; 130: interrupted.

    Examples:
        flexspine export mjcf --hold --out sc618.xml

        flexspine export mjcf --pinned toe_1 --out pinned.xml --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.control.spine_comparison import spine_of
    from flexspine.engines.installed import mujoco_module
    from flexspine.engines.mjcf import specification
    from flexspine.engines.mujoco_planar import pinned_specification
    from flexspine.models.locking import locked as lock
    from flexspine.models.robot_file import load_robot
    from flexspine.models.space import SpaceRobot

    interruptible()
    mujoco = mujoco_module()
    if plane and pinned:
        raise InputError("--plane and --pinned are both given", "leave one of them")
    if hold and pinned:
        raise InputError("--hold and --pinned are both given", "leave one of them")
    changes = numbers("--set", set_)
    body = load_robot(robot, changes)
    refuse_without_effect(changes, plane=plane, locked=spine_of(body) if locked else None)
    body = lock(body, spine_of(body)) if locked else body
    with steps() as progress:
        progress.begin("describing")
        if pinned is not None:
            spec = pinned_specification(mujoco, body.linkage, pinned)
        else:
            spec = specification(mujoco, SpaceRobot(body, plane), hold=hold)
        spec.compile()
        text = spec.to_xml()
    if out is not None:
        with ResultDirectory(out.parent, tells=False) as directory, directory.stage() as stage:
            (stage / out.name).write_text(text, encoding="utf-8")
    if json:
        told = {"mjcf": text} if out is None else {"file": str(out), "bytes": len(text.encode())}
        print_json(
            {
                **STAMP,
                "robot": body.name,
                **told,
            }
        )
    elif out is None:
        print(text, end="")
    else:
        print(f"robot in {out}")
    return 0
