"""What steered animals survive: thousands of runs, each disturbed at random, and what it adds to.

Every animal meets the same disturbances.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexspine.control.disturbance import Disturbance, Draw, Fate, disturbance, draw, endure
from flexspine.control.stabilize import Stabilizer
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.simulation import check_count
from flexspine.parameters import check_seed, is_finite, shortened
from flexspine.workers.lasting import do_all

# Runs that are done, and kept, together: some seconds of work.
CHUNK = 100

# Of the standard normal; 95 of 100 intervals hold the truth.
QUANTILE = 1.959963984540054

# To each side.
BINS = 20

MOST_RUNS = 10_000_000


class Bin(NamedTuple):
    """Runs of about the same size: how many, how many survived, and Wilson's interval of that."""

    low: float
    high: float
    runs: int
    survived: int
    least: float
    most: float

    @property
    def share(self) -> float | None:
        """Which share survived; None of no runs."""
        return self.survived / self.runs if self.runs else None


@dataclass(frozen=True, eq=False)
class Endurance:
    """The runs of one animal: ``sizes`` (runs,) of what disturbed them, and their fates."""

    sizes: Array
    fates: tuple[Fate, ...]

    @cached_property
    def survived(self) -> NDArray[np.bool_]:
        """Which runs made all strides, shape (runs,)."""
        return np.array([fate.survived for fate in self.fates], dtype=bool)

    def safe(self, sign: int) -> float | None:
        """The size up to which every run survived, to one side; None if all did, or none was."""
        sizes, fine = self._side(sign)
        if fine.all():
            return None
        return float(sizes[sizes < sizes[~fine].min()].max(initial=0.0))

    def typical(self, sign: int) -> float | None:
        """The size that tells best who survives from who does not, to one side; None if all do.

        None as well without runs. As many as can be survived below it and failed above it.
        """
        sizes, fine = self._side(sign)
        if fine.all():
            return None
        order = np.argsort(sizes)
        fine = fine[order]
        right = np.append(0, np.cumsum(fine)) + np.append(np.cumsum(~fine[::-1])[::-1], 0)
        return float(np.append(0.0, sizes[order])[int(np.argmax(right))])

    def outcomes(self, sign: int) -> dict[str, int]:
        """How many runs ended how, to one side."""
        names = [
            f.outcome for f, size in zip(self.fates, self.sizes, strict=True) if size * sign >= 0
        ]
        return {name: names.count(name) for name in sorted(set(names))}

    def bins(self, edges: Array) -> list[Bin]:
        """Survival by size, between ``edges`` (bins + 1,)."""
        place = np.clip(np.searchsorted(edges, self.sizes, side="right") - 1, 0, len(edges) - 2)
        found = []
        for k, (low, high) in enumerate(pairwise(edges.tolist())):
            here = self.survived[place == k]
            count, fine = len(here), int(here.sum())
            found.append(Bin(low, high, count, fine, *wilson(fine, count)))
        return found

    def _side(self, sign: int) -> tuple[Array, NDArray[np.bool_]]:
        """Sizes to one side, without sign, and who survived them."""
        here = self.sizes * sign >= 0
        return np.abs(self.sizes[here]), self.survived[here]


def wilson(survived: int, runs: int) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson 1927, J Am Stat Assoc 22:209-212)."""
    if not runs:
        return 0.0, 1.0
    share, z = survived / runs, QUANTILE**2 / runs
    middle = (share + z / 2) / (1 + z)
    half = QUANTILE * sqrt(share * (1 - share) / runs + z / (4 * runs)) / (1 + z)
    return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True, eq=False)
class Robustness:
    """What animals survive of one kind of disturbance, of sizes up to ``largest``.

    Each was to make ``strides`` strides; ``animals`` has by name what became of its runs, all of
    which met the same disturbances, drawn from ``seed``.
    """

    kind: Disturbance
    largest: float
    strides: int
    seed: int
    animals: Mapping[str, Endurance]

    @property
    def signs(self) -> dict[str, int]:
        """The sides to which it may disturb, by name: 1, or -1 for negative sizes."""
        return {"positive": 1, "negative": -1} if self.kind.signed else {"positive": 1}

    @property
    def edges(self) -> Array:
        """The edges of the bins in which survival is counted by size, shape (bins + 1,)."""
        low = -self.largest if self.kind.signed else 0.0
        return np.linspace(low, self.largest, BINS * len(self.signs) + 1)


class _Piece(NamedTuple):
    animal: str
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
    progress: Callable[[int, int], None] | None = None,
) -> Robustness:
    """Disturb every animal ``runs`` times at random, each to make ``strides`` strides.

    ``animals`` are gaits under feedback, by name. ``kind`` is ``push`` (N s), ``step``, ``rough``,
    ``blocks`` (m), ``acting`` or ``sensing`` (noise, relative); sizes are drawn evenly up to
    ``largest``, to both sides where there are two. ``store`` is a file that keeps what is done;
    the same call goes on from there. ``processes`` share the work without a change to results.
    ``progress`` is told how many runs are done, and of how many. Raises `UnknownNameError`,
    `ParameterError` and `OutputError`.
    """
    what = disturbance(kind)
    largest = what.largest if largest is None else largest
    _check(animals, what, largest, runs, strides, seed)
    pieces = [
        _Piece(name, stabilizer, kind, largest, strides, seed, first, min(CHUNK, runs - first))
        for first in range(0, runs, CHUNK)
        for name, stabilizer in animals.items()
    ]
    done = do_all(
        _run_piece,
        pieces,
        processes=check_count("processes", processes),
        progress=counting(progress, runs * len(animals)),
        store=store,
        description={
            "kind": kind, "largest": largest, "runs": runs, "strides": strides, "seed": seed,
            "animals": [
                [name, {**each.gait.model.record(), **each.settings}]
                for name, each in animals.items()
            ],
        },
        to_json=list,
        from_json=lambda rows: [Fate(*row) for row in rows],
    )  # fmt: skip
    sizes = np.array([draw(what, largest, seed, k).size for k in range(runs)])
    fates: dict[str, list[Fate]] = {name: [] for name in animals}
    for piece, found in zip(pieces, done, strict=True):
        fates[piece.animal] += found
    each = {name: Endurance(sizes, tuple(found)) for name, found in fates.items()}
    return Robustness(what, largest, strides, seed, each)


def _check(
    animals: Mapping[str, Stabilizer],
    kind: Disturbance,
    largest: float,
    runs: int,
    strides: int,
    seed: int,
) -> None:
    """Refuse what cannot be made before anything is done."""
    if not (is_finite(largest) and largest > 0):
        raise ParameterError(
            f"largest = {shortened(largest)} is not usable", "give a number above zero"
        )
    check_seed(seed)
    check_runs(runs)
    check_count("strides", strides)
    if not animals:
        raise ParameterError("there is no animal to disturb", "give one or more by name")
    for each in animals.values():
        for sign in (1, -1) if kind.signed else (1,):
            kind.make(each.gait, Draw(sign * largest, 0.5, seed), strides)


def counting(
    progress: Callable[[int, int], None] | None, runs: int
) -> Callable[[int, int], None] | None:
    """What is told about pieces, told of so many runs."""
    if progress is None:
        return None
    return lambda done, pieces: progress(runs * done // pieces, runs)


def check_runs(runs: int) -> int:
    """Return a number of runs. Raises `ParameterError` for none, and for more than memory holds."""
    if check_count("runs", runs) > MOST_RUNS:
        raise ParameterError(f"runs = {runs} are too many", f"give no more than {MOST_RUNS}")
    return runs


def _run_piece(piece: _Piece) -> list[Fate]:
    kind = disturbance(piece.kind)
    return [
        endure(piece.stabilizer, kind, draw(kind, piece.largest, piece.seed, k), piece.strides)
        for k in range(piece.first, piece.first + piece.runs)
    ]
