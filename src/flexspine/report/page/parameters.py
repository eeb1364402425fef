"""Every parameter of a run or a gait with its unit, value and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from flexspine.control.gains import Gains
from flexspine.models.dataset import VARIABLES
from flexspine.models.registry import KINDS
from flexspine.models.robot import (
    SPACE,
    FootNumbers,
    GroundNumbers,
    JointNumbers,
    LinkNumbers,
    SpaceNumbers,
)
from flexspine.parameters import ParameterSet, Quantity, quantities
from flexspine.report.page.markup import Markup, joined, table, tag
from flexspine.report.timeline import is_robot

if TYPE_CHECKING:
    import xarray as xr

HEAD = ("parameter", "value", "unit", "meaning", "where it comes from")

# The state that starts a run, by the variable that it is of.
STARTS = {"height": "com_y", "speed": "com_x_rate"}

# Of a value of which nothing else is noted.
BY_SOURCE = "the preset's source"

Row = tuple[str, Any, str, str, str]


def of_run(dataset: xr.Dataset) -> Markup:
    """Return the parameters of a run, and what it was asked for."""
    attrs = dataset.attrs
    given = {
        name: json.loads(attrs.get(name, "{}"))
        for name in ("parameters", "apex", "touchdown_angles", "provenance", "settings", "gains")
    }
    feet = [str(name) for name in dataset["foot_name"].values] if is_robot(dataset) else []
    parts = [_source(attrs.get("citation")), of_values(attrs.get("model", ""), given, feet)]
    for name, title in (("gains", "Numbers of the walk"), ("settings", "What was asked for")):
        if given[name]:
            parts += [tag("h4", title), _plain(given[name], _gains() if name == "gains" else {})]
    return joined(parts)


def of_values(
    model: str, given: Mapping[str, Mapping[str, Any]], feet: Collection[str] = ()
) -> Markup:
    """Return a table of ``parameters``, ``apex`` and ``touchdown_angles`` of a kind of model."""
    return table(HEAD, _rows(model, given, feet))


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
        unit, meaning = (about.unit, about.meaning) if about else ("", "")
        yield name, value, unit, meaning, origins.get(name, BY_SOURCE)
    for name, value in given.get("apex", {}).items():
        unit, meaning = VARIABLES[STARTS.get(name, name)]
        origin = origins.get("apex", BY_SOURCE)
        yield f"apex.{name}", value, unit, f"{meaning} at the start", origin
    for side, value in given.get("touchdown_angles", {}).items():
        meaning = f"touchdown angle of the {side} leg, from the vertical"
        yield f"touchdown.{side}", value, "rad", meaning, origins.get("touchdown", BY_SOURCE)


def _of_robot(name: str, feet: Collection[str]) -> Quantity | None:
    """What is declared about a number of a robot's part."""
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


def _gains() -> dict[str, Quantity]:
    return {each.name: each for each in quantities(Gains)}


def _plain(values: Mapping[str, Any], declared: Mapping[str, Quantity]) -> Markup:
    if not declared:
        return table(("name", "value"), values.items())
    rows = [
        (name, value, declared[name].unit, declared[name].meaning)
        if name in declared
        else (name, value, "", "")
        for name, value in values.items()
    ]
    return table(("name", "value", "unit", "meaning"), rows)


def _source(citation: str | None) -> Markup:
    return tag("p", f"Source: {citation}", class_="note") if citation else Markup()
