"""``flexspine presets``: what there is, and every value with unit and provenance."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import Json
from flexspine.cli.output import print_json, steps
from flexspine.errors import UnknownNameError

if TYPE_CHECKING:
    from flexspine.control.gains import Walk
    from flexspine.models.model import Model, Source
    from flexspine.models.robot import Robot
    from flexspine.parameters import Quantity

Record = dict[str, Any]

# What is listed: heading, and the options that take it.
HEADINGS = {
    "presets": "Presets: bounders in the plane (--preset)",
    "robots": "Robots: articulated ones (--robot)",
    "walks": "Walks: of a robot in space (run3d --gait, spines --gait)",
}


def presets(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="A preset, a robot or a walk, or a TOML file of one.",
            show_default="list all",
            autocompletion=completion.everything,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List presets, robots and walks, or show every value of one.

    Values are told with unit, bounds, meaning and provenance; all of them can be changed by their
    dotted names with --set.

    Exit code 0: done; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine presets

        flexspine presets scout2

        flexspine presets sc618 --json
    """
    interruptible()
    with steps() as progress:
        progress.begin("reading")
        record = _everything() if name is None else _details(name)
    if json:
        print_json({**STAMP, **record})
    elif name is None:
        _print_list(record)
    else:
        _print_details(record)


def _everything() -> dict[str, list[Record]]:
    from flexspine.control.gains import load_walk, walk_names
    from flexspine.models.presets import load_model, preset_names
    from flexspine.models.robot_file import load_robot, robot_names

    robots = robot_names()
    return {
        "presets": [_of_model(load_model(name)) for name in preset_names()],
        "robots": [_of_robot(load_robot(name)) for name in robots],
        "walks": [
            _of_walk(load_walk(f"{robot}-{name}", robot), f"{robot}-{name}")
            for robot in robots
            for name in walk_names(robot)
        ],
    }


def _of_model(model: Model) -> Record:
    return {
        "name": model.name,
        "model": model.kind.name,
        "title": model.source.title,
        "citation": model.source.citation,
    }


def _of_robot(robot: Robot) -> Record:
    return {
        "name": robot.name,
        "links": len(robot.parents),
        "motors": len(robot.motors),
        "title": robot.source.title,
        "citation": robot.source.citation,
    }


def _of_walk(walk: Walk, name: str) -> Record:
    return {
        "name": name,
        "rhythm": walk.rhythm,
        "title": walk.source.title,
        "citation": walk.source.citation or walk.source.source,
    }


def _details(name: str) -> Record:
    """All of what has that name, or is in that file. Raises `UnknownNameError`, `PresetError`."""
    from flexspine.control.gains import Gains, load_walk
    from flexspine.models.presets import load_model
    from flexspine.models.robot_file import load_robot
    from flexspine.parameters import quantities, values

    kind = _kind(name)
    if kind == "robot":
        robot = load_robot(name)
        declared, numbers = _declared(robot), robot.numbers
        return _told(_of_robot(robot), robot.source, _rows(declared, numbers, robot.source))
    if kind == "walk":
        walk = load_walk(name, "")
        rows = _rows(quantities(Gains), values(walk.gains), walk.source)
        return _told(_of_walk(walk, walk.name), walk.source, rows)
    try:
        model = load_model(name)
    except UnknownNameError:
        known = (row["name"] for rows in _everything().values() for row in rows)
        raise UnknownNameError("preset, robot or walk", name, known) from None
    rows = _rows(quantities(type(model.parameters)), values(model.parameters), model.source)
    return _told(_of_model(model), model.source, [*rows, *_start(model)])


def _kind(name: str) -> str:
    """What a name, or the file that it is of, stands for."""
    for kind in ("robot", "walk"):
        if name in completion.titles(f"{kind}s"):
            return kind
    try:
        content = tomllib.loads(Path(name).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return "preset"  # which tells what is wrong
    return "robot" if "links" in content else "walk" if "rhythm" in content else "preset"


def _told(headline: Record, source: Source, rows: list[Record]) -> Record:
    return {
        **headline,
        "source": source.source,
        "notes": list(source.notes),
        "doubts": list(source.doubts),
        "values": rows,
    }


def _rows(
    declared: Iterable[Quantity], numbers: Mapping[str, float], source: Source
) -> list[Record]:
    return [
        {
            "name": about.name,
            "value": numbers[about.name],
            "unit": about.unit,
            "meaning": about.meaning,
            "bounds": about.bounds,
            "provenance": source.of(about.name),
        }
        for about in declared
        if about.name in numbers
    ]


def _declared(robot: Robot) -> Iterator[Quantity]:
    """What is declared about the numbers of a robot, part by part."""
    from flexspine.models import robot as parts
    from flexspine.parameters import quantities

    yield from quantities(parts.GroundNumbers)
    for names, kind in (
        (robot.parents, parts.LinkNumbers),
        (robot.joints, parts.JointNumbers),
        (robot.feet, parts.FootNumbers),
        ((parts.SPACE,), parts.SpaceNumbers),
    ):
        for name in names:
            yield from quantities(kind, f"{name}.")


def _start(model: Model) -> Iterator[Record]:
    """The start of a bounder, and its touchdown angles."""
    from flexspine.models.dataset import VARIABLES

    renamed = {"height": "com_y", "speed": "com_x_rate"}
    for name, value in model.apex.items():
        unit, meaning = VARIABLES[renamed.get(name, name)]
        yield {
            "name": f"apex.{name}",
            "value": value,
            "unit": unit,
            "meaning": f"{meaning} at the start",
            "provenance": model.source.of("apex"),
        }
    for side, angle in model.touchdown.items():
        yield {
            "name": f"touchdown.{side}",
            "value": angle,
            "unit": "rad",
            "meaning": f"touchdown angle of the {side} leg, from the vertical",
            "provenance": model.source.of("touchdown"),
        }


def _print_list(record: dict[str, list[Record]]) -> None:
    for kind, rows in record.items():
        print(HEADINGS[kind])
        for row in rows:
            print(f"  {row['name']:<24}{_sort(row):<18}{row['title']}")
            print(f"  {'':<24}{row['citation']}")
        print()
    print("Every value of one: flexspine presets NAME")


def _sort(row: Record) -> str:
    if "links" in row:
        return f"{row['links']} links"
    return str(row.get("model") or row["rhythm"])


def _print_details(record: Record) -> None:
    print(f"{record['name']} ({_sort(record)}): {record['title']}")
    for kind in ("citation", "source"):
        print(f"{kind}: {record[kind] or '-'}")
    for kind in ("notes", "doubts"):
        for text in record[kind]:
            print(f"{kind[:-1]}: {text}")
    print()
    name, unit, bounds = (
        max(len(row.get(key, "")) for row in record["values"]) for key in ("name", "unit", "bounds")
    )
    for row in record["values"]:
        other = row["provenance"] != record["source"]
        print(
            f"{row['name']:<{name}}  {row['value']:<22.16g} {row['unit']:<{unit}}  "
            f"{row.get('bounds', ''):<{bounds}}  {row['meaning']}"
            + (f"  [{row['provenance']}]" if other else "")
        )
