"""How far a steered animal gets over ground that is not flat, before it falls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import CensoredData, ecdf

from flexspine.control.disturbance import Fate
from flexspine.control.steering import SteeredRun, Steering, steer
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.compile import Array
from flexspine.models.ground import BEGINS, Ground
from flexspine.models.model import Model, check_between
from flexspine.models.simulation import check_count
from flexspine.studies.robustness import check_runs, counting
from flexspine.workers.lasting import do_all

# Runs that are done, and kept, together.
CHUNK = 20

# Of a share.
ROUNDING = 1e-12

# Ground is made so much longer than an undisturbed run, for those that get faster.
RESERVE = 1.5


@dataclass(frozen=True)
class Terrain:
    """A kind of ground with its numbers, from which ground is made for each seed.

    ``kind`` is ``step``, ``stairs``, ``ramp``, ``slope``, ``waves``, ``rough``, ``blocks`` or the
    path of a CSV file; ``numbers`` are those of the method of `Ground` of that name, by name. The
    seed draws what is random, and where within a stride it begins; a file is as it is.
    """

    kind: str
    numbers: Mapping[str, float]

    @cached_property
    def track(self) -> Ground | None:
        """The ground of a file, read once. Raises `InputError`."""
        if not self.kind.endswith(".csv"):
            return None
        if self.numbers:
            raise ParameterError("ground from a file has no numbers", "leave them away")
        return Ground.read(self.kind)

    @property
    def all_numbers(self) -> dict[str, float]:
        """Its numbers, those that are left at their defaults too. Raises `InputError`."""
        if self.track is not None:
            return {}
        if self.kind not in KINDS and Path(self.kind).exists():
            raise ParameterError(
                f"'{self.kind}' is no file of ground", "give a file whose name ends in .csv"
            )
        if self.kind not in KINDS:
            raise UnknownNameError("kind of ground", self.kind, KINDS)
        _, known = KINDS[self.kind]
        for name in self.numbers:
            if name not in known:
                raise UnknownNameError(f"number of '{self.kind}'", name, known)
        return {**known, **self.numbers}

    def ground(self, seed: int, stride: float, strides: int) -> Ground:
        """Return ground for a seed, long enough for ``strides`` strides of ``stride`` m.

        Raises `InputError`.
        """
        if self.track is not None:
            return self.track
        given: dict[str, Any] = {**self.all_numbers}
        make, _ = KINDS[self.kind]
        if self.kind in RANDOM:
            given |= {"length": RESERVE * stride * strides + BEGINS, "seed": seed}
        where = float(np.random.default_rng([seed, 1]).uniform())  # not what draws heights
        return make(**given, at=BEGINS + where * stride)


# How each kind is made, and its numbers where none are given.
KINDS: Mapping[str, tuple[Callable[..., Ground], Mapping[str, float]]] = {
    "step": (Ground.step, {"height": -0.01}),
    "stairs": (Ground.stairs, {"height": -0.01, "length": 2.0, "count": 5}),
    "ramp": (Ground.ramp, {"height": 0.02, "length": 5.0}),
    "slope": (Ground.slope, {"degrees": -0.3}),
    "waves": (Ground.waves, {"amplitude": 0.005, "wavelength": 1.0}),
    "rough": (Ground.rough, {"height": 0.005, "spacing": 0.3}),
    "blocks": (Ground.blocks, {"height": 0.002, "spacing": 0.3}),
}
RANDOM = ("rough", "blocks")

# All other numbers are lengths in m.
NO_LENGTHS = ("degrees", "count")


@dataclass(frozen=True)
class Wayfaring:
    """Many runs over ground of one kind, each of its own seed from ``first_seed`` on.

    ``strides`` were to be made; the ``fates`` of the runs are in the order of the seeds.
    """

    terrain: Terrain
    strides: int
    first_seed: int
    fates: tuple[Fate, ...]

    @property
    def distances(self) -> Array:
        """How far each run came, in m, shape (runs,)."""
        return np.array([fate.distance for fate in self.fates])

    @property
    def arrived(self) -> int:
        """How many runs made all strides."""
        return sum(fate.survived for fate in self.fates)

    @property
    def outcomes(self) -> dict[str, int]:
        """How many runs ended with each outcome."""
        names = [fate.outcome for fate in self.fates]
        return {name: names.count(name) for name in sorted(set(names))}

    def going(self) -> tuple[Array, Array]:
        """Return distances (m) and the share of runs still going after each, shape (k,) both.

        Kaplan and Meier's estimate (1958, J Am Stat Assoc 53:457-481): runs that made all their
        strides say nothing about what lies beyond.
        """
        arrived = np.array([fate.survived for fate in self.fates])
        found = ecdf(CensoredData.right_censored(self.distances, arrived)).sf
        return found.quantiles, found.probabilities

    def quantile(self, share: float) -> float | None:
        """Return the distance (m) by which a share of runs ended early; None if none did."""
        distances, going = self.going()
        there = np.flatnonzero(going <= 1 - share + ROUNDING)
        return float(distances[there[0]]) if there.size else None

    def metres_per_fall(self) -> float | None:
        """Return all distance over all runs that ended early, in m; None without any."""
        falls = len(self.fates) - self.arrived
        return float(self.distances.sum()) / falls if falls else None


class _Piece(NamedTuple):
    model: Model
    steering: Steering
    terrain: Terrain
    stride: float
    strides: int
    seeds: tuple[int, ...]


def walk_over(
    model: Model,
    steering: Steering,
    terrain: Terrain,
    *,
    stride: float,
    strides: int,
    seed: int = 0,
) -> SteeredRun:
    """Run over ground of a seed; ``stride`` is the length (m) of an undisturbed one."""
    ground = terrain.ground(seed, stride, strides)
    return steer(model.on(ground), steering, strides=strides, seed=seed)


def distance_to_fall(
    model: Model,
    steering: Steering,
    terrain: Terrain,
    *,
    stride: float,
    strides: int = 200,
    runs: int = 100,
    seed: int = 0,
    processes: int = 1,
    store: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Wayfaring:
    """Run ``runs`` times over ground of seeds ``seed``, ``seed + 1``, ... for up to ``strides``.

    ``steering`` is a controller, such as `stabilize` designs; ``stride`` is the length (m) of an
    undisturbed stride. ``store`` is a file that keeps what is done; the same call goes on from
    there. ``processes`` share the work without a change to results. ``progress`` is told how many
    runs are done, and of how many. Raises `InputError`.
    """
    check_runs(runs)
    check_count("strides", strides)
    check_between("stride", stride, 0, inf)
    terrain.ground(seed, stride, strides)  # refused before anything is done
    if terrain.track is not None and runs > 1:
        raise ParameterError(
            f"ground from '{terrain.kind}' is the same in all {runs} runs", "run over it once"
        )
    pieces = [
        _Piece(
            model, steering, terrain, stride, strides,
            tuple(range(seed + first, seed + min(first + CHUNK, runs))),
        )
        for first in range(0, runs, CHUNK)
    ]  # fmt: skip
    done = do_all(
        _run_piece,
        pieces,
        processes=check_count("processes", processes),
        progress=counting(progress, runs),
        store=store,
        description={
            "kind": terrain.kind, "numbers": dict(terrain.numbers), "runs": runs,
            "strides": strides, "seed": seed, "animal": {**model.record(), **steering.settings},
        },
        to_json=list,
        from_json=lambda rows: [Fate(*row) for row in rows],
    )  # fmt: skip
    return Wayfaring(terrain, strides, seed, tuple(fate for fates in done for fate in fates))


def _run_piece(piece: _Piece) -> list[Fate]:
    return [
        Fate.of(
            walk_over(
                piece.model, piece.steering, piece.terrain,
                stride=piece.stride, strides=piece.strides, seed=seed,
            )
        )
        for seed in piece.seeds
    ]  # fmt: skip
