"""Writes the pages of the site that follow from the code, into ``docs/reference``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from api_pages import api_pages
from command_pages import command_pages
from equation_pages import equation_pages
from parameter_pages import parameter_pages

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def write_pages(app: Sphinx) -> None:
    """Write all of them; files that stay as they are keep their time, so as not to be read anew."""
    root = Path(app.srcdir) / "reference"
    pages: dict[str, str] = {}
    for part in (parameter_pages(), equation_pages(), command_pages(), api_pages()):
        pages |= part
    _remove_others(root, pages)
    for name, text in pages.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def _remove_others(root: Path, pages: Mapping[str, str]) -> None:
    for path in root.rglob("*.md"):
        if path.relative_to(root).as_posix() not in pages:
            path.unlink()


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx of them."""
    app.connect("builder-inited", write_pages, priority=100)  # before the gallery
    return {"parallel_read_safe": True, "parallel_write_safe": True}
