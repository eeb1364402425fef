"""The flexible bounder in MuJoCo, let go at an apex; its legs change as ours do.

Motions and forces are MuJoCo's. It is told what a leg is to do:

- In flight a servo at the hinge turns the leg to its touchdown angle, measured from the vertical,
  and a spring-damper on the slide holds its length; both critically damped, at the rate `SERVO`
  over the time step. Nothing meets the ground.
- Where an armed leg's hip falls through ``l0 cos(gamma)`` the toe is pinned, the hinge let loose,
  and the slide gets the leg's own spring and damper.
- Where their force falls through zero the toe is let go. The leg is armed again once its hip is
  above ``l0 cos(gamma)``.

The steps in which that happens are cut short at the instant itself, found by root finding.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from flexspine.engines.bounder_mjcf import AHEAD, PITCHES, check_bounder, specification
from flexspine.engines.installed import mujoco_module, unheard
from flexspine.hybrid.compile import Array
from flexspine.models.legs import SIDES, Leg
from flexspine.models.model import Model, check_between
from flexspine.parameters import values

# s, and of the body's mass; servos that are slower than a stride or toes heavier than this would
# be another animal.
LONGEST_STEP, HEAVIEST_TOE = 1e-3, 0.1

# Rate of the servos times the time step; torques are held for a step, which this much allows.
SERVO = 0.2

# s; what rounding leaves of a run.
SLIVER = 1e-12

# Of a time step; within this an event has happened.
INSTANT = 1e-10


class LegEvent(NamedTuple):
    """What happened to a leg, named as in our runs ("fore touchdown"), and when, in s."""

    name: str
    time: float


class BounderMotion(NamedTuple):
    """What MuJoCo found at the end of every step, ``times`` in s, shape (k,).

    ``com`` is that of both segments, x and y in m, ``pitches`` in rad and ``forces`` of legs in N
    are those of `SIDES`, shape (k, 2) each. The force is that of spring and damper, along the leg:
    what the ground feels also stops the toe.
    """

    times: Array
    com: Array
    pitches: Array
    forces: Array
    contacts: tuple[LegEvent, ...]

    @property
    def peaks(self) -> Array:
        """Peak forces of the legs, in N, in the order of `SIDES`."""
        found: Array = self.forces.max(axis=0)
        return found


@dataclass
class _MovingLeg:
    """A leg, where MuJoCo keeps its parts, and what it is about.

    ``pitch`` are the coordinates whose sum is the pitch of its segment.
    """

    side: str
    numbers: Leg
    touchdown: float
    pitch: list[int]
    hinge: int
    slide: int
    slide_joint: int
    hip: int
    toe: int
    pin: int
    stands: bool = False
    armed: bool = False


class MujocoBounder:
    """A flexible bounder in MuJoCo, ``step`` in s; each toe has a ``share`` of the body's mass.

    ``model`` and ``data`` are MuJoCo's. A leg that lands while it lengthens, which ours lets go at
    once, pulls here, and nothing ends a run but its time. Raises `ParameterError` for any other
    kind of model, for actuators and for steps and shares that are not usable, and `MachineError` if
    MuJoCo is not there or has a version that is not supported.
    """

    def __init__(self, bounder: Model, step: float, share: float) -> None:
        check_bounder(bounder)
        self.bounder = bounder
        self.step = check_between("step", step, 0, LONGEST_STEP)
        self._toe = check_between("share", share, 0, HEAVIEST_TOE) * bounder.mass
        self._rate = SERVO / self.step
        self._mujoco = mujoco_module()
        self.model = specification(self._mujoco, bounder, self._toe, self.step).compile()
        self.data = self._mujoco.MjData(self.model)
        # All joints have one coordinate, so that places and velocities are kept alike.
        self._at = {
            name: int(self.model.joint(name).qposadr[0]) for name in ("x", "y", *PITCHES.values())
        }
        self._legs = [self._leg(side) for side in SIDES]
        self._segments = [self.model.body(side).id for side in SIDES]
        masses = self.model.body_mass[self._segments]
        self._shares = masses / masses.sum()
        self._kept = self._mujoco.mjtState.mjSTATE_INTEGRATION
        self._before = np.zeros(self._mujoco.mj_stateSize(self.model, self._kept))
        self.set_off()

    def run(self, seconds: float) -> BounderMotion:
        """Let go at the model's apex, for ``seconds``; NaN from where it diverged."""
        self.set_off()
        rows, contacts = [self._row()], []
        with unheard(self._mujoco):
            while (left := seconds - self.data.time) > SLIVER:
                contacts += self.advance(min(self.step, left))
                rows.append(self._row())
        times, com, pitches, forces = np.split(np.array(rows), [1, 3, 5], axis=1)
        return BounderMotion(times[:, 0], com, pitches, forces, tuple(contacts))

    def set_off(self) -> None:
        """Go to the model's apex, with legs that are at rest at their touchdown angles."""
        self._mujoco.mj_resetData(self.model, self.data)
        q, v, at, apex = self.data.qpos, self.data.qvel, self._at, self.bounder.apex
        pitches = np.array([apex[f"{side}_pitch"] for side in SIDES])
        rates = np.array([apex[f"{side}_pitch_rate"] for side in SIDES])
        # From the CoM of both segments to the spine joint.
        given = values(self.bounder.parameters)
        offsets = [AHEAD[side] * given[f"{side}.spine_offset"] for side in SIDES]
        levers = -self._shares * np.array(offsets)
        q[at["x"]], q[at["y"]] = levers @ np.cos(pitches), apex["height"] + levers @ np.sin(pitches)
        v[at["x"]] = apex["speed"] - levers @ (np.sin(pitches) * rates)
        v[at["y"]] = levers @ (np.cos(pitches) * rates)
        for each, (fore, hind) in ((q, pitches), (v, rates)):
            each[at["pitch"]], each[at["spine"]] = fore, hind - fore
        for leg in self._legs:
            q[leg.hinge] = leg.touchdown - q[leg.pitch].sum()
            v[leg.hinge] = -v[leg.pitch].sum()
            q[leg.slide] = leg.numbers.rest_length
            self._let_go(leg)
        self._mujoco.mj_kinematics(self.model, self.data)
        for leg in self._legs:
            leg.armed = self._margin(leg) > 0

    def advance(self, step: float) -> list[LegEvent]:
        """Take one step of at most ``step`` s, up to the next event; returns what happened."""
        self._hold()
        self._mujoco.mj_getState(self.model, self.data, self._before, self._kept)
        self._take(step)
        due = [leg for leg in self._legs if leg.armed and -inf < self._margin(leg) <= 0]
        if due:
            when = [self._instant(leg, step) for leg in due]
            first = due[int(np.argmin(when))]
            self._take_again(min(when))
            due = [leg for leg in due if leg is first or self._margin(leg) <= 0]
        happened = [self._change(leg) for leg in due]
        for leg in self._legs:
            leg.armed = leg.armed or self._margin(leg) > 0
        return happened

    def _leg(self, side: str) -> _MovingLeg:
        model = self.model
        slide = model.joint(f"{side}_slide")
        return _MovingLeg(
            side=side,
            numbers=getattr(self.bounder.parameters, side).leg,
            touchdown=self.bounder.touchdown[side],
            pitch=[self._at[PITCHES[each]] for each in SIDES[: SIDES.index(side) + 1]],
            hinge=int(model.joint(f"{side}_hinge").qposadr[0]),
            slide=int(slide.qposadr[0]),
            slide_joint=slide.id,
            hip=model.body(f"{side}_leg").id,
            toe=model.body(f"{side}_toe").id,
            pin=model.equality(side).id,
        )

    def _margin(self, leg: _MovingLeg) -> float:
        """What changes the leg as it falls through zero: its force in N, or its hip's height."""
        if leg.stands:
            return self._force(leg)
        reach = leg.numbers.rest_length * cos(leg.touchdown)
        return float(self.data.xpos[leg.hip, 1]) - reach

    def _force(self, leg: _MovingLeg) -> float:
        if not leg.stands:
            return 0.0
        short = leg.numbers.rest_length - self.data.qpos[leg.slide]
        damped = leg.numbers.damping * self.data.qvel[leg.slide]
        return float(leg.numbers.stiffness * short - damped)

    def _change(self, leg: _MovingLeg) -> LegEvent:
        if leg.stands:
            self._let_go(leg)
            return LegEvent(f"{leg.side} lift-off", float(self.data.time))
        self._pin(leg)
        return LegEvent(f"{leg.side} touchdown", float(self.data.time))

    def _pin(self, leg: _MovingLeg) -> None:
        """The toe stays where it is, on the ground; the rest is up to the leg's spring."""
        leg.stands, leg.armed = True, False
        self.model.eq_data[leg.pin][:6] = 0, 0, 0, self.data.xpos[leg.toe, 0], 0, 0
        self.data.eq_active[leg.pin] = True
        self.data.qfrc_applied[leg.hinge] = 0.0
        self._set_slide(leg, leg.numbers.stiffness, leg.numbers.damping)

    def _let_go(self, leg: _MovingLeg) -> None:
        leg.stands, leg.armed = False, False
        self.data.eq_active[leg.pin] = False
        self._set_slide(leg, self._toe * self._rate**2, 2 * self._toe * self._rate)

    def _set_slide(self, leg: _MovingLeg, stiffness: float, damping: float) -> None:
        self.model.jnt_stiffness[leg.slide_joint] = stiffness
        self.model.dof_damping[leg.slide] = damping

    def _hold(self) -> None:
        """The torques of the servos: between leg and segment, by the leg's absolute angle."""
        for leg in self._legs:
            if not leg.stands:
                turns = [*leg.pitch, leg.hinge]
                off = self.data.qpos[turns].sum() - leg.touchdown
                pull = self._rate**2 * off + 2 * self._rate * self.data.qvel[turns].sum()
                inertia = self._toe * leg.numbers.rest_length**2
                self.data.qfrc_applied[leg.hinge] = -inertia * pull

    def _take(self, step: float) -> None:
        self.model.opt.timestep = step
        self._mujoco.mj_step(self.model, self.data)
        # A step leaves bodies where they were before it.
        self._mujoco.mj_kinematics(self.model, self.data)

    def _take_again(self, step: float) -> None:
        self._mujoco.mj_setState(self.model, self.data, self._before, self._kept)
        self._take(step)

    def _instant(self, leg: _MovingLeg, step: float) -> float:
        """How long after the beginning of the latest step the leg changes, in s."""

        def margin(part: float) -> float:
            self._take_again(part)
            return self._margin(leg)

        return float(brentq(margin, 0.0, step, xtol=INSTANT * step))

    def _row(self) -> list[float]:
        com = self._shares @ self.data.xipos[self._segments]
        pitches = (self.data.qpos[leg.pitch].sum() for leg in self._legs)
        return [self.data.time, *com[:2], *pitches, *(self._force(leg) for leg in self._legs)]
