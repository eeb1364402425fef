"""The postures of a run, as the player in a page draws them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine.report.postures import Point, Posture, postures
from flexspine.report.robot_parts import RobotParts
from flexspine.report.robot_postures import RobotPosture, robot_postures
from flexspine.report.robot_scene import scale_of, tell_footing
from flexspine.report.robot_sketch import FOOT, JOINT, LINK_WIDTH, SPINE, leg_nodes
from flexspine.report.sagittal import is_spatial, sagittal
from flexspine.report.scene import tell_bend
from flexspine.report.stage import View, round_down
from flexspine.report.stick_figure import ARROW_LENGTH, ARROW_WIDTH, TRUNK_WIDTH, Scale
from flexspine.report.style import INK, SIDE_COLORS
from flexspine.report.timeline import PHASE_NAMES, drawable, is_robot
from flexspine.report.way import Way

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

# Postures a second of animation, and of a whole run at most; the rest would only be weight.
RATE = 60
MOST_FRAMES = 1200

# A bounder's stride takes a quarter of a second: it is played so many times slower than real.
SLOW_DOWN = 8

# Sizes in lengths of the leg.
LEG_WIDTH = 0.034
TOE, HIP = 0.075, 0.085

# m; drawn to a tenth of a millimetre.
DECIMALS = 4


@dataclass(frozen=True)
class Part:
    """What is drawn in every frame: a ``stroke`` of so many ``points``, a ``dot`` or a ``foot``.

    ``size`` is its width in lengths of the leg.
    """

    kind: str
    color: str
    size: float
    points: int = 1


@dataclass(frozen=True)
class Frame:
    """An instant: numbers of the parts one after the other, and what is told of it."""

    time: float
    com: Point
    numbers: list[float]
    words: str


def reel(dataset: xr.Dataset) -> dict[str, Any]:
    """Return parts, frames, view, scale and ground of a run with two samples at least.

    The numbers of a part in a frame are x and y (m) of its points; of a foot x, y, whether it
    stands (1) and slides (2), and the force on it in N.
    """
    dataset = drawable(dataset)
    robot = is_robot(dataset)
    slow_down = 1 if robot else SLOW_DOWN
    times = _times(dataset["time"].values, slow_down)
    way = Way.of(dataset)
    if robot:
        flat = sagittal(dataset) if is_spatial(dataset) else dataset
        names = RobotParts.of(flat)
        scale = scale_of(flat, names)
        parts, frames = _robot(flat, names, robot_postures(flat, names, times))
    else:
        scale = Scale.of(dataset)
        shown = postures(dataset, times)
        parts, frames = _bounder_parts(shown[0]), [_bounder_frame(each) for each in shown]
    levels = [0.0 if way is None else way.level(frame.com[0]) for frame in frames]
    view = View.around(_seen(parts, frames, levels, scale), scale)
    words = sorted({frame.words for frame in frames})
    return {
        "slow_down": slow_down,
        "leg": scale.leg,
        "stroke": round_down(0.3 * scale.leg),
        "arrow": scale.arrow,
        "arrow_width": ARROW_WIDTH,
        "view": {"aside": view.aside, "low": view.low, "high": view.high},
        "ground": None if way is None else _short(way.points.ravel()),
        "parts": [[part.kind, _color(part.color), part.size, part.points] for part in parts],
        "words": words,
        "frames": [
            [
                round(frame.time, 6), level, *_short(frame.com), words.index(frame.words),
                *_short(frame.numbers),
            ]
            for frame, level in zip(frames, _short(levels), strict=True)
        ],
    }  # fmt: skip


def _times(sampled: Array, slow_down: float) -> Array:
    start, end = float(sampled[0]), float(sampled[-1])
    count = int(np.ceil((end - start) * RATE * slow_down)) + 1
    return np.linspace(start, end, min(max(count, 2), MOST_FRAMES))


def _short(numbers: Iterable[float]) -> list[float]:
    return [round(float(number), DECIMALS) for number in numbers]


def _color(color: str) -> str:
    """Ink is dark on light pages and light on dark ones."""
    return "ink" if color == INK else color


def _bounder_parts(example: Posture) -> list[Part]:
    trunk = 2 if example.joint is None else 3
    parts = [Part("stroke", INK, TRUNK_WIDTH / 2, trunk)]
    if example.joint is not None:
        parts.append(Part("dot", INK, SPINE))
    for side in example.legs:
        color = SIDE_COLORS[side]
        parts += [Part("stroke", color, LEG_WIDTH * 1.4, 2), Part("dot", color, HIP)]
        parts.append(Part("foot", color, TOE))
    return parts


def _bounder_frame(posture: Posture) -> Frame:
    hind, fore = posture.legs["hind"].hip, posture.legs["fore"].hip
    joint = () if posture.joint is None else posture.joint
    numbers = [*hind, *joint, *fore, *joint]
    for leg in posture.legs.values():
        numbers += [*leg.hip, *leg.toe, *leg.hip, *leg.toe, float(leg.stands), *leg.force]
    words = f"{posture.phase}: {PHASE_NAMES[posture.phase]}"
    return Frame(posture.time, posture.com, numbers, _with_bend(words, posture.bend))


def _robot(
    dataset: xr.Dataset, names: RobotParts, shown: Sequence[RobotPosture]
) -> tuple[list[Part], list[Frame]]:
    """Legs behind the trunk, the trunk, legs before it."""
    behind = [leg for leg in names.legs if not leg.near]
    before = [leg for leg in names.legs if leg.near]
    parts: list[Part] = []
    for legs in (behind, before):
        if legs is before:
            for link in names.trunk:
                color = SIDE_COLORS[names.side_of(dataset, link)]
                parts.append(Part("stroke", color, TRUNK_WIDTH, 2))
            if names.spine is not None:
                parts.append(Part("dot", INK, SPINE))
        for leg in legs:
            count = len(leg.links) + 1
            parts.append(Part("stroke", leg.color, LINK_WIDTH, count))
            parts += [Part("dot", leg.color, JOINT)] * (count - 1)
            parts.append(Part("foot", leg.color, FOOT))
    frames = []
    for posture in shown:
        numbers: list[float] = []
        for legs in (behind, before):
            if legs is before:
                for link in names.trunk:
                    numbers += [each for end in posture.links[link] for each in end]
                numbers += posture.joint or ()
            for leg in legs:
                nodes = leg_nodes(leg, posture)
                foot = posture.feet[leg.name]
                numbers += [each for node in (*nodes, *nodes[1:]) for each in node]
                state = 2.0 if foot.slides else float(foot.stands)
                numbers += [*foot.place, state, *foot.force]
        words = _with_bend(tell_footing(posture, names), posture.bend)
        frames.append(Frame(posture.time, posture.com, numbers, words))
    return parts, frames


def _with_bend(words: str, bend: float | None) -> str:
    return words if bend is None else f"{words}; {tell_bend(bend)}"


def _seen(
    parts: Sequence[Part], frames: Sequence[Frame], levels: Sequence[float], scale: Scale
) -> Iterable[Point]:
    """Points that are to be seen, from below the CoM."""
    reach = ARROW_LENGTH * scale.leg
    for frame, level in zip(frames, levels, strict=True):
        x, y = frame.com
        yield 0.0, y - level
        place = 0
        for part in parts:
            count = 2 * part.points
            ends = frame.numbers[place : place + count]
            yield from ((ends[i] - x, ends[i + 1] - level) for i in range(0, count, 2))
            place += count
            if part.kind == "foot":
                _, along, _ = frame.numbers[place : place + 3]
                tail = float(np.clip(scale.arrow * along, -reach, reach))
                yield ends[0] - x - tail, ends[1] - level
                place += 3
