"""What a page holds, read by the standard library's parser."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from typing import Any

VOID = ("img", "input", "meta", "link", "br")


class Page(HTMLParser):
    """``elements`` are names with attributes, ``text`` is what people read, ``data`` by id."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.read: list[str] = []
        self.scripts: list[str] = []
        self.styles: list[str] = []
        self.data: dict[str, Any] = {}
        self.open: list[str] = []
        self.feed(html)
        self.close()
        assert not self.open, "elements that do not end"

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.read).split())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        inside, attributes = self.open[-1] if self.open else "", self.elements[-1:]
        if inside == "style":
            self.styles.append(data)
        elif inside == "script":
            about = attributes[0][1]
            if about.get("type") == "application/json":
                self.data[str(about["id"])] = json.loads(data)
            else:
                self.scripts.append(data)
        else:
            self.read.append(data)

    def of(self, name: str) -> list[dict[str, str | None]]:
        return [attributes for tag, attributes in self.elements if tag == name]

    @property
    def numbers(self) -> set[float]:
        """The numbers of all tables, with all their digits."""
        return {float(str(cell["data-value"])) for cell in self.of("td") if "data-value" in cell}


def assert_needs_nothing_else(page: Page) -> None:
    """Nothing is fetched: no address but in the page itself, and a policy that says so."""
    for _, attributes in page.elements:
        for name in ("src", "href", "data", "poster", "srcset", "action"):
            assert (attributes.get(name) or "#").startswith(("#", "data:"))
    for style in page.styles:
        assert "@import" not in style
        assert "url(" not in style
    assert not page.of("link")
    assert not page.of("iframe")
    policies = [each for each in page.of("meta") if "http-equiv" in each]
    assert [str(each["content"]).startswith("default-src 'none'") for each in policies] == [True]
