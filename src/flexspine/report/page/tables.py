"""CSV and Parquet files as tables that can be put in order by a click."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flexspine.errors import InputError
from flexspine.report.page.markup import Markup, joined, table, tag

if TYPE_CHECKING:
    import pyarrow as pa

# Rows that are shown of a table; more make a page slow, and nobody reads them.
MOST_ROWS = 200


def table_section(files: tuple[Path, ...], rows: Path | None) -> Markup:
    """Show tables one below the other, and the rows of a sweep."""
    parts = [_shown(file.name, _read(file)) for file in files]
    if rows is not None:
        parts.append(_rows(rows))
    return joined(parts)


def _shown(name: str, found: pa.Table, count: int | None = None) -> Markup:
    whole = found.num_rows if count is None else count
    some = found.slice(0, MOST_ROWS)
    columns = [some.column(i).to_pylist() for i in range(some.num_columns)]
    more = f", of which the first {some.num_rows} are shown" if some.num_rows < whole else ""
    return joined(
        [
            tag("h3", name),
            tag("p", f"{whole} row{'s' * (whole != 1)}{more}.", class_="note"),
            table(some.column_names, zip(*columns, strict=True), sortable=True),
        ]
    )


def _read(file: Path) -> pa.Table:
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    try:
        if file.suffix == ".csv":
            return pa.csv.read_csv(file)
        return pa.parquet.read_table(file)
    except pa.ArrowInvalid as failure:
        if not file.stat().st_size:
            return pa.table({})
        raise InputError(
            f"cannot read '{file}' ({failure})", "remove it, or make the results anew"
        ) from None


def _rows(path: Path) -> Markup:
    """The first rows of a sweep."""
    import pyarrow as pa
    import pyarrow.dataset as ds

    files = [str(file) for file in sorted(path.rglob("*.parquet"))]
    if not files:
        return tag("p", f"{path.name}/ has no rows yet.", class_="note")
    try:
        parts = ds.dataset(
            files, format="parquet", partition_base_dir=str(path), partitioning="hive"
        )
        return _shown(f"{path.name}/", parts.head(MOST_ROWS), parts.count_rows())
    except pa.ArrowInvalid as failure:
        raise InputError(
            f"cannot read the rows in '{path}' ({failure})", "run the sweep again: it goes on"
        ) from None
