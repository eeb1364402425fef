"""The Python examples of README.md and of the pages in docs/ are run as tests.

A page is one program; ``<!-- skip: next -->`` before an example that would take long leaves it out.
Pages with code cells are run when the site is made.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from sybil import Sybil
from sybil.parsers.markdown import PythonCodeBlockParser, SkipParser

HERE = Path(__file__).parent

# The site is made there, in `make test` at the same time.
collect_ignore = ["docs/_build", "docs/gallery", "docs/reference"]


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What examples write goes to a directory in which they find ``examples/``."""
    place = tmp_path_factory.mktemp("page")
    (place / "examples").symlink_to(HERE / "examples")
    before = Path.cwd()
    os.chdir(place)
    yield
    os.chdir(before)


pytest_collect_file = Sybil(
    parsers=[PythonCodeBlockParser(), SkipParser()],
    patterns=["README.md", "docs/*.md"],
    fixtures=["elsewhere"],
).pytest()
