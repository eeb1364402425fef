"""Plans of sweeps as people write them: TOML files."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.gaits.files import load_gait
from flexspine.models.model import Model
from flexspine.models.presets import load_model
from flexspine.parameters import flattened, is_finite, shortened
from flexspine.studies.axes import Axis
from flexspine.studies.plan import Plan

ENTRIES = {"model", "task", "method", "samples", "seed", "chunk", "options", "axes", "set"}


def read_plan(path: str | Path) -> Plan:
    """Read a plan from a TOML file. Raises `InputError`."""
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
    for entry in ("model", "axes"):
        if entry not in content:
            raise InputError(f"there is no '{entry}'", f"add {entry}")
    names = content["model"]
    names = [names] if isinstance(names, str) else names
    if not (isinstance(names, list) and names and all(isinstance(n, str) for n in names)):
        raise InputError("'model' names no model", 'write model = "PRESET" or a list of them')
    for entry in ("axes", "options", "set"):
        if not isinstance(content.get(entry, {}), Mapping):
            raise InputError(f"'{entry}' is not a table", f"write [{entry}]")
    models = [_changed(load_start(n, place), content.get("set", {})) for n in names]
    axes = [Axis.read(n, what) for n, what in _axes(content["axes"])]
    options = dict(content.get("options", {}))
    if isinstance(options.get("fixed"), Mapping):
        options["fixed"] = flattened(options["fixed"])
    plain = {k: content[k] for k in ("task", "method", "samples", "seed", "chunk") if k in content}
    return Plan(tuple(models), tuple(axes), options=options, **plain)


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
        if not is_finite(value):
            raise ParameterError(f"'{name}' = {shortened(value)} is no number", "give a number")
    apex = {name: float(given.pop(name)) for name in list(given) if name in model.apex}
    angles = {
        name.partition(".")[2]: float(given.pop(name))
        for name in list(given)
        if name.startswith("touchdown.")
    }
    return model.with_values(
        {name: float(value) for name, value in given.items()}, apex=apex, touchdown=angles
    )
