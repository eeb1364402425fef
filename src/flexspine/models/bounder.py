"""A bounding quadruped in the sagittal plane: any body, carried by a fore and a hind leg.

Phases: DF (both legs in flight), FS (fore stance), HS (hind stance), DS (both in stance). Every
order of them can occur. The section is the apex: CoM highest, in flight, after both legs have
had a stance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import sympy as sp

from flexspine.hybrid.outcome import OutcomeKind
from flexspine.hybrid.system import Arming, Guard, HybridSystem, Mode, Reversal, Section
from flexspine.mechanics.lagrangian import Definitions, Lagrangian
from flexspine.models.actuation import SPINE_WORK, Features, SwitchedSpine
from flexspine.models.legs import (
    PHASES,
    SIDES,
    STANCE_PHASES,
    LegSymbols,
    StanceLeg,
    SwingLeg,
    hip_velocity,
    phase_of,
)
from flexspine.models.underfoot import TOES, WAVE_NUMBER, WAVES_FROM, Underfoot, clearance
from flexspine.parameters import ParameterSet, quantity

FELL = OutcomeKind(
    "fell",
    "start from a gait or choose other touchdown angles; most passive gaits are unstable",
)
NO_APEX = OutcomeKind(
    "no_apex",
    "the animal stays on the ground, or flies for very long; change the energy of the start or "
    "the touchdown angles",
)

X, Y, X_RATE, Y_RATE, DISSIPATED, GRAVITY = sp.symbols("x y xdot ydot E_d g", real=True)
FORE, HIND = LegSymbols.of("fore"), LegSymbols.of("hind")
STOOD = FORE.stanced, HIND.stanced

# The CoM passes the middle between the toes while both legs stand.
MIDSTANCE = "mid-stance"

# No orbit is half done after both stances; this keeps its balance from vanishing.
UNBALANCED = 10


def gravity_field() -> Any:
    """The parameter that every model has."""
    return quantity("m/s^2", "gravitational acceleration", above=0, upper=100, default=9.81)


@dataclass(frozen=True, eq=False)
class Body:
    """What carries the hips: everything about a model but its legs.

    ``coordinates`` maps public names of the angles to (angle, rate), in rad and rad/s;
    ``parameters`` maps dotted names to letters; hips and ``low_points`` are in the inertial
    frame, the latter being what must stay above the ground besides hips and CoM. ``pitches`` are
    angle and rate of what carries each hip. ``power_lost`` is what the spine's damper takes, in W.
    Where fore and hind ends are alike, looking at the body from its other side turns each angle
    into minus that in ``mirror``.
    """

    coordinates: Mapping[str, tuple[sp.Symbol, sp.Symbol]]
    mirror: Mapping[str, str]
    parameters: Mapping[str, sp.Symbol]
    definitions: Definitions
    kinetic: sp.Expr
    gravity: sp.Expr
    hips: Mapping[str, tuple[sp.Expr, sp.Expr]]
    pitches: Mapping[str, tuple[sp.Symbol, sp.Symbol]]
    spine: sp.Expr = sp.S.Zero
    switched: SwitchedSpine | None = None
    power_lost: sp.Expr = sp.S.Zero
    low_points: Mapping[str, tuple[sp.Expr, sp.Expr]] = field(default_factory=dict)
    observables: Mapping[str, sp.Expr] = field(default_factory=dict)


HIP = {side: sp.symbols(f"X_{side[0]} Y_{side[0]}", real=True) for side in SIDES}


@dataclass(frozen=True)
class BounderKind:
    """A kind of bounder: its parameter class and how its body follows from the parameters.

    ``body`` takes which dampers and actuators there are, to leave out the terms of all others.
    """

    name: str
    title: str
    source: str
    parameters: type[ParameterSet]
    body: Callable[[Features], Body]

    def system(self, features: Features) -> HybridSystem:
        """The hybrid system of all models with these features."""
        return bounder_system(self.name, self.body(features), features)


def lagrangian(body: Body, phase: str = "DF", stance: tuple[StanceLeg, ...] = ()) -> Lagrangian:
    """The body's mechanics with the given legs on the ground."""
    angles = body.coordinates.values()
    definitions = body.switched.definitions(phase, STOOD) if body.switched else {}
    definitions |= body.definitions
    for side, (x, y) in body.hips.items():
        definitions |= dict(zip(HIP[side], (x, y), strict=True))
    for leg in stance:
        definitions |= leg.definitions
    return Lagrangian(
        coordinates=(X, Y, *(angle for angle, _ in angles)),
        rates=(X_RATE, Y_RATE, *(rate for _, rate in angles)),
        kinetic=body.kinetic,
        potential=body.gravity + body.spine,
        dissipation=body.power_lost / 2,
        forces=tuple(force for leg in stance for force in leg.applied),
        definitions=definitions,
    )


def stance_legs(body: Body, phase: str, features: Features) -> tuple[StanceLeg, ...]:
    """The legs that stand in a phase."""
    bare = lagrangian(body)
    return tuple(
        StanceLeg(
            leg,
            HIP[leg.side],
            hip_velocity(bare, HIP[leg.side]),
            body.pitches[leg.side],
            features,
        )
        for leg in (FORE, HIND)
        if phase in STANCE_PHASES[leg.side]
    )


@lru_cache(maxsize=32)
def bounder_system(name: str, body: Body, features: Features) -> HybridSystem:
    """Assemble the hybrid system of a body on two legs.

    What belongs to ``features`` that it does not have is taken to be zero, which spares its terms.
    """
    angles = body.coordinates.values()
    states = (
        X, Y, *(a for a, _ in angles), X_RATE, Y_RATE, *(r for _, r in angles), DISSIPATED,
        *works(features).values(),
    )  # fmt: skip
    built: dict[str, Mode] = {}

    def mode(phase: str) -> Mode:
        if phase not in built:
            built[phase] = _mode(body, phase, features)
        return built[phase]

    held = [FORE.toe, HIND.toe, FORE.stanced, HIND.stanced, FORE.left, HIND.left]
    if features.thrust:
        held += [FORE.pushes, HIND.pushes]
    if features.uneven:
        held += [FORE.toe_height, HIND.toe_height, WAVES_FROM, WAVE_NUMBER]
        held += [symbol for below in beneath(body) for symbol in below.held]
    return HybridSystem(
        name=name,
        states=states,
        held=tuple(held),
        parameters=(*body.parameters.values(), FORE.gamma, HIND.gamma),
        modes=PHASES,
        mode=mode,
        section=Section(
            guards=("apex",),
            requires={FORE.stanced: 1.0, HIND.stanced: 1.0},
            resets={FORE.stanced: 0.0, HIND.stanced: 0.0},
            coordinates={
                "height": Y,
                **{n: a for n, (a, _) in body.coordinates.items()},
                "speed": X_RATE,
                **{f"{n}_rate": r for n, (_, r) in body.coordinates.items()},
            },
            missed=NO_APEX,
            mode="DF",
            quantities={"energy": body.kinetic + body.gravity + body.spine},
            conserved=("energy",) if features.conservative else (),
        ),
        reversal=_reversal(body) if features.reversible else None,
        tracked=tuple(f"{side}_grf" for side in SIDES),
    )


def _reversal(body: Body) -> Reversal:
    """Running backwards and looking from the other side, which swaps the legs.

    Half a stride after a symmetric apex there is another, after the stance of one leg only, which
    left the ground at minus the angle at which the other one touches down; or, with both legs on
    the ground, a lowest or highest point midway between the toes.
    """
    pairs = [
        (name, other)
        for i, (name, other) in enumerate(body.mirror.items())
        if other in list(body.mirror)[i:]
    ]
    coordinates: dict[str, dict[sp.Symbol, int]] = {"height": {Y: 1}}
    shape: dict[str, sp.Expr] = {}
    rates: dict[str, dict[sp.Symbol, int]] = {}
    for name, other in pairs:
        (angle, rate), (mirrored, mirrored_rate) = body.coordinates[name], body.coordinates[other]
        shape[name] = angle + mirrored
        rates[f"{name}_rate"] = {rate: 1}
        if name != other:
            coordinates[name] = {angle: 1, mirrored: -1}
            shape[f"{name}_rate"] = rate - mirrored_rate
            rates[f"{name}_rate"] |= {mirrored_rate: 1}
    in_flight = FORE.stanced * (FORE.left + HIND.gamma) + HIND.stanced * (HIND.left + FORE.gamma)
    in_flight += UNBALANCED * FORE.stanced * HIND.stanced
    return Reversal(
        coordinates={**coordinates, "speed": {X_RATE: 1}, **rates},
        middle=Section(
            guards=("apex", MIDSTANCE), requires={}, resets={}, coordinates={}, missed=NO_APEX
        ),
        balance={
            "DF": {**shape, "touchdown.fore": in_flight},
            "DS": {**shape, "speed": Y_RATE},
        },
    )


def works(features: Features) -> dict[str, sp.Symbol]:
    """What actuators do, by public name, in J."""
    found: dict[str, sp.Symbol] = {}
    if features.thrust:
        found |= {f"{leg.side}_leg_work": leg.thrust_work for leg in (FORE, HIND)}
    if features.hips:
        found |= {f"{leg.side}_hip_work": leg.hip_work for leg in (FORE, HIND)}
    if features.switched:
        found["spine_work"] = SPINE_WORK
    return found


def beneath(body: Body) -> list[Underfoot]:
    """What may meet ground that is not flat: toes and points of the body."""
    return [*TOES.values(), *(Underfoot.of(name) for name in _low(body))]


def _low(body: Body) -> dict[str, tuple[sp.Expr, sp.Expr]]:
    """Points of the body that end the run on the ground."""
    hips = {f"{side} hip": HIP[side] for side in HIP}
    return {**hips, **body.low_points, "CoM": (X, Y)}


def _mode(body: Body, phase: str, features: Features) -> Mode:
    stance = stance_legs(body, phase, features)
    standing = {leg.leg.side for leg in stance}
    swing = [
        SwingLeg(leg, HIP[leg.side], features) for leg in (FORE, HIND) if leg.side not in standing
    ]
    mechanics = lagrangian(body, phase, stance)
    solving, accelerations = mechanics.accelerations()
    rates = dict(zip(mechanics.coordinates, mechanics.rates, strict=True))
    rates |= dict(zip(mechanics.rates, accelerations, strict=True))
    rates[DISSIPATED] = body.power_lost + sp.Add(*(leg.power_lost for leg in stance))
    rates |= dict.fromkeys(works(features).values(), sp.S.Zero)
    if features.hips:
        rates |= {leg.leg.hip_work: leg.hip_power for leg in stance}
    guards = [leg.touchdown(phase_of(standing | {leg.leg.side})) for leg in swing]
    guards += [leg.liftoff(phase_of(standing - {leg.leg.side}), DISSIPATED) for leg in stance]
    if body.switched:
        guards = [_switching(body.switched, body.spine, guard) for guard in guards]
    if features.thrust:
        guards += [leg.thrust() for leg in stance]
    if not stance:
        guards.append(Guard("apex", Y_RATE))
    if len(stance) == len(SIDES):
        guards.append(Guard(MIDSTANCE, FORE.toe + HIND.toe - 2 * X))
    guards += _falls(body, features)
    guards += [guard for leg in swing for guard in leg.looking()]
    observables = _observables(body, (*stance, *swing))
    observables["leg_energy"] = sp.Add(*(leg.energy for leg in stance))
    return Mode(phase, {**mechanics.definitions, **solving}, rates, tuple(guards), observables)


def _falls(body: Body, features: Features) -> list[Guard]:
    """A point of the body comes to the ground."""
    if features.uneven:
        return [
            guard
            for name, (x, y) in _low(body).items()
            for below in [Underfoot.of(name)]
            for guard in (clearance(below, x, y, FELL), *below.edges(x))
        ]
    # On flat ground the CoM, between all others, is never the first to touch it.
    lows = {name: y for name, (_, y) in _low(body).items() if name != "CoM"}
    return [
        Guard(f"{what} on the ground", height, arming=Arming.LEVEL, ends=FELL)
        for what, height in lows.items()
    ]


def _switching(spine: SwitchedSpine, energy: sp.Expr, guard: Guard) -> Guard:
    """A change of phase with the work that the spine's spring takes to change."""
    assert guard.target is not None
    fore, hind = (guard.resets.get(flag, flag) for flag in STOOD)
    work = spine.energy(guard.target, (fore, hind)) - energy
    return replace(guard, resets={**guard.resets, SPINE_WORK: SPINE_WORK + work})


def _observables(body: Body, legs: tuple[StanceLeg | SwingLeg, ...]) -> dict[str, sp.Expr]:
    table: dict[str, sp.Expr] = {}
    for leg in legs:
        side = leg.leg.side
        table |= leg.observables()
        table |= {f"{side}_hip_x": HIP[side][0], f"{side}_hip_y": HIP[side][1]}
    return table | {
        **body.observables,
        "kinetic_energy": body.kinetic,
        "gravity_energy": body.gravity,
        "spine_energy": body.spine,
    }
