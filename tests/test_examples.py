from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

import pytest

import flexspine
from flexspine.cli.app import app

EXAMPLES = Path(__file__).parents[1] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("[0-9]*.py"))

# What examples may import besides flexspine and the standard library.
LIBRARIES = {"numpy", "matplotlib", "xarray"}


def modules(tree: ast.Module) -> set[str]:
    """The modules that are imported, by their first name."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add((node.module or "").partition(".")[0])
    return found


def test_they_are_numbered_without_a_gap() -> None:
    assert [path.name[:3] for path in SCRIPTS] == [f"{n:02d}_" for n in range(1, 11)]
    assert {path.name for path in EXAMPLES.glob("*.py")} == {path.name for path in SCRIPTS}


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_they_use_only_what_is_public(path: Path) -> None:
    tree = ast.parse(path.read_text())
    ours = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    ours = [node for node in ours if (node.module or "").startswith("flexspine")]
    names = {alias.name for node in ours for alias in node.names}
    assert {node.module for node in ours} == {"flexspine"}
    assert names <= set(flexspine.__all__)
    assert modules(tree) <= {"flexspine", *LIBRARIES, *sys.stdlib_module_names}
    hidden = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute) and n.attr[0] == "_"}
    assert not hidden


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_they_begin_with_a_title_and_end_with_a_picture_of_their_name(path: Path) -> None:
    tree = ast.parse(path.read_text())
    title, underline, blank, *_ = (ast.get_docstring(tree) or "").splitlines()
    assert (underline, blank) == ("=" * len(title), "")
    last = tree.body[-1]
    assert isinstance(last, ast.Expr)
    assert isinstance(last.value, ast.Call)
    assert isinstance(last.value.func, ast.Attribute)
    assert last.value.func.attr == "savefig"
    (picture,) = last.value.args
    assert ast.literal_eval(picture) == f"{path.stem[3:]}.png"


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_commands_that_they_name_are_there(path: Path) -> None:
    named = set(re.findall(r"``flexspine (\w+)", path.read_text()))
    assert named <= {command.name for command in app.registered_commands}
