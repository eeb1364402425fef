"""All commands of the command line, and the examples in their help."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

import typer

from flexspine.cli.app import app

ROOT: Any = typer.main.get_command(app)


def commands(group: Any = ROOT, path: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Every command that does something, by the words that call it."""
    for name, each in group.commands.items():
        if hasattr(each, "commands"):
            yield from commands(each, (*path, name))
        else:
            yield " ".join((*path, name)), each


COMMANDS: dict[str, Any] = dict(commands())


def options(verb: str) -> dict[str, Any]:
    """The options of a command by name."""
    found = {each.opts[0]: each for each in COMMANDS[verb].params}
    return {name: each for name, each in found.items() if name.startswith("--")}


def examples(verb: str) -> list[str]:
    """The lines of examples in a command's help."""
    _, _, told = COMMANDS[verb].help.partition("Examples:\n")
    return [line.strip() for line in told.splitlines() if line.strip()]


def calls(line: str) -> Iterator[list[str]]:
    """The words after ``flexspine`` of every such command in a line of a shell."""
    for command in line.split("&&"):
        words = shlex.split(command)
        if words[0] == "flexspine":
            yield words[1:]


def called(words: list[str]) -> tuple[str, list[str]]:
    """Which command words call, and with what."""
    for length in (2, 1):
        verb = " ".join(words[:length])
        if verb in COMMANDS:
            return verb, words[length:]
    raise AssertionError(f"there is no '{words[0]}'")
