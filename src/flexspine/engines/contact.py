"""How feet meet the ground in MuJoCo: which law, and its constants.

MuJoCo chooses contact forces ``f`` by ``R f + a = -b v - k r``, where ``r`` is the distance from
the ground (negative within it), ``v`` and ``a`` are its first two derivatives, ``a`` with the
force in it, and ``R = (1 - d) / d A`` follows from the impedance ``d`` and ``A``, MuJoCo's estimate
of the inverse mass of a foot. With ``k = K R`` and ``b = C R`` that is
``f = -K r - C v - a / R``: a spring ``K``, a damper ``C``, and a mass ``1 / R`` that the foot drags
along while it touches. Forces never pull, and friction is Coulomb's (elliptic cones): across the
normal the law is ``R_t f_t + a_t = -b_t v_t`` within the cone, a foot that sticks creeps by
``R_t / b_t`` a newton.
"""

from __future__ import annotations

from dataclasses import dataclass

from flexspine.models.robot import SpaceNumbers

# d; so little keeps the mass that is dragged along far below that of a foot.
IMPEDANCE = 0.02

# R / R_t; so large that feet that stick creep by micrometres a second for each newton.
TANGENTIAL = 1e5

# b_t in 1/s; a foot that sticks comes to rest within some milliseconds.
FRICTION_RATE = 500.0


@dataclass(frozen=True)
class ContactLaw:
    """The law of one foot: ``stiffness`` (N/m), ``damping`` (N s/m), ``dragged`` mass (kg).

    ``creep`` is the speed at which a foot that sticks slips for each newton, in m/(N s).
    """

    stiffness: float
    damping: float
    dragged: float
    creep: float

    @classmethod
    def of(cls, ground: SpaceNumbers, inverse_mass: float) -> ContactLaw:
        """The law of a foot that MuJoCo gives an inverse mass (1/kg)."""
        regular = (1 - IMPEDANCE) / IMPEDANCE * inverse_mass
        return cls(
            ground.ground_stiffness,
            ground.ground_damping,
            1 / regular,
            regular / TANGENTIAL / FRICTION_RATE,
        )

    @property
    def solref(self) -> list[float]:
        """MuJoCo's numbers: ``-k d`` and ``-b d``."""
        return [
            -self.stiffness / self.dragged * IMPEDANCE,
            -self.damping / self.dragged * IMPEDANCE,
        ]

    @property
    def solreffriction(self) -> list[float]:
        """The same across the normal, where there is no spring."""
        return [0.0, -FRICTION_RATE * IMPEDANCE]
