"""What shells offer for the words of a command: names, read from files without loading a model.

Completers are asked at every press of Tab, so nothing here imports more than TOML.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

Found = list[tuple[str, str]]
Completer = Callable[[str], Found]

PACKAGE = Path(__file__).parent.parent

DEFAULT_PRESET = "kamimura2015-flexible"
DEFAULT_ROBOT = "sc618"

# What a preset need not tell, as it is zero unless told otherwise.
PHASES = ("flight", "fore", "between", "hind", "both")
UNTOLD = tuple(
    f"{leg}.{actuator}"
    for leg in ("fore.leg", "hind.leg", "legs")
    for actuator in ("stiffening", "extension", "hip_lever")
)
UNTOLD_OF_SPINES = tuple(
    f"spine.{shift}.{phase}" for shift in ("stiffness_shift", "rest_shift") for phase in PHASES
)

# What the parts of a robot have, told or not, by the table that they are in.
OF_PARTS = {
    "links": ("length", "mass", "com", "inertia", "at"),
    "joints": ("stiffness", "damping", "rest"),
    "feet": ("at", "mass"),
}
OF_PACES = ("speed", "height", "stance", "clearance", "landing", "ramp", "stop")
OF_WALKS = ("gait", "servo")

QUANTITIES = ("energy", "height", "mean_speed", "touchdown.fore", "touchdown.hind")


def titles(folder: str) -> dict[str, str]:
    """What comes along in a folder, ``presets``, ``robots`` or ``walks``: titles by name."""
    names = sorted(file.stem for file in (PACKAGE / folder).glob("*.toml"))
    return {name: str(_read(folder, name).get("title", "")) for name in names}


def among(*names: str) -> Completer:
    """Complete one of these."""

    def complete(incomplete: str) -> Found:
        return _beginning(incomplete, dict.fromkeys(names, ""))

    return complete


def presets(incomplete: str) -> Found:
    """Complete the name of a preset."""
    return _beginning(incomplete, titles("presets"))


def robots(incomplete: str) -> Found:
    """Complete the name of a robot."""
    return _beginning(incomplete, titles("robots"))


def walks(context: typer.Context, incomplete: str) -> Found:
    """Complete a walk: of the robot by its short name, of any by its full one."""
    known, robot = titles("walks"), f"{_robot(context)}-"
    own = {name.removeprefix(robot): t for name, t in known.items() if name.startswith(robot)}
    return _beginning(incomplete, own | known)


def everything(incomplete: str) -> Found:
    """Complete the name of a preset, a robot or a walk."""
    return _beginning(incomplete, titles("presets") | titles("robots") | titles("walks"))


def models(incomplete: str) -> Found:
    """Complete a kind of model, or a preset."""
    kinds = {str(_read("presets", name).get("model", "")): "" for name in titles("presets")}
    return _beginning(incomplete, kinds | titles("presets"))


def apex(context: typer.Context, incomplete: str) -> Found:
    """Complete the start values of a preset, as assignments."""
    return _assigning(incomplete, _of_preset(context, "apex"))


def touchdown(context: typer.Context, incomplete: str) -> Found:
    """Complete the touchdown angles of a preset, as assignments."""
    return _assigning(incomplete, _of_preset(context, "touchdown"))


def settings(context: typer.Context, incomplete: str) -> Found:
    """Complete what can be set, as assignments: of the preset, or of the robot and its walk."""
    return _assigning(incomplete, _parameters(context))


def quantities(context: typer.Context, incomplete: str) -> Found:
    """Complete what a gait can be followed in, or what is kept or steered."""
    known = {**dict.fromkeys(QUANTITIES), **_of_preset(context, "apex"), **_parameters(context)}
    return _beginning(incomplete, dict.fromkeys(known, ""))


def feet(context: typer.Context, incomplete: str) -> Found:
    """Complete a foot of the robot."""
    return _beginning(incomplete, dict.fromkeys(_parts(context, "feet"), ""))


def joints(context: typer.Context, incomplete: str) -> Found:
    """Complete a joint of the robot."""
    return _beginning(incomplete, dict.fromkeys(_parts(context, "joints"), ""))


def ranges(context: typer.Context, incomplete: str) -> Found:
    """Complete the same, where a range or a value follows."""
    found = [(f"{name}=", about) for name, about in quantities(context, incomplete)]
    if len(found) == 1:  # a shell would add a space
        found.append((f"{found[0][0]}0", "a value, or LOW:HIGH"))
    return found


def _beginning(incomplete: str, known: Mapping[str, str]) -> Found:
    return [(name, about) for name, about in known.items() if name.startswith(incomplete)]


def _assigning(incomplete: str, known: Mapping[str, Any]) -> Found:
    """``NAME=`` of each; if one is left its value too, without which a shell would add a space."""
    found = [name for name in known if name.startswith(incomplete)]
    if len(found) == 1 and known[found[0]] is not None:
        (name,) = found
        return [(f"{name}=", "another value"), (f"{name}={known[name]}", "as it is")]
    return [(f"{name}=", "" if known[name] is None else str(known[name])) for name in found]


def _parameters(context: typer.Context) -> dict[str, Any]:
    """What can be set by the options so far, with its value where a file tells it."""
    if not any(each.name == "robot" for each in context.command.params):
        return _of_preset(context, "parameters")
    found = _of_robot(_read("robots", _robot(context)))
    if context.command.name == "trot":
        return found | dict.fromkeys(f"gait.{name}" for name in OF_PACES)
    walk = context.params.get("gait")
    if walk is None or context.command.name == "tune":
        return found
    told = _read("walks", f"{_robot(context)}-{walk}") or _read("walks", str(walk))
    return found | dict(_flat({part: told.get(part, {}) for part in OF_WALKS}))


def _of_preset(context: typer.Context, table: str) -> dict[str, Any]:
    """A table of the preset that was given, with what its base tells."""
    given = context.params.get("preset") or DEFAULT_PRESET
    name = given if isinstance(given, str) else given[-1]
    found: dict[str, Any] = {}
    seen: set[str] = set()
    while name and name not in seen:
        seen.add(name)
        content = _read("presets", name)
        found = {**dict(_flat(content.get(table, {}))), **found}
        if table == "parameters" and "model" in content:
            more = UNTOLD_OF_SPINES if content["model"] == "flexible-bounder" else ()
            found = {**found, **{key: 0.0 for key in (*UNTOLD, *more) if key not in found}}
        name = str(content.get("base", ""))
    return found


def _of_robot(content: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {
        f"{part}.{entry}": told.get(entry)
        for table, entries in OF_PARTS.items()
        for part, told in content.get(table, {}).items()
        for entry in entries
    }
    ground = {key: value for key, value in content.items() if isinstance(value, int | float)}
    return found | ground | dict(_flat({"space": content.get("space", {})}))


def _robot(context: typer.Context) -> str:
    return str(context.params.get("robot") or DEFAULT_ROBOT)


def _parts(context: typer.Context, table: str) -> list[str]:
    return list(_read("robots", _robot(context)).get(table, {}))


def _read(folder: str, name: str) -> dict[str, Any]:
    """What comes along under a name, or a file of the user's; nothing if it cannot be read."""
    own = PACKAGE / folder / f"{name}.toml"
    try:
        return tomllib.loads((own if own.is_file() else Path(name)).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return {}


def _flat(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
