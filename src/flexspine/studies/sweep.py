"""Sweeps: chunks of a plan done by workers, kept as they come, gone on with after a crash."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexspine.errors import InputError
from flexspine.models.simulation import check_count
from flexspine.parameters import shortened
from flexspine.studies.parts import digest_of
from flexspine.studies.plan import Plan
from flexspine.studies.plan_file import read_plan
from flexspine.studies.store import MANIFEST, Store, made_with, read_manifest, read_plan_of
from flexspine.studies.tasks import check_task, do_chunk
from flexspine.workers.crew import Crew
from flexspine.workers.local import LocalWorkers


@dataclass(frozen=True)
class Sweep:
    """A finished sweep: where it is, and what its rows amount to.

    ``path`` is its directory. ``outcomes`` counts ``rows`` by outcome, ``strides`` is the number of
    those completed; ``digest`` is of all rows; ``made`` tells how many of its chunks were made just
    now, in ``seconds``.
    """

    path: Path
    plan: Plan
    rows: int
    outcomes: Mapping[str, int]
    strides: int
    digest: str
    made: int
    seconds: float

    @property
    def files(self) -> list[Path]:
        """Its Parquet files, in order."""
        store = Store(self.path, self.plan)
        return [store.file(chunk) for chunk in range(self.plan.chunks)]


def sweep(
    plan: Plan | str | Path,
    out: str | Path,
    *,
    processes: int = 1,
    client: Any = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Do all that a plan asks for and keep the rows in the directory ``out``.

    ``plan`` is a `Plan` or the path of its TOML file. Interrupted or killed, the same call goes on
    with the same directory. ``processes`` are local; ``client`` is a Dask client, or a scheduler's
    address such as ``tcp://host:8786``, in their place. ``progress`` is told how many points are
    done, and of how many. Raises `InputError`, `MachineError` where workers fail, and `OSError`
    where the disk does.
    """
    if not isinstance(plan, Plan | str | Path):
        raise InputError(f"{shortened(plan)} is no plan", "give one, or the path of a TOML file")
    plan = plan if isinstance(plan, Plan) else read_plan(plan)
    begun, tell = time.monotonic(), progress or (lambda _done, _whole: None)
    if not (Path(out) / MANIFEST).exists():
        check_task(plan)  # what was begun has been checked
    workers = min(check_count("processes", processes), plan.chunks)
    # Workers that cannot be had leave no directory behind.
    with crew_of(workers, client) as crew, Store(Path(out), plan).opened() as store:
        missing = [n for n in range(plan.chunks) if n not in store.finished]
        whole = plan.points * len(plan.models)
        done = whole - sum(plan.of_chunk(n)[2] for n in missing)
        tell(done, whole)
        for chunk, part in crew.map(do_chunk, ((n, (plan, n)) for n in missing)):
            store.add(chunk, part)
            done += plan.of_chunk(chunk)[2]
            tell(done, whole)
        found = store.finish()
    return Sweep(Path(out), plan, **found, made=len(missing), seconds=time.monotonic() - begun)


def crew_of(processes: int, client: Any) -> Crew:
    """The workers: a Dask cluster if there is a client, local processes otherwise."""
    if client is None:
        return LocalWorkers(processes)
    from flexspine.workers.cluster import DaskWorkers

    return DaskWorkers(client)


@dataclass(frozen=True)
class Rerun:
    """Whether a sweep came out the same a second time.

    ``chunks`` were compared, ``differing`` are those that came out otherwise, with their files,
    ``missing`` those of a finished sweep that are no longer there. ``changed`` tells, by name, what
    it was made with and what that is now, where they differ.
    """

    chunks: int
    differing: Mapping[int, Path]
    missing: tuple[int, ...]
    changed: Mapping[str, tuple[str, str]]

    @property
    def same(self) -> bool:
        """Whether every chunk is there and came out bit for bit the same."""
        return not self.differing and not self.missing


def rerun(
    path: str | Path,
    *,
    processes: int = 1,
    client: Any = None,
    progress: Callable[[int, int], None] | None = None,
) -> Rerun:
    """Repeat a sweep from its manifest and compare every chunk with what is there.

    ``path`` is its directory. Nothing is written. An unfinished sweep is repeated as far as it got.
    ``progress`` is told how many chunks are done, and of how many. Raises as `sweep`.
    """
    manifest, plan = read_manifest(Path(path)), read_plan_of(Path(path))
    store = Store(Path(path), plan)
    chunks = store.held()
    if not chunks:
        raise InputError(f"'{path}' has no finished chunk", "finish the sweep first")
    differing: dict[int, Path] = {}
    with crew_of(min(check_count("processes", processes), len(chunks)), client) as crew:
        jobs = ((n, (plan, n)) for n in chunks)
        for count, (chunk, part) in enumerate(crew.map(do_chunk, jobs), start=1):
            if part.digest != digest_of(store.file(chunk)):
                differing[chunk] = store.file(chunk)
            if progress is not None:
                progress(count, len(chunks))
    before, now = manifest["made_with"], made_with()
    changed = {n: (before.get(n, ""), v) for n, v in now.items() if before.get(n) != v}
    lost = set(range(plan.chunks)) - set(chunks) if manifest.get("finished") else set()
    return Rerun(len(chunks), dict(sorted(differing.items())), tuple(sorted(lost)), changed)
