"""``flexspine forces``: how motors share the weight of a standing robot between its feet."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_ROBOT,
    Assignments,
    Json,
    RobotName,
    numbers,
)
from flexspine.cli.output import print_json, steps
from flexspine.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from flexspine.control.distribution import Distribution, ForceFamily
    from flexspine.models.robot import Robot


def forces(
    robot: RobotName = DEFAULT_ROBOT,
    foot: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A foot that stands; repeat it.",
            show_default="all",
            autocompletion=completion.feet,
        ),
    ] = None,
    aim: Annotated[
        str,
        typer.Option(
            metavar="AIM",
            help="What to choose where there is a choice: split (normal forces as equal as can "
            "be, or as --share says), torque (least torque) or friction (farthest from slipping).",
            autocompletion=completion.among("split", "torque", "friction"),
        ),
    ] = "split",
    share: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FOOT=SHARE",
            help="A foot's share of the load, for --aim split; repeat it for every foot.",
            show_default="equal ones",
        ),
    ] = None,
    lock: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A joint that is locked, e.g. spine; repeat it.",
            autocompletion=completion.joints,
        ),
    ] = None,
    height: Annotated[float, typer.Option(help="Height of the hips, in m.")] = 0.33,
    ahead: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LEG=METRES",
            help="How far a leg's foot is ahead of its hip, in m; repeat it.",
            show_default="0",
        ),
    ] = None,
    set_: Assignments = None,
    json: Json = False,
) -> int:
    """Tell with which torques a robot can stand still.

    It stands with a level trunk, all feet below their hips or ahead of them. Printed are how many
    torques there are (unique, a family and its dimension, or none), the torques and forces that are
    chosen, and within what the normal force on each foot can be shifted while none pulls or slips.
    Units are SI and radians.

    Exit code 0: it can stand; 1: it cannot; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine forces

        flexspine forces --foot toe_1 --foot toe_4

        flexspine forces --foot toe_1 --foot toe_2 --foot toe_3 --aim torque --json
    """
    from flexspine.control.distribution import Aim, Verdict, force_family
    from flexspine.control.leg_function import standing
    from flexspine.models.leg_geometry import legs_of
    from flexspine.models.model import check_between
    from flexspine.models.robot_file import load_robot

    interruptible()
    made = load_robot(robot, numbers("--set", set_))
    feet = _feet(made, foot)
    for name in lock or []:
        if name not in made.joints:
            raise UnknownNameError("joint", name, made.joints)
    if aim not in {each.value for each in Aim}:
        raise UnknownNameError("aim", aim, [each.value for each in Aim])
    legs = legs_of(made)
    places = numbers("--ahead", ahead)
    for name in places:
        if name not in legs:
            raise UnknownNameError("leg", name, legs)
    check_between("--height", height, 0, inf)
    with steps() as progress:
        progress.begin("sharing the load")
        q = standing(made, height, places)
        family = force_family(made.linkage, q, feet, locked=lock or [])
        chosen = family.choose(Aim(aim), made.friction, _shares(feet, share, aim))
        record = _record(made, feet, family, chosen)
    if json:
        print_json(record)
    else:
        print(_report(record))
    return 0 if chosen.verdict in (Verdict.UNIQUE, Verdict.FAMILY) else 1


def _feet(robot: Robot, given: list[str] | None) -> list[str]:
    """The feet that stand, in the robot's order. Raises `UnknownNameError`."""
    for name in given or []:
        if name not in robot.feet:
            raise UnknownNameError("foot", name, robot.feet)
        if (given or []).count(name) > 1:
            raise InputError(f"--foot {name} is given twice", "name each foot once")
    return [name for name in robot.feet if given is None or name in given]


def _shares(feet: list[str], given: list[str] | None, aim: str) -> list[float] | None:
    """Shares that sum to one, in the order of the feet. Raises `InputError`."""
    if not given:
        return None
    if aim != "split":
        raise InputError("--share is given for another aim", "give it with --aim split")
    shares = numbers("--share", given)
    for name in shares:
        if name not in feet:
            raise UnknownNameError("foot that stands", name, feet)
    whole = sum(shares.values())
    if set(shares) != set(feet) or min(shares.values()) < 0 or not whole > 0:
        raise InputError(
            "--share does not tell the share of every foot that stands",
            "give one from zero on for each of " + ", ".join(feet),
        )
    return [shares[name] / whole for name in feet]


def _record(
    robot: Robot, feet: list[str], family: ForceFamily, chosen: Distribution
) -> dict[str, Any]:
    ranges = [family.normal_range(i, robot.friction) for i in range(len(feet))]
    forces, torques = chosen.forces, chosen.torques
    return {
        **STAMP,
        "robot": robot.name,
        "feet": feet,
        "verdict": chosen.verdict.value,
        "dimension": chosen.dimension,
        "margin": chosen.margin,
        "forces": None
        if forces is None
        else {
            foot: dict(zip("xy", row.tolist(), strict=True))
            for foot, row in zip(feet, forces, strict=True)
        },
        "normal_ranges": {
            foot: None if each is None else list(each)
            for foot, each in zip(feet, ranges, strict=True)
        },
        "torques": None
        if torques is None
        else dict(zip(robot.motors, torques.tolist(), strict=True)),
    }


def _report(record: dict[str, Any]) -> str:
    """The distribution for a person."""
    dimension, verdict = record["dimension"], record["verdict"]
    more = f" of dimension {dimension}" if verdict == "family" else ""
    lines = [f"{record['robot']} on {', '.join(record['feet'])}: {verdict}{more}"]
    if record["forces"] is None:
        return lines[0]
    for foot, force in record["forces"].items():
        reach = record["normal_ranges"][foot]
        text = f"  {foot:<8} normal {force['y']:8.2f} N, tangential {force['x']:+8.2f} N"
        if reach is not None and dimension:
            text += f", normal between {reach[0]:.2f} and {reach[1]:.2f} N"
        lines.append(text)
    lines.append(f"  {record['margin']:.2f} N from slipping")
    lines += [f"  {joint:<8} {torque:+8.3f} N m" for joint, torque in record["torques"].items()]
    return "\n".join(lines)
