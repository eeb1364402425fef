"""``flexspine gait``: find the gaits of an animal, with their multipliers."""

from __future__ import annotations

import re
import sys
from contextlib import ExitStack
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_PRESET,
    Assignments,
    Json,
    Preset,
    Seed,
    Symmetric,
    assignments,
    check_number,
    numbers,
    output_directory,
    span,
)
from flexspine.cli.output import Steps, print_json, steps
from flexspine.cli.starts import own_gait
from flexspine.errors import InputError, ParameterError

if TYPE_CHECKING:
    from flexspine.gaits.gait import Gait
    from flexspine.models.model import Model

# What a search of an earlier run has left.
SAVED = re.compile(r"gait-\d+\.(json|png)")

DRAWN_PERIODS = 2


def gait(
    preset: Preset = None,
    set_: Assignments = None,
    energy: Annotated[float | None, typer.Option(help="Total energy, in J.")] = None,
    height: Annotated[
        float | None, typer.Option(help="Height of the CoM at the apex, in m.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Mean speed, in m/s.")] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Fix another quantity: an apex coordinate, e.g. pitch_rate=0.5 (speed is the "
            "speed at the apex), touchdown.fore or touchdown.hind; repeat it.",
            autocompletion=completion.ranges,
        ),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH",
            help="Let a parameter be unknown, within bounds, e.g. spine.stiffness=200:300, or "
            "legs.extension=0:0.02 to make good what dampers take; repeat it.",
            autocompletion=completion.ranges,
        ),
    ] = None,
    within: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH",
            help="Look for an unknown within bounds, e.g. touchdown.fore=0.4:0.5; repeat it.",
            autocompletion=completion.ranges,
        ),
    ] = None,
    symmetric: Symmetric = None,
    starts: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="How many random starts, of each kind.", show_default="100"
        ),
    ] = None,
    seed: Seed = 0,
    out: Annotated[Path | None, output_directory("gaits and figures")] = None,
    json: Json = False,
) -> int:
    """Find the gaits of an animal, and tell how stable they are.

    They have the given energy, apex height and mean speed. What is not given is that of the
    preset's own gait, before any --set. With --fix nothing is added: exactly what the options name
    is fixed. Units are SI and radians.

    Exit code 0: gaits found; 1: none found; 2: bad input; 3: the machine failed; 130: interrupted.

    Examples:
        flexspine gait --energy 290 --height 0.32 --speed 4.25

        flexspine gait --set spine.stiffness=240 --symmetric --out found

        flexspine gait --energy 290 --fix height=0.32 --fix touchdown.fore=0.46

        flexspine gait --set spine.damping=1 --free legs.extension=0:0.02 --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.gaits.gait_record import gait_record
    from flexspine.gaits.search import DEFAULT_STARTS, find_gaits
    from flexspine.models.presets import load_model

    interruptible()
    name = DEFAULT_PRESET if preset is None else preset
    model = load_model(name, assignments("--set", set_))
    fixed = _fixed(name, {"energy": energy, "height": height, "mean_speed": speed}, fix)
    freed = _freed(model, free)
    bounds = _ranges("--within", within)
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = ResultDirectory.within(stack, out)
        progress.begin("looking for gaits")
        found = find_gaits(
            model,
            fixed,
            free=freed,
            symmetric=symmetric,
            starts=DEFAULT_STARTS if starts is None else starts,
            seed=seed,
            bounds=bounds,
            progress=progress.at,
        )
        record = {
            **STAMP,
            "preset": model.name,
            "fixed": fixed,
            "free": list(freed),
            "gaits": [gait_record(gait) for gait in found],
            "advice": found.advice,
            "tally": dict(found.tally),
            "dropped": dict(found.dropped),
        }
        if directory is not None:
            with directory.stage(SAVED) as stage:
                _write(stage, found.gaits, record, progress)
    if json:
        print_json(record)
    elif record["gaits"]:
        print(_report(record))
        if out is not None:
            print(f"results in {out}")
    if not record["gaits"]:
        print(f"flexspine: no gait found: {found.advice}", file=sys.stderr)
    return 0 if record["gaits"] else 1


def _fixed(preset: str, named: dict[str, float | None], fix: list[str] | None) -> dict[str, float]:
    """What is fixed: what the options name, else energy, height and mean speed."""
    given = {name: value for name, value in named.items() if value is not None}
    more = numbers("--fix", fix)
    for name in given.keys() & more.keys():
        raise InputError(f"{name} is given twice", f"leave --fix {name}")
    if not more and len(given) < len(named):
        missing = " and ".join(OPTION[name] for name in named if name not in given)
        given = own_gait(preset, f"give {missing}").quantities | given
    fixed = given | more
    for name, value in fixed.items():
        check_number(OPTION.get(name, name), value)
        if name in FORWARD and value < 0:
            raise ParameterError(
                f"{OPTION.get(name, name)} = {value:g} is backward", "give 0 or more"
            )
        if name in ABOVE_GROUND and value <= 0:
            raise ParameterError(
                f"{OPTION.get(name, name)} = {value:g} is below the ground", "give more than 0"
            )
    return fixed


OPTION = {"energy": "--energy", "height": "--height", "mean_speed": "--speed"}

ABOVE_GROUND = ("energy", "height")

FORWARD = ("mean_speed", "speed")


def _ranges(option: str, given: list[str] | None) -> dict[str, tuple[float, float]]:
    """Parse ``NAME=LOW:HIGH`` items."""
    pairs = (item.partition("=")[::2] for item in given or [])
    return {name.strip(): span(f"{option} {name.strip()}", ends) for name, ends in pairs}


def _freed(model: Model, free: list[str] | None) -> dict[str, tuple[float, float]]:
    """Parse parameters that are set free, and see that the model takes both bounds."""
    from flexspine.parameters import values

    ranges = _ranges("--free", free)
    for name, ends in ranges.items():
        for end in ends:
            model.with_values({name: end})
        if ends[0] <= 0 < values(model.parameters)[name] and name not in model.may_vanish:
            raise ParameterError(
                f"--free {name} from {ends[0]:g} on would let it vanish", "give a LOW above zero"
            )
    return ranges


def _write(stage: Path, gaits: tuple[Gait, ...], record: dict[str, Any], progress: Steps) -> None:
    """Write every gait by itself, with a figure, and all of them together."""
    from flexspine.cli.results import write_json
    from flexspine.models.dataset import to_dataset
    from flexspine.models.simulation import simulate
    from flexspine.report.figure import plot_run

    progress.begin("drawing")
    write_json(record, stage / "gaits.json")
    for number, (gait, single) in enumerate(zip(gaits, record["gaits"], strict=True), 1):
        write_json(single, stage / f"gait-{number}.json")
        run = simulate(gait.model, strides=DRAWN_PERIODS * gait.strides, tolerance=gait.tolerance)
        plot_run(to_dataset(run)).savefig(stage / f"gait-{number}.png")
        progress.at(number / len(gaits))


def _report(record: dict[str, Any]) -> str:
    """The gaits in a table for a person, and below it the multipliers of each."""
    gaits = record["gaits"]
    fixed = ", ".join(f"{name} = {value:.9g}" for name, value in record["fixed"].items())
    lines = [
        f"{record['preset']}: {len(gaits)} gait{'s' * (len(gaits) > 1)} with {fixed}",
        "",
        "     mean speed   peak GRF (N)         spectral",
        "  #       (m/s)      fore      hind      radius  stable  residual  family",
    ]
    for number, gait in enumerate(gaits, 1):
        peak = gait["peak_grf"]
        lines.append(
            f"{number:3}{gait['mean_speed']:12.6f}{peak['fore']:10.3f}{peak['hind']:10.3f}"
            f"{gait['level_spectral_radius']:12.6f}  {'yes' if gait['stable'] else 'no':<6}"
            f"{gait['residual']:10.1e}  {gait['family']}"
            + (", symmetric" if gait["symmetric"] else "")
        )
    level = "" if gaits[0]["energy_identity"] is None else " on the energy level"
    lines += [
        "",
        f"The spectral radius is that of the stride map{level}, at fixed touchdown angles.",
        *_unknowns(record),
    ]
    for number, gait in enumerate(gaits, 1):
        lines += ["", *_multipliers(number, gait)]
    return "\n".join([*lines, "", record["advice"]])


def _unknowns(record: dict[str, Any]) -> list[str]:
    """What free parameters have become, and what is spent."""
    gaits, rows = record["gaits"], []
    for name in record["free"]:
        rows.append((name, [gait["parameters"][name] for gait in gaits]))
    if any(gait["work"] for gait in gaits):
        rows.append(("cost of transport", [gait["cost_of_transport"] for gait in gaits]))
    if not rows:
        return []
    head = "".join(f"  {name:>17}" for name, _ in rows)
    lines = ["", f"  #{head}"]
    for number, values in enumerate(zip(*(found for _, found in rows), strict=True), 1):
        lines.append(f"{number:3}" + "".join(f"  {value:17.8g}" for value in values))
    return lines


def _multipliers(number: int, gait: dict[str, Any]) -> list[str]:
    lines = [f"{f'multipliers of gait {number}':<26}magnitude     error  condition  moves most"]
    for (real, imaginary), mode in zip(gait["floquet_multipliers"], gait["modes"], strict=True):
        value = f"{real:+.8f}" + (f"{imaginary:+.8f}i" if imaginary else "")
        lines.append(
            f"  {value:<24}{hypot(real, imaginary):9.6f}{_number(mode['error'], '.1e'):>10}"
            f"{_number(mode['condition_number'], '.1f'):>11}  {next(iter(mode['moves']))}"
        )
    return lines


def _number(value: float | None, form: str) -> str:
    """A number, or a dash for one that is infinite."""
    return "-" if value is None else format(value, form)
