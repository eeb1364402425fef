"""``flexspine run3d``: the robot walks in space, in MuJoCo."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Animation,
    Json,
    Locked,
    Plane,
    RobotName,
    RunDirectory,
    Seed,
    WalkAssignments,
    Walks,
    numbers,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.errors import InputError

if TYPE_CHECKING:
    from flexspine.engines.space_measures import SpaceSummary
    from flexspine.engines.space_run import SpaceRun
    from flexspine.studies.walkers import Walker

# What a run in space writes, in which an earlier one's pictures would pass for its own.
PICTURES = re.compile(r"(figure|animation|film)\.(png|mp4|gif)")

FILMS, FILM_RATE = ("film.mp4", "film.gif"), 25


def run3d(
    robot: RobotName = DEFAULT_ROBOT,
    gait: Walks = "trot",
    set_: WalkAssignments = None,
    seconds: Annotated[float, typer.Option(help="How long to walk, in s.")] = 15.0,
    locked: Locked = False,
    plane: Plane = False,
    sensing: Annotated[
        float, typer.Option(help="Read angles of joints off by up to this much, in rad.")
    ] = 0.0,
    seed: Seed = 0,
    render: Annotated[
        bool, typer.Option("--render", help="With --out, film it as MuJoCo draws it (OpenGL).")
    ] = False,
    out: RunDirectory = None,
    animation: Animation = True,
    json: Json = False,
) -> int:
    """Let the robot walk in space, in MuJoCo (extra engine).

    It starts standing, and coupled oscillators draw its legs. Units are SI and radians.

    Exit code 0: it stayed up; 1: it did not; 2: bad input; 3: MuJoCo or OpenGL is missing, or the
    machine failed; 130: interrupted.

    Examples:
        flexspine run3d --out trot3d

        flexspine run3d --gait bound --seconds 10 --render --out bound3d

        flexspine run3d --locked --set gait.speed=0.4 --json
    """
    from flexspine.cli.results import ResultDirectory, write_robot_run
    from flexspine.engines.installed import mujoco_module
    from flexspine.engines.space_dataset import space_dataset
    from flexspine.engines.space_measures import space_record, summarize_space
    from flexspine.engines.space_run import run_in_space

    interruptible()
    mujoco_module()
    if render and out is None:
        raise InputError("--render is given without --out", "give --out, where the film goes")
    walker = walker_of(robot, gait, set_, lock=locked, plane=plane)
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = ResultDirectory.within(stack, out, films=animation or render)
        progress.begin("walking")
        run = run_in_space(
            walker.robot, walker.walk, seconds,
            plane=plane, sensing=sensing, seed=seed, progress=progress.at,
        )  # fmt: skip
        summary = summarize_space(run)
        record = space_record(run, summary)
        if directory is not None:
            with directory.stage(PICTURES) as stage:
                write_robot_run(stage, space_dataset(run), record, animation, progress)
            if render:
                with directory.stage() as stage:
                    _film(stage, run, progress)
    if json:
        print_json(record)
    else:
        print(_report(run, summary))
        if out is not None:
            print(f"results in {out}")
    return 0 if run.outcome.completed else 1


def walker_of(
    robot: str, gait: str, given: list[str] | None, *, lock: bool = False, plane: bool = False
) -> Walker:
    """What walks, and how, as options tell it. Raises `InputError`."""
    from flexspine.control.gains import load_walk
    from flexspine.control.spine_comparison import spine_of
    from flexspine.models.robot_file import load_robot
    from flexspine.models.space import SpaceRobot
    from flexspine.studies.walkers import Walker

    changes = numbers("--set", given)
    body = load_robot(robot)
    SpaceRobot(body)  # whatever is wrong with it comes first
    walk = load_walk(gait, body.name)
    walker = Walker(f"{body.name}-{walk.name}", body, walk).with_values(changes)
    walker.check()
    refuse_without_effect(changes, plane=plane, locked=spine_of(body) if lock else None)
    return walker.with_locked_spine() if lock else walker


# What tells only of motions that leave the plane.
ACROSS = ("space.yaw_stiffness", "space.yaw_damping", "servo.out_stiffness", "servo.out_damping")


def refuse_without_effect(changes: Iterable[str], *, plane: bool, locked: str | None) -> None:
    """Raise `InputError` if what is set is of joints that --plane or --locked leaves out."""
    for name in changes:
        if plane and name in ACROSS:
            raise InputError(f"--set {name} and --plane are both given", "leave one of them")
        if locked is not None and name.startswith(f"{locked}."):
            raise InputError(f"--set {name} and --locked are both given", "leave one of them")


def _film(stage: Path, run: SpaceRun, progress: Steps) -> None:
    import numpy as np

    from flexspine.engines.render import rendered
    from flexspine.report.film import write_film

    progress.begin("filming")
    times = np.arange(0, run.duration, 1 / FILM_RATE)
    pictures = rendered(run, times)
    places = [stage / name for name in FILMS]
    write_film(pictures, places, fps=FILM_RATE, gif_every=2, count=len(times), progress=progress.at)


def _report(run: SpaceRun, summary: SpaceSummary) -> str:
    """The run in a few lines for a person."""
    lines = [f"{run.robot.name}, {run.walk.name}: {run.outcome.name} ({run.outcome.message})"]
    if not run.outcome.completed:
        lines.append(f"  advice           {run.outcome.advice}")
    if summary.speed is not None:
        assert summary.heading is not None
        assert summary.turning is not None
        lines.append(
            f"  steady speed     {summary.speed:.3f} m/s ({run.walk.gains.gait.speed:.3f} wanted "
            f"of feet that stand), {summary.strides} strides, "
            f"{summary.distance:.2f} m; heading {summary.heading:+.3f} rad, turning "
            f"{summary.turning:+.4f} rad/s"
        )
        lines.append(
            f"  normal forces    mean {summary.normal or 0:.1f} N on feet that stand, impacts "
            f"{summary.impact or 0:.0f} N, peak {summary.peak_normal:.0f} N"
        )
        lines.append(
            f"  oscillation      CoM height {1e3 * (summary.bounce or 0):.1f} mm, sideways "
            f"{1e3 * (summary.sway or 0):.1f} mm; roll {summary.roll:.4f}, pitch "
            f"{summary.pitch:.4f} rad (rms)"
        )
        lines += [f"  {name:<16} {angle:.4f} rad (rms)" for name, angle in summary.spine.items()]
        lines.append(f"  flight           {100 * (summary.flight or 0):.1f} % of the time")
        lines.append(
            f"  lost a stride    {summary.contact_loss:.2f} J to the ground, "
            f"{summary.damper_loss:.2f} J to dampers of joints"
        )
        lines.append(f"  tracking error   {summary.error:.4f} rad (rms)")
    if summary.cost_of_transport is not None:
        lines.append(f"  cost of transport {summary.cost_of_transport:.3f}")
    law = next(iter(run.laws.values()))
    lines += [
        f"  torque           up to {summary.torque:.1f} N m",
        f"  contact          f = {law.stiffness:g} N/m depth + {law.damping:g} N s/m rate, "
        f"friction {run.robot.friction:g}; it adds {1e3 * law.dragged:.0f} g to a foot, which "
        f"creeps by {1e6 * law.creep:.1f} um/s a newton while it sticks",
        f"  depth            up to {1e3 * summary.deepest:.1f} mm",
        f"  energy           balance closed to {summary.imbalance:.2g} J at steps of "
        f"{1e3 * run.settings['step']:g} ms",
    ]
    return "\n".join(lines)
