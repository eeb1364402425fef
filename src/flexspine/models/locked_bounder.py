"""The flexible bounder with its spine locked straight: the fair rigid baseline.

The same segments and legs, so the same mass distribution; only the joint is gone. This is the
limit of an infinitely stiff spine with rest angle zero.
"""

from __future__ import annotations

from functools import lru_cache

import sympy as sp

from flexspine.models.actuation import Features
from flexspine.models.bounder import FORE, GRAVITY, HIND, Body, BounderKind, gravity_field
from flexspine.models.flexible_bounder import FORE_HALF, HIND_HALF, MU, Segment
from flexspine.models.legs import LEGS_PARAMETERS, Legs
from flexspine.models.rigid_bounder import H_F, H_H, INERTIA, M, rigid_body
from flexspine.parameters import ParameterSet

# Parameters


class LockedBounderParameters(ParameterSet):
    """Parameters of the flexible bounder without those of the spine."""

    fore: Segment
    hind: Segment
    legs: Legs = Legs()
    gravity: float = gravity_field()


# Geometry: the segments' CoMs are a_f + a_h apart, the joint is b ahead of the whole CoM


@lru_cache
def _body(_features: Features) -> Body:
    fore, hind = FORE_HALF, HIND_HALF
    ahead = sp.Symbol("b", real=True)
    constants = {
        M: fore.m + hind.m,
        MU: fore.m * hind.m / M,
        INERTIA: fore.J + hind.J + MU * (fore.a + hind.a) ** 2,
        ahead: (hind.m * hind.a - fore.m * fore.a) / M,
        H_F: fore.a + fore.h + ahead,
        H_H: hind.a + hind.h - ahead,
    }
    parameters = {
        **fore.parameters,
        **FORE.parameters,
        **hind.parameters,
        **HIND.parameters,
        **LEGS_PARAMETERS,
        "gravity": GRAVITY,
    }
    return rigid_body(parameters, constants)


# Register

LOCKED_BOUNDER = BounderKind(
    name="locked-bounder",
    title="the flexible bounder with its spine locked straight",
    source="Kamimura et al. 2015, with the joint removed",
    parameters=LockedBounderParameters,
    body=_body,
)
