"""HTML that cannot be broken by what it shows: all text is escaped, only `Markup` is not."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any

from flexspine.parameters import is_number

# Elements without an end.
VOID = ("img", "input", "meta", "link", "br")

# Digits of numbers that people read; the whole number is in the cell's title.
DIGITS = 5


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


def tag(name: str, /, *parts: Any, **attributes: Any) -> Markup:
    """Return an element; attributes that are Python's words end in ``_``, as in ``class_``."""
    told = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
        for key, value in attributes.items()
    )
    if name in VOID:
        return Markup(f"<{name}{told}>")
    return Markup(f"<{name}{told}>{joined(parts)}</{name}>")


def joined(parts: Iterable[Any]) -> Markup:
    """Put parts one after the other, escaped unless they are HTML."""
    return Markup(
        "".join(part if isinstance(part, Markup) else html.escape(str(part)) for part in parts)
    )


def cell(value: Any) -> Markup:
    """Return a value of a table: numbers short, with all digits in the title."""
    if value is None:
        return tag("td", "-", class_="none")
    if is_number(value):
        # Not repr() itself, in which NumPy names its types.
        exact = repr(value if isinstance(value, int) else float(value))
        return tag("td", short(value), class_="number", title=exact, data_value=exact)
    return tag("td", value if isinstance(value, Markup) else told(value))


def short(value: Any) -> str:
    """Return a number as people read it."""
    return str(value) if isinstance(value, int) else f"{value:.{DIGITS}g}"


def told(value: Any) -> str:
    """Return any value of a record in words."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if is_number(value):
        return short(value)
    if isinstance(value, list | tuple):
        return ", ".join(map(told, value)) or "none"
    if isinstance(value, dict):
        return ", ".join(f"{name}: {told(each)}" for name, each in value.items()) or "none"
    return str(value)


def table(head: Sequence[str], rows: Iterable[Sequence[Any]], *, sortable: bool = False) -> Markup:
    """Return a table; a ``sortable`` one is put in order by a click on its head."""
    names = [tag("th", tag("button", name) if sortable else name, scope="col") for name in head]
    body = [tag("tr", *map(cell, row)) for row in rows]
    whole = tag(
        "table",
        tag("thead", tag("tr", *names)),
        tag("tbody", *body),
        class_="sortable" if sortable else "plain",
    )
    return tag("div", whole, class_="scroll")


def folded(title: str, *parts: Any) -> Markup:
    """Return what is shown when somebody asks for it."""
    return tag("details", tag("summary", title), *parts)


def code(text: str) -> Markup:
    """Return a block of text as it is."""
    return tag("pre", tag("code", text))


def data(name: str, value: Any) -> Markup:
    """Return what scripts read, under an id."""
    text = json.dumps(finite(value), allow_nan=False, separators=(",", ":"))
    # Nothing in it may end the element that holds it.
    safe = text.replace("<", "\\u003c")
    return Markup(f'<script type="application/json" id="{html.escape(name)}">{safe}</script>')


def finite(value: Any) -> Any:
    """Return data as JSON can hold it: numbers that are not finite become None."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite(each) for each in value]
    return value
