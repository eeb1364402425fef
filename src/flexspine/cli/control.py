"""``flexspine control``: make a gait stable by feedback at apexes, and try it."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Annotated, Any

import typer

from flexspine.cli.interrupts import interruptible
from flexspine.cli.options import (
    Animation,
    Assignments,
    GaitFile,
    Json,
    Preset,
    RunDirectory,
    Seed,
    check_number,
)
from flexspine.cli.output import print_json, steps
from flexspine.cli.starts import starting_gait
from flexspine.cli.steering_options import Effort, Method, Once, Steer, stabilizer_of
from flexspine.errors import InputError

# Spectral radii that differ by less are the same.
ON_LEVEL = 1e-6


def control(
    preset: Preset = None,
    gait: GaitFile = None,
    set_: Assignments = None,
    steer: Steer = None,
    method: Method = "lqr",
    once: Once = False,
    effort: Effort = None,
    strides: Annotated[
        int, typer.Option(min=1, metavar="N", help="How many strides to run.")
    ] = 1000,
    sensing: Annotated[
        float,
        typer.Option(
            min=0,
            metavar="SHARE",
            help="Gaussian noise on the measured apex, in natural units.",
        ),
    ] = 0.0,
    acting: Annotated[
        float,
        typer.Option(
            min=0,
            metavar="SHARE",
            help="Gaussian noise on what is steered, relative: 0.01 is 1 %.",
        ),
    ] = 0.0,
    uniform: Annotated[
        bool, typer.Option("--uniform", help="Draw --acting evenly from -VALUE to VALUE instead.")
    ] = False,
    push: Annotated[
        float, typer.Option(help="A push forward at the first apex, in N s (backward if negative).")
    ] = 0.0,
    seed: Seed = 0,
    out: RunDirectory = None,
    animation: Animation = True,
    json: Json = False,
) -> int:
    """Stabilise a gait by feedback at apexes; try noise and pushes.

    The feedback is linear, designed on the exact derivative of the stride. Touchdown angles cannot
    change the energy of a passive animal; thrust such as legs.extension can. With --out the first 8
    strides are kept in full and drawn, of a run that ended early the last 8; apexes.csv has all.
    Units are SI and radians.

    Exit code 0: all strides done; 1: it fell, or nothing makes it stable; 2: bad input; 3: the
    machine failed; 130: interrupted.

    Examples:
        flexspine control --acting 0.01 --uniform --out steered

        flexspine control --steer touchdown.fore --steer touchdown.hind --once

        flexspine control --push 3 --strides 100 --json
    """
    from flexspine.cli.results import ResultDirectory
    from flexspine.control.excerpt import excerpt
    from flexspine.control.steered_record import apex_table, steered_record
    from flexspine.control.steering import Noise
    from flexspine.control.steering import steer as run_steered

    interruptible()
    for option, value in (("--sensing", sensing), ("--acting", acting), ("--push", push)):
        check_number(option, value)
    if uniform and not acting:
        raise InputError("--uniform is given without --acting", "give --acting, what is uniform")
    noise = Noise(sensing=sensing, acting=acting, uniform=uniform)
    with ExitStack() as stack:
        progress = stack.enter_context(steps())
        start = starting_gait(gait, preset, set_, None, progress)
        progress.begin("designing the feedback")
        found = stabilizer_of(start, steer, method, once, effort)
        directory = ResultDirectory.within(stack, out, films=animation)
        model = start.model
        if push:
            speed = model.apex["speed"] + push / model.mass
            model = model.with_values(apex={"speed": speed}, origin=f"a push of {push:g} N s")
        progress.begin(f"running {strides} strides")
        run = run_steered(model, found, strides=strides, noise=noise, seed=seed)
        record = {**steered_record(run, start, found), "push": push}
        if directory is not None:
            from flexspine.report.control_figure import plot_control
            from flexspine.studies.tables import write_table

            table, part = apex_table(run, start), excerpt(run)
            record["shown"] = part.record
            with directory.stage_run(part, record, animation, progress) as stage:
                write_table(table, stage / "apexes.csv")
                plot_control(record, table).savefig(stage / "control.png")
    if json:
        print_json(record)
    else:
        print(report(record))
        if out is not None:
            print(f"results in {out}")
    return 0 if run.outcome.completed else 1


def report(record: dict[str, Any]) -> str:
    """The run in a few lines for a person."""
    lines = [f"{record['preset']}: {record['outcome']} ({record['message']})"]
    if record["ground"]:
        lines.append(f"  ground           {record['ground']}")
    lines += [
        *_feedback(record),
        f"  strides          {record['strides']} over {record['distance']:.1f} m",
        f"  deviation        {record['largest_deviation']:.3g} at most, "
        f"{record['last_deviation']:.3g} at the end (natural units)",
    ]
    lines.append(_energy(record))
    if record["outcome"] != "completed":
        lines.append(f"  advice           {record['advice']}")
    if record.get("shown", {}).get("told"):
        lines.append(f"  shown            {record['shown']['told']}")
    return "\n".join(lines)


def _energy(record: dict[str, Any]) -> str:
    """Where energy came from and went, in one line."""
    told = [f"{record['energy_at_start']:.3f} J at the start, {record['energy_at_end']:.3f} J now"]
    if record["dissipated"]:
        told.append(f"dissipated {record['dissipated']:.3f} J")
    told += [f"{n.replace('_', ' ')} {net:+.3f} J" for n, net in record["net_work"].items()]
    if record["energy_unaccounted"] is not None:
        told.append(f"balance closed to {record['energy_unaccounted']:.1e}")
    return f"  energy           {', '.join(told)}"


def _feedback(record: dict[str, Any]) -> list[str]:
    radius = record["spectral_radius"]
    if "with" not in radius:
        without = f"  spectral radius  {radius['without']:.4f}"
        return ["  steered          nothing: fixed touchdown angles", without]
    often = "twice" if record["acts_per_stride"] == 2 else "once"
    level, with_it = radius["on_level"], f"{radius['with']:.4f}"
    if level < radius["with"] - ON_LEVEL:
        with_it = f"{level:.4f} on the energy level, which is kept"
    return [
        f"  steered          {', '.join(record['inputs'])}; {record['method']}, {often} a stride",
        f"  spectral radius  {radius['without']:.4f} without feedback, {with_it} with it",
    ]
