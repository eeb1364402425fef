"""CONTRIBUTING.md tells where everything is; here it is held to that."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src/flexspine"


def named_files() -> Iterator[str]:
    """Every Python file that the layout names, by its path in the package."""
    told = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    layout = told.partition("src/flexspine/\n")[2].partition("tests/ mirrors it")[0]
    folders: dict[int, str] = {}
    for line in layout.splitlines():
        depth = len(line) - len(line.lstrip())
        above = [folder for indent, folder in folders.items() if indent < depth]
        if folder := re.match(r"\s+(\w+/)(\s|$)", line):
            folders = {indent: name for indent, name in folders.items() if indent < depth}
            folders[depth] = folder[1]
        for name in re.findall(r"\w+\.py\b", line):
            inside = [*above, folder[1]] if folder else above
            yield "".join([*inside, name])


def test_the_layout_names_every_file_once() -> None:
    there = [
        file.relative_to(SOURCE).as_posix()
        for file in SOURCE.rglob("*.py")
        if file.name != "__init__.py"
    ]
    assert sorted(named_files()) == sorted(there)
