"""Presets and users' own parameter files, both TOML of the same form."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexspine.errors import InputError, PresetError
from flexspine.models.model import Model, Source
from flexspine.models.registry import find_kind
from flexspine.models.toml_files import read_named, shipped_names
from flexspine.parameters import build, flattened

FOLDER = "presets"

_TABLES = {"parameters", "apex", "touchdown", "provenance"}
_TEXTS = {"model", "base", "title", "citation", "source"}
_LISTS = {"notes", "doubts"}


def preset_names() -> list[str]:
    """Return the names of the presets that come with flexspine."""
    return shipped_names(FOLDER)


def load_model(
    preset: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    apex: Mapping[str, float] | None = None,
    touchdown: Mapping[str, float] | None = None,
) -> Model:
    """Load a preset by name, or a TOML file by path, with some values changed.

    ``parameters`` by dotted name (``{"spine.stiffness": 240}``), ``apex`` by section coordinate
    such as ``height``, ``touchdown`` by leg (``fore``, ``hind``); SI and radians. Raises
    `UnknownNameError`, `PresetError`, `ParameterError`.

    >>> from flexspine import load_model
    >>> model = load_model("kamimura2015-flexible", {"spine.stiffness": 240}, apex={"height": 0.33})
    >>> model.parameters.spine.stiffness, model.apex["height"]
    (240.0, 0.33)
    """
    model = _load(str(preset), ())
    return model.with_values(parameters, apex=apex, touchdown=touchdown)


def _load(name: str, users: tuple[str, ...]) -> Model:
    """Load a preset or a file; ``users`` are the files that are based on it."""
    if name in users:
        raise PresetError(f"'{name}' is its own base", "base it on a preset")
    content = read_named(name, "preset", FOLDER)
    _check_entries(name, content)
    try:
        return _model(name, content, users)
    except InputError as failure:
        if isinstance(failure, PresetError):
            raise
        raise PresetError(f"'{name}': {failure.message}", failure.remedy) from None


def _check_entries(name: str, content: Mapping[str, Any]) -> None:
    for key, value in content.items():
        if key not in _TABLES | _TEXTS | _LISTS:
            raise PresetError(
                f"'{name}': unknown entry '{key}'",
                f"known: {', '.join(sorted(_TABLES | _TEXTS | _LISTS))}",
            )
        wanted = dict if key in _TABLES else str if key in _TEXTS else list
        texts = not isinstance(value, list) or all(isinstance(item, str) for item in value)
        if not (isinstance(value, wanted) and texts):
            kind = {dict: "a table", str: "a text", list: "a list of texts"}[wanted]
            raise PresetError(f"'{name}': '{key}' is not {kind}", f"make it {kind}")


def _model(name: str, content: Mapping[str, Any], users: tuple[str, ...]) -> Model:
    title = Path(name).stem if name.endswith(".toml") else name
    if "base" in content:
        return _based(title, name, content, users)
    if "model" not in content:
        raise PresetError(f"'{name}' names no model", 'add model = "..." or base = "PRESET"')
    kind = find_kind(content["model"])
    return Model(
        name=title,
        kind=kind,
        parameters=build(kind.parameters, flattened(content.get("parameters", {}))),
        apex=_numbers(content, "apex"),
        touchdown=_numbers(content, "touchdown"),
        source=Source(
            title=content.get("title", kind.title),
            citation=content.get("citation", ""),
            source=content.get("source", f"file {name}"),
            notes=tuple(content.get("notes", ())),
            doubts=tuple(content.get("doubts", ())),
            provenance=flattened(content.get("provenance", {})),
        ),
    )


def _based(title: str, name: str, content: Mapping[str, Any], users: tuple[str, ...]) -> Model:
    """A file that changes some values of a preset."""
    if "model" in content:
        raise PresetError(f"'{name}' has both 'model' and 'base'", "keep one of them")
    base = _load(content["base"], (*users, name))
    changed = flattened(content.get("parameters", {}))
    model = base.with_values(
        changed, apex=_numbers(content, "apex"), touchdown=_numbers(content, "touchdown")
    )
    told = dict.fromkeys((*changed, *({"apex", "touchdown"} & content.keys())), f"file {name}")
    provenance = {**model.source.provenance, **told, **flattened(content.get("provenance", {}))}
    source = Source(
        title=content.get("title", f"{base.name}, changed"),
        citation=content.get("citation", base.source.citation),
        source=base.source.source,
        notes=(*_of(base, base.source.notes), *content.get("notes", ())),
        doubts=(*_of(base, base.source.doubts), *content.get("doubts", ())),
        provenance=provenance,
    )
    return model.renamed(title, source)


def _of(base: Model, texts: tuple[str, ...]) -> tuple[str, ...]:
    """What is told of a base, not of what is based on it."""
    return tuple(f"{base.name}: {text}" for text in texts)


def _numbers(content: Mapping[str, Any], table: str) -> dict[str, float]:
    return {
        key: float(value) if type(value) is int and abs(value) < 2**53 else value
        for key, value in content.get(table, {}).items()
    }
