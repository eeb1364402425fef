"""A sweep on disk: a manifest, and one Parquet file a chunk, each written whole or not at all.

``manifest.json`` tells what is done and with what; rows are in ``rows/model=NAME/part-N.parquet``,
which pandas, polars and duckdb read as one table. A file that is there is finished.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import platform
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any
from urllib.parse import quote

from numpy.typing import NDArray

from flexspine._version import SCHEMA_VERSION, __version__, check_schema
from flexspine.errors import OUT_OF_SPACE, InputError, OutputError
from flexspine.parameters import shortened
from flexspine.studies.parts import Part, read_about
from flexspine.studies.plan import Plan

MANIFEST, ROWS, LOCK, PARTIAL = "manifest.json", "rows", ".flexspine-lock", ".partial-"
ENTRIES = {"key": str, "plan": dict, "made_with": dict}
# How many differences are told.
TOLD = 3

ANEW = "begin the sweep anew in another directory"
ENGINE = "mujoco"  # which not everybody has
LIBRARIES = ("heyoka", "numpy", "scipy", "sympy", "pyarrow")


class Store:
    """The directory of one sweep. Raises `OutputError` and `InputError`."""

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path, self.plan = path, plan
        self.finished: set[int] = set()
        self.manifest: dict[str, Any] = {}
        self._maker = made_with()

    @contextmanager
    def opened(self) -> Iterator[Store]:
        """Make or go on with the directory, keeping others out of it meanwhile."""
        new = [p for p in (self.path, *self.path.parents) if not p.exists()]
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._refuse_what_is_not_ours()
            lock = self._lock()
        except OSError as failure:
            if failure.errno in OUT_OF_SPACE:
                raise
            raise OutputError(
                f"cannot write to '{self.path}' ({failure.strerror})", "give another directory"
            ) from None
        with lock:
            try:
                self._begin()
                yield self
            finally:
                (self.path / LOCK).unlink(missing_ok=True)
                if not (self.path / MANIFEST).exists():
                    for made in new:
                        if made.is_dir() and not any(made.iterdir()):
                            made.rmdir()

    def _refuse_what_is_not_ours(self) -> None:
        """Only what was killed before it had a manifest leaves anything without one."""
        if (self.path / MANIFEST).exists():
            return
        for entry in self.path.iterdir():
            locks = entry.name == LOCK and not entry.stat().st_size
            if not locks and entry.name != f"{PARTIAL}{MANIFEST}":
                raise OutputError(
                    f"'{self.path}' holds something else ({entry.name})",
                    "give an empty or a new directory",
                )

    def _lock(self) -> IO[str]:
        """Take the lock; whoever had it may have deleted its file meanwhile."""
        while True:
            lock = (self.path / LOCK).open("a")
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                lock.close()
                raise OutputError(
                    f"another process is at work in '{self.path}'",
                    "wait for it, or give another directory",
                ) from None
            except OSError as failure:
                lock.close()
                raise OutputError(
                    f"'{self.path}' cannot be locked ({failure.strerror})",
                    "give a directory on a disk of this machine",
                ) from None
            try:
                if os.path.samestat(os.fstat(lock.fileno()), (self.path / LOCK).stat()):
                    return lock
            except FileNotFoundError:
                pass
            lock.close()

    def _begin(self) -> None:
        if not (self.path / MANIFEST).exists():
            self.manifest = {
                "schema_version": SCHEMA_VERSION,
                "kind": "sweep",
                "key": self.plan.key,
                "plan": self.plan.record(),
                "chunks": self.plan.chunks,
                "made_with": self._maker,
            }
            self._write_manifest()
            return
        self.manifest = read_manifest(self.path)
        if self.manifest["key"] != self.plan.key:
            found = _differences(self.manifest["plan"], self.plan.record())
            more = f", and {len(found) - TOLD} more" if len(found) > TOLD else ""
            what = ", ".join(found[:TOLD]) + more
            raise InputError(
                f"'{self.path}' holds a sweep with another configuration ({what})",
                "give another directory, or the configuration it was begun with",
            )
        for folder in (self.path, *self.path.glob(f"{ROWS}/*")):
            for left in folder.glob(f"{PARTIAL}*"):
                left.unlink()
        self.finished = set(self.held())

    def held(self) -> list[int]:
        """The chunks that are there. Raises `InputError` for files that are not of this sweep."""
        ours = {self.file(chunk) for chunk in range(self.plan.chunks)}
        for file in sorted(self.path.glob(f"{ROWS}/**/*.parquet")):
            if file not in ours:
                # Whoever reads the rows would read it as well.
                raise InputError(f"'{file}' is not of this sweep", "move it elsewhere")
        return [chunk for chunk in range(self.plan.chunks) if self.file(chunk).exists()]

    def file(self, chunk: int) -> Path:
        """Where the rows of a chunk are."""
        model, _, _ = self.plan.of_chunk(chunk)
        folder = self.path / ROWS / f"model={quote(model.name, safe='')}"
        return folder / f"part-{chunk % self.plan.chunks_each:06d}.parquet"

    def columns(self, number: int, names: list[str]) -> dict[str, NDArray[Any]]:
        """Columns of all rows of a model, by its number, in order. Raises `InputError`."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        each = self.plan.chunks_each
        files = [self.file(chunk) for chunk in range(number * each, (number + 1) * each)]
        try:
            tables = [pq.ParquetFile(file).read(columns=names) for file in files]
        except FileNotFoundError:
            raise InputError(f"'{self.path}' is not finished", "finish the sweep first") from None
        except pa.ArrowInvalid:
            raise InputError(f"'{self.path}' is damaged", ANEW) from None
        whole = pa.concat_tables(tables)
        return {name: whole[name].to_numpy() for name in names}

    def add(self, chunk: int, part: Part) -> None:
        """Keep a finished chunk."""
        self._note_maker()
        file = self.file(chunk)
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, part.content)
        self.finished.add(chunk)

    def _note_maker(self) -> None:
        """Keep on record that what makes rows now is not what began."""
        makers = [self.manifest["made_with"], *self.manifest.get("also_made_with", [])]
        if self._maker not in makers:
            self.manifest["also_made_with"] = [*makers[1:], self._maker]
            self._write_manifest()

    def finish(self) -> dict[str, Any]:
        """Note that all chunks are there, and return what they are together."""
        parts = [read_about(self.file(n)) for n in sorted(self.finished)]
        outcomes: Counter[str] = Counter()
        for part in parts:
            outcomes.update(part.outcomes)
        found = {
            "rows": sum(part.rows for part in parts),
            "outcomes": dict(sorted(outcomes.items())),
            "strides": sum(part.strides for part in parts),
            "digest": hashlib.sha256("".join(part.digest for part in parts).encode()).hexdigest(),
        }
        self.manifest |= {"finished": True, **found}
        self._write_manifest()
        return found

    def _write_manifest(self) -> None:
        text = json.dumps(self.manifest, indent=2, allow_nan=False) + "\n"
        write_whole(self.path / MANIFEST, text.encode())


def write_whole(file: Path, content: bytes) -> None:
    """Write a file under another name, then rename it; on failure nothing is left."""
    partial = file.with_name(f"{PARTIAL}{file.name}")
    try:
        with partial.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(file)
    except BaseException as failure:
        partial.unlink(missing_ok=True)
        if isinstance(failure, OSError) and failure.filename is None:
            failure.filename = str(file)  # the system tells only of which file it opened
        raise


def read_manifest(path: Path) -> dict[str, Any]:
    """The manifest of a directory. Raises `InputError` if there is none."""
    try:
        manifest = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
    except OSError as failure:
        raise InputError(
            f"'{path}' has no manifest ({failure.strerror})",
            "give a directory made by 'flexspine sweep'",
        ) from None
    except ValueError:
        manifest = None
    known = manifest if isinstance(manifest, dict) else {}
    if not all(isinstance(known.get(entry), kind) for entry, kind in ENTRIES.items()):
        raise InputError(f"the manifest in '{path}' is damaged", ANEW)
    check_schema(known, f"the manifest in '{path}'")
    return known


def read_plan_of(path: Path) -> Plan:
    """The plan of a directory. Raises `InputError`."""
    manifest = read_manifest(path)
    try:
        plan = Plan.revive(manifest["plan"])
    except InputError as failure:
        raise InputError(f"the manifest in '{path}' is damaged ({failure.message})", ANEW) from None
    if plan.key != manifest["key"]:
        raise InputError(f"the manifest in '{path}' was changed", ANEW)
    return plan


def made_with() -> dict[str, str]:
    """Versions and processor, on which the last bits of results depend."""
    about = {"flexspine": __version__, "python": platform.python_version()}
    about |= {name: version(name) for name in LIBRARIES}
    with suppress(PackageNotFoundError):
        about[ENGINE] = version(ENGINE)
    return {**about, "processor": _processor()}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _differences(before: Any, now: Any, where: str = "") -> list[str]:
    """Everything in which two records differ."""
    if isinstance(before, dict) and isinstance(now, dict):
        found: list[str] = []
        for name in dict.fromkeys([*before, *now]):
            if before.get(name) != now.get(name):
                inner = f"{where}.{name}" if where else name
                found += _differences(before.get(name), now.get(name), inner)
        return found
    if isinstance(before, list) and isinstance(now, list) and _names(before) != _names(now):
        return [f"{where} were {_names(before)} and are {_names(now)}"]
    if isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        pairs = enumerate(zip(before, now, strict=True))
        inner = [_differences(one, other, f"{where}[{n}]") for n, (one, other) in pairs]
        return [each for part in inner for each in part]
    if before == now:
        return []
    told = ["nothing" if value is None else shortened(value) for value in (before, now)]
    return [f"{where} was {told[0]} and is {told[1]}"]


def _names(records: list[Any]) -> str:
    return ", ".join(str(record["name"]) for record in records if isinstance(record, dict))
