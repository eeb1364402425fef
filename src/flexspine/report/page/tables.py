"""Tables that can be put in order by a click, with a plot of any column over any other."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

from flexspine.parameters import is_finite, is_number
from flexspine.report.page.holdings import Holdings
from flexspine.report.page.markup import Markup, data, folded, joined, table, tag, told
from flexspine.report.page.reading import Table
from flexspine.report.page.words import unit_of

Columns = Mapping[str, Sequence[Any]]

# Letters of a text in a table that are shown; all are in the cell's title.
LONGEST_TEXT = 60

# Points that make a plot worth while, and values of a text that colours can tell apart.
FEWEST_POINTS, MOST_COLORS = 3, 8

# Significant digits of numbers that are plotted.
DIGITS = 6

# Digits to which values are the same.
SAME = 12

# Before the names of what a sweep varied.
VARIED = "at_"

# Columns that only count.
COUNTS = ("point", "run", "seed", "gait", "position", "schema_version")

SCALES = ("linear", "log up", "log across", "log both")


class View(NamedTuple):
    """What is drawn at first: ``up`` is the first of these columns that there is."""

    across: str = ""
    up: tuple[str, ...] = ()
    color: str = ""
    scale: str = SCALES[0]


# By the name of the table.
VIEWS = {
    "apexes": View("stride", ("deviation",)),
    "branch": View(up=("peak_grf.fore",)),
    "damping": View("spine_damping", ("cost_of_transport",), "actuator", SCALES[2]),
    "front": View("cost_of_transport", ("peak_grf",)),
    "gaits": View("mean_speed", ("peak_grf_fore",)),
    "limits": View("speed", ("acting_noise", "sensing_noise", "push_forward", "step_up")),
    "map": View("mean_speed", ("peak_grf",), "spine_stiffness"),
    "pinned": View("time", ("difference_at_step_0.0005",), scale=SCALES[1]),
    "spines": View("asked_speed", ("peak_normal",)),
    "stiffness": View("spine_stiffness", ("peak_grf_fore",), "mean_speed"),
}

# What colours points unless somebody chooses, and those of what a sweep varied, in this order.
TELLING = ("animal", "body", "design", "outcome", "kind", "spine", "case", "model", "stable")
MEASURED = ("outcome", "peak_grf_fore", "peak_normal", "strides")


def table_section(holdings: Holdings) -> Markup:
    """Show tables one below the other, and the rows of a sweep."""
    found = dict(holdings.tables)
    if holdings.rows is not None:
        found["rows/"] = holdings.rows
    return joined(_part(name, each, f"table-{i}") for i, (name, each) in enumerate(found.items()))


def _part(name: str, found: Table, key: str) -> Markup:
    some = len(next(iter(found.first.values()), ()))
    more = f", of which the first {some} are shown" if some < found.rows else ""
    return joined(
        [
            tag("h3", name),
            tag("p", f"{found.rows} row{'s' * (found.rows != 1)}{more}.", class_="note"),
            plot(found.sample, key, VIEWS.get(PurePath(name).stem, View())),
            shown(found.first),
        ]
    )


def shown(columns: Columns) -> Markup:
    """Return columns as a table, without those in which all rows have the same: they are told."""
    count = len(next(iter(columns.values()), ()))
    same = {
        name: values[0]
        for name, values in columns.items()
        if count > 1 and len({_rounded(value) for value in values}) == 1
    }
    varied = {name: values for name, values in columns.items() if name not in same}
    parts = []
    if varied:
        rows = zip(*([_cell(value) for value in values] for values in varied.values()), strict=True)
        parts.append(table([_titled(*column) for column in varied.items()], rows, sortable=True))
    if same:
        rows_ = [(_titled(name, [value]), _cell(value)) for name, value in same.items()]
        parts.append(folded("the same in all of these rows", table(("column", "value"), rows_)))
    return joined(parts)


def plot(columns: Columns, key: str, view: View) -> Markup:
    """Return a plot of a table, under an id, in which people choose what is drawn over what.

    Nothing for a table with fewer than two columns of numbers, or too few rows.
    """
    drawn = {name: _numbers(values) for name, values in columns.items()}
    numbers = {name: values for name, values in drawn.items() if len(set(values) - {None}) > 1}
    if len(numbers) < 2 or len(next(iter(numbers.values()))) < FEWEST_POINTS:
        return Markup()
    texts = {name: list(map(told, values)) for name, values in columns.items() if _tells(values)}
    across = {name: _head(name) for name in numbers}
    heads = {**{name: name for name in texts}, **across}
    x, y, color, only = _choice(numbers, texts, view)
    parts = {json.dumps([n, v]): f"{n}: {v}" for n, vs in texts.items() for v in dict.fromkeys(vs)}
    chosen = [
        _select("across", across, x),
        _select("up", across, y),
        _select("scale", {name: name for name in SCALES}, view.scale),
        _select("colour", {"": "none", **heads}, color),
        *([_select("only", {"": "all", **parts}, only)] if texts else []),
    ]
    return tag(
        "div",
        tag("div", *chosen, class_="controls"),
        tag("div", class_="plot"),
        data(key, {"numbers": numbers, "texts": texts, "heads": heads}),
        class_="scatter",
        data_scatter=key,
    )


def _select(name: str, options: Mapping[str, str], usual: str) -> Markup:
    """A list to choose from: what scripts read, and what people do."""
    listed = [
        tag("option", told_, value=value, **({"selected": ""} if value == usual else {}))
        for value, told_ in options.items()
    ]
    return tag("label", name, tag("select", *listed, name=name))


def _choice(numbers: Columns, texts: Columns, view: View) -> tuple[str, str, str, str]:
    """What is drawn at first: across, up, in which colours, and only which part of it.

    Without a view it is what a sweep varied (of its first model), or the first columns.
    """
    telling = [name for name in numbers if name not in COUNTS]
    varied = [name for name in telling if name.startswith(VARIED)]
    usual = (*varied, *telling, *numbers)
    x = next(name for name in (view.across, *usual) if name in numbers)
    y = next(name for name in (*view.up, *usual) if name in numbers and name != x)
    of_texts = [name for name in (*TELLING, *texts) if name in texts]
    wanted = MEASURED if len(varied) > 1 else of_texts
    known = [name for name in (view.color, *wanted) if name in texts or name in numbers]
    apart = len(varied) > 1 and "model" in texts
    only = json.dumps(["model", texts["model"][0]]) if apart else ""
    return x, y, known[0] if known else "", only


def _tells(values: Sequence[Any]) -> bool:
    """Whether a column has texts that can be told apart by colours."""
    kinds = isinstance(next((value for value in values if value is not None), None), str | bool)
    return kinds and 1 < len(set(map(told, values))) <= MOST_COLORS


def _numbers(values: Sequence[Any]) -> list[float | None]:
    """Numbers as they are plotted, gaps as None; none of a column with anything else in it."""
    if not all(value is None or is_number(value) for value in values):
        return []
    return [float(f"{value:.{DIGITS}g}") if is_finite(value) else None for value in values]


def _titled(name: str, values: Sequence[Any]) -> str:
    """The head of a column; only numbers have a unit."""
    return _head(name) if any(map(is_number, values)) else name


def _head(name: str) -> str:
    unit = "" if "[" in name else unit_of(name)
    return f"{name} ({unit})" if unit else name


def _cell(value: Any) -> Any:
    """A long text cut short; one that is a list of numbers with few digits."""
    if not isinstance(value, str) or len(value) <= LONGEST_TEXT:
        return value
    try:
        text = told(json.loads(value))
    except (ValueError, RecursionError):
        text = value
    if len(text) > LONGEST_TEXT:
        return tag("span", f"{text[: LONGEST_TEXT - 1]}…", title=value)
    return text


def _rounded(value: Any) -> str:
    return f"{value:.{SAME}g}" if is_number(value) else repr(value)
