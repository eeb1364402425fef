"""TOML files: those that come with flexspine, by name, and users' own, by path."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from flexspine.errors import PresetError, UnknownNameError

SUFFIX = ".toml"


def shipped_names(folder: str) -> list[str]:
    """Return the names of the files in a folder of the package, without suffix, sorted."""
    return sorted(
        entry.name.removesuffix(SUFFIX)
        for entry in (files("flexspine") / folder).iterdir()
        if entry.name.endswith(SUFFIX)
    )


def read_shipped(name: str, folder: str) -> dict[str, Any]:
    """Return what a file says that comes along."""
    file = files("flexspine") / folder / f"{name}{SUFFIX}"
    return _parsed(name, file.read_text(encoding="utf-8"))


def read_file(name: str) -> dict[str, Any]:
    """Return what the file at a path says. Raises `PresetError`."""
    try:
        text = Path(name).read_text(encoding="utf-8-sig")
    except OSError as failure:
        raise PresetError(
            f"cannot read '{name}' ({failure.strerror})", "give a readable TOML file"
        ) from None
    except UnicodeDecodeError:
        raise PresetError(f"'{name}' is not text", "give a TOML file in UTF-8") from None
    except ValueError:
        raise PresetError(f"{name!r} is no file name", "give a readable TOML file") from None
    return _parsed(name, text)


def read_named(name: str, kind: str, folder: str) -> dict[str, Any]:
    """Return what a file says: one that comes along if it has this name, else one at this path.

    ``kind`` is what it describes, such as ``robot``. Raises `UnknownNameError` and `PresetError`.
    """
    shipped = shipped_names(folder)
    if name in shipped:
        return read_shipped(name, folder)
    if is_path(name):
        return read_file(name)
    raise UnknownNameError(kind, name, shipped)


def is_path(name: str) -> bool:
    """Whether a name can only be meant as that of a user's file."""
    try:
        return Path(name).suffix == SUFFIX or Path(name).exists()
    except (OSError, ValueError):
        return True


def _parsed(name: str, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as failure:
        raise PresetError(f"'{name}' is not valid TOML: {failure}", "mend that line") from None
