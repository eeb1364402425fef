"""The ``flexspine`` command: verbs, exit codes, and how errors are told.

Exit codes: 0 done, 1 the run ended without its goal, 2 bad input, 3 the machine failed,
130 interrupted.
"""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from flexspine._version import __version__
from flexspine.cli import (
    basin,
    bound,
    branch,
    cache,
    control,
    doctor,
    equations,
    export,
    forces,
    gait,
    gait_map,
    limits,
    optimise,
    presets,
    report,
    robustness,
    run3d,
    spines,
    study,
    sweep,
    terrain,
    trot,
    tune,
    verify,
)
from flexspine.cli.output import WORDS, fail
from flexspine.errors import OUT_OF_SPACE, FlexspineError, InputError, MachineError

INTERRUPTED = 130


class InterruptionError(FlexspineError):
    """Somebody, or the system, ended the command."""

    code = "interrupted"
    exit_code = INTERRUPTED


# Typer has carried its own click since 0.26 and used the installed one before.
UsageError: type[Exception] = typer.BadParameter.__mro__[1]

app = typer.Typer(
    name="flexspine",
    help="Bounding quadrupeds with a rigid or a flexible spine.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("bound")(bound.bound)
app.command("gait")(gait.gait)
app.command("branch")(branch.branch)
app.command("study")(study.study)
app.command("sweep")(sweep.sweep)
app.command("rerun")(sweep.rerun)
app.command("basin")(basin.basin)
app.command("map")(gait_map.gait_map)
app.command("control")(control.control)
app.command("terrain")(terrain.terrain)
app.command("robustness")(robustness.robustness)
app.command("limits")(limits.limits)
app.command("optimise")(optimise.optimise)
app.command("trot")(trot.trot)
app.command("run3d")(run3d.run3d)
app.command("spines")(spines.spines)
app.command("tune")(tune.tune)
app.command("report")(report.report)
app.command("forces")(forces.forces)
app.command("presets")(presets.presets)
app.command("equations")(equations.equations)
app.command("doctor")(doctor.doctor)
app.add_typer(export.app, name="export")
app.add_typer(verify.app, name="verify")
app.add_typer(cache.app, name="cache")


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _common(
    context: typer.Context,
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code."""
    as_json = "--json" in arguments
    WORDS.set(tuple(arguments))
    try:
        code = app(arguments, standalone_mode=False)
    except UsageError as failure:
        if type(failure).__name__ == "NoArgsIsHelpError":
            return 2  # the help it stands for is printed already
        return fail(_usage(failure), as_json)
    except FlexspineError as failure:
        return fail(failure, as_json)
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except OSError as failure:
        return fail(_disk(failure), as_json)
    except SystemExit:
        code = 0  # the reader of our output went away; Typer leaves like this then
    if code == INTERRUPTED:
        print("flexspine: interrupted", file=sys.stderr)
        if as_json:
            fail(InterruptionError("interrupted", "run it again"), as_json)
    return code if isinstance(code, int) else 0


def _usage(failure: Any) -> InputError:
    command = failure.ctx.command_path if failure.ctx else "flexspine"
    message = failure.format_message().rstrip(".").replace("\n", " ")
    return InputError(message[:1].lower() + message[1:], f"see '{command} --help'")


def _disk(failure: OSError) -> MachineError:
    where = f" '{failure.filename}'" if failure.filename else ""
    full = failure.errno in OUT_OF_SPACE
    remedy = "free some space and run it again" if full else "look at the disk and run it again"
    return MachineError(f"cannot use{where} ({failure.strerror or failure})", remedy)
