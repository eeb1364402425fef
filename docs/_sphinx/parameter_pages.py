"""Every parameter with unit and bounds, and every preset with its values and their sources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tables import code, table

from flexspine import load_model, load_robot, load_walk, preset_names, robot_names, walk_names
from flexspine.control.gains import Gains
from flexspine.models.registry import KINDS
from flexspine.models.robot import (
    FootNumbers,
    GroundNumbers,
    JointNumbers,
    LinkNumbers,
    SpaceNumbers,
)
from flexspine.parameters import ParameterSet, quantities, values

PARAMETERS = """# Parameters

All of them by the dotted name that `--set`, TOML files and the functions of the library take, with
unit and bounds, as the code declares them. `--set NAME=VALUE` sets one from the command line; what
is out of bounds is refused. A dash in the column of defaults marks a value that has to be given.
`flexspine presets NAME` prints the values of a preset.
"""

PRESETS = """# Presets

What comes with flexspine, value by value. A file of your own that names one as its `base` changes
what it likes: see {doc}`../extending`.
"""

STARTS = """## Starts

`--apex NAME=VALUE` sets a coordinate of the apex that a run starts from, `--touchdown fore=ANGLE`
and `--touchdown hind=ANGLE` the angles (rad, between -pi/2 and pi/2) from the vertical at which
legs touch down, foot ahead of the hip positive.
"""

ROBOT_PARTS = (
    ("Of every link: `LINK.NAME`", "", LinkNumbers),
    ("Of every joint: `JOINT.NAME`", "", JointNumbers),
    ("Of every foot: `FOOT.NAME`", "", FootNumbers),
    ("Of the ground", "", GroundNumbers),
    ("Across the plane", "space.", SpaceNumbers),
)


def parameter_pages() -> dict[str, str]:
    """Return the pages of parameters and of presets."""
    parts = [PARAMETERS]
    for kind in KINDS.values():
        parts += [f"## {kind.name}\n", f"{_capital(kind.title)}. Source: {kind.source}.\n"]
        parts.append(declared(kind.parameters))
    parts.append(STARTS)
    parts.append("## Articulated robots\n")
    for title, prefix, kind in ROBOT_PARTS:
        parts += [f"### {title}\n", declared(kind, prefix)]
    parts += ["## Walks in space\n", declared(Gains)]
    parts.append("How the planar robot trots, `gait.speed` and its like, is in {doc}`../robot`.\n")
    return {
        "parameters.md": "\n".join(parts),
        "presets.md": "\n".join([PRESETS, *map(_preset, preset_names()), _robots(), _walks()]),
    }


def declared(kind: type[ParameterSet], prefix: str = "") -> str:
    """A table of what a class of parameters declares."""
    rows = (
        (
            code(each.name),
            "" if each.unit == "1" else each.unit,
            each.bounds,
            "-" if each.default is None else f"{each.default:g}",
            each.meaning,
        )
        for each in quantities(kind, prefix)
    )
    return table(("name", "unit", "bounds", "default", "meaning"), rows)


def _preset(name: str) -> str:
    model = load_model(name)
    about = {each.name: each for each in quantities(type(model.parameters))}
    rows = [
        (code(key), f"{value:g}", about[key].unit.replace("1", ""), model.source.of(key))
        for key, value in values(model.parameters).items()
        if value or about[key].default is None
    ]
    rows += [
        (code(f"apex.{key}"), f"{value:.12g}", "", model.source.of("apex"))
        for key, value in model.apex.items()
    ]
    rows += [
        (code(f"touchdown.{key}"), f"{value:.12g}", "rad", model.source.of("touchdown"))
        for key, value in model.touchdown.items()
    ]
    told = f"## {name}\n\n{model.source.title}. Model: `{model.kind.name}`.\n\n"
    return f"{told}{_sources(model.source)}\n{table(('name', 'value', 'unit', 'from'), rows)}\n"


def _robots() -> str:
    return "\n".join(
        _numbers(name, "robot", robot.source, robot.numbers)
        for name, robot in ((name, load_robot(name)) for name in robot_names())
    )


def _walks() -> str:
    walks = [load_walk(name, robot) for robot in robot_names() for name in walk_names(robot)]
    return "\n".join(
        _numbers(walk.name, "space", walk.source, values(walk.gains)) for walk in walks
    )


def _numbers(name: str, page: str, source: Any, numbers: Mapping[str, float]) -> str:
    rows = ((code(key), f"{value:g}") for key, value in numbers.items())
    told = f"## {name}\n\n{source.title}. See {{doc}}`../{page}`.\n\n{_sources(source)}\n"
    return f"{told}{table(('name', 'value (SI)'), rows)}\n"


def _sources(source: Any) -> str:
    lines = [f"- Source: {source.citation or source.source}"]
    lines += [f"- {note}" for note in source.notes]
    lines += [f"- In doubt: {doubt}" for doubt in source.doubts]
    return "\n".join(lines) + "\n"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
