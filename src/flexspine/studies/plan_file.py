"""Plans of sweeps as people write them: TOML files."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from flexspine.control.gains import load_walk
from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.gaits.files import load_gait
from flexspine.models.model import Model
from flexspine.models.presets import load_model
from flexspine.models.robot_file import load_robot
from flexspine.parameters import flattened, is_finite, shortened
from flexspine.studies.axes import Axis
from flexspine.studies.plan import Plan
from flexspine.studies.task_kinds import WALKS
from flexspine.studies.walkers import Walker

ENTRIES = {
    "model", "robot", "gait", "spine", "task", "method", "samples", "seed", "chunk", "options",
    "axes", "set",
}  # fmt: skip

FLEXIBLE, LOCKED = "flexible", "locked"


def read_plan(path: str | Path) -> Plan:
    """Read the plan of a sweep from a TOML file; paths in it are from the file's directory.

    Raises `InputError`.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as failure:
        raise InputError(f"cannot read '{path}' ({failure.strerror})", "give a TOML file") from None
    except (ValueError, RecursionError) as failure:
        raise InputError(f"'{path}' is not valid TOML: {failure}", "mend that line") from None
    try:
        return _plan(content, Path(path).parent)
    except InputError as failure:
        raise InputError(f"'{path}': {failure.message}", failure.remedy) from None


def load_start(name: str, place: Path | None = None) -> Model:
    """Load a preset, a TOML file, or the model of a gait file (JSON); paths are from ``place``."""
    path = Path(name) if place is None else place / name
    if Path(name).suffix == ".json":
        gait = load_gait(path)
        return gait.model.renamed(path.stem, gait.model.source)
    if Path(name).suffix == ".toml":
        return load_model(path)
    return load_model(name)


def _plan(content: Mapping[str, Any], place: Path) -> Plan:
    for entry in content:
        if entry not in ENTRIES:
            raise UnknownNameError("entry", entry, ENTRIES)
    walks = content.get("task") == WALKS
    for entry in ("robot" if walks else "model", "axes"):
        if entry not in content:
            raise InputError(f"there is no '{entry}'", f"add {entry}")
    for entry in ("model",) if walks else ("robot", "gait", "spine"):
        if entry in content:
            raise InputError(f"'{entry}' is not for this task", f"leave it, or task = '{WALKS}'")
    for entry in ("axes", "options", "set"):
        if not isinstance(content.get(entry, {}), Mapping):
            raise InputError(f"'{entry}' is not a table", f"write [{entry}]")
    changes = content.get("set", {})
    models: list[Model | Walker]
    if walks:
        models = list(_walkers(content, changes, place))
    else:
        models = [_changed(load_start(n, place), changes) for n in _listed(content, "model")]
    axes = [Axis.read(n, what) for n, what in _axes(content["axes"])]
    options = dict(content.get("options", {}))
    if isinstance(options.get("fixed"), Mapping):
        options["fixed"] = flattened(options["fixed"])
    plain = {k: content[k] for k in ("task", "method", "samples", "seed", "chunk") if k in content}
    return Plan(tuple(models), tuple(axes), options=options, **plain)


def _listed(content: Mapping[str, Any], entry: str, usual: str | None = None) -> list[str]:
    """One name or a list of them."""
    names = content.get(entry, usual)
    names = [names] if isinstance(names, str) else names
    if not (isinstance(names, list) and names and all(isinstance(n, str) for n in names)):
        raise InputError(f"'{entry}' names no {entry}", f'write {entry} = "NAME" or a list of them')
    return names


def _walkers(
    content: Mapping[str, Any], changes: Mapping[str, Any], place: Path
) -> Iterator[Walker]:
    """Every robot with every gait, its spine flexible, locked, or once this and once that."""
    given = flattened(changes)
    for name, value in given.items():
        _check_finite(name, value)
    spines = _listed(content, "spine", FLEXIBLE)
    for spine in spines:
        if spine not in (FLEXIBLE, LOCKED):
            raise UnknownNameError("spine", spine, (FLEXIBLE, LOCKED))
    for robot in _listed(content, "robot"):
        body = load_robot(place / robot if Path(robot).suffix == ".toml" else robot)
        for gait in _listed(content, "gait", "trot"):
            walk = load_walk(place / gait if Path(gait).suffix == ".toml" else gait, body.name)
            walker = Walker(f"{body.name}-{walk.name}", body, walk).with_values(given)
            for spine in spines:
                yield walker if spine == FLEXIBLE else walker.with_locked_spine()


def _check_finite(name: str, value: Any) -> None:
    if not is_finite(value):
        raise ParameterError(f"'{name}' = {shortened(value)} is no number", "give a number")


def _axes(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Axes by dotted name, whether it was quoted or written as nested tables."""
    forms = {"low", "high", "around", "within", "steps", "keeps"}
    for name, content in table.items():
        if isinstance(content, Mapping) and not content.keys() <= forms:
            yield from _axes(content, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", content


def _changed(model: Model, table: Mapping[str, Any]) -> Model:
    """A model with some values set."""
    given = flattened(table)
    for name, value in given.items():
        _check_finite(name, value)
    apex = {name: float(given.pop(name)) for name in list(given) if name in model.apex}
    angles = {
        name.partition(".")[2]: float(given.pop(name))
        for name in list(given)
        if name.startswith("touchdown.")
    }
    return model.with_values(
        {name: float(value) for name, value in given.items()}, apex=apex, touchdown=angles
    )
