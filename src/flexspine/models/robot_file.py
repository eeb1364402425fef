"""Descriptions of planar robots, TOML files, and those that come with flexspine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from flexspine.errors import InputError, PresetError, UnknownNameError
from flexspine.models.model import Source
from flexspine.models.robot import SPACE, LegParts, Robot, checked
from flexspine.models.toml_files import read_named, shipped_names
from flexspine.parameters import flattened

FOLDER = "robots"

TABLES = ("links", "joints", "feet")
LEGS = "legs"
PROVENANCE = "provenance"
TEXTS = ("title", "citation", "source")
LISTS = ("notes", "doubts")
GROUND = ("gravity", "friction")

# What the entries of the tables are, besides numbers.
WORDS = {"links": ("parent",), "joints": ("link", "actuated"), "feet": ("link",)}


def robot_names() -> list[str]:
    """Return the names of the robots that come with flexspine."""
    return shipped_names(FOLDER)


def load_robot(robot: str | Path, parameters: Mapping[str, Any] | None = None) -> Robot:
    """Load a robot by name, or its description by the path of a TOML file.

    ``parameters`` are numbers to change, by dotted name (``{"spine.stiffness": 300}``); SI and
    radians. Raises `UnknownNameError`, `PresetError` and `ParameterError`.

    >>> from flexspine import load_robot
    >>> load_robot("sc618", {"spine.stiffness": 300})
    <Robot sc618: 10 links, 8 motors, 4 feet>
    """
    name = str(robot)
    content = read_named(name, "robot", FOLDER)
    try:
        _check_entries(content)
        made = _robot(Path(name).stem, content, f"file {name}")
    except InputError as failure:
        raise PresetError(f"'{name}': {failure.message}", failure.remedy) from None
    return made.with_values(parameters) if parameters else made


def _check_entries(content: Mapping[str, Any]) -> None:
    known = (*TABLES, LEGS, SPACE, PROVENANCE, *TEXTS, *LISTS, *GROUND)
    for entry in content:
        if entry not in known:
            raise InputError(f"unknown entry '{entry}'", f"known: {', '.join(known)}")
    for entry in TEXTS:
        if not isinstance(content.get(entry, ""), str):
            raise InputError(f"'{entry}' is no text", "put it in quotes")
    for entry in (SPACE, PROVENANCE):
        if not isinstance(content.get(entry, {}), Mapping):
            raise InputError(f"'{entry}' is not a table", f"write [{entry}]")
    for entry in LISTS:
        texts = content.get(entry, [])
        if not (isinstance(texts, list) and all(isinstance(text, str) for text in texts)):
            raise InputError(f"'{entry}' is not a list of texts", f'write {entry} = ["..."]')


def _table(content: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    table = content.get(name, {})
    if not isinstance(table, Mapping):
        raise InputError(f"'{name}' is not a table", f"write [{name}.NAME]")
    for part, entries in table.items():
        if not isinstance(entries, Mapping):
            raise InputError(f"{name}.{part} is not a table", f"write [{name}.{part}]")
    return table


def _robot(name: str, content: Mapping[str, Any], origin: str) -> Robot:
    links, joints, feet = (_table(content, table) for table in TABLES)
    _check_names(links, joints, feet)
    parents = {link: part.get("parent") for link, part in links.items()}
    _check_tree(parents)
    for table, parts in (("joints", joints), ("feet", feet)):
        for part, entries in parts.items():
            _check_link(f"{table}.{part}", entries.get("link"), links)
    _check_joints(joints, parents)
    legs = _table(content, LEGS)
    for leg, entries in legs.items():
        _check_leg(f"{LEGS}.{leg}", entries, links, feet)
    numbers = {entry: content[entry] for entry in GROUND if entry in content}
    numbers |= {f"{SPACE}.{entry}": value for entry, value in content.get(SPACE, {}).items()}
    for table, parts in zip(TABLES, (links, joints, feet), strict=True):
        for part, entries in parts.items():
            numbers |= {f"{part}.{k}": v for k, v in entries.items() if k not in WORDS[table]}
    # Without a word a link starts at the end of its parent, and a foot is at the end of its link.
    ends = {f"{link}.at": parent for link, parent in parents.items() if parent is not None}
    ends |= {f"{foot}.at": entries["link"] for foot, entries in feet.items()}
    ends = {name: link for name, link in ends.items() if name not in numbers}
    numbers |= {name: links[link].get("length") for name, link in ends.items()}
    wired = {j: (part["link"], part.get("actuated", False)) for j, part in joints.items()}
    standing = {foot: part["link"] for foot, part in feet.items()}
    numbers = checked(parents, wired, standing, numbers)
    origins = {name: f"the end of {link} as described" for name, link in ends.items()}
    return Robot(
        name=name,
        parents=parents,
        joints=wired,
        feet=standing,
        numbers=numbers,
        source=Source(
            title=str(content.get("title", name)),
            citation=str(content.get("citation", "")),
            source=str(content.get("source", origin)),
            notes=tuple(content.get("notes", ())),
            doubts=tuple(content.get("doubts", ())),
            provenance={**origins, **_provenance(content, numbers)},
        ),
        legs={leg: LegParts(**entries) for leg, entries in legs.items()},
    )


def _provenance(content: Mapping[str, Any], numbers: Mapping[str, float]) -> dict[str, str]:
    """Where numbers come from that the source does not tell, by dotted name."""
    told = flattened(content.get(PROVENANCE, {}))
    for name, text in told.items():
        if name not in numbers:
            unknown = UnknownNameError("parameter", name, numbers)
            raise InputError(f"{PROVENANCE}: {unknown.message}", unknown.remedy)
        if not isinstance(text, str):
            raise InputError(f"{PROVENANCE}.'{name}' is no text", "put it in quotes")
    return told


def _check_names(*tables: Mapping[str, Any]) -> None:
    links, _, feet = tables
    if not links:
        raise InputError("there are no links", "add [links.NAME] tables")
    if not feet:
        raise InputError("there are no feet", "add a [feet.NAME] table with the link that it is on")
    names = [name for table in tables for name in table]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"two parts are named '{name}'", "name links, joints, feet differently"
            )
        if "." in name:
            raise InputError(f"'{name}' has a dot in its name", "use an underscore")
        if name == SPACE:
            raise InputError(f"a part is named '{SPACE}'", "name it otherwise")


def _check_tree(parents: Mapping[str, Any]) -> None:
    """One free link, and every other one after its parent."""
    for link, parent in parents.items():
        if parent is not None:
            _check_link(f"links.{link}", parent, parents, "parent")
    for link in parents:
        walk = [link]
        while (above := parents[walk[-1]]) is not None:
            walk.append(above)
            if above in walk[:-1]:
                loop = " -> ".join(walk[walk.index(above) :])
                raise InputError(
                    f"links.{link}: {loop} is a loop", "let one of them have no parent"
                )
    free = [link for link, parent in parents.items() if parent is None]
    if len(free) > 1:
        raise InputError(
            f"links.{free[1]} has no parent, and neither has {free[0]}",
            f"give links.{free[1]} a parent",
        )
    seen: set[str] = set()
    for link, parent in parents.items():
        if parent is not None and parent not in seen:
            raise InputError(f"links.{link} comes before its parent '{parent}'", "move it below")
        seen.add(link)


def _check_link(where: str, name: Any, links: Mapping[str, Any], entry: str = "link") -> None:
    if name is None:
        raise InputError(f"{where} names no link", f'add {entry} = "LINK"')
    if not isinstance(name, str):
        raise InputError(f"{where}: {entry} = {name!r} is no name", "give the name of a link")
    if name not in links:
        unknown = UnknownNameError("link", name, links)
        raise InputError(f"{where}: {unknown.message}", unknown.remedy)


def _check_joints(joints: Mapping[str, Any], parents: Mapping[str, Any]) -> None:
    taken: dict[str, str] = {}
    for joint, entries in joints.items():
        link = entries["link"]
        if parents[link] is None:
            raise InputError(
                f"joints.{joint}: link '{link}' has no parent to be joined to",
                "name the link on the far side of the joint",
            )
        if link in taken:
            raise InputError(
                f"joints.{joint}: link '{link}' already has the joint '{taken[link]}'",
                "keep one of them",
            )
        taken[link] = joint
        if not isinstance(entries.get("actuated", False), bool):
            raise InputError(
                f"joints.{joint}: actuated = {entries['actuated']!r} is neither true nor false",
                "write actuated = true",
            )


def _check_leg(
    where: str, entries: Mapping[str, Any], links: Mapping[str, Any], feet: Mapping[str, Any]
) -> None:
    known = tuple(each.name for each in fields(LegParts))
    for entry in entries:
        if entry not in known:
            raise InputError(f"{where}: unknown entry '{entry}'", f"known: {', '.join(known)}")
    for entry, places in (("foot", feet), ("thigh", links), ("trunk", links)):
        name = entries.get(entry)
        if not isinstance(name, str):
            raise InputError(f"{where} names no {entry}", f'add {entry} = "NAME"')
        if name not in places:
            unknown = UnknownNameError("foot" if entry == "foot" else "link", name, places)
            raise InputError(f"{where}: {unknown.message}", unknown.remedy)
    if not isinstance(entries.get("knee_back", True), bool):
        raise InputError(
            f"{where}: knee_back = {entries['knee_back']!r} is neither true nor false",
            "write knee_back = true",
        )
    if entries.get("side", "") not in ("", "left", "right"):
        raise InputError(
            f"{where}: side = {entries['side']!r} is neither left nor right",
            'write side = "left"',
        )
    shank, thigh, trunk = feet[entries["foot"]]["link"], entries["thigh"], entries["trunk"]
    if len({shank, thigh, trunk}) < 3:
        raise InputError(
            f"{where}: shank '{shank}', thigh '{thigh}' and trunk '{trunk}' are not three links",
            "name three links",
        )
    if links[thigh].get("parent") != shank and links[shank].get("parent") != thigh:
        raise InputError(
            f"{where}: thigh '{thigh}' does not meet the foot's link '{shank}'",
            "name the link at the other side of the knee",
        )
