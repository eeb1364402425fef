"""Where every part of the animal is at given times, for drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flexspine.models.legs import STANCE_PHASES
from flexspine.report.timeline import Span, apex_times, phase_spans
from flexspine.report.way import Way, heights

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Point = tuple[float, float]

SIDES = ("fore", "hind")

# The models' massless legs swing in no time, so how a swing is drawn is a matter of looks.
SWING_FORWARD = 0.75  # share of the swing in which the leg turns to its touchdown angle
SWING_CLEARANCE = 0.14  # height of the toe in mid-swing, in lengths of the leg


@dataclass(frozen=True)
class LegPosture:
    """A leg from hip to toe (m); ``force`` is the ground reaction force (N per leg pair)."""

    hip: Point
    toe: Point
    stands: bool
    force: Point


@dataclass(frozen=True)
class Posture:
    """The animal at a time (s), positions in m; ``bend`` is fore minus hind pitch in rad.

    ``joint`` and ``bend`` are None where the model has no spine joint.
    """

    time: float
    phase: str
    com: Point
    joint: Point | None
    bend: float | None
    legs: Mapping[str, LegPosture]


class _Stance(NamedTuple):
    """A stretch of time (s) with the toe on the ground; ``first`` and ``last`` sample."""

    start: float
    end: float
    first: int
    last: int


class _Swing(NamedTuple):
    """A stretch of time (s) in the air, with the leg's angle (rad) and length (m) at its ends."""

    start: float
    end: float
    angles: tuple[float, float]
    lengths: tuple[float, float]


def postures(dataset: xr.Dataset, times: Array) -> list[Posture]:
    """Return the postures at ``times`` (s), interpolated between the samples.

    Legs in stance and their forces are the dataset's. Legs in the air are made up: from lift-off
    they turn to their touchdown angle, drawn in so that the toe clears the ground below it.
    """
    spans = phase_spans(dataset)
    starts = np.array([span.start for span in spans])
    phases = [spans[i].phase for i in np.searchsorted(starts, times, side="right").clip(1) - 1]
    com = _points(dataset, "com", times)
    legs = {side: _legs(dataset, side, spans, phases, times) for side in SIDES}
    joints: list[Point | None] = [None] * len(times)
    bends: list[float | None] = [None] * len(times)
    if "spine_joint_x" in dataset:
        joints = list(_points(dataset, "spine_joint", times))
        bends = [float(bend) for bend in _at(dataset, "spine_angle", times)]
    return [
        Posture(
            float(times[i]), phases[i], com[i], joints[i], bends[i], {s: legs[s][i] for s in SIDES}
        )
        for i in range(len(times))
    ]


def _at(dataset: xr.Dataset, name: str, times: Array) -> Array:
    values: Array = np.interp(times, dataset["time"].values, dataset[name].values)
    return values


def _points(dataset: xr.Dataset, name: str, times: Array) -> list[Point]:
    x, y = _at(dataset, f"{name}_x", times), _at(dataset, f"{name}_y", times)
    return list(zip(x.tolist(), y.tolist(), strict=True))


def _legs(
    dataset: xr.Dataset, side: str, spans: list[Span], phases: list[str], times: Array
) -> list[LegPosture]:
    way = Way.of(dataset)
    hips = np.array(_points(dataset, f"{side}_hip", times)).reshape(-1, 2)
    toes = hips.copy()
    stands = np.array([phase in STANCE_PHASES[side] for phase in phases], dtype=bool)
    stances = _stances(spans, side)
    toe_x, toe_y = (dataset[f"{side}_toe_{axis}"].values for axis in "xy")
    sample = np.searchsorted(dataset["time"].values, times, side="right") - 1
    for stance in stances:
        now = stands & (times >= stance.start) & (times <= stance.end)
        standing = sample[now].clip(stance.first, stance.last)
        toes[now] = np.column_stack([toe_x[standing], toe_y[standing]])
    for begin, end, swing in _swings(dataset, side, stances):
        now = ~stands & (times >= begin) & (times <= end)
        above = hips[now, 1] - heights(way, hips[now, 0])
        toes[now] = hips[now] + _swinging(swing, times[now], above)
    # Not below the ground by a rounding error either.
    toes[:, 1] = np.maximum(toes[:, 1], heights(way, toes[:, 0]))
    forces = np.column_stack([_at(dataset, f"{side}_grf_{axis}", times) for axis in "xy"])
    forces[~stands] = 0.0
    return [
        LegPosture(tuple(hip), tuple(toe), bool(standing), tuple(force))
        for hip, toe, standing, force in zip(
            hips.tolist(), toes.tolist(), stands, forces.tolist(), strict=True
        )
    ]


def _stances(spans: list[Span], side: str) -> list[_Stance]:
    stances: list[_Stance] = []
    for span in spans:
        if span.phase not in STANCE_PHASES[side]:
            continue
        if stances and stances[-1].last == span.first - 1:
            stances[-1] = stances[-1]._replace(end=span.end, last=span.last)
        else:
            stances.append(_Stance(span.start, span.end, span.first, span.last))
    return stances


def _swings(
    dataset: xr.Dataset, side: str, stances: list[_Stance]
) -> list[tuple[float, float, _Swing]]:
    """The swings, each with the part of it (s) that lies in the run."""
    time = dataset["time"].values
    apexes = apex_times(dataset)
    swings = []
    for before, after in zip([None, *stances], [*stances, None], strict=True):
        first = before.last + 1 if before else 0
        if first > (after.first - 1 if after else len(time) - 1):
            continue  # no sample of it, so it is not drawn either
        begin = before.end if before else float(time[0])
        end = after.start if after else float(time[-1])
        lifted, landing = _liftoff(before, stances, apexes), _touchdown(after, stances, apexes)
        held = tuple(float(dataset[f"{side}_leg_{what}"][first]) for what in ("angle", "length"))
        if lifted is None:
            # Nothing is known of what came before: hold the leg out for touchdown.
            swing = _Swing(begin - 1.0, begin, (held[0], held[0]), (held[1], held[1]))
        else:
            stance, shift = lifted
            angle, length = _geometry(dataset, side, stance)
            if landing is None or landing < end:
                landing = end + max(0.0, 2 * (stance.end - stance.start) - (end - begin))
            swing = _Swing(stance.end + shift, landing, (angle, held[0]), (length, held[1]))
        swings.append((begin, end, swing))
    return swings


def _liftoff(
    before: _Stance | None, stances: list[_Stance], apexes: Array
) -> tuple[_Stance, float] | None:
    """The stance that a swing follows, and the time to add to it.

    A run that starts in mid-swing is taken to come from a stride like its first.
    """
    if before is not None:
        return before, 0.0
    if len(apexes) > 1:
        ended = [s for s in stances if apexes[0] <= s.end <= apexes[1]]
        if ended:
            return ended[-1], float(apexes[0] - apexes[1])
    return None


def _touchdown(after: _Stance | None, stances: list[_Stance], apexes: Array) -> float | None:
    """The time (s) at which a swing ends; past the run as in a stride like its last."""
    if after is not None:
        return after.start
    if len(apexes) > 1:
        begun = [s for s in stances if apexes[-2] <= s.start <= apexes[-1]]
        if begun:
            return float(begun[0].start + apexes[-1] - apexes[-2])
    return None


def _geometry(dataset: xr.Dataset, side: str, stance: _Stance) -> tuple[float, float]:
    """Angle (rad) and length (m) of the leg at lift-off."""
    ((hip_x, hip_y),) = _points(dataset, f"{side}_hip", np.array([stance.end]))
    ahead = float(dataset[f"{side}_toe_x"][stance.last]) - hip_x
    above = hip_y - float(dataset[f"{side}_toe_y"][stance.last])
    return float(np.arctan2(ahead, above)), float(np.hypot(ahead, above))


def _swinging(swing: _Swing, times: Array, hip_height: Array) -> Array:
    """The toe seen from the hip (m), shape (times, 2), never below the ground."""
    progress = ((times - swing.start) / max(swing.end - swing.start, 1e-12)).clip(0, 1)
    turned = (progress / SWING_FORWARD).clip(0, 1)
    turned = turned**2 * (3 - 2 * turned)
    angle = swing.angles[0] + (swing.angles[1] - swing.angles[0]) * turned
    length = swing.lengths[0] + (swing.lengths[1] - swing.lengths[0]) * progress
    clearance = SWING_CLEARANCE * swing.lengths[1] * np.sin(np.pi * progress) ** 2
    room = hip_height - np.minimum(clearance, hip_height / 2)
    length = np.minimum(length, room / np.cos(angle))
    return np.column_stack([length * np.sin(angle), -length * np.cos(angle)])
