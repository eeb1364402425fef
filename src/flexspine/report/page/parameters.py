"""Every parameter of a run or a gait with its unit, value and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from flexspine.control.gains import Gains, load_walk, walk_names
from flexspine.models.dataset import unit_and_meaning
from flexspine.models.model import Source
from flexspine.models.presets import load_model, preset_names
from flexspine.models.registry import KINDS
from flexspine.models.robot import (
    SPACE,
    FootNumbers,
    GroundNumbers,
    JointNumbers,
    LinkNumbers,
    SpaceNumbers,
)
from flexspine.models.robot_file import load_robot, robot_names
from flexspine.parameters import ParameterSet, Quantity, quantities, values
from flexspine.report.page.markup import Markup, folded, joined, table, tag
from flexspine.report.page.words import firm, unit_of
from flexspine.report.timeline import is_robot

if TYPE_CHECKING:
    import xarray as xr

HEAD = ("parameter", "value", "unit", "meaning", "where it comes from")

# The state that starts a run, by the variable that it is of.
STARTS = {"height": "com_y", "speed": "com_x_rate"}

# Of a value of which nothing else is noted.
BY_SOURCE = "the source"
BY_DEFAULT = "default"
UNKNOWN = "not recorded"

# Groups of starts, and what is said of those that no preset has.
APEX, TOUCHDOWN = "apex", "touchdown"
BY_RECORD = "of this gait"

Row = tuple[str, Any, str, str, str]


def of_run(dataset: xr.Dataset) -> Markup:
    """Return the parameters of a run, and what it was asked for."""
    attrs = dataset.attrs
    given = {
        name: json.loads(attrs.get(name, "{}"))
        for name in ("parameters", "apex", "touchdown_angles", "provenance", "settings", "gains")
    }
    feet = [str(name) for name in dataset["foot_name"].values] if is_robot(dataset) else []
    parts = [_source(attrs), of_values(attrs.get("model", ""), given, feet)]
    if given["gains"]:
        parts += [tag("h4", "Numbers of the walk"), _gains(given["gains"], attrs)]
    if given["settings"]:
        rows = [(name, value, unit_of(name)) for name, value in given["settings"].items()]
        parts += [tag("h4", "What was asked for"), table(("name", "value", "unit"), rows)]
    return joined(parts)


def of_record(record: Mapping[str, Any]) -> Markup:
    """Return the parameters of a gait, a robot, or a model of a sweep, all by their records.

    Its preset or description tells where they come from.
    """
    name = record.get("preset", record.get("robot", record.get("name", "")))
    frame = name if isinstance(name, Mapping) else {}
    known = _known(str(frame.get("name", name)), record.get("walk"))
    given: dict[str, dict[str, Any]] = {
        "parameters": record["parameters"],
        "apex": record.get("apex", {}),
        "touchdown_angles": record.get("touchdown_angles", record.get("touchdown", {})),
    }
    given["provenance"] = _origins(given, known)
    whole = of_values(str(record.get("model")), given, frame.get("feet", known.feet))
    return joined([_source(known.source.attributes()), whole])


def of_values(
    model: str, given: Mapping[str, Mapping[str, Any]], feet: Collection[str] = ()
) -> Markup:
    """Return a table of ``parameters``, ``apex`` and ``touchdown_angles`` of a kind of model.

    Those that are as they would be without a word are folded.
    """
    rows = list(_rows(model, given, feet))
    usual = [row for row in rows if row[-1] == BY_DEFAULT]
    whole = table(HEAD, [row for row in rows if row[-1] != BY_DEFAULT])
    if not usual:
        return whole
    return joined([whole, folded(f"{len(usual)} parameters at their default", table(HEAD, usual))])


class Known(NamedTuple):
    """What comes with flexspine under a name: nothing under that of anything else."""

    numbers: Mapping[str, float] = {}
    source: Source = Source("")
    feet: Collection[str] = ()


def _known(name: str, walk: Any) -> Known:
    """A preset, or a robot with one of its walks."""
    if name in preset_names():
        model = load_model(name)
        return Known(model.numbers, model.source)
    if name not in robot_names():
        return Known()
    robot = load_robot(name)
    if walk not in walk_names(name):
        return Known(robot.numbers, robot.source, robot.feet)
    gains = load_walk(walk, name)
    numbers = values(gains.gains)
    told = {**robot.source.provenance, **dict.fromkeys(numbers, gains.source.source)}
    source = replace(robot.source, provenance=told)
    return Known({**robot.numbers, **numbers}, source, robot.feet)


def _origins(given: Mapping[str, Mapping[str, float]], known: Known) -> dict[str, str]:
    """Where the values of a record come from, as far as what is known tells."""
    numbers = known.numbers
    origins = dict(known.source.provenance)
    for name, value in given["parameters"].items():
        if name not in numbers:
            origins[name] = UNKNOWN
        elif numbers[name] != value:
            origins[name] = f"changed from {numbers[name]:g}"
    for group, before, found in (
        (APEX, "", given["apex"]), (TOUCHDOWN, f"{TOUCHDOWN}.", given["touchdown_angles"]),
    ):  # fmt: skip
        if any(numbers.get(f"{before}{name}") != value for name, value in found.items()):
            origins[group] = BY_RECORD
    return origins


def _rows(
    model: str, given: Mapping[str, Mapping[str, Any]], feet: Collection[str]
) -> Iterator[Row]:
    origins = given.get("provenance", {})
    declared = (
        {each.name: each for each in quantities(KINDS[model].parameters)}
        if (model in KINDS)
        else {}
    )
    for name, value in given.get("parameters", {}).items():
        about = declared.get(name) or _of_robot(name, feet)
        unit, meaning = (firm(about.unit), about.meaning) if about else ("", "")
        usual = BY_DEFAULT if about and value == about.default else BY_SOURCE
        yield name, value, unit, meaning, origins.get(name, usual)
    for name, value in given.get("apex", {}).items():
        unit, meaning = unit_and_meaning(STARTS.get(name, name))
        origin = origins.get(APEX, BY_SOURCE)
        yield f"apex.{name}", value, unit, f"{meaning} at the start", origin
    for side, value in given.get("touchdown_angles", {}).items():
        meaning = f"touchdown angle of the {side} leg, from the vertical"
        yield f"touchdown.{side}", value, "rad", meaning, origins.get(TOUCHDOWN, BY_SOURCE)


def _of_robot(name: str, feet: Collection[str]) -> Quantity | None:
    """What is declared about a number of a robot's part, or of its walk."""
    gains = {each.name: each for each in quantities(Gains)}
    if name in gains:
        return gains[name]
    part, _, last = name.rpartition(".")
    kinds: tuple[type[ParameterSet], ...] = (LinkNumbers, JointNumbers)
    if not part:
        kinds = (GroundNumbers,)
    elif part == SPACE:
        kinds = (SpaceNumbers,)
    elif part in feet:
        kinds = (FootNumbers,)
    found = (each for kind in kinds for each in quantities(kind) if each.name == last)
    return next(found, None)


def _gains(gains: Mapping[str, Any], attrs: Mapping[str, str]) -> Markup:
    """The numbers of a walk in space."""
    declared = {each.name: each for each in quantities(Gains)}
    origins = json.loads(attrs.get("gains_provenance", "{}"))
    source = attrs.get("gains_source") or UNKNOWN
    rows = [
        (name, value, firm(about.unit), about.meaning, origins.get(name, source))
        for name, value in gains.items()
        if (about := declared.get(name))
    ]
    return table(HEAD, rows)


def _source(attrs: Mapping[str, str]) -> Markup:
    """What the source is, and what is doubted about it."""
    known = [attrs[name] for name in ("citation", "source") if attrs.get(name)]
    told = [f"Source: {'; '.join(dict.fromkeys(known))}"] if known else []
    for name, word in (("notes", "Note"), ("doubts", "Doubt")):
        told += [f"{word}: {text}" for text in json.loads(attrs.get(name, "[]"))]
    return joined(tag("p", text, class_="note") for text in told)
