"""The page on troubles has an entry for everything that runs, searches and branches tell."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest

import flexspine
from flexspine import errors
from flexspine.errors import FlexspineError
from flexspine.gaits import landmarks
from flexspine.gaits.search import ADVICE
from flexspine.hybrid.outcome import OutcomeKind

PAGE = Path(__file__).parents[1] / "docs" / "troubleshooting.md"
TEXT = PAGE.read_text(encoding="utf-8")


def headings(level: int) -> list[str]:
    return re.findall(rf"^{'#' * level} (.+)$", TEXT, flags=re.MULTILINE)


def section(title: str) -> str:
    """The text below a heading, up to the next one of the same level."""
    return TEXT.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def outcome_kinds() -> set[str]:
    """All that any module declares."""
    modules = [
        import_module(found.name) for found in walk_packages(flexspine.__path__, "flexspine.")
    ]
    return {
        value.name
        for module in modules
        for value in vars(module).values()
        if isinstance(value, OutcomeKind)
    }


def test_every_outcome_has_its_heading_and_no_heading_is_stale() -> None:
    told = {title for title in headings(2) if re.fullmatch(r"[a-z_]+", title)}
    assert {"completed", "fell", "grazed", "singular"} <= told
    assert told == outcome_kinds()


@pytest.mark.parametrize("outcome", sorted(outcome_kinds() - {"completed"}))
def test_every_outcome_is_told_with_what_to_do(outcome: str) -> None:
    text = section(outcome)
    for part in ("**What it means.**", "**Why.**", "**What to do.**"):
        assert part in text


def test_every_reason_of_a_search_is_told() -> None:
    assert set(re.findall(r"^\| `(\w+)` \|", section("No gait found"), flags=re.MULTILINE)) == {
        *ADVICE
    }


def test_every_end_of_a_branch_is_told() -> None:
    told = section("A branch ends early")
    for kind in (
        landmarks.SECOND_TOUCHDOWN,
        landmarks.GRAZING,
        landmarks.NO_FLIGHT,
        landmarks.REFUTED,
    ):
        assert f"| `{kind} at" in told


def test_every_exit_code_and_code_of_an_error_is_told() -> None:
    kinds = {
        value
        for value in vars(errors).values()
        if isinstance(value, type) and issubclass(value, FlexspineError) and value.code != "error"
    }
    told = section("Exit codes")
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", told, flags=re.MULTILINE)} >= {
        kind.exit_code for kind in kinds
    }
    for kind in kinds:
        assert f"`{kind.code}`" in told
