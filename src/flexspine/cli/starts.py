"""The gait that a verb starts from: of a file, of a preset, or found with changed parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flexspine.cli.bound import refuse_besides_gait
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import DEFAULT_PRESET, assignments
from flexspine.cli.output import Steps, steps
from flexspine.errors import FlexspineError, InputError, ParameterError

if TYPE_CHECKING:
    from flexspine.gaits.gait import Gait


def own_gait(preset: str, remedy: str) -> Gait:
    """The gait that a preset starts in. Raises `ParameterError` if it starts in none."""
    from flexspine.gaits.gait import examine
    from flexspine.models.presets import load_model

    own = examine(load_model(preset))
    if own.flaw is not None:
        raise ParameterError(f"the start of '{preset}' is no gait: {own.flaw}", remedy)
    return own


def start_of(preset: str, file: Path | None, set_: list[str] | None) -> Gait:
    """The gait of a file, if there is one, or of a preset. Raises `FlexspineError` if none is."""
    from flexspine.gaits.files import load_gait
    from flexspine.gaits.gait import examine
    from flexspine.models.presets import load_model

    if file is not None:
        refuse_besides_gait({"--set": set_})
    interruptible()
    with steps() as progress:
        progress.begin("looking at the gait to start from")
        found = examine(load_model(preset)) if file is None else load_gait(file)
    if found.flaw is not None:
        # No InputError: its exit code is that of what ended without its goal.
        raise FlexspineError(
            f"the start of '{preset if file is None else file}' is no gait: {found.flaw}",
            "find one with 'flexspine gait --out' and give it with --gait",
        )
    if not set_:
        return found
    with steps() as progress:
        return starting_gait(None, preset, set_, None, progress)


def starting_gait(
    file: Path | None,
    preset: str | None,
    set_: list[str] | None,
    symmetric: bool | None,
    progress: Steps,
) -> Gait:
    """The gait to start from. Raises `InputError`, and `FlexspineError` if there is none."""
    from flexspine.gaits.files import load_gait
    from flexspine.gaits.search import find_gaits
    from flexspine.models.presets import load_model

    if file is not None:
        refuse_besides_gait({"--preset": preset, "--set": set_})
        saved = load_gait(file)
        if saved.flaw is not None:
            raise InputError(
                f"'{file}' holds no gait: {saved.flaw}", "find one with 'flexspine gait --out'"
            )
        return saved
    progress.begin("looking at the gait to start from")
    name = DEFAULT_PRESET if preset is None else preset
    model = load_model(name, assignments("--set", set_))
    own = own_gait(name, "find one with 'flexspine gait --out' and give it with --gait")
    if model.parameters == own.model.parameters:
        return own
    if not model.features.conservative:
        raise ParameterError(
            f"'{name}' with dampers or actuators has no gait of its own to start from",
            "find one with 'flexspine gait --free legs.extension=0:0.02 --out' and give it with "
            "--gait",
        )
    progress.begin("looking for the gait to start from")
    found = find_gaits(model, own.quantities, symmetric=symmetric, progress=progress.at)
    if not found.gaits:
        # No InputError: its exit code is that of a run that ended without its goal.
        raise FlexspineError(
            f"'{name}' with these parameters has no gait at the energy, apex height and mean "
            f"speed of its own ({found.advice})",
            "find one elsewhere with 'flexspine gait --out' and give it with --gait",
        )
    mirrored = [other for other in found if other.symmetric]
    return min(mirrored or found, key=lambda other: _distance(other, own))


def _distance(one: Gait, other: Gait) -> float:
    """How far two gaits are apart, squared, in natural units."""
    scales = other.model.scales
    apart = [(one.model.apex[n] - other.model.apex[n]) / scales[n] for n in one.model.apex]
    apart += [one.touchdown_angles[n] - other.touchdown_angles[n] for n in one.touchdown_angles]
    return sum(difference**2 for difference in apart)
