"""The flexible bounder: two segments joined by a torsional spring-damper, on two legs.

Coordinates are the whole-body CoM and the absolute pitch of each segment; in them only the two
pitches are coupled. Source: Kamimura et al. 2015, Artif Life Robotics 20:270-275, section 2,
extended to unequal segments and a damper.
"""

from __future__ import annotations

from functools import lru_cache

import sympy as sp
from sympy import cos, sin

from flexspine.models.actuation import (
    REST_NOW,
    SPINE_SHIFTS,
    STIFFNESS_NOW,
    Features,
    RestShift,
    StiffnessShift,
    SwitchedSpine,
)
from flexspine.models.bounder import (
    FORE,
    GRAVITY,
    HIND,
    X_RATE,
    Y_RATE,
    Body,
    BounderKind,
    X,
    Y,
    gravity_field,
)
from flexspine.models.legs import LEGS_PARAMETERS, Leg, Legs
from flexspine.parameters import ParameterSet, quantity

# Parameters


class Segment(ParameterSet):
    """The fore or the hind half of the trunk, with its legs."""

    mass: float = quantity("kg", "mass of the segment", above=0, upper=1e6)
    inertia: float = quantity("kg m^2", "inertia about the segment's CoM", above=0, upper=1e6)
    spine_offset: float = quantity(
        "m", "distance from the segment's CoM to the spine joint", at_least=0, upper=100
    )
    hip_offset: float = quantity(
        "m", "distance from the segment's CoM to the hip", at_least=0, upper=100
    )
    leg: Leg


class Spine(ParameterSet):
    """The joint between the segments, on the relative angle fore minus hind."""

    stiffness: float = quantity("N m/rad", "torsional stiffness k_t", at_least=0, upper=1e9)
    damping: float = quantity(
        "N m s/rad", "torsional damping c_t", at_least=0, upper=1e6, default=0.0
    )
    rest_angle: float = quantity(
        "rad", "relative angle without torque", at_least=-1.5, upper=1.5, default=0.0
    )
    stiffness_shift: StiffnessShift = StiffnessShift()
    rest_shift: RestShift = RestShift()


class FlexibleBounderParameters(ParameterSet):
    """Parameters of the flexible bounder."""

    fore: Segment
    hind: Segment
    spine: Spine
    legs: Legs = Legs()
    gravity: float = gravity_field()


# Geometry

F, F_RATE, H, H_RATE = sp.symbols("theta_f thetadot_f theta_h thetadot_h", real=True)
BEND, BEND_RATE, TWIST = sp.symbols("delta deltadot epsilon", real=True)
K_T, C_T, REST = sp.symbols("k_t c_t rho", real=True)
M, MU = sp.symbols("m mu", real=True)  # whole and reduced mass


class SegmentSymbols:
    """The letters of one segment."""

    def __init__(self, side: str) -> None:
        self.side = side
        self.m, self.J, self.a, self.h, self.A = (
            sp.Symbol(f"{letter}_{side[0]}", real=True) for letter in "mJahA"
        )

    @property
    def parameters(self) -> dict[str, sp.Symbol]:
        """Dotted parameter name to letter."""
        names = ("mass", "inertia", "spine_offset", "hip_offset")
        letters = (self.m, self.J, self.a, self.h)
        return {f"{self.side}.{n}": letter for n, letter in zip(names, letters, strict=True)}


FORE_HALF, HIND_HALF = SegmentSymbols("fore"), SegmentSymbols("hind")


@lru_cache
def _body(features: Features) -> Body:
    fore, hind = FORE_HALF, HIND_HALF
    # How far the CoM is moved by a unit vector along each segment, seen from the joint.
    lever_f, lever_h, coupling = sp.symbols("b_f b_h B", real=True)
    definitions = {
        M: fore.m + hind.m,
        MU: fore.m * hind.m / M,
        lever_f: fore.m * fore.a / M,
        lever_h: hind.m * hind.a / M,
        fore.A: fore.J + MU * fore.a**2,
        hind.A: hind.J + MU * hind.a**2,
        coupling: MU * fore.a * hind.a,
        BEND: F - H,
        BEND_RATE: F_RATE - H_RATE,
        TWIST: BEND - (REST_NOW if features.switched else REST),
    }
    joint = (
        X - lever_f * cos(F) + lever_h * cos(H),
        Y - lever_f * sin(F) + lever_h * sin(H),
    )
    reach_f, reach_h = fore.a + fore.h - lever_f, hind.a + hind.h - lever_h
    hips = {
        "fore": (X + reach_f * cos(F) + lever_h * cos(H), Y + reach_f * sin(F) + lever_h * sin(H)),
        "hind": (X - lever_f * cos(F) - reach_h * cos(H), Y - lever_f * sin(F) - reach_h * sin(H)),
    }
    # Energies. The two CoMs move against each other with velocity a_f f' + a_h h'.
    stiffness = STIFFNESS_NOW if features.switched else K_T
    torque = stiffness * TWIST
    return Body(
        coordinates={"fore_pitch": (F, F_RATE), "hind_pitch": (H, H_RATE)},
        mirror={"fore_pitch": "hind_pitch", "hind_pitch": "fore_pitch"},
        parameters={
            **fore.parameters,
            **FORE.parameters,
            **hind.parameters,
            **HIND.parameters,
            "spine.stiffness": K_T,
            "spine.damping": C_T,
            "spine.rest_angle": REST,
            **SPINE_SHIFTS,
            **LEGS_PARAMETERS,
            "gravity": GRAVITY,
        },
        definitions=definitions,
        kinetic=M * (X_RATE**2 + Y_RATE**2) / 2
        + fore.A * F_RATE**2 / 2
        + hind.A * H_RATE**2 / 2
        + coupling * cos(BEND) * F_RATE * H_RATE,
        gravity=M * GRAVITY * Y,
        pitches={"fore": (F, F_RATE), "hind": (H, H_RATE)},
        spine=stiffness * TWIST**2 / 2,
        switched=SwitchedSpine(F - H, K_T, REST) if features.switched else None,
        power_lost=C_T * BEND_RATE**2 if features.damped_spine else sp.S.Zero,
        hips=hips,
        low_points={"spine joint": joint},
        observables={
            "spine_joint_x": joint[0],
            "spine_joint_y": joint[1],
            "spine_angle": BEND,
            "spine_torque": torque + C_T * BEND_RATE if features.damped_spine else torque,
        },
    )


# Register

FLEXIBLE_BOUNDER = BounderKind(
    name="flexible-bounder",
    title="two segments with a torsional spring-damper spine, on a fore and a hind leg",
    source="Kamimura et al. 2015",
    parameters=FlexibleBounderParameters,
    body=_body,
)
