"""What steered animals survive: thousands of runs, each disturbed at random, and what it adds to.

Every animal meets the same disturbances.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexspine._version import __version__
from flexspine.control.disturbance import Disturbance, Fate, disturbance, draw, endure
from flexspine.control.stabilize import Stabilizer
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.simulation import check_count
from flexspine.parameters import is_number, shortened, values
from flexspine.workers.journal import Journal
from flexspine.workers.local import LocalWorkers

# Runs that are done, and kept, together: some seconds of work.
CHUNK = 100

# Of the standard normal; 95 of 100 intervals hold the truth.
QUANTILE = 1.959963984540054

BINS = 20

COMPLETED = "completed"


class Bin(NamedTuple):
    """Runs of about the same size: how many, how many survived, and Wilson's interval of that."""

    low: float
    high: float
    runs: int
    survived: int
    least: float
    most: float

    @property
    def share(self) -> float:
        """Which share survived."""
        return self.survived / self.runs if self.runs else float("nan")


@dataclass(frozen=True)
class Endurance:
    """The runs of one animal."""

    body: str
    fates: tuple[Fate, ...]
    strides: int

    @property
    def survived(self) -> Array:
        """Which runs made all strides, shape (runs,)."""
        return np.array([fate.outcome == COMPLETED for fate in self.fates], dtype=float)

    @property
    def sizes(self) -> Array:
        """How large the disturbances were, shape (runs,)."""
        return np.array([fate.size for fate in self.fates])

    def safe(self, sign: int) -> float | None:
        """The size up to which every run survived, to one side; None if all did."""
        failed = [abs(f.size) for f in self._side(sign) if f.outcome != COMPLETED]
        below = [abs(f.size) for f in self._side(sign) if abs(f.size) < min(failed, default=0)]
        return max(below, default=0.0) if failed else None

    def half(self, sign: int) -> float | None:
        """The size that tells best who survives from who does not, to one side; None if all do.

        As many smaller ones failed and larger ones survived as need be: their sum is least.
        """
        runs = sorted(self._side(sign), key=lambda fate: abs(fate.size))
        if all(fate.outcome == COMPLETED for fate in runs):
            return None
        fine = np.array([fate.outcome == COMPLETED for fate in runs])
        wrong = np.cumsum(np.append(0, ~fine)) + fine.sum() - np.cumsum(np.append(0, fine))
        best = int(np.argmin(wrong))
        sizes = [0.0, *(abs(fate.size) for fate in runs)]
        return sizes[best]

    def outcomes(self, sign: int) -> dict[str, int]:
        """How many runs ended how, to one side."""
        names = [fate.outcome for fate in self._side(sign)]
        return {name: names.count(name) for name in sorted(set(names))}

    def bins(self, largest: float, signed: bool) -> list[Bin]:
        """Survival by size."""
        edges = np.linspace(-largest if signed else 0.0, largest, BINS * (1 + signed) + 1)
        place = np.clip(np.searchsorted(edges, self.sizes, side="right") - 1, 0, len(edges) - 2)
        found = []
        for k in range(len(edges) - 1):
            here = self.survived[place == k]
            count, fine = len(here), int(here.sum())
            least, most = wilson(fine, count)
            found.append(Bin(float(edges[k]), float(edges[k + 1]), count, fine, least, most))
        return found

    def _side(self, sign: int) -> list[Fate]:
        return [fate for fate in self.fates if fate.size * sign >= 0]


def wilson(survived: int, runs: int) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson 1927, J Am Stat Assoc 22:209-212)."""
    if not runs:
        return 0.0, 1.0
    share, z = survived / runs, QUANTILE**2 / runs
    middle = (share + z / 2) / (1 + z)
    half = QUANTILE * sqrt(share * (1 - share) / runs + z / (4 * runs)) / (1 + z)
    return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True)
class Robustness:
    """What animals survive of one kind of disturbance up to ``largest``."""

    kind: Disturbance
    largest: float
    strides: int
    seed: int
    bodies: Mapping[str, Endurance]


class _Piece(NamedTuple):
    body: str
    stabilizer: Stabilizer
    kind: str
    largest: float
    strides: int
    seed: int
    first: int
    runs: int


def survive(
    animals: Mapping[str, Stabilizer],
    kind: str,
    *,
    largest: float | None = None,
    runs: int = 1000,
    strides: int = 50,
    seed: int = 0,
    processes: int = 1,
    store: Path | None = None,
    progress: Callable[[int, int], None] = lambda _done, _whole: None,
) -> Robustness:
    """Disturb every animal ``runs`` times at random, each to make ``strides`` strides.

    ``kind`` is push, step, rough, blocks, acting or sensing; sizes are drawn evenly up to
    ``largest``, to both sides where there are two. ``store`` is a file that keeps what is done;
    the same call goes on from there. ``processes`` share the work without a change to results.
    Raises `UnknownNameError`, `ParameterError` and `OutputError`.
    """
    what = disturbance(kind)
    largest = what.largest if largest is None else largest
    if not (is_number(largest) and isfinite(largest) and largest > 0):
        raise ParameterError(
            f"largest = {shortened(largest)} is not usable", "give a number above zero"
        )
    if not (isinstance(seed, int) and seed >= 0):
        raise ParameterError(f"seed = {seed} is not usable", "give a whole number from 0 on")
    check_count("runs", runs)
    check_count("strides", strides)
    pieces = [
        _Piece(
            body, stabilizer, kind, largest, strides, seed, first, min(CHUNK, runs - first)
        )
        for first in range(0, runs, CHUNK)
        for body, stabilizer in animals.items()
    ]  # fmt: skip
    journal = None
    done: dict[int, list[Fate]] = {}
    if store is not None:
        setting = {"kind": kind, "largest": largest, "runs": runs, "strides": strides, "seed": seed}
        about = {name: _about(stabilizer) for name, stabilizer in animals.items()}
        header = {"flexspine": __version__, **setting, "animals": about}
        journal = Journal(store, header, "runs", _is_line)
        done = {line["piece"]: [Fate(*fate) for fate in line["fates"]] for line in journal.lines}

    def jobs() -> Iterator[tuple[int, _Piece]]:
        return ((k, piece) for k, piece in enumerate(pieces) if k not in done)

    whole = runs * len(animals)
    progress(sum(map(len, done.values())), whole)
    with LocalWorkers(check_count("processes", processes)) as crew:
        for number, fates in crew.map(_run_piece, jobs()):
            done[number] = fates
            if journal is not None:
                journal.add({"piece": number, "fates": [list(fate) for fate in fates]})
            progress(sum(map(len, done.values())), whole)
    bodies = {
        body: Endurance(
            body,
            tuple(f for k, piece in enumerate(pieces) if piece.body == body for f in done[k]),
            strides,
        )
        for body in animals
    }
    return Robustness(what, largest, strides, seed, bodies)


def _run_piece(piece: _Piece) -> list[Fate]:
    kind = disturbance(piece.kind)
    return [
        endure(piece.stabilizer, kind, *draw(kind, piece.largest, piece.seed, k), piece.strides)
        for k in range(piece.first, piece.first + piece.runs)
    ]


def _about(stabilizer: Stabilizer) -> dict[str, Any]:
    """All that decides what an animal does."""
    model = stabilizer.gait.model
    return {
        "model": model.kind.name,
        "parameters": values(model.parameters),
        "apex": dict(model.apex),
        "touchdown": dict(model.touchdown),
        "tolerance": stabilizer.gait.tolerance,
        "inputs": list(stabilizer.inputs),
        "gains": [gain.tolist() for gain in stabilizer.gains],
    }


def _is_line(line: Any) -> bool:
    return isinstance(line, dict) and line.keys() >= {"piece", "fates"}
