"""What stands around the code is true of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from flexspine import __version__

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "decisions").glob("*.md")),
    *sorted((ROOT / "docs" / "models").glob("*.md")),
]
LINK = re.compile(r"\]\((?!https?:|mailto:|#)([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_between_files_lead_somewhere(page: Path) -> None:
    """As a reader of the repository sees them; the site's own are checked when it is made."""
    missing = [
        link
        for link in LINK.findall(page.read_text(encoding="utf-8"))
        if not (page.parent / link).exists() and not _made_with_the_site(page.parent / link)
    ]
    assert not missing


def _made_with_the_site(path: Path) -> bool:
    made = [ROOT / "docs" / "reference", ROOT / "docs" / "gallery"]
    return any(parent in path.resolve().parents for parent in made)


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == __version__
    assert citation["license"] == "MIT"
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()


def test_the_changelog_begins_with_what_is_to_come_or_with_this_version() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    first = re.search(r"^## (\S+)", text, flags=re.MULTILINE)
    assert first is not None
    assert first[1] in ("Unreleased", __version__)


def test_environment_names_every_dependency() -> None:
    """Users of conda get what users of pip get."""
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    environment = (ROOT / "environment.yml").read_text(encoding="utf-8").lower()
    names = [re.split(r"[<>=\[ ]", line)[0].lower() for line in project["dependencies"]]
    absent = [name for name in names if name not in environment]
    assert not absent
