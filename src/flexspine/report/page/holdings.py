"""What a directory of results holds, sorted by what can be shown of it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexspine.errors import InputError
from flexspine.studies.store import MANIFEST, PARTIAL, ROWS

if TYPE_CHECKING:
    import xarray as xr

PICTURES = (".png", ".jpg", ".jpeg")
TABLES = (".csv", ".parquet")

# What a table of every instant has that the plots do not show.
TRAJECTORY = "trajectory"


@dataclass(frozen=True)
class Holdings:
    """What is there, by the names of the files.

    ``records`` and ``gaits`` are JSON objects, ``runs`` datasets, ``texts`` descriptions as TOML,
    ``others`` are only named.
    """

    path: Path
    records: dict[str, dict[str, Any]]
    gaits: dict[str, dict[str, Any]]
    manifest: dict[str, Any] | None
    runs: dict[str, xr.Dataset]
    tables: tuple[Path, ...]
    pictures: tuple[Path, ...]
    texts: dict[str, str]
    others: tuple[Path, ...]

    @property
    def rows(self) -> Path | None:
        """Where a sweep keeps its rows."""
        rows = self.path / ROWS
        return rows if self.manifest is not None and rows.is_dir() else None


def survey(path: Path, leave: Path | None = None) -> Holdings:
    """Look into a directory, at all but the file ``leave``.

    Raises `InputError` if nothing of flexspine's is in it, or what is there cannot be read.
    """
    if not path.is_dir():
        raise InputError(f"'{path}' is no directory", "give one that flexspine wrote with --out")
    records: dict[str, dict[str, Any]] = {}
    gaits: dict[str, dict[str, Any]] = {}
    runs: dict[str, xr.Dataset] = {}
    texts: dict[str, str] = {}
    manifest, known = None, []
    left = None if leave is None else leave.resolve()
    files = [
        file
        for file in sorted(path.iterdir())
        if not file.name.startswith((".", PARTIAL)) and file.resolve() != left
    ]
    for file in files:
        if file.suffix == ".json" and file.is_file():
            record = _record(file)
            if record is None:
                continue
            if file.name == MANIFEST:
                manifest = record
            else:
                (gaits if is_gait(record) else records)[file.name] = record
            known.append(file)
        elif file.suffix == ".nc" and file.is_file():
            dataset = _run(file)
            if dataset is not None:
                runs[file.name] = dataset
                known.append(file)
    if not (records or gaits or runs or manifest):
        raise InputError(
            f"there are no results of flexspine in '{path}'",
            "give a directory that flexspine wrote with --out",
        )
    tables = _tables(files)
    pictures = tuple(file for file in files if file.suffix.lower() in PICTURES and file.is_file())
    for file in files:
        if file.suffix == ".toml" and file.is_file():
            texts[file.name] = file.read_text(encoding="utf-8", errors="replace")
            known.append(file)
    shown = {*known, *tables, *pictures, path / ROWS} if manifest else {*known, *tables, *pictures}
    others = tuple(file for file in files if file not in shown)
    return Holdings(path, records, gaits, manifest, runs, tables, pictures, texts, others)


def is_gait(record: Any) -> bool:
    """Tell a saved gait from all else in records."""
    return isinstance(record, dict) and {"family", "apex", "touchdown_angles"} <= record.keys()


def _record(file: Path) -> dict[str, Any] | None:
    """A JSON object of flexspine's, None for another's."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as failure:
        raise InputError(
            f"cannot read '{file}' ({failure})", "remove it, or make the results anew"
        ) from None
    return found if isinstance(found, dict) and "schema_version" in found else None


def _run(file: Path) -> xr.Dataset | None:
    """A run of flexspine's, None for another dataset."""
    import xarray as xr

    try:
        dataset = xr.load_dataset(file, engine="h5netcdf")
    except (OSError, ValueError, KeyError, RuntimeError) as failure:
        raise InputError(
            f"cannot read '{file}' ({failure})", "remove it, or make the results anew"
        ) from None
    return dataset if "flexspine_version" in dataset.attrs else None


def _tables(files: list[Path]) -> tuple[Path, ...]:
    """Tables, once where there are several forms of one; not those of every instant."""
    found = {
        file.stem: file
        for file in files
        if file.suffix in TABLES and file.stem != TRAJECTORY and file.is_file()
    }
    return tuple(found.values())
