"""What a bounder has besides springs: dampers, and actuators that put energy into it.

Three small laws, each with its work counted in a state of its own (J):

- *Thrust.* From its greatest compression to its lift-off a leg is stiffer,
  ``k (1 + stiffening)``, or longer, ``l0 + extension``. Its work is the jump of the energy of its
  spring.
- *Hip torque.* A leg that stands is turned backward by ``hip_lever`` times its force, so that the
  torque sets in and ends with the force. Seen from the hip, the ground reaction force passes that
  far ahead of it.
- *Spine by phase.* Stiffness and rest angle of the spine are shifted in each phase of the stride.
  Its work is by how much the energy of the spine's spring jumps from phase to phase.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import partial
from typing import Any

import sympy as sp

from flexspine.parameters import ParameterSet, quantity

# The phases of a stride, as far as an actuator may tell them apart. Flights before the first stance
# and after the second are one, so that the apex between them changes nothing.
STRIDE_PHASES = ("flight", "fore", "between", "hind", "both")


_stiffer = partial(quantity, "1", at_least=-0.99, upper=1e3, default=0.0)
_bent = partial(quantity, "rad", at_least=-3, upper=3, default=0.0)


class StiffnessShift(ParameterSet):
    """By what share of itself the spine's stiffness is changed in a phase."""

    flight: float = _stiffer("relative change of k_t in the flight around the apex")
    fore: float = _stiffer("relative change of k_t while only the fore leg stands")
    between: float = _stiffer("relative change of k_t in the flight between the stances")
    hind: float = _stiffer("relative change of k_t while only the hind leg stands")
    both: float = _stiffer("relative change of k_t while both legs stand")


class RestShift(ParameterSet):
    """By how much the spine's rest angle is changed in a phase."""

    flight: float = _bent("change of the spine's rest angle in the flight around the apex")
    fore: float = _bent("change of the spine's rest angle while only the fore leg stands")
    between: float = _bent("change of the spine's rest angle in the flight between the stances")
    hind: float = _bent("change of the spine's rest angle while only the hind leg stands")
    both: float = _bent("change of the spine's rest angle while both legs stand")


STIFFNESS_SHIFTS = {p: sp.Symbol(f"kappa_{p}", real=True) for p in STRIDE_PHASES}
REST_SHIFTS = {p: sp.Symbol(f"rho_{p}", real=True) for p in STRIDE_PHASES}

# By dotted parameter name.
SPINE_SHIFTS: dict[str, sp.Symbol] = {
    **{f"spine.stiffness_shift.{phase}": symbol for phase, symbol in STIFFNESS_SHIFTS.items()},
    **{f"spine.rest_shift.{phase}": symbol for phase, symbol in REST_SHIFTS.items()},
}

# Of a leg, or of all legs.
THRUSTS, HIP_LEVER = ("stiffening", "extension"), "hip_lever"


def stiffening() -> Any:
    """Declare by what share of itself a leg's stiffness grows."""
    about = "relative gain in leg stiffness from greatest compression to lift-off"
    return quantity("1", about, above=-1, upper=1e3, default=0.0)


def extension() -> Any:
    """Declare by how much a leg gets longer."""
    about = "gain in leg length from greatest compression to lift-off"
    return quantity("m", about, at_least=-10, upper=10, default=0.0)


def hip_lever() -> Any:
    """Declare how large a hip's torque is for its leg's force."""
    about = "torque that turns legs in stance backward, per leg force"
    return quantity("m", about, at_least=-10, upper=10, default=0.0)


SPINE_WORK = sp.Symbol("W_s", real=True)


@dataclass(frozen=True)
class Features:
    """Which dampers and actuators there are; the terms of those that are not are left out.

    ``switched``: the spine changes with the phase; ``uneven``: the ground is not flat.
    """

    damped_legs: bool = False
    damped_spine: bool = False
    thrust: bool = False
    hips: bool = False
    switched: bool = False
    uneven: bool = False

    @classmethod
    def of(cls, given: Mapping[str, float]) -> Features:
        """What parameters by dotted name, or rather those that do not vanish, ask for."""

        def any_of(*endings: str) -> bool:
            return any(value != 0 for name, value in given.items() if name.endswith(endings))

        return cls(
            damped_legs=any_of(".leg.damping"),
            damped_spine=any_of("spine.damping"),
            thrust=any_of(*(f".{name}" for name in THRUSTS)),
            hips=any_of(f".{HIP_LEVER}"),
            switched=any(given.get(name, 0.0) != 0 for name in SPINE_SHIFTS),
        )

    def __or__(self, other: Features) -> Features:
        both = zip(astuple(self), astuple(other), strict=True)
        return Features(*(mine or theirs for mine, theirs in both))

    @property
    def damped(self) -> bool:
        """Whether energy is lost in dampers."""
        return self.damped_legs or self.damped_spine

    @property
    def reversible(self) -> bool:
        """Whether a film of it, shown backwards, shows nothing impossible."""
        return not (self.damped or self.thrust or self.hips or self.uneven)

    @property
    def conservative(self) -> bool:
        """Whether energy stays what it is."""
        return self.reversible and not self.switched


BARE = Features()
DAMPED = Features(damped_legs=True, damped_spine=True)

# Parameters of actuators, by dotted name.
ACTUATORS = (
    *(f"{of}.{name}" for of in ("legs", "fore.leg", "hind.leg") for name in (*THRUSTS, HIP_LEVER)),
    *SPINE_SHIFTS,
)


# Which legs have stood since the apex, fore and hind: 1 or 0.
Stood = tuple[sp.Expr, sp.Expr]

_STANCES = {"FS": "fore", "HS": "hind", "DS": "both"}

STIFFNESS_NOW, REST_NOW = sp.symbols("k_now rho_now", real=True)


@dataclass(frozen=True)
class SwitchedSpine:
    """A spring whose stiffness and rest angle depend on the contact phase (DF, FS, HS, DS).

    ``bend`` is its angle, ``stiffness`` and ``rest`` are what the shifts of phases go out from.
    """

    bend: sp.Expr
    stiffness: sp.Symbol
    rest: sp.Symbol

    def definitions(self, mode: str, stood: Stood) -> dict[sp.Symbol, sp.Expr]:
        """Stiffness and rest angle in a phase."""
        return {
            STIFFNESS_NOW: self.stiffness * (1 + _shift(STIFFNESS_SHIFTS, mode, stood)),
            REST_NOW: self.rest + _shift(REST_SHIFTS, mode, stood),
        }

    def energy(self, mode: str, stood: Stood) -> sp.Expr:
        """Elastic energy in a phase, in J."""
        now = self.definitions(mode, stood)
        return now[STIFFNESS_NOW] * (self.bend - now[REST_NOW]) ** 2 / 2


def _shift(shifts: Mapping[str, sp.Symbol], mode: str, stood: Stood) -> sp.Expr:
    if mode in _STANCES:
        return shifts[_STANCES[mode]]
    one_of_two = (stood[0] - stood[1]) ** 2
    return shifts["flight"] * (1 - one_of_two) + shifts["between"] * one_of_two
