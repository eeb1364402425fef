"""A bounder of your own: three segments in a row, with a torsional spring-damper at both joints."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

from flexspine.models.actuation import Features
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


class Middle(ParameterSet):
    """The segment between the joints."""

    mass: float = quantity("kg", "mass of the segment", above=0, upper=1e6)
    inertia: float = quantity("kg m^2", "inertia about its CoM", above=0, upper=1e6)
    spine_offset: float = quantity("m", "from its CoM to its joints", at_least=0, upper=100)


class End(Middle):
    """The fore or the hind segment, with its legs."""

    hip_offset: float = quantity("m", "from its CoM to the hip", at_least=0, upper=100)
    leg: Leg


class Joints(ParameterSet):
    """Both joints, on the relative angles."""

    stiffness: float = quantity("N m/rad", "of each joint", at_least=0, upper=1e9)
    damping: float = quantity("N m s/rad", "of each joint", at_least=0, upper=1e6, default=0.0)


class TwoJointParameters(ParameterSet):
    """Parameters of the two-joint bounder."""

    fore: End
    middle: Middle
    hind: End
    spine: Joints
    legs: Legs = Legs()
    gravity: float = gravity_field()


# Geometry: every CoM and hip is the whole CoM plus lever arms times the directions of the segments

PARTS = ("fore", "middle", "hind")
PITCHES = tuple(f"{part}_pitch" for part in PARTS)
ANGLES = sp.symbols("theta_f theta_m theta_h", real=True)
RATES = sp.symbols("thetadot_f thetadot_m thetadot_h", real=True)
MASSES = sp.symbols("m_f m_m m_h", real=True)
INERTIAS = sp.symbols("J_f J_m J_h", real=True)
OFFSETS = sp.symbols("a_f a_m a_h", real=True)
H_F, H_H, K_T, C_T = sp.symbols("h_f h_h k_t c_t", real=True)
M = sp.Symbol("m", real=True)
MEAN = sp.symbols("b_f b_m b_h", real=True)  # of the lever arms, by mass

A_F, A_M, A_H = OFFSETS
FROM_MIDDLE = ((A_F, A_M, 0), (0, 0, 0), (0, -A_M, -A_H))  # of the three CoMs


def place(levers: tuple[sp.Expr, ...]) -> tuple[sp.Expr, sp.Expr]:
    """A point of the body by its lever arms, seen from the CoM of the middle segment."""
    arms = [lever - mean for lever, mean in zip(levers, MEAN, strict=True)]
    return (
        X + sum(arm * cos(angle) for arm, angle in zip(arms, ANGLES, strict=True)),
        Y + sum(arm * sin(angle) for arm, angle in zip(arms, ANGLES, strict=True)),
    )


def body(features: Features) -> Body:
    """Energies and hips."""
    definitions = {M: sum(MASSES)}
    for i, mean in enumerate(MEAN):
        moment = sum(m * arms[i] for m, arms in zip(MASSES, FROM_MIDDLE, strict=True))
        definitions[mean] = moment / M
    # T = 1/2 m v^2 + 1/2 sum A_ij cos(theta_i - theta_j) theta_i' theta_j', with constant A
    kinetic = M * (X_RATE**2 + Y_RATE**2) / 2
    for i in range(3):
        for j in range(i + 1):
            coupling = sp.Symbol(f"A_{i + 1}{j + 1}", real=True)
            definitions[coupling] = sum(
                m * (arms[i] - MEAN[i]) * (arms[j] - MEAN[j])
                for m, arms in zip(MASSES, FROM_MIDDLE, strict=True)
            ) + (INERTIAS[i] if i == j else 0)
            share = sp.Rational(1, 2) if i == j else 1
            kinetic += share * coupling * cos(ANGLES[i] - ANGLES[j]) * RATES[i] * RATES[j]
    bends = (ANGLES[0] - ANGLES[1], ANGLES[1] - ANGLES[2])
    rates = (RATES[0] - RATES[1], RATES[1] - RATES[2])
    letters = (("mass", MASSES), ("inertia", INERTIAS), ("spine_offset", OFFSETS))
    return Body(
        coordinates=dict(zip(PITCHES, zip(ANGLES, RATES, strict=True), strict=True)),
        mirror=dict(zip(PITCHES, reversed(PITCHES), strict=True)),
        parameters={
            **{f"{part}.{name}": row[i] for i, part in enumerate(PARTS) for name, row in letters},
            "fore.hip_offset": H_F,
            **FORE.parameters,
            "hind.hip_offset": H_H,
            **HIND.parameters,
            "spine.stiffness": K_T,
            "spine.damping": C_T,
            **LEGS_PARAMETERS,
            "gravity": GRAVITY,
        },
        definitions=definitions,
        kinetic=kinetic,
        gravity=M * GRAVITY * Y,
        spine=K_T * (bends[0] ** 2 + bends[1] ** 2) / 2,
        power_lost=C_T * (rates[0] ** 2 + rates[1] ** 2) if features.damped_spine else sp.S.Zero,
        pitches={"fore": (ANGLES[0], RATES[0]), "hind": (ANGLES[2], RATES[2])},
        hips={"fore": place((A_F + H_F, A_M, 0)), "hind": place((0, -A_M, -A_H - H_H))},
        low_points={"fore joint": place((0, A_M, 0)), "hind joint": place((0, -A_M, 0))},
    )


# Register

TWO_JOINT_BOUNDER = BounderKind(
    name="two-joint-bounder",
    title="three segments with two torsional spring-dampers, on a fore and a hind leg",
    source="this guide",
    parameters=TwoJointParameters,
    body=body,
)
