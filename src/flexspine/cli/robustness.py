"""``flexspine robustness``: what rigid, locked and flexible bodies survive under one controller."""

from __future__ import annotations

from contextlib import ExitStack
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexspine._version import STAMP
from flexspine.cli import completion
from flexspine.cli.interrupts import interruptible
from flexspine.cli.kept import kept
from flexspine.cli.options import Json, Processes, Seed, output_directory
from flexspine.cli.output import counting, print_json, steps
from flexspine.cli.steering_options import Effort, Method, Once, Steer, stabilizer_of
from flexspine.cli.sweep import count_of
from flexspine.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from flexspine.control.stabilize import Stabilizer
    from flexspine.studies.robustness import Endurance, Robustness
# m/s
SPEED = 4.5

# What can be completed.
DISTURBANCES = ("push", "step", "rough", "blocks", "acting", "sensing")
BODIES = ("published-rigid", "locked-spine", "flexible")


def robustness(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="push, step, rough, blocks, acting or sensing (noise).",
            autocompletion=completion.among(*DISTURBANCES),
        ),
    ],
    out: Annotated[Path | None, output_directory("runs, a figure and a summary")] = None,
    body: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="published-rigid, locked-spine or flexible; repeat it.",
            show_default="all three",
            autocompletion=completion.among(*BODIES),
        ),
    ] = None,
    gait: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="A gait saved by 'flexspine gait --out'; repeat it."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Mean speed of the bodies' gaits, in m/s.", show_default="4.5"),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, metavar="N", help="How many runs of each.")] = 10_000,
    strides: Annotated[
        int, typer.Option(min=1, metavar="N", help="How many strides a run has to make.")
    ] = 50,
    largest: Annotated[
        float | None,
        typer.Option(
            help="The largest disturbance (SI), drawn evenly up to it.",
            show_default="push 20 N s, step 0.06 m, rough 0.03 m, blocks 0.02 m, noise 0.03",
        ),
    ] = None,
    steer: Steer = None,
    method: Method = "lqr",
    once: Once = False,
    effort: Effort = None,
    seed: Seed = 0,
    processes: Processes = None,
    json: Json = False,
) -> int:
    """Disturb stabilised gaits at random, and tell what they survive.

    Gaits have the energy and apex height of the published ones; feedback is designed for each by
    the same rule, and each meets the same disturbances: a push forward or backward at an apex (N
    s), a step up or down anywhere in a stride, rough ground, or noise. Interrupted, the same
    command goes on. Units are SI.

    Exit code 0: done; 1: no feedback makes a gait stable; 2: bad input, or a speed without a gait;
    3: the machine failed; 130: interrupted.

    Examples:
        flexspine robustness step --out step

        flexspine robustness push --runs 1000 --body flexible --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.control.disturbance import disturbance
    from flexspine.models.model import check_between
    from flexspine.studies.robustness import survive

    if body and gait:
        raise InputError("--body and --gait are both given", "leave one of them")
    if speed is not None and gait:
        raise InputError("--speed and --gait are both given", "leave one of them")
    interruptible()
    disturbance(kind)  # refused before anything is done
    for option, value in (("--speed", speed), ("--largest", largest)):
        if value is not None:
            check_between(option, value, 0, inf)
    workers = count_of(processes)
    with ExitStack() as stack:
        directory = ResultDirectory.within(stack, out)
        store = stack.enter_context(kept(out, kind))
        with steps() as progress:
            progress.begin("looking for gaits")
            animals = {
                name: stabilizer_of(found, steer, method, once, effort)
                for name, found in _gaits(body, gait, SPEED if speed is None else speed).items()
            }
        with counting("runs") as count:
            found = survive(
                animals, kind, largest=largest, runs=runs, strides=strides, seed=seed,
                processes=workers, store=store, progress=count,
            )  # fmt: skip
        record = _record(found, animals)
        if directory is not None:
            with directory.stage() as stage:
                _write(stage, found, record)
    if json:
        print_json(record)
    else:
        print(_report(record))
        if out is not None:
            print(f"results in {out}")
    return 0


def _gaits(bodies: list[str] | None, files: list[Path] | None, speed: float) -> dict[str, Any]:
    from flexspine.gaits.files import load_gait
    from flexspine.studies.spines import PRESETS, Setting, gait_of

    if files:
        found = {}
        for file in files:
            if file.stem in found:
                raise InputError(
                    f"two gaits are called '{file.stem}'", "rename the file of one of them"
                )
            found[file.stem] = load_gait(file)
            if found[file.stem].flaw is not None:
                raise InputError(f"'{file}' holds no gait: {found[file.stem].flaw}", "give others")
        return found
    known = {name.replace(" ", "-"): name for name in PRESETS}
    for name in bodies or []:
        if name not in known:
            raise UnknownNameError("body", name, known)
    setting = Setting(speeds=(speed, speed))
    return {name: gait_of(known[name], setting) for name in bodies or known}


def _record(found: Robustness, animals: dict[str, Stabilizer]) -> dict[str, Any]:
    from flexspine.control.steered_record import stabilizer_record

    return {
        **STAMP,
        "disturbance": found.kind.name,
        "about": found.kind.about,
        "unit": found.kind.unit,
        "sides": list(found.kind.sides),
        "largest": found.largest,
        "strides": found.strides,
        "seed": found.seed,
        "animals": {
            name: {**stabilizer_record(animals[name]), **_survival(found, each)}
            for name, each in found.animals.items()
        },
    }


def _survival(found: Robustness, each: Endurance) -> dict[str, Any]:
    return {
        "runs": len(each.fates),
        "survived": int(each.survived.sum()),
        **{
            side: {
                "all_survived_up_to": each.safe(sign),
                "typically_survived_up_to": each.typical(sign),
                "outcomes": each.outcomes(sign),
            }
            for side, sign in found.signs.items()
        },
        "bins": [{**one._asdict(), "share": one.share} for one in each.bins(found.edges)],
    }


def _write(stage: Path, found: Robustness, record: dict[str, Any]) -> None:
    from flexspine.cli.results import write_json
    from flexspine.report.robustness_figure import plot_robustness
    from flexspine.studies.tables import write_table

    name = found.kind.name
    write_json(record, stage / f"{name}.json")
    rows = [
        {"animal": animal, "run": number, "size": size, **fate._asdict()}
        for animal, each in found.animals.items()
        for number, (size, fate) in enumerate(zip(each.sizes.tolist(), each.fates, strict=True))
    ]
    write_table(rows, stage / f"{name}.parquet")
    plot_robustness(found, record["animals"]).savefig(stage / f"{name}.png")


def _report(record: dict[str, Any]) -> str:
    """What each animal survives, for a person."""
    largest = _size(record["largest"], record["unit"])
    lines = [f"{record['about']}, up to {largest}; survived: {record['strides']} strides made"]
    for name, each in record["animals"].items():
        lines.append(f"{name}: {each['survived']} of {each['runs']} runs survived")
        for side, name in zip(("positive", "negative"), record["sides"], strict=False):
            lines.append(f"  {name:<11} {_limits(each[side], record['unit'])}")
    return "\n".join(lines)


def _limits(side: dict[str, Any], unit: str) -> str:
    ended = ", ".join(f"{count} {name}" for name, count in side["outcomes"].items())
    if not ended:
        return "no runs"
    if side["all_survived_up_to"] is None:
        return f"all survived ({ended})"
    most, typical = (
        _size(side[name], unit) for name in ("all_survived_up_to", "typically_survived_up_to")
    )
    return f"all up to {most}, typically up to {typical} ({ended})"


def _size(size: float, unit: str) -> str:
    """A size for a person: lengths in mm, shares in percent."""
    factor, shown = {"m": (1e3, "mm"), "1": (100.0, "%")}.get(unit, (1.0, unit))
    return f"{factor * size:.3g} {shown}"
