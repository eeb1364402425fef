"""What a directory of results holds, sorted by what can be shown of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from flexspine.errors import InputError
from flexspine.report.page.reading import (
    COMMAND,
    Table,
    read_record,
    read_rows,
    read_run,
    read_table,
)
from flexspine.studies.store import MANIFEST, PARTIAL, ROWS

if TYPE_CHECKING:
    import xarray as xr

Found = TypeVar("Found")

PICTURES = (".png", ".jpg", ".jpeg")
FILMS = (".mp4", ".gif")
TABLES = (".csv", ".parquet")

# What a table of every instant has that the plots do not show.
TRAJECTORY = "trajectory"

# Rows of a table that are shown; more make a page slow, and nobody reads them.
MOST_ROWS = 200

# Larger films would make the page heavy.
LARGEST_FILM = 3_000_000  # bytes


@dataclass
class Holdings:
    """What is there, by the names of the files.

    ``records`` and ``gaits`` are JSON objects, ``runs`` datasets, ``texts`` descriptions as TOML;
    ``rows`` those of a sweep; ``unreadable`` are messages; ``others`` are only named.
    """

    path: Path
    command: str = ""
    manifest: dict[str, Any] | None = None
    records: dict[str, dict[str, Any]] = field(default_factory=dict)
    gaits: dict[str, dict[str, Any]] = field(default_factory=dict)
    runs: dict[str, xr.Dataset] = field(default_factory=dict)
    tables: dict[str, Table] = field(default_factory=dict)
    rows: Table | None = None
    pictures: list[Path] = field(default_factory=list)
    films: list[Path] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    unreadable: dict[str, str] = field(default_factory=dict)
    others: list[Path] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The name of the directory."""
        return self.path.resolve().name

    @property
    def branches(self) -> dict[str, dict[str, Any]]:
        """The records that are branches of gaits."""
        return {name: each for name, each in self.records.items() if is_branch(each)}

    @property
    def models(self) -> dict[str, dict[str, Any]]:
        """What has parameters and no run of its own: models of a sweep, animals, a robot."""
        if self.runs:
            return {}
        plan = (self.manifest or {}).get("plan", {})
        found = {str(model.get("name")): model for model in _mappings(plan, "models")}
        for name, record in self.records.items():
            animals = record.get("animals")
            inside = animals if isinstance(animals, dict) else {name: record}
            found |= {key: each for key, each in inside.items() if _has_parameters(each)}
        return {name: each for name, each in found.items() if _has_parameters(each)}


def survey(path: Path, leave: Path | None = None) -> Holdings:
    """Look into a directory, at all but the file ``leave``.

    Raises `InputError` if nothing of flexspine's can be read in it.
    """
    if not path.is_dir():
        raise InputError(f"'{path}' is no directory", "give one that flexspine wrote with --out")
    found = Holdings(path)
    files = _files(path, leave)
    for file in files:
        _sort_in(found, file)
    if found.manifest is not None and (path / ROWS).is_dir():
        found.rows = _read(found, path / ROWS, lambda rows: read_rows(rows, MOST_ROWS))
        found.others.remove(path / ROWS)
    if not (found.records or found.gaits or found.runs or found.manifest is not None):
        raise InputError(
            next(iter(found.unreadable.values()), f"there are no results of flexspine in '{path}'"),
            "give a directory that flexspine wrote with --out",
        )
    found.films, large = _lighter(found.films)
    found.others += large
    return found


def is_gait(record: Any) -> bool:
    """Tell a saved gait from all else in records."""
    return isinstance(record, dict) and {"family", "apex", "touchdown_angles"} <= record.keys()


def is_branch(record: Any) -> bool:
    """Tell a branch of gaits from all else in records."""
    return isinstance(record, dict) and {"over", "points", "landmarks"} <= record.keys()


def _has_parameters(record: Any) -> bool:
    return isinstance(record, dict) and isinstance(record.get("parameters"), dict)


def _mappings(record: Any, name: str) -> list[dict[str, Any]]:
    """The mappings in a list of a record."""
    listed = record.get(name) if isinstance(record, dict) else None
    return [each for each in listed if isinstance(each, dict)] if isinstance(listed, list) else []


def _files(path: Path, leave: Path | None) -> list[Path]:
    try:
        files = sorted(path.iterdir())
    except OSError as failure:
        raise InputError(f"cannot read '{path}' ({failure.strerror})", "make it readable") from None
    left = None
    if leave is not None and leave.parent.resolve() == path.resolve():
        left = leave.name
    return [
        file for file in files if not file.name.startswith((".", PARTIAL)) and file.name != left
    ]


def _sort_in(found: Holdings, file: Path) -> None:
    """Read a file if it is of a kind that can be shown, and keep it in its place."""
    kind = file.suffix.lower()
    if not file.is_file():
        found.others.append(file)
    elif kind == ".json":
        record = _read(found, file, read_record)
        if record is None:
            _name(found, file)
        elif file.name == MANIFEST:
            found.manifest = record
        else:
            (found.gaits if is_gait(record) else found.records)[file.name] = record
    elif kind == ".nc":
        dataset = _read(found, file, read_run)
        if dataset is None:
            _name(found, file)
        else:
            found.runs[file.name] = dataset
    elif kind in TABLES and file.stem != TRAJECTORY:
        table = _read(found, file, lambda each: read_table(each, MOST_ROWS))
        if table is not None:
            # Once, where there are several forms of it.
            found.tables = {n: t for n, t in found.tables.items() if Path(n).stem != file.stem}
            found.tables[file.name] = table
    elif kind in (*PICTURES, *FILMS):
        (found.pictures if kind in PICTURES else found.films).append(file)
    elif kind == ".toml" or file.name == COMMAND:
        text = _read(found, file, _text)
        if file.name == COMMAND:
            found.command = (text or "").strip()
        elif text is not None:
            found.texts[file.name] = text
    else:
        found.others.append(file)


def _read(found: Holdings, file: Path, read: Callable[[Path], Found | None]) -> Found | None:
    """What is in a file; one that cannot be read is noted."""
    try:
        return read(file)
    except InputError as failure:
        found.unreadable[file.name] = failure.message
        return None


def _name(found: Holdings, file: Path) -> None:
    """Only name a file that is not flexspine's."""
    if file.name not in found.unreadable:
        found.others.append(file)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError as failure:
        raise InputError(f"cannot read '{file}' ({failure.strerror})", "make it readable") from None


def _lighter(films: list[Path]) -> tuple[list[Path], list[Path]]:
    """Films that are shown, of two forms of one the lighter one, and the others."""
    shown: dict[str, Path] = {}
    for film in sorted(films, key=lambda each: each.stat().st_size):
        if film.stat().st_size <= LARGEST_FILM:
            shown.setdefault(film.stem, film)
    kept = sorted(shown.values())
    return kept, [film for film in films if film not in kept]
