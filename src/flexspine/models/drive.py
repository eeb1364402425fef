"""What turns a robot's motors, as far as its equations have to know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from flexspine.hybrid.system import Guard
from flexspine.hybrid.trajectory import HybridState
from flexspine.mechanics.linkage import Array
from flexspine.mechanics.linkage_motion import LinkageMotion, Point
from flexspine.models.footing import Footing
from flexspine.models.robot import Robot

if TYPE_CHECKING:
    from flexspine.models.articulated import BoundRobot


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

    A law that knows what the robot does under it may say so: ``accelerations`` of the motion's
    coordinates and ``forces`` by foot.
    """

    torques: Mapping[str, sp.Expr] = field(default_factory=dict)
    definitions: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)
    observables: Mapping[str, sp.Expr] = field(default_factory=dict)
    accelerations: list[sp.Expr] | None = None
    forces: Mapping[str, Point] = field(default_factory=dict)


@dataclass(frozen=True)
class Drive:
    """What turns the motors. This one leaves them alone.

    Drives that are equal share compiled equations, so what differs between them belongs to
    ``values``.
    """

    @property
    def name(self) -> str:
        """What it is called."""
        return "passive"

    def held(self, robot: Robot) -> tuple[sp.Symbol, ...]:
        """What it remembers."""
        del robot
        return ()

    def values(self, robot: Robot) -> dict[sp.Symbol, float]:
        """Its parameters."""
        del robot
        return {}

    def label(self, robot: Robot, moment: Moment) -> str:
        """What else but the footing the mode depends on, `` by ...``."""
        del robot, moment
        return ""

    def turning(self, robot: Robot, motion: LinkageMotion, mode: str) -> Turning:
        """The torques in a mode."""
        del robot, motion, mode
        return Turning()

    def torques_at(self, bound: BoundRobot, point: HybridState) -> Array:
        """The torques at a point, shape (m,)."""
        del point
        return np.zeros(bound.linkage.actuation.shape[1])

    def guards(self, robot: Robot, mode: str) -> tuple[Guard, ...]:
        """When it changes its mind."""
        del robot, mode
        return ()

    def after_impact(self, robot: Robot, moment: Moment, landed: tuple[str, ...]) -> Moment:
        """What it makes of an impact at which feet landed."""
        del robot, landed
        return moment
