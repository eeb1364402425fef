"""What upsets a steered animal, of any size, and how long it goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexspine.control.stabilize import Stabilizer
from flexspine.control.steering import Noise, SteeredRun, steer
from flexspine.errors import UnknownNameError
from flexspine.hybrid.outcome import COMPLETED
from flexspine.models.ground import BEGINS, Ground
from flexspine.models.model import Model


class Upset(NamedTuple):
    """What becomes of a model, and what noise there is."""

    model: Model
    noise: Noise = Noise()


# From a gait's model, size, where (0 to 1 of a stride), seed and length of a stride (m).
Maker = Callable[[Model, float, float, int, float], Upset]


@dataclass(frozen=True)
class Disturbance:
    """A kind of disturbance. ``signed`` ones have a size to either side."""

    name: str
    about: str
    unit: str
    signed: bool
    largest: float
    make: Maker


def _push(model: Model, size: float, _where: float, _seed: int, _stride: float) -> Upset:
    return Upset(model.with_values(apex={"speed": model.apex["speed"] + size / model.mass}))


def _step(model: Model, size: float, where: float, _seed: int, stride: float) -> Upset:
    return Upset(model.on(Ground.step(size, at=BEGINS + where * stride)))


def _rough(model: Model, size: float, where: float, seed: int, stride: float) -> Upset:
    return Upset(model.on(_far(Ground.rough, size, where, seed, stride)))


def _blocks(model: Model, size: float, where: float, seed: int, stride: float) -> Upset:
    return Upset(model.on(_far(Ground.blocks, size, where, seed, stride)))


def _far(
    make: Callable[..., Ground], size: float, where: float, seed: int, stride: float
) -> Ground:
    at = BEGINS + where * stride
    return make(size, SPACING, LENGTH, seed, at)


def _acting(model: Model, size: float, _where: float, _seed: int, _stride: float) -> Upset:
    return Upset(model, Noise(acting=size))


def _sensing(model: Model, size: float, _where: float, _seed: int, _stride: float) -> Upset:
    return Upset(model, Noise(sensing=size))


# m; of rough ground, as long as any run of a few hundred strides.
SPACING, LENGTH = 0.3, 1000.0

DISTURBANCES: Mapping[str, Disturbance] = {
    kind.name: kind
    for kind in (
        Disturbance("push", "push forward at the first apex", "N s", True, 20.0, _push),
        Disturbance("step", "step up or down, anywhere in a stride", "m", True, 0.06, _step),
        Disturbance("rough", "height of rough ground", "m", False, 0.03, _rough),
        Disturbance("blocks", "height of blocks", "m", False, 0.02, _blocks),
        Disturbance("acting", "Gaussian noise on what is steered", "1", False, 0.03, _acting),
        Disturbance("sensing", "Gaussian noise on the apex", "1", False, 0.03, _sensing),
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


def endure(
    stabilizer: Stabilizer, kind: Disturbance, size: float, where: float, seed: int, strides: int
) -> Fate:
    """Run a gait under feedback and a disturbance for so many strides, or until it fails."""
    gait = stabilizer.gait
    upset = kind.make(gait.model, size, where, seed, gait.stride_length)
    return Fate.of(steer(upset.model, stabilizer, strides=strides, noise=upset.noise, seed=seed))


def draw(kind: Disturbance, largest: float, seed: int, number: int) -> tuple[float, float, int]:
    """Size, place and seed of one of many runs; the same for every animal."""
    random = np.random.default_rng([seed, number])
    size = float(random.uniform(-largest if kind.signed else 0.0, largest))
    return size, float(random.uniform()), int(random.integers(2**31))
