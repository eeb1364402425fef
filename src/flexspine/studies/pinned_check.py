"""A robot pinned by one foot and let go: our motion against MuJoCo's, as its step shrinks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np
from numpy.typing import NDArray

from flexspine.engines.mujoco_planar import PinnedMotion, PinnedMujoco
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.models.pinned import Energies, PinnedRun, crouch, swing
from flexspine.models.robot import Robot

# s; the largest of MuJoCo's steps, and how often it is halved. Larger ones are too coarse for a
# robot whose limp legs spin about their knees.
STEP, HALVINGS = 5e-4, 4

# s; until when both have to agree. The motion is chaotic, and later errors have grown too large.
COMPARED = 0.5

# s; how long runs last, and how often they are looked at, unless the largest step is longer.
SECONDS, LONGEST = 1.0, 10.0
SAMPLE = 1e-3

# rad; as far as links may be apart at the smallest step.
ALLOWED = 1e-6

# Of the Runge-Kutta method, as fitted.
ORDERS = 3.5, 4.5

# rad; smaller differences are rounding as well, and larger ones grow in ways of their own, as the
# motion is chaotic. An order is fitted to what is between, if that is enough.
ROUNDING, COARSE, ENOUGH = 1e-11, 1e-4, 3


@dataclass(frozen=True)
class PinnedCase:
    """One motion, ours and MuJoCo's by every one of ``steps`` (s), at the same ``times`` (s)."""

    name: str
    run: PinnedRun
    times: Array
    steps: tuple[float, ...]
    theirs: tuple[PinnedMotion, ...]

    @cached_property
    def angles(self) -> Array:
        """Ours, of all links from +x in rad, shape (times, links)."""
        return self.run.angles(self.times)

    @cached_property
    def differences(self) -> Array:
        """Of the link that is farthest apart, in rad, shape (steps, times)."""
        apart = np.array([np.abs(each.angles - self.angles).max(axis=1) for each in self.theirs])
        differences: Array = np.nan_to_num(apart, nan=np.inf)
        return differences

    @cached_property
    def compared(self) -> Array:
        """The largest differences up to `COMPARED`, in rad, shape (steps,)."""
        early = self.times <= COMPARED + self.steps[-1] / 2
        largest: Array = self.differences[:, early].max(axis=1)
        return largest

    @property
    def fitted(self) -> NDArray[np.bool_]:
        """At which steps these differences tell an order, shape (steps,)."""
        found: NDArray[np.bool_] = (self.compared > ROUNDING) & (self.compared < COARSE)
        return found

    @cached_property
    def order(self) -> float | None:
        """The power of the step that these differences follow; None: too few tell it."""
        fitted = self.fitted
        if np.count_nonzero(fitted) < ENOUGH:
            return None
        logs = np.log(np.array(self.steps)[fitted]), np.log(self.compared[fitted])
        return float(np.polyfit(*logs, 1)[0])

    @property
    def close(self) -> bool:
        """Whether the difference at the smallest step is allowed."""
        return bool(self.compared[-1] <= ALLOWED)

    @property
    def agrees(self) -> bool:
        """Whether the smallest step is close to us, and the larger ones as close as they can be."""
        low, high = ORDERS
        return self.close and self.order is not None and low <= self.order <= high

    @cached_property
    def energies(self) -> Energies:
        """Ours over time."""
        return self.run.energies(self.times)

    @cached_property
    def imbalance(self) -> Array:
        """How far the sum of our energies is off what it was at the start, in J, over time."""
        total = self.energies.sum
        off: Array = total - total[0]
        return off

    @cached_property
    def their_imbalance(self) -> Array:
        """The same of MuJoCo's energies, with what our dampers took, in J, shape (steps, times)."""
        taken, start = self.energies.dissipated, self.energies.sum[0]
        return np.array([each.energies + taken - start for each in self.theirs])


@dataclass(frozen=True)
class PinnedCheck:
    """A robot pinned by a foot and let go, by our equations and by MuJoCo's.

    ``cases`` are its motions, without dampers and with those that it has, if any.
    """

    robot: Robot
    foot: str
    cases: tuple[PinnedCase, ...]

    @property
    def agrees(self) -> bool:
        """Whether every motion is MuJoCo's: close at its smallest step, and of its order."""
        return all(case.agrees for case in self.cases)


def check_pinned(
    robot: Robot,
    foot: str | None = None,
    *,
    seconds: float = SECONDS,
    step: float = STEP,
    progress: Callable[[str], None] | None = None,
) -> PinnedCheck:
    """Let a passive robot go from a crouch, held by a foot: by our equations and by MuJoCo's.

    ``foot`` is the robot's first if none is given, ``seconds`` how long it swings, ``step`` the
    largest of MuJoCo's steps in s, shortened to divide the 0.5 s in which both have to agree; each
    of the others is half the one before. ``progress`` is told what is done next. Raises
    `MachineError` without a MuJoCo that will do, `UnknownNameError` for an unknown foot,
    `ParameterError` for times that are not usable and `StateError` if the motion cannot be
    integrated.
    """
    if not COMPARED <= seconds <= LONGEST:
        raise ParameterError(
            f"{seconds:g} s are not usable", f"give from {COMPARED:g} to {LONGEST:g} s"
        )
    if not STEP / 100 <= step <= COMPARED / 10:
        raise ParameterError(
            f"a step of {step:g} s is not usable",
            f"give from {STEP / 100:g} to {COMPARED / 10:g} s",
        )
    foot = next(iter(robot.feet)) if foot is None else foot
    bare = robot.with_values({f"{joint}.damping": 0.0 for joint in robot.joints}, "left away")
    kinds = {"without dampers": bare}
    if any(joint.damping for joint in robot.linkage.joints):
        kinds["with dampers"] = robot
    cases = []
    for name, each in kinds.items():
        if progress is not None:
            progress(name)
        cases.append(_case(name, each, foot, seconds, step))
    return PinnedCheck(robot, foot, tuple(cases))


def _case(name: str, robot: Robot, foot: str, seconds: float, step: float) -> PinnedCase:
    engine, start = PinnedMujoco(robot.linkage, foot), crouch(robot)
    # Whole steps make a sample, and whole samples the time that is compared.
    each = max(1, round(SAMPLE / step))
    sample = COMPARED / ceil(COMPARED / (each * step))
    count = round(seconds / sample)
    times = sample * np.arange(count + 1, dtype=float)
    splits = [each * 2**halvings for halvings in range(HALVINGS + 1)]
    return PinnedCase(
        name=name,
        run=swing(robot, foot, start, times[-1]),
        times=times,
        steps=tuple(sample / split for split in splits),
        theirs=tuple(engine.run(start, sample / split, count * split, split) for split in splits),
    )
