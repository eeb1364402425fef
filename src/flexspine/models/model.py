"""A bounder with numbers: parameters, a start and touchdown angles."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from math import inf, pi
from typing import Any

import numpy as np

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.hybrid.bound import BoundSystem
from flexspine.hybrid.compile import Array, compile_system
from flexspine.hybrid.system import HybridSystem
from flexspine.hybrid.trajectory import HybridState
from flexspine.models.actuation import ACTUATORS, BARE, HIP_LEVER, Features
from flexspine.models.bounder import FORE, HIND, BounderKind, beneath, works
from flexspine.models.ground import Ground
from flexspine.models.legs import ANGLES, SIDES, phase_of
from flexspine.models.underfoot import OnGround, begin
from flexspine.parameters import ParameterSet, is_number, quantities, replaced, shortened, values

# Below the first, rounding exceeds the truncation; above the second, nothing said here holds.
TOLERANCES = (1e-17, 1e-3)

# An end as a word of a parameter's name.
SIDE = re.compile(rf"(?<![a-z])({'|'.join(SIDES)})(?![a-z])")

# SI; beyond this no start or angle means anything, and squares of it still fit a double.
LARGEST_START = 1e6


@dataclass(frozen=True)
class Source:
    """Where the numbers of a model, a robot or a walk come from.

    ``source`` tells it in short, ``citation`` in full; ``provenance`` tells it per dotted name
    where it differs from ``source``. ``notes`` and ``doubts`` are sentences.
    """

    title: str
    citation: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)

    def of(self, name: str) -> str:
        """Return where the value of a dotted name comes from."""
        return self.provenance.get(name, self.source)

    def attributes(self) -> dict[str, str]:
        """Return what a dataset keeps of it; lists and tables as JSON."""
        return {
            "citation": self.citation,
            "source": self.source,
            "notes": json.dumps(self.notes),
            "doubts": json.dumps(self.doubts),
            "provenance": json.dumps(dict(self.provenance)),
        }


@dataclass(frozen=True)
class Model:
    """A bounder ready to run, as `load_model` makes it. All values in SI and radians.

    ``kind`` is what it is, with its equations; ``parameters`` are its numbers, in groups. ``apex``
    is the start, by section coordinate; ``touchdown`` the angle of each leg (``fore``, ``hind``)
    from the vertical at touchdown, foot ahead of the hip positive. ``source`` tells where numbers
    come from. ``kept`` are dampers and actuators whose terms stay in the equations even where their
    numbers vanish. The apex height is above the ``ground`` at x = 0, which is flat and at height 0
    if none is given. Raises `UnknownNameError` and `ParameterError`.
    """

    name: str
    kind: BounderKind
    parameters: ParameterSet
    apex: Mapping[str, float]
    touchdown: Mapping[str, float]
    source: Source
    kept: Features = BARE
    ground: Ground | None = None

    def __post_init__(self) -> None:
        coordinates = self.system.section.coordinates
        _check_numbers("apex coordinate", self.apex, coordinates)
        _check_numbers("touchdown angle", self.touchdown, SIDES)
        for side, angle in self.touchdown.items():
            if not abs(angle) < pi / 2:
                raise ParameterError(
                    f"touchdown angle '{side}' = {angle:g} rad is beyond the horizontal",
                    "give an angle from the vertical between -1.57 and 1.57 rad",
                )
        # Plain floats, whatever kind of number was given.
        for name in ("apex", "touchdown"):
            plain = {key: float(value) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, plain)

    def __repr__(self) -> str:
        where = "" if self.ground is None else f" on {self.ground.name}"
        return f"<Model {self.name}: {self.kind.name}{where}>"

    def __getstate__(self) -> dict[str, Any]:
        """What goes to another process: the fields, not what was made of them."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def with_values(
        self,
        parameters: Mapping[str, Any] | None = None,
        *,
        apex: Mapping[str, float] | None = None,
        touchdown: Mapping[str, float] | None = None,
        origin: str = "set by user",
    ) -> Model:
        """Return the same model with some values changed, parameters by dotted name.

        ``apex`` is by section coordinate, ``touchdown`` by leg; what is not named stays. ``origin``
        tells where they come from. Raises `UnknownNameError` and `ParameterError`.
        """
        changed = dict(parameters or {})
        names = [*changed, *(["apex"] if apex else []), *(["touchdown"] if touchdown else [])]
        source = replace(
            self.source,
            provenance={**self.source.provenance, **dict.fromkeys(names, origin)},
        )
        return replace(
            self,
            parameters=replaced(self.parameters, changed) if changed else self.parameters,
            apex={**self.apex, **(apex or {})},
            touchdown={**self.touchdown, **(touchdown or {})},
            source=source,
        )

    def renamed(self, name: str, source: Source) -> Model:
        """Return the same numbers under another name and origin."""
        return replace(self, name=name, source=source)

    def record(self) -> dict[str, Any]:
        """Return all that decides what it does on flat ground, as JSON holds it."""
        return {
            "model": self.kind.name,
            "parameters": values(self.parameters),
            "apex": dict(self.apex),
            "touchdown": dict(self.touchdown),
        }

    @cached_property
    def system(self) -> HybridSystem:
        """The hybrid system behind the model."""
        return self.kind.system(self.features)

    @cached_property
    def features(self) -> Features:
        """The dampers and actuators that its equations know."""
        uneven = Features(uneven=self.ground is not None)
        return Features.of(values(self.parameters)) | self.kept | uneven

    def keeping(self, names: Iterable[str]) -> Model:
        """Return the same model, its equations ready for these parameters to be other than zero."""
        return replace(self, kept=self.kept | Features.of(dict.fromkeys(names, 1.0)))

    def on(self, ground: Ground | None) -> Model:
        """Return the same model on other ground; None is flat. Raises `ParameterError`."""
        if not (ground is None or isinstance(ground, Ground)):
            raise ParameterError(
                f"{shortened(ground)} is no ground", "make one, such as Ground.rough(0.01)"
            )
        return replace(self, ground=ground)

    def on_flat_ground(self, what: str) -> None:
        """Raise `ParameterError` where ``what`` is asked for on ground that is not flat."""
        if self.ground is not None:
            raise ParameterError(
                f"{what} on {self.ground.name} cannot be had, only on flat ground",
                "leave the ground away",
            )

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order, such as ``com_x`` and ``fore_pitch_rate``."""
        coordinates = ("com_x", "com_y", *self.kind.body(BARE).coordinates)
        rates = (f"{name}_rate" for name in coordinates)
        return (*coordinates, *rates, "dissipated_energy", *works(self.features))

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Dotted names of ``system.parameters``, in order; the touchdown angles come last."""
        return (*self.kind.body(BARE).parameters, *ANGLES)

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Every value by name: apex coordinates, touchdown angles and parameters."""
        angles = {f"touchdown.{side}": angle for side, angle in self.touchdown.items()}
        return {**self.apex, **angles, **values(self.parameters)}

    @cached_property
    def may_vanish(self) -> frozenset[str]:
        """Parameters that animals can do without: of actuators and dampers, rest angles."""
        known = quantities(type(self.parameters))
        return frozenset(
            each.name for each in known if each.lower < 0 or each.name.endswith(".damping")
        )

    @cached_property
    def alike(self) -> bool:
        """Whether the fore and the hind end have the same parameters.

        Those are told by ``fore`` and ``hind`` as words of their names, wherever they stand.
        """
        ends: dict[str, dict[str, float]] = {side: {} for side in SIDES}
        for name, value in values(self.parameters).items():
            side = SIDE.search(name)
            if side:
                ends[side[0]][SIDE.sub("", name, count=1)] = value
        fore, hind = ends.values()
        return fore == hind

    @cached_property
    def mass(self) -> float:
        """Mass of the whole body, in kg."""
        given = values(self.parameters)
        if "body.mass" in given:
            return given["body.mass"]
        return sum(given[f"{side}.mass"] for side in SIDES)

    @cached_property
    def scales(self) -> dict[str, float]:
        """Natural scales: of section coordinates, touchdown angles, actuators, energy, mean speed.

        Built from weight, leg length and gravity, so that figures in them know no units.
        """
        given = values(self.parameters)
        gravity = given["gravity"]
        length = sum(given[f"{side}.leg.rest_length"] for side in SIDES) / 2
        speed, rate = (gravity * length) ** 0.5, (gravity / length) ** 0.5
        scales = {"height": length, "speed": speed, "mean_speed": speed, "period": 1 / rate}
        scales["energy"] = self.mass * gravity * length
        for name in self.system.section.coordinates:
            scales.setdefault(name, rate if name.endswith("_rate") else 1.0)
        scales |= dict.fromkeys(ANGLES, 1.0)
        return scales | {
            name: length if name.endswith((".extension", f".{HIP_LEVER}")) else 1.0
            for name in ACTUATORS
        }

    def unit_of(self, name: str) -> float:
        """The natural unit of a quantity or a parameter: its scale, or its size where it has none.

        One for what has neither.
        """
        return self.scales.get(name) or abs(self.numbers[name]) or 1.0

    @cached_property
    def parameter_vector(self) -> Array:
        """Parameters and touchdown angles in the order of ``system.parameters``."""
        given = values(self.parameters)
        needed = self.kind.body(BARE).parameters
        for name in needed.keys() - given.keys():
            raise UnknownNameError(f"parameter of the body of a {self.kind.name}", name, given)
        return np.array([*(given[name] for name in needed), *(self.touchdown[s] for s in SIDES)])

    def bind(self, tolerance: float) -> BoundSystem:
        """Compile the system for a tolerance and give it this model's numbers.

        Raises `ParameterError` for a tolerance that is not usable.
        """
        tolerance = check_between("tolerance", tolerance, *TOLERANCES)
        compiled = compile_system(self.system, tolerance)
        if self.ground is None:
            return BoundSystem(compiled, self.parameter_vector)
        return OnGround(compiled, self.parameter_vector, self.ground)

    def apex_state(self) -> HybridState:
        """Return the start in flight, at the apex."""
        name_of = dict(zip(self.system.states, self.state_names, strict=True))
        section = self.system.section.coordinates
        start = {name_of[symbol]: self.apex[c] for c, symbol in section.items()}
        if self.ground is not None:
            start["com_y"] += self.ground.height(0.0)
        return self.state(start)

    def state(
        self, start: Mapping[str, float], toes: Mapping[str, float] | None = None
    ) -> HybridState:
        """Return any state, by state name; absent ones are zero.

        ``toes`` are the places x in m of those on the ground, by leg. Raises `UnknownNameError` and
        `ParameterError`.
        """
        toes = toes or {}
        _check_numbers("state", {**dict.fromkeys(self.state_names, 0.0), **start}, self.state_names)
        _check_numbers("toe", {**dict.fromkeys(SIDES, 0.0), **toes}, SIDES)
        states = np.array([float(start.get(name, 0.0)) for name in self.state_names])
        held = np.zeros(len(self.system.held))
        for leg in (FORE, HIND):
            held[self.system.places[leg.toe]] = toes.get(leg.side, states[0])
            held[self.system.places[leg.stanced]] = leg.side in toes
            if self.ground is not None:
                held[self.system.places[leg.toe_height]] = self.ground.height(
                    held[self.system.places[leg.toe]]
                )
        if self.ground is not None:
            points = beneath(self.kind.body(BARE))
            begin(self.ground, held, self.system.places, float(states[0]), points)
        return HybridState(0.0, phase_of(toes), states, held)


def _check_numbers(kind: str, given: Mapping[str, Any], known: Collection[str]) -> None:
    for name, value in given.items():
        if name not in known:
            raise UnknownNameError(kind, name, known)
        # Comparisons with NaN are false.
        if not (is_number(value) and -LARGEST_START <= value <= LARGEST_START):
            raise ParameterError(
                f"{kind} '{name}' = {shortened(value)} is not usable",
                f"give a number in SI units or radians, no larger than {LARGEST_START:g}",
            )
    for name in known:
        if name not in given:
            raise ParameterError(f"{kind} '{name}' has no value", f"give it, e.g. {name}=...")


def check_between(name: str, value: float, low: float, high: float) -> float:
    """Return a number with low < value < high. Raises `ParameterError` for anything else."""
    if not (is_number(value) and low < value < high):
        between = f"above {low:g}" + (f" and below {high:g}" if high < inf else "")
        raise ParameterError(
            f"{name} = {shortened(value)} is not usable", f"give a number {between}"
        )
    return float(value)
