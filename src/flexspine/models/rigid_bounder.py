"""The rigid bounder: one body on a fore and a hind leg.

Source: Kamimura et al. 2015, Artif Life Robotics 20:270-275, section 2; with its hips at equal
distances also Poulakakis, Papadopoulos & Buehler 2006, Int J Robotics Research 25:669-687.
"""

from __future__ import annotations

from functools import lru_cache

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
from flexspine.models.legs import LEGS_PARAMETERS, SIDES, Leg, Legs
from flexspine.parameters import ParameterSet, quantity

# Parameters


class Trunk(ParameterSet):
    """The one rigid body."""

    mass: float = quantity("kg", "mass of the body", above=0, upper=1e6)
    inertia: float = quantity("kg m^2", "pitch inertia about the CoM", above=0, upper=1e6)


class End(ParameterSet):
    """The fore or the hind end of the body."""

    hip_offset: float = quantity("m", "distance from the CoM to the hip", at_least=0, upper=100)
    leg: Leg


class RigidBounderParameters(ParameterSet):
    """Parameters of the rigid bounder."""

    body: Trunk
    fore: End
    hind: End
    legs: Legs = Legs()
    gravity: float = gravity_field()


# Geometry and energies

THETA, THETA_RATE = sp.symbols("theta thetadot", real=True)
M, INERTIA, H_F, H_H = sp.symbols("m I h_f h_h", real=True, positive=True)


def rigid_body(parameters: dict[str, sp.Symbol], constants: dict[sp.Symbol, sp.Expr]) -> Body:
    """A rigid body with mass ``m``, inertia ``I`` and hips ``h_f`` ahead and ``h_h`` behind.

    ``constants`` defines those four letters where they are not parameters themselves.
    """
    return Body(
        coordinates={"pitch": (THETA, THETA_RATE)},
        mirror={"pitch": "pitch"},
        parameters=parameters,
        definitions=constants,
        kinetic=M * (X_RATE**2 + Y_RATE**2) / 2 + INERTIA * THETA_RATE**2 / 2,
        gravity=M * GRAVITY * Y,
        pitches=dict.fromkeys(SIDES, (THETA, THETA_RATE)),
        hips={
            "fore": (X + H_F * cos(THETA), Y + H_F * sin(THETA)),
            "hind": (X - H_H * cos(THETA), Y - H_H * sin(THETA)),
        },
    )


@lru_cache
def _body(_features: Features) -> Body:
    parameters = {
        "body.mass": M,
        "body.inertia": INERTIA,
        "fore.hip_offset": H_F,
        **FORE.parameters,
        "hind.hip_offset": H_H,
        **HIND.parameters,
        **LEGS_PARAMETERS,
        "gravity": GRAVITY,
    }
    return rigid_body(parameters, {})


# Register

RIGID_BOUNDER = BounderKind(
    name="rigid-bounder",
    title="one rigid body on a fore and a hind leg",
    source="Kamimura et al. 2015",
    parameters=RigidBounderParameters,
    body=_body,
)
