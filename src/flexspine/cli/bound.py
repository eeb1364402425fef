"""``flexspine bound``: simulate bounding and hand over data, a figure and an animation."""

from __future__ import annotations

from contextlib import ExitStack
from math import inf
from typing import Annotated, Any

import typer

from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    DEFAULT_PRESET,
    Animation,
    Apex,
    Assignments,
    GaitFile,
    Json,
    Preset,
    RunDirectory,
    Tolerance,
    Touchdown,
    assignments,
)
from flexspine.cli.output import print_json, steps
from flexspine.errors import InputError


def bound(
    preset: Preset = None,
    gait: GaitFile = None,
    set_: Assignments = None,
    apex: Apex = None,
    touchdown: Touchdown = None,
    strides: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="How many strides to run.",
            show_default="1, or the period of --gait",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(help="Run this long, in s, instead of counting strides."),
    ] = None,
    tolerance: Tolerance = None,
    interval: Annotated[
        float | None,
        typer.Option(help="Time between samples of the written data, in s.", show_default="0.001"),
    ] = None,
    out: RunDirectory = None,
    animation: Animation = True,
    json: Json = False,
) -> int:
    """Simulate bounding from an apex, or a saved gait.

    Units are SI and radians.

    Exit code 0: all strides done; 1: the run ended otherwise, for example by a fall; 2: bad input;
    3: the machine failed; 130: interrupted.

    Examples:
        flexspine bound --strides 3 --out run

        flexspine bound --set spine.stiffness=240 --apex height=0.33 --json

        flexspine gait --out found && flexspine bound --gait found/gait-1.json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.gaits.record import run_record
    from flexspine.models.dataset import DEFAULT_INTERVAL, check_interval
    from flexspine.models.model import check_between
    from flexspine.models.presets import load_model
    from flexspine.models.simulation import DEFAULT_TOLERANCE, simulate

    interruptible()
    if seconds is not None and strides is not None:
        raise InputError("--seconds and --strides are both given", "leave one of them")
    if interval is not None and out is None:
        raise InputError("--interval is given without --out", "give --out, where the data goes")
    if seconds is not None:
        check_between("--seconds", seconds, 0, inf)
    step = DEFAULT_INTERVAL if interval is None else interval
    check_interval(step)
    if gait is not None:
        refuse_besides_gait(
            {"--preset": preset, "--set": set_, "--apex": apex, "--touchdown": touchdown}
        )
        from flexspine.gaits.files import load_gait

        saved = load_gait(gait)
        model = saved.model
        if seconds is None:
            strides = strides or saved.strides
    else:
        model = load_model(
            DEFAULT_PRESET if preset is None else preset,
            assignments("--set", set_),
            apex=assignments("--apex", apex),
            touchdown=assignments("--touchdown", touchdown),
        )
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        directory = ResultDirectory.within(stack, out, films=animation)
        progress.begin("simulating")
        run = simulate(
            model,
            strides=strides,
            duration=seconds,
            tolerance=DEFAULT_TOLERANCE if tolerance is None else tolerance,
        )
        record = run_record(run)
        if directory is not None:
            directory.write(run, record, step, animation, progress)
    if json:
        print_json(record)
    else:
        print(_report(record))
        if out is not None:
            print(f"results in {out}")
    return 0 if run.outcome.completed else 1


def refuse_besides_gait(options: dict[str, Any]) -> None:
    """Raise `InputError` if an option is given that would change a saved gait."""
    for option, given in options.items():
        if given not in (None, []):
            raise InputError(
                f"{option} and --gait are both given",
                f"leave {option}, as a gait is the gait of one animal; 'flexspine gait' finds "
                "those of others",
            )


def _report(record: dict[str, Any]) -> str:
    """The run in a few lines for a person."""
    lines = [f"{record['preset']}: {record['outcome']} ({record['message']})"]
    if record["outcome"] != "completed":
        lines.append(f"  advice           {record['advice']}")
    lines.append(f"  phases           {_shortened(record['phases'])}")
    peak, vertical, duty = (record[k] for k in ("peak_grf", "peak_grf_vertical", "duty_factor"))
    lines += _line("mean speed", record["mean_speed"], "m/s")
    lines += _line("stride period", record["period"], "s")
    lines += _line("stride length", record["stride_length"], "m")
    lines.append(
        f"  peak GRF         fore {peak['fore']:.2f} N, hind {peak['hind']:.2f} N "
        f"(vertical {vertical['fore']:.2f} N, {vertical['hind']:.2f} N; per pair of legs)"
    )
    if duty["fore"] is not None:
        lines.append(f"  duty factor      fore {duty['fore']:.4f}, hind {duty['hind']:.4f}")
    energy = record["energy"]
    if energy["relative_drift"] is not None:
        lines.append(
            f"  energy           {energy['initial']:.4f} J, balance closed to "
            f"{energy['relative_drift']:.1e}"
        )
    lines += [
        f"  {name.replace('_', ' '):<16} {work['positive']:.4f} J given, {work['net']:.4f} J net"
        for name, work in record["work"].items()
    ]
    if record["work"] and record["cost_of_transport"] is not None:
        lines.append(f"  cost of transport {record['cost_of_transport']:.5f}")
    return "\n".join(lines)


def _line(label: str, value: float | None, unit: str) -> list[str]:
    return [] if value is None else [f"  {label:<16} {value:.6f} {unit}"]


def _shortened(phases: list[str], most: int = 12) -> str:
    shown = " ".join(phases[:most])
    return shown if len(phases) <= most else f"{shown} ... ({len(phases)} in all)"
