"""The command line, verb by verb, from the texts that ``--help`` prints."""

from __future__ import annotations

import re
from collections.abc import Iterator
from inspect import cleandoc
from typing import Any

import typer
from tables import code, table

from flexspine.cli.app import app

HEAD = """# Command line

What `flexspine VERB --help` prints, on one page. Units are SI and radians unless an option says
otherwise. Exit codes: 0 done; 1 the run ended without its goal (it fell, no gait found); 2 bad
input; 3 the machine failed (disk, worker, missing extra); 130 interrupted. `--json` prints one JSON
object on stdout and nothing else; messages go to stderr.

`flexspine --install-completion` teaches your shell to complete verbs, options and the names of
presets, robots, walks and parameters.
"""


def command_pages() -> dict[str, str]:
    """Return the page of all verbs."""
    parts = [HEAD]
    for path, command in leaves(typer.main.get_command(app), ("flexspine",)):
        parts.append(f"## {' '.join(path)}\n")
        parts += [described(command), usage(path, command), taken(command)]
    return {"cli.md": "\n".join(parts)}


def leaves(command: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every command below one, with its words."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield path, command
        return
    for name, each in inner.items():
        yield from leaves(each, (*path, name))


def described(command: Any) -> str:
    """What it does, and its examples as code."""
    text, _, examples = cleandoc(command.help or "").partition("Examples:\n")
    lines = [line.strip() for line in examples.splitlines() if line.strip()]
    shown = "```sh\n" + "\n".join(lines) + "\n```\n" if lines else ""
    return f"{_plain(text).strip()}\n\n{shown}"


def usage(path: tuple[str, ...], command: Any) -> str:
    """How it is called."""
    pieces = command.collect_usage_pieces(command.make_context("", [], resilient_parsing=True))
    return f"Usage: `{' '.join([*path, *pieces])}`\n"


def taken(command: Any) -> str:
    """A table of its options and arguments."""
    rows = []
    for each in command.params:
        if each.name == "help":
            continue
        named = each.param_type_name == "option"
        names = [*each.opts, *each.secondary_opts] if named else [str(each.name).upper()]
        default = each.show_default if isinstance(each.show_default, str) else each.default
        if default is True and named and each.secondary_opts:
            default = each.opts[0]
        told = "" if default is None or default is False or callable(default) else str(default)
        rows.append((", ".join(map(code, names)), _plain(getattr(each, "help", "") or ""), told))
    return table(("option", "", "default"), rows)


def _plain(text: str) -> str:
    """Without Rich's marks, and safe in Markdown."""
    return re.sub(r"([<>*_])", r"\\\1", re.sub(r"\[/?(?:bold|dim|italic)\]", "", text))
