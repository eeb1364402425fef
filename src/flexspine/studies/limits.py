"""The largest noise, push and step that gaits under feedback survive, over stiffness and speed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexspine.control.disturbance import Draw, disturbance, endure
from flexspine.control.stabilize import Stabilizer, stabilize
from flexspine.errors import FlexspineError, ParameterError
from flexspine.gaits.gait import Gait, examine
from flexspine.gaits.stability import floquet_multipliers
from flexspine.models.legs import ANGLES
from flexspine.models.model import Model, check_between
from flexspine.models.simulation import check_count
from flexspine.studies.following import Line, LostGaitError, carried
from flexspine.workers.lasting import do_all

# Relative; limits are known to it, and are on the safe side.
PRECISION = 0.1

# Of a disturbance's usual largest size: where the search begins, and where it gives up.
FIRST, SMALLEST, LARGEST = 2.0**-5, 2.0**-14, 8.0

SEEDS = 6
PLACES = 8
NOISY_STRIDES, UPSET_STRIDES = 1000, 50

THRUST = "legs.extension"


class FeedbackDesign(NamedTuple):
    """A way to stabilise: what is steered, and whether at both flight apexes."""

    name: str
    inputs: tuple[str, ...]
    twice: bool


DESIGNS = (
    FeedbackDesign("angles, once", ANGLES, False),
    FeedbackDesign("angles, twice", ANGLES, True),
    FeedbackDesign("angles and thrust, twice", (*ANGLES, THRUST), True),
)


class Limit(NamedTuple):
    """A kind of limit: which disturbance, to which side, in how many strides, and which tries."""

    name: str
    kind: str
    sign: int
    strides: int
    tries: tuple[tuple[float, int], ...]


_SEEDED = tuple((0.0, seed) for seed in range(SEEDS))
_ANYWHERE = tuple((k / PLACES, 0) for k in range(PLACES))

LIMITS = (
    Limit("acting_noise", "acting", 1, NOISY_STRIDES, _SEEDED),
    Limit("sensing_noise", "sensing", 1, NOISY_STRIDES, _SEEDED),
    Limit("push_forward", "push", 1, UPSET_STRIDES, ((0.0, 0),)),
    Limit("push_backward", "push", -1, UPSET_STRIDES, ((0.0, 0),)),
    Limit("step_up", "step", 1, UPSET_STRIDES, _ANYWHERE),
    Limit("step_down", "step", -1, UPSET_STRIDES, _ANYWHERE),
)


@dataclass(frozen=True)
class Cell:
    """A gait under one design: spectral radii without and with feedback, and its limits, SI.

    Without a gait, or feedback that stabilises it, ``reason`` tells why.
    """

    stiffness: float
    speed: float
    design: str
    radius: float | None
    steered_radius: float | None
    limits: Mapping[str, float]
    reason: str | None


def largest(stabilizer: Stabilizer, limit: Limit) -> float:
    """The largest size at which all tries survive, by doubling, halving and bisection, SI.

    That smaller ones are survived is taken for granted. Zero where even next to nothing is not.
    """
    kind = disturbance(limit.kind)

    def fine(size: float) -> bool:
        return all(
            endure(stabilizer, kind, Draw(limit.sign * size, where, seed), limit.strides).survived
            for where, seed in limit.tries
        )

    low = high = kind.largest * FIRST
    if fine(low):
        while fine(high := 2 * low):
            if high > kind.largest * LARGEST:
                return high
            low = high
    else:
        while not fine(low := high / 2):
            if low < kind.largest * SMALLEST:
                return 0.0
            high = low
    while high > low * (1 + PRECISION):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if fine(middle) else (low, middle)
    return low


class _Piece(NamedTuple):
    stiffness: float
    speed: float
    gait: Gait | None
    design: FeedbackDesign
    limits: tuple[Limit, ...]
    reason: str | None


def find_limits(
    model: Model,
    stiffnesses: Sequence[float],
    speeds: Sequence[float],
    *,
    designs: Sequence[FeedbackDesign] = DESIGNS,
    limits: Sequence[Limit] = LIMITS,
    processes: int = 1,
    store: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Cell]:
    """Find what the model's gait survives at most, over spine stiffness and mean speed.

    ``stiffnesses`` are in N m/rad, ``speeds`` in m/s. At each of them the gait is stabilised by
    every one of ``designs``, and the largest noise, push (N s) and step (m) of ``limits`` found by
    doubling and bisection, to a tenth of itself. ``store`` is a file that keeps what is done; the
    same call goes on from there. ``processes`` share the work without a change to results.
    ``progress`` is told how many pieces are done, and of how many. Raises `ParameterError` and
    `OutputError`.
    """
    _check(model, stiffnesses, speeds)
    pieces = [
        _Piece(stiffness, speed, gait, design, tuple(limits), reason)
        for stiffness, speed, gait, reason in _gaits(model, stiffnesses, speeds)
        for design in designs
    ]
    return do_all(
        _examine_piece,
        pieces,
        processes=check_count("processes", processes),
        progress=progress,
        store=store,
        description={
            "model": model.name, "numbers": model.numbers,
            "stiffnesses": list(stiffnesses), "speeds": list(speeds),
            "designs": [list(design) for design in designs],
            "limits": [list(limit) for limit in limits],
        },
        to_json=vars,
        from_json=lambda cell: Cell(**cell),
    )  # fmt: skip


def _check(model: Model, stiffnesses: Sequence[float], speeds: Sequence[float]) -> None:
    if not (stiffnesses and speeds):
        raise ParameterError("no stiffness or no speed is given", "give at least one of each")
    if "spine.stiffness" not in model.parameter_names:
        raise ParameterError(f"'{model.name}' has no spine that bends", "give another model")
    for name, given in (("stiffness", stiffnesses), ("speed", speeds)):
        for value in given:
            check_between(name, value, 0, inf)


def _gaits(
    model: Model, stiffnesses: Sequence[float], speeds: Sequence[float]
) -> Iterator[tuple[float, float, Gait | None, str | None]]:
    """The gait at each stiffness and speed, or why there is none."""
    own = examine(model)
    if own.flaw is not None:
        raise ParameterError(f"the start of '{model.name}' is no gait ({own.flaw})", "give a gait")
    for stiffness in stiffnesses:
        try:
            line = Line.through(
                carried(own, "spine.stiffness", stiffness), "mean_speed", np.array(speeds), None
            )
        except LostGaitError as lost:
            for speed in speeds:
                yield stiffness, speed, None, str(lost)
            continue
        for speed in speeds:
            found = line.at(speed)
            if found is None:
                yield stiffness, speed, None, line.end
            else:
                yield stiffness, speed, found[0], None


def _examine_piece(piece: _Piece) -> Cell:
    at = piece.stiffness, piece.speed, piece.design.name
    if piece.gait is None:
        return Cell(*at, None, None, {}, piece.reason)
    radius = None
    try:
        radius = floquet_multipliers(piece.gait).spectral_radius
        found = stabilize(piece.gait, piece.design.inputs, twice=piece.design.twice)
    except FlexspineError as failure:
        return Cell(*at, radius, None, {}, failure.message)
    limits = {limit.name: largest(found, limit) for limit in piece.limits}
    return Cell(*at, radius, found.level_spectral_radius, limits, None)
