"""What turns a robot's motors, as far as its equations have to know."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from flexspine.hybrid.system import Guard
from flexspine.mechanics.linkage import Array
from flexspine.mechanics.linkage_motion import LinkageMotion, Point
from flexspine.models.footing import Footing
from flexspine.models.robot import Robot

if TYPE_CHECKING:
    from flexspine.models.bound_robot import BoundRobot


@dataclass(frozen=True)
class Moment:
    """A robot at one instant: time (s), ``q`` and its rates (N,), footing, held numbers."""

    time: float
    q: Array
    rates: Array
    footing: Footing
    held: Mapping[sp.Symbol, float]


@dataclass(frozen=True)
class Turning:
    """The torques of motors by joint, in symbols, in terms of ``definitions``.

    ``guards`` tell where they cannot be had. A law that knows what the robot does under it may say
    so: ``accelerations`` of the motion's coordinates and ``forces`` by foot.
    """

    torques: Mapping[str, sp.Expr] = field(default_factory=dict)
    definitions: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)
    observables: Mapping[str, sp.Expr] = field(default_factory=dict)
    guards: tuple[Guard, ...] = ()
    accelerations: list[sp.Expr] | None = None
    forces: Mapping[str, Point] = field(default_factory=dict)


@dataclass(frozen=True)
class Drive:
    """What turns the motors of a robot. This one leaves them alone."""

    robot: Robot

    @property
    def key(self) -> tuple[Hashable, ...]:
        """What it shares with all drives that have the same equations."""
        return (type(self).__name__,)

    def held(self) -> tuple[sp.Symbol, ...]:
        """What it remembers."""
        return ()

    def values(self) -> dict[sp.Symbol, float]:
        """Its parameters."""
        return {}

    @property
    def usual(self) -> tuple[tuple[str, ...], ...]:
        """Feet that stand together for long; such footings get a field of their own."""
        feet = tuple(self.robot.feet)
        return ((), *((foot,) for foot in feet))

    def label(self, moment: Moment) -> str:
        """What else but the footing the mode depends on."""
        return ""

    def turning(self, motion: LinkageMotion, mode: str) -> Turning:
        """The torques in a mode."""
        return Turning()

    def torques_at(self, bound: BoundRobot, moment: Moment, states: Array) -> Array:
        """The torques at a moment, in the order of the motors, shape (m,).

        ``states`` are those that the moment itself does not tell.
        """
        return np.zeros(bound.linkage.actuation.shape[1])

    def guards(self) -> tuple[Guard, ...]:
        """When it changes its mind, or gives up, in any mode."""
        return ()

    def to_stand(self, held: Mapping[sp.Symbol, float]) -> tuple[str, ...]:
        """The feet that are to stand."""
        return tuple(self.robot.feet)

    def steps(self, held: Mapping[sp.Symbol, float]) -> int:
        """How many steps it has done."""
        return 0

    def ready(self, start: Moment) -> Moment:
        """What there is to do before the beginning."""
        return start

    def after_landing(self, moment: Moment, landed: tuple[str, ...]) -> Moment:
        """What it makes of an impact at which feet landed."""
        return moment

    def after_settling(self, moment: Moment) -> Moment:
        """What it makes of the footing that comes of a change; the same moment if nothing."""
        return moment
