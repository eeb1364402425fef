"""One stride of the flexible bounder: ours against MuJoCo's, as its steps and toes shrink.

What MuJoCo's motion differs by, with the step ``h`` and the mass ``m`` of a toe:

- *Impact of the toe.* A toe that lands is stopped, which takes its momentum off the body: ~ m.
- *Reaction of the servos.* They throw the toe forward after lift-off and carry it along: ~ m.
- *Give of the pin.* Under load a toe is off by the force over the pin's stiffness, which is
  ``1.5e4 m / t^2`` with a time constant ``t`` of two steps: ~ h^2 / m. As it lands it is off by its
  speed times ``t``, for about as long: ~ h^2.
- *Lag of the servos.* A leg in flight is off its angle by some ``a / (l w^2)``, where ``a`` is the
  acceleration of the hip and ``w`` the servo's rate, which goes with 1 / h: ~ h^2.
- *Integrator.* Runge-Kutta's steps give ~ h^4; servos hold their torques for a step, which only
  toes feel: ~ m h. As no step reaches across an event, there is nothing of order h. The rate of the
  servos leaves their steps as coarse at any ``h``: of the momentum of a toe that is thrown forward,
  ~ m / h, some 1e-5 gets lost, which by an estimate moves the body by some 1e-8 m at all levels.

With ``m`` in proportion to ``h`` all but the last shrinks at least with their first power.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from flexspine.engines.bounder_mjcf import check_bounder
from flexspine.engines.mujoco_bounder import BounderMotion, LegEvent, MujocoBounder
from flexspine.errors import ParameterError, StateError
from flexspine.gaits.measures import summarize
from flexspine.hybrid.compile import Array
from flexspine.models.dataset import sample
from flexspine.models.legs import SIDES
from flexspine.models.model import Model
from flexspine.models.simulation import Run, simulate


class Level(NamedTuple):
    """A time step of MuJoCo in s, and the mass of a toe as a share of the body's."""

    step: float
    share: float


class Apart(NamedTuple):
    """How far two strides are apart at most; infinite where their contacts are not the same.

    ``place`` of the CoM in m, ``angle`` of a segment in rad, ``contact`` the time of a touchdown or
    a lift-off in s, ``peak`` of a leg's force, as a share of the larger one of ours.
    """

    place: float
    angle: float
    contact: float
    peak: float


# Toes are so heavy that most of the difference is theirs, and its order clear.
LEVELS = tuple(Level(1e-4 / 2**k, 5e-5 / 2**k) for k in range(4))

# At the finest level; about three times what is found of the published gait and of uneven bodies.
ALLOWED = Apart(place=5e-5, angle=2e-4, contact=5e-5, peak=2e-4)

# The power of the toe's mass by which differences are to shrink, as fitted. Peaks have to be close,
# no more: there the give of the pins makes up for part of what toes do, and hides the order.
ORDERS, ORDERED = (0.8, 1.2), ("place", "angle", "contact")

# Fewer levels tell no order.
ENOUGH = 3


@dataclass(frozen=True)
class TemplateStride:
    """A stride in MuJoCo, and how far it is from ours."""

    level: Level
    motion: BounderMotion
    apart: Apart


@dataclass(frozen=True)
class TemplateCheck:
    """One stride of a flexible bounder, ``model``, by our equations and by MuJoCo's.

    ``run`` is ours, ``strides`` are MuJoCo's at every level, the finest last.
    """

    model: Model
    run: Run
    strides: tuple[TemplateStride, ...]

    @cached_property
    def differences(self) -> Array:
        """How far both are apart at most, at all levels, shape (levels, 4).

        In the place of the CoM (m), the angle of a segment (rad), the time of a touchdown or
        lift-off (s) and the peak force of a leg, as a share of the larger one of ours.
        """
        return np.array([each.apart for each in self.strides])

    @cached_property
    def orders(self) -> Apart | None:
        """The power of the toe's mass that each difference follows.

        None where that is not to be had: all toes have the same mass, or a stride differs in kind.
        """
        shares = np.array([each.level.share for each in self.strides])
        if np.ptp(shares) == 0 or not np.isfinite(self.differences).all():
            return None
        return Apart(*np.polyfit(np.log(shares), np.log(self.differences), 1)[0].tolist())

    @cached_property
    def contacts(self) -> tuple[LegEvent, ...]:
        """Our touchdowns and lift-offs, with their times in s."""
        return _contacts(self.run)

    @cached_property
    def peaks(self) -> Array:
        """Our peak forces of the fore and the hind leg, in N, shape (2,)."""
        return _peaks(self.run)

    @property
    def close(self) -> bool:
        """Whether nothing at the finest level differs by more than is allowed."""
        return bool((self.differences[-1] <= ALLOWED).all())

    @property
    def agrees(self) -> bool:
        """Whether the finest level is close to us, and differences shrink as they have to."""
        low, high = ORDERS
        orders = self.orders
        return (
            self.close
            and orders is not None
            and all(low <= getattr(orders, name) <= high for name in ORDERED)
        )


def check_template(
    model: Model,
    levels: Sequence[Level] = LEVELS,
    *,
    progress: Callable[[str], None] | None = None,
) -> TemplateCheck:
    """Compare one stride of a flexible bounder with MuJoCo's at every one of ``levels``.

    The stride starts at the model's apex, which ought to be that of a gait. A level is a time step
    (s) and the mass of a toe as a share of the body's; both shrink from one to the next.
    ``progress`` is told what is done next. Raises `MachineError` without a MuJoCo that will do,
    `ParameterError` for other models, actuators and levels that are not usable, and `StateError` if
    the model makes no stride.
    """
    check_bounder(model)
    levels = tuple(Level(*level) for level in levels)
    finer = all(b != a and b.step <= a.step and b.share <= a.share for a, b in pairwise(levels))
    if not (finer and len(levels) >= ENOUGH):
        raise ParameterError(
            "these steps and shares of toes are not usable",
            f"give {ENOUGH} pairs or more, each smaller than the one before",
        )
    tell = progress or (lambda _what: None)
    tell("exact")
    run = simulate(model)
    outcome = run.outcome
    if not outcome.completed:
        raise StateError(f"'{model.name}' makes no stride: {outcome.message}", outcome.advice)
    strides = []
    for level in levels:
        tell(f"step {level.step * 1e3:.4g} ms, toes {level.share:.3g} of the body")
        motion = MujocoBounder(model, *level).run(run.trajectory.duration)
        strides.append(TemplateStride(level, motion, _apart(run, motion)))
    return TemplateCheck(model, run, tuple(strides))


def deviations(run: Run, motion: BounderMotion) -> tuple[Array, Array]:
    """How far MuJoCo's CoM and segments are from ours at its times, in m and rad, shape (k,) each.

    Infinite where MuJoCo's motion diverged.
    """
    ours = sample(run, np.minimum(motion.times, run.trajectory.end.time))
    com = np.column_stack([ours["com_x"], ours["com_y"]])
    pitches = np.column_stack([ours[f"{side}_pitch"] for side in SIDES])
    place = np.linalg.norm(motion.com - com, axis=1)
    angle = np.abs(motion.pitches - pitches).max(axis=1)
    return np.nan_to_num(place, nan=np.inf), np.nan_to_num(angle, nan=np.inf)


def _apart(run: Run, motion: BounderMotion) -> Apart:
    ours, theirs = _contacts(run), motion.contacts
    contact = np.inf
    if [each.name for each in ours] == [each.name for each in theirs]:
        contact = max(abs(a.time - b.time) for a, b in zip(ours, theirs, strict=True))
    place, angle = (float(each.max()) for each in deviations(run, motion))
    peaks = _peaks(run)
    peak = float(np.nan_to_num(np.abs(motion.peaks - peaks), nan=np.inf).max() / peaks.max())
    return Apart(place, angle, contact, peak)


def _contacts(run: Run) -> tuple[LegEvent, ...]:
    return tuple(
        LegEvent(name, event.time)
        for event in run.trajectory.events
        for name in event.names
        if name.endswith(("touchdown", "lift-off"))
    )


def _peaks(run: Run) -> Array:
    peaks = summarize(run).peak_grf
    return np.array([peaks[side] for side in SIDES])
