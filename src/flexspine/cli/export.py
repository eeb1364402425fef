"""``flexspine export``: what we know, in the files of others."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import DEFAULT_ROBOT, Assignments, RobotName, numbers
from flexspine.errors import InputError

app = typer.Typer(help="What we know, in the files of others.", no_args_is_help=True)


@app.callback()
def _group() -> None:
    pass


@app.command("mjcf")
def mjcf(
    robot: RobotName = DEFAULT_ROBOT,
    set_: Assignments = None,
    plane: Annotated[
        bool, typer.Option("--plane", help="Keep the robot to its plane: no abduction, no roll.")
    ] = False,
    pinned: Annotated[
        str | None,
        typer.Option(metavar="FOOT", help="The robot of 'verify pinned', held by this foot."),
    ] = None,
    locked: Annotated[bool, typer.Option("--locked", help="Lock the spine.")] = False,
    hold: Annotated[
        bool,
        typer.Option("--hold", help="Springs at the motors keep it standing; else it sinks down."),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Write this file (default: to the terminal).")
    ] = None,
) -> int:
    """Write the robot as MJCF, which MuJoCo, its viewer and other tools load (extra engine).

    Units are SI and radians; x forward, y left, z up (of --pinned: x forward, y up). Motors turn
    hinges by the torque that they are told, and are limp before. Exit code 0: done; 2: bad input;
    3: MuJoCo is missing or the machine failed.

    Examples:
        flexspine export mjcf --hold --out sc618.xml && python -m mujoco.viewer --mjcf=sc618.xml

        flexspine export mjcf --pinned toe_1 --out pinned.xml
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
    body = load_robot(robot, numbers("--set", set_))
    body = lock(body, spine_of(body)) if locked else body
    if pinned is not None:
        spec = pinned_specification(mujoco, body.linkage, pinned)
    else:
        spec = specification(mujoco, SpaceRobot(body, plane), hold=hold)
    spec.compile()
    text = spec.to_xml()
    if out is None:
        print(text, end="")
        return 0
    with ExitStack() as stack:
        directory = stack.enter_context(ResultDirectory(out.parent, tells=False))
        with directory.stage() as stage:
            (stage / out.name).write_text(text, encoding="utf-8")
    print(f"robot in {out}")
    return 0
