"""Pictures and films of a directory, embedded in the page."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from pathlib import Path

from flexspine.report.page.markup import Markup, joined, tag

KINDS = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".gif": "image/gif",
    ".mp4": "video/mp4",
}


def picture_section(files: Iterable[Path]) -> Markup:
    """Show pictures and films one below the other."""
    return joined(map(_shown, files))


def _shown(file: Path) -> Markup:
    kind = KINDS[file.suffix.lower()]
    text = base64.b64encode(file.read_bytes()).decode("ascii")
    source = f"data:{kind};base64,{text}"
    if kind.startswith("video"):
        shown = tag("video", src=source, controls="", loop="", preload="auto")
    else:
        shown = tag("img", src=source, alt=file.name)
    return tag("figure", shown, tag("figcaption", file.name))
