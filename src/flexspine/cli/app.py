"""The ``flexspine`` command: verbs, exit codes, and how errors are told.

Exit codes: 0 done, 1 the run ended without its goal, 2 bad input, 3 the machine failed,
130 interrupted.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from functools import cache as once
from inspect import cleandoc
from itertools import pairwise
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

# Set by shells that ask for completions.
COMPLETING = "_FLEXSPINE_COMPLETE"


class InterruptionError(FlexspineError):
    """Somebody, or the system, ended the command."""

    code = "interrupted"
    exit_code = INTERRUPTED


# Typer has carried its own click since 0.26 and used the installed one before.
UsageError: type[Exception] = typer.BadParameter.__mro__[1]

COMMAND = "flexspine"

ABOUT = """Bounding quadrupeds with a rigid or a flexible spine.

Units are SI and radians. --json prints one JSON object on stdout and nothing else. Every verb tells
its options and examples with --help; 'flexspine --install-completion' lets the shell complete them,
and the names of presets and parameters.

Exit code 0: done; 1: ended without its goal; 2: bad input; 3: the machine failed; 130: interrupted.

Examples:
    flexspine doctor

    flexspine bound --out run && flexspine report run
"""


def unwrapped(text: str | None) -> str:
    """A docstring as help: paragraphs without line breaks, examples without blank lines."""
    prose, examples, commands = cleandoc(text or "").partition("Examples:\n")
    told = "\n\n".join(" ".join(each.split()) for each in prose.split("\n\n"))
    lines = [f"    {line.strip()}\n" for line in commands.splitlines() if line.strip()]
    return told + examples + "".join(lines)


app = typer.Typer(
    name=COMMAND,
    help=unwrapped(ABOUT),
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

Verb = Callable[..., int | None]

# Verbs by subject, in the order in which a newcomer meets them.
PANELS: dict[str, dict[str, Verb | typer.Typer]] = {
    "Start here": {
        "doctor": doctor.doctor,
        "presets": presets.presets,
        "equations": equations.equations,
    },
    "Bounding in the plane: runs and gaits": {
        "bound": bound.bound,
        "gait": gait.gait,
        "branch": branch.branch,
        "study": study.study,
        "map": gait_map.gait_map,
        "basin": basin.basin,
        "optimise": optimise.optimise,
    },
    "Feedback, pushes and rough ground": {
        "control": control.control,
        "terrain": terrain.terrain,
        "robustness": robustness.robustness,
        "limits": limits.limits,
    },
    "The articulated robot, in the plane": {
        "trot": trot.trot,
        "forces": forces.forces,
    },
    "The robot in space (extra engine)": {
        "run3d": run3d.run3d,
        "spines": spines.spines,
        "tune": tune.tune,
        "export": export.app,
    },
    "Many runs, results and checks": {
        "sweep": sweep.sweep,
        "rerun": sweep.rerun,
        "report": report.report,
        "verify": verify.app,
        "cache": cache.app,
    },
}


def _compose() -> None:
    """Put all verbs together."""
    for panel, verbs in PANELS.items():
        for name, verb in verbs.items():
            if isinstance(verb, typer.Typer):
                app.add_typer(verb, name=name, rich_help_panel=panel)
                for command in verb.registered_commands:
                    assert command.callback is not None
                    command.help = unwrapped(command.callback.__doc__)
            else:
                app.command(name, help=unwrapped(verb.__doc__), rich_help_panel=panel)(verb)


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


_compose()


@once
def _command() -> Callable[..., Any]:
    """The verbs with their options, which take Typer a while."""
    return typer.main.get_command(app)


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code."""
    as_json = "--json" in arguments
    WORDS.set(tuple(arguments))
    try:
        code = _command()(arguments, prog_name=COMMAND, standalone_mode=False)
    except UsageError as failure:
        if type(failure).__name__ == "NoArgsIsHelpError":
            return 2  # the help it stands for is printed already
        return fail(_usage(failure, arguments), as_json)
    except FlexspineError as failure:
        return fail(failure, as_json)
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except OSError as failure:
        return fail(_disk(failure), as_json)
    except SystemExit as leaving:
        # Shells ask for completions by an exit code; else the reader of our output went away.
        code = leaving.code if COMPLETING in os.environ else 0
    if code == INTERRUPTED:
        print("flexspine: interrupted", file=sys.stderr)
        if as_json:
            fail(InterruptionError("interrupted", "run it again"), as_json)
    return code if isinstance(code, int) else 0


def _usage(failure: Any, arguments: list[str]) -> InputError:
    command = failure.ctx.command_path if failure.ctx else COMMAND
    message = failure.format_message()
    options: Sequence[str] = getattr(getattr(failure, "param", None), "opts", ())
    given = _given(options, arguments) if type(failure) is typer.BadParameter else []
    if given:
        why = failure.message[:1].lower() + failure.message[1:]
        message = f"{options[0]} {', '.join(map(repr, given))} is not usable: {why}"
    message = message.rstrip(".").replace("\n", " ")
    return InputError(message[:1].lower() + message[1:], f"see '{command} --help'")


def _given(options: Sequence[str], arguments: list[str]) -> list[str]:
    """The values that were given to an option."""
    found = [value for option, value in pairwise(arguments) if option in options]
    for argument in arguments:
        option, equals, value = argument.partition("=")
        found += [value] if equals and option in options else []
    return found


def _disk(failure: OSError) -> MachineError:
    where = f" '{failure.filename}'" if failure.filename else ""
    full = failure.errno in OUT_OF_SPACE
    remedy = "free some space and run it again" if full else "look at the disk and run it again"
    return MachineError(f"cannot use{where} ({failure.strerror or failure})", remedy)
