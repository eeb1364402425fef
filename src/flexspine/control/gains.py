"""How a robot in space steps and how firmly its joints follow: numbers kept as TOML files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from flexspine.control.cpg import RHYTHMS, Rhythm, rhythm
from flexspine.control.leg_pairs import hip_pairs
from flexspine.errors import InputError, PresetError, UnknownNameError
from flexspine.models.leg_geometry import Leg
from flexspine.models.model import Source
from flexspine.models.toml_files import is_path, read_file, read_shipped, shipped_names
from flexspine.parameters import ParameterSet, build, flattened, quantity, replaced

FOLDER = "walks"

ENTRIES = ("rhythm", "title", "source", "notes", "gait", "servo")


class GaitNumbers(ParameterSet):
    """How feet move; see `Rhythm`."""

    speed: float = quantity("m/s", "of feet that stand, under the hips", at_least=-5, upper=5)
    frequency: float = quantity("Hz", "of strides", above=0, upper=20)
    duty: float = quantity("1", "share of its stride that a leg stands", at_least=0.05, upper=0.95)
    height: float = quantity("m", "of the hips over feet that stand", above=0, upper=10)
    clearance: float = quantity("m", "how high feet are lifted", at_least=0, upper=1)
    lag: float = quantity(
        "1", "share of a stride by which the second pair is behind", at_least=0, upper=1,
        default=0.5,
    )  # fmt: skip
    hind_ahead: float = quantity(
        "m", "of hind feet ahead of their hips", at_least=-1, upper=1, default=0.0
    )
    fore_ahead: float = quantity(
        "m", "of fore feet ahead of their hips", at_least=-1, upper=1, default=0.0
    )
    coupling: float = quantity(
        "1/s", "how fast phases get into step", at_least=0, upper=1e3, default=5.0
    )
    readiness: float = quantity(
        "1/s", "how fast steps grow from standing", above=0, upper=1e3, default=4.0
    )


class ServoNumbers(ParameterSet):
    """Springs and dampers that draw joints after their references."""

    stiffness: float = quantity("N m/rad", "of hips and knees", at_least=0, upper=1e5)
    damping: float = quantity("N m s/rad", "of hips and knees", at_least=0, upper=1e3)
    out_stiffness: float = quantity(
        "N m/rad", "of abduction, which is drawn to zero", at_least=0, upper=1e5
    )
    out_damping: float = quantity("N m s/rad", "of abduction", at_least=0, upper=1e3)
    limit: float = quantity("N m", "largest torque of a motor", above=0, upper=1e4, default=1e3)
    rate: float = quantity(
        "Hz", "how often torques are chosen", at_least=10, upper=4e3, default=400.0
    )


class Gains(ParameterSet):
    """All of them, by dotted names such as ``gait.frequency`` and ``servo.stiffness``."""

    gait: GaitNumbers
    servo: ServoNumbers


@dataclass(frozen=True)
class Walk:
    """A way to walk in space, with its numbers.

    ``rhythm`` is ``trot`` or ``bound``; ``gains`` are its numbers and those of the servos, by
    dotted name such as ``gait.frequency``. ``source`` tells where they come from.
    """

    name: str
    rhythm: str
    gains: Gains
    source: Source = field(default_factory=lambda: Source(title=""))

    def with_values(self, changes: Mapping[str, Any]) -> Walk:
        """Return the same with some numbers changed, by dotted name, SI.

        Raises `UnknownNameError` and `ParameterError`.
        """
        provenance = {**self.source.provenance, **dict.fromkeys(changes, "set by user")}
        source = replace(self.source, provenance=provenance)
        return Walk(self.name, self.rhythm, replaced(self.gains, changes), source)

    def pattern(self, legs: Mapping[str, Leg]) -> Rhythm:
        """Return its rhythm on these legs, by name.

        Raises `ParameterError` unless two are at each of two hips.
        """
        gait = self.gains.gait
        hind, _ = hip_pairs(legs)
        return replace(
            rhythm(self.rhythm, legs, gait.lag),
            frequency=gait.frequency,
            duty=gait.duty,
            stride=gait.speed * gait.duty / gait.frequency,
            height=gait.height,
            clearance=gait.clearance,
            coupling=gait.coupling,
            readiness=gait.readiness,
            ahead={leg: gait.hind_ahead if leg in hind else gait.fore_ahead for leg in legs},
        )


def walk_names(robot: str) -> list[str]:
    """Return the names of the walks of a robot that come with flexspine, such as ``trot``.

    ``robot`` is the name of one.
    """
    own = f"{robot}-"
    return [name.removeprefix(own) for name in shipped_names(FOLDER) if name.startswith(own)]


def load_walk(walk: str | Path, robot: str) -> Walk:
    """Load a walk of a robot by name, one of another by its full name, or from a TOML file.

    ``robot`` is the name of one; a full name is such as ``sc618-trot``. Raises `UnknownNameError`
    and `PresetError`.
    """
    name = str(walk)
    if is_path(name) and name not in (*walk_names(robot), *shipped_names(FOLDER)):
        content, name = read_file(name), Path(name).stem
    else:
        content = read_shipped(_full_name(name, robot), FOLDER)
    try:
        return _walk(name, content)
    except InputError as failure:
        raise PresetError(f"gait '{walk}': {failure.message}", failure.remedy) from None


def _full_name(name: str, robot: str) -> str:
    """What a walk that comes along is called: one of this robot, or of any by its full name."""
    shipped, known = shipped_names(FOLDER), walk_names(robot)
    if name in known:
        return f"{robot}-{name}"
    if name in shipped:
        return name
    if known:
        raise UnknownNameError("gait", name, known)
    raise PresetError(
        f"robot '{robot}' has no gait '{name}' of its own",
        f"give that of another robot ({', '.join(shipped)}) or a TOML file, such as "
        "'flexspine tune --out' writes",
    )


def _walk(name: str, content: Mapping[str, Any]) -> Walk:
    for entry in content:
        if entry not in ENTRIES:
            raise UnknownNameError("entry", entry, ENTRIES)
    rhythm = content.get("rhythm")
    if rhythm not in RHYTHMS:
        raise InputError(f"rhythm = {rhythm!r} is none", f"write one of {', '.join(RHYTHMS)}")
    numbers = {part: content.get(part, {}) for part in ("gait", "servo")}
    for part, table in numbers.items():
        if not isinstance(table, Mapping):
            raise InputError(f"'{part}' is not a table", f"write [{part}]")
    return Walk(
        name,
        rhythm,
        build(Gains, flattened(numbers)),
        Source(
            title=str(content.get("title", name)),
            source=str(content.get("source", "")),
            notes=tuple(map(str, content.get("notes", ()))),
        ),
    )
