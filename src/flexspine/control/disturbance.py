"""What upsets a steered animal, of any size, and how long it goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexspine.control.stabilize import Stabilizer
from flexspine.control.steering import Noise, SteeredRun, steer
from flexspine.errors import UnknownNameError
from flexspine.gaits.gait import Gait
from flexspine.hybrid.outcome import COMPLETED
from flexspine.models.ground import BEGINS, Ground
from flexspine.models.model import Model

# m; between the points of rough ground.
SPACING = 0.3

# Ground is so much longer than the undisturbed way, for those that get faster.
LONGER = 1.5


class Draw(NamedTuple):
    """How large a disturbance is, where in a stride it begins (0 to 1), and a seed."""

    size: float
    where: float
    seed: int


class Upset(NamedTuple):
    """What becomes of a model, and what noise there is."""

    model: Model
    noise: Noise = Noise()


# What becomes of a gait that is to make so many strides.
Maker = Callable[[Gait, Draw, int], Upset]


@dataclass(frozen=True)
class Disturbance:
    """A kind of disturbance: ``sides`` names those to which it may go, the positive one first."""

    name: str
    about: str
    unit: str
    sides: tuple[str, ...]
    largest: float
    make: Maker

    @property
    def signed(self) -> bool:
        """Whether it has a size to either side."""
        return len(self.sides) == 2


def _push(gait: Gait, drawn: Draw, _strides: int) -> Upset:
    speed = gait.model.apex["speed"] + drawn.size / gait.model.mass
    return Upset(gait.model.with_values(apex={"speed": speed}))


def _step(gait: Gait, drawn: Draw, _strides: int) -> Upset:
    return Upset(gait.model.on(Ground.step(drawn.size, at=_place(gait, drawn))))


def _rough(gait: Gait, drawn: Draw, strides: int) -> Upset:
    at = _place(gait, drawn)
    length = LONGER * gait.stride_length * strides + SPACING
    return Upset(gait.model.on(Ground.rough(drawn.size, SPACING, length, drawn.seed, at)))


def _blocks(gait: Gait, drawn: Draw, strides: int) -> Upset:
    at = _place(gait, drawn)
    length = LONGER * gait.stride_length * strides + SPACING
    return Upset(gait.model.on(Ground.blocks(drawn.size, SPACING, length, drawn.seed, at)))


def _place(gait: Gait, drawn: Draw) -> float:
    return BEGINS + drawn.where * gait.stride_length


def _acting(gait: Gait, drawn: Draw, _strides: int) -> Upset:
    return Upset(gait.model, Noise(acting=drawn.size))


def _sensing(gait: Gait, drawn: Draw, _strides: int) -> Upset:
    return Upset(gait.model, Noise(sensing=drawn.size))


# The one side of what has no other.
EITHER = ("of any kind",)

DISTURBANCES: Mapping[str, Disturbance] = {
    kind.name: kind
    for kind in (
        Disturbance("push", "push at the first apex", "N s", ("forward", "backward"), 20.0, _push),
        Disturbance(
            "step", "step up or down, anywhere in a stride", "m", ("up", "down"), 0.06, _step
        ),
        Disturbance("rough", "height of rough ground", "m", EITHER, 0.03, _rough),
        Disturbance("blocks", "height of blocks", "m", EITHER, 0.02, _blocks),
        Disturbance("acting", "Gaussian noise on what is steered", "1", EITHER, 0.03, _acting),
        Disturbance("sensing", "Gaussian noise on the apex", "1", EITHER, 0.03, _sensing),
    )
}


def disturbance(name: str) -> Disturbance:
    """Return a kind of disturbance. Raises `UnknownNameError`."""
    if name not in DISTURBANCES:
        raise UnknownNameError("disturbance", name, DISTURBANCES)
    return DISTURBANCES[name]


class Fate(NamedTuple):
    """What became of a run: strides and distance (m) to the end of it, and how it ended."""

    strides: int
    distance: float
    outcome: str

    @classmethod
    def of(cls, run: SteeredRun) -> Fate:
        """What became of a run."""
        start, end = run.trajectory.start.states[0], run.trajectory.end.states[0]
        return cls(len(run.trajectory.crossings), float(end - start), run.outcome.name)

    @property
    def survived(self) -> bool:
        """Whether it made all its strides."""
        return self.outcome == COMPLETED.name


def endure(stabilizer: Stabilizer, kind: Disturbance, drawn: Draw, strides: int) -> Fate:
    """Run a gait under feedback and a disturbance for so many strides, or until it fails."""
    upset = kind.make(stabilizer.gait, drawn, strides)
    run = steer(upset.model, stabilizer, strides=strides, noise=upset.noise, seed=drawn.seed)
    return Fate.of(run)


def draw(kind: Disturbance, largest: float, seed: int, number: int) -> Draw:
    """Draw one of many disturbances; the same for every animal."""
    random = np.random.default_rng([seed, number])
    size = float(random.uniform(-largest if kind.signed else 0.0, largest))
    return Draw(size, float(random.uniform()), int(random.integers(2**31)))
