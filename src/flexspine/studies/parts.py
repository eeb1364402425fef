"""The file of one chunk: its rows as Parquet, with a digest of them and what they amount to."""

from __future__ import annotations

import hashlib
import io
import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from flexspine.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

DIGEST, TALLY = b"flexspine.digest", b"flexspine.tally"


class Part(NamedTuple):
    """A finished chunk: its file, how many rows it has, and a digest of them."""

    content: bytes
    rows: int
    digest: str


class About(NamedTuple):
    """What a finished file says of its rows: how many, their digest, outcomes and strides."""

    rows: int
    digest: str
    outcomes: Mapping[str, int]
    strides: int


def make_part(table: pa.Table) -> Part:
    """Make the file of a table."""
    import pyarrow.parquet as pq

    digest = _digest(table)
    tally = Counter(table["outcome"].to_pylist())
    strides = int(sum(table["strides"].to_pylist())) if "strides" in table.column_names else 0
    told = json.dumps({"outcomes": tally, "strides": strides})
    stream = io.BytesIO()
    pq.write_table(
        table.replace_schema_metadata({DIGEST: digest, TALLY: told}), stream, compression="zstd"
    )
    return Part(stream.getvalue(), table.num_rows, digest)


def read_about(file: Path) -> About:
    """What a finished file says of its rows. Raises `InputError`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        about = pq.read_metadata(file)
        tally = json.loads(about.metadata[TALLY])
        digest = about.metadata[DIGEST].decode()
        return About(about.num_rows, digest, tally["outcomes"], tally["strides"])
    except (pa.ArrowInvalid, KeyError, TypeError, ValueError):
        raise _damaged(file) from None


def digest_of(file: Path) -> str:
    """The digest of the rows that are in a file. Raises `InputError`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return _digest(pq.ParquetFile(file).read())
    except (pa.ArrowException, OSError):
        raise _damaged(file) from None


def _damaged(file: Path) -> InputError:
    return InputError(f"'{file}' is damaged", "delete it; the sweep makes it anew")


def _digest(table: pa.Table) -> str:
    import pyarrow as pa

    digest = hashlib.sha256()
    for name, column in zip(table.column_names, table.columns, strict=True):
        digest.update(name.encode())
        if column.type == pa.float64():
            digest.update(column.to_numpy().tobytes())
        else:
            digest.update(json.dumps(column.to_pylist()).encode())
    return digest.hexdigest()
