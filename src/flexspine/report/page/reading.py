"""Reads the files of results; `InputError` tells of one that cannot be read, whatever is in it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray as xr

REMEDY = "remove it, or make the results anew"

# The command that made the results, as a line of text.
COMMAND = "command.txt"

# What libraries raise that meet a damaged file.
DAMAGED = (
    OSError,
    ArithmeticError,
    AttributeError,
    LookupError,
    RuntimeError,
    TypeError,
    ValueError,
)

# Rows of a table that are kept to be drawn; of a longer one as many, evenly apart.
MOST_POINTS = 2000


@dataclass(frozen=True)
class Table:
    """The first rows of a table, some of all of them, and how many there are.

    Columns are lists by name; ``sample`` has no more than `MOST_POINTS` rows.
    """

    first: dict[str, list[Any]]
    sample: dict[str, list[Any]]
    rows: int


def read_record(file: Path) -> dict[str, Any] | None:
    """Return a JSON object of flexspine's, None for another's."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as failure:
        raise _unreadable(file, failure) from None
    return found if isinstance(found, dict) and "schema_version" in found else None


def read_run(file: Path) -> xr.Dataset | None:
    """Return a run of flexspine's, None for another dataset."""
    import xarray as xr

    try:
        dataset = xr.load_dataset(file, engine="h5netcdf")
    except DAMAGED as failure:
        raise _unreadable(file, failure) from None
    return dataset if "flexspine_version" in dataset.attrs else None


def read_table(file: Path, most: int) -> Table:
    """Return the first ``most`` rows, and a sample, of a CSV or Parquet file."""
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    try:
        if not file.stat().st_size:
            return Table({}, {}, 0)
        read = pa.csv.read_csv if file.suffix == ".csv" else pa.parquet.read_table
        found: pa.Table = read(file)
    except (*DAMAGED, pa.ArrowException) as failure:
        raise _unreadable(file, failure) from None
    return Table(
        _columns(found.slice(0, most)), _columns(found.take(_some(found.num_rows))), found.num_rows
    )


def read_rows(path: Path, most: int) -> Table:
    """Return the first ``most`` rows, and a sample, of those of a sweep; of none no columns."""
    import pyarrow as pa
    import pyarrow.dataset as ds

    files = [str(file) for file in sorted(path.rglob("*.parquet"))]
    if not files:
        return Table({}, {}, 0)
    try:
        parts = ds.dataset(
            files, format="parquet", partition_base_dir=str(path), partitioning="hive"
        )
        count = parts.count_rows()
        return Table(_columns(parts.head(most)), _columns(parts.take(_some(count))), count)
    except (*DAMAGED, pa.ArrowException) as failure:
        raise InputError(
            f"cannot read the rows in '{path}' ({_told(failure)})",
            "run the sweep again: it goes on",
        ) from None


def _some(count: int) -> list[int]:
    """Which of so many rows are drawn."""
    kept = np.linspace(0, count - 1, min(count, MOST_POINTS)).round().astype(int)
    return [int(row) for row in kept]


def _columns(found: pa.Table) -> dict[str, list[Any]]:
    return {name: found.column(place).to_pylist() for place, name in enumerate(found.column_names)}


def _unreadable(file: Path, failure: BaseException) -> InputError:
    return InputError(f"cannot read '{file}' ({_told(failure)})", REMEDY)


def _told(failure: BaseException) -> str:
    text = getattr(failure, "strerror", None) or str(failure) or type(failure).__name__
    return " ".join(str(text).split())
