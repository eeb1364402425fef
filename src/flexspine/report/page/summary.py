"""What a record says: its outcome first, then its main numbers in words with units."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from flexspine.parameters import is_number
from flexspine.report.page.holdings import is_gait
from flexspine.report.page.markup import Markup, code, folded, joined, table, tag, told
from flexspine.report.page.tables import View, plot, shown
from flexspine.report.page.words import WORDS, firm, plain, unit_of

# Told elsewhere on the page, or of no use to a reader of it.
ELSEWHERE = (
    "schema_version", "outcome", "message", "advice", "parameters", "apex", "touchdown_angles",
    "liftoff_angles", "provenance", "settings", "gains", "usual", "shown", "contact",
    "digest", "key", "verdicts", "walk", "landmarks", "points", "fronts", "about", "told",
    "verdict", "agrees",
    "tolerance", "preset", "model", "flexspine", "seed", "kind", "finished", "notes", "ground",
)  # fmt: skip

# Longer lists are for machines.
LONGEST_LIST = 12

# Names of what has more numbers inside, to be unfolded.
NESTED = ("measures", "setting")

# Lists of two that are a least and a largest value.
RANGES = ("normal", "height", "pitch", "speeds", "spine")

# Lists that are worth a plot, by their words.
PLOTTED = {
    "bounder: levels": View("share", ("place",), scale="log both"),
    "trot: grounds": View("stiffness", ("angle",), scale="log both"),
}

GOOD = "completed"

Keys = tuple[str, ...]


def record_summary(name: str, record: Mapping[str, Any], tabled: Collection[int] = ()) -> Markup:
    """Return the outcome of a record in words, its main numbers, and all of it, folded.

    Lists with as many entries as a table of the page has rows (``tabled``) are left to that.
    """
    parts = [outcome(record), *_told(record)]
    found = [each for key, value in record.items() for each in _entries((key,), value)]
    rows = [row for row in found if not isinstance(row[1], Rows)]
    if rows:
        parts.append(table(("quantity", "value", "unit"), rows))
    for title, several, _ in found:
        if isinstance(several, Rows) and len(several) not in tabled:
            parts.append(tag("h4", title))
            if title in PLOTTED:
                parts.append(plot(several.columns, f"{name} {title}", PLOTTED[title]))
            parts.append(shown(several.columns))
    parts.append(folded(f"all of {name}", code(json.dumps(record, indent=2))))
    if isinstance(record.get("walk"), Mapping):
        parts += [tag("h4", "The walk that was found"), record_summary("it", record["walk"])]
    return joined(parts)


def outcome(record: Mapping[str, Any]) -> Markup:
    """Return how a run ended, with advice if it ended early, or whether engines agree."""
    if isinstance(record.get("agrees"), bool):
        good, text = record["agrees"], "they agree" if record["agrees"] else "they do not agree"
        return tag("p", tag("strong", text), class_="outcome good" if good else "outcome bad")
    if "outcome" not in record:
        return Markup()
    name = str(record["outcome"])
    good = name == GOOD
    told_ = [tag("strong", plain(name)), f": {record.get('message', '')}"]
    if not good and record.get("advice"):
        told_.append(f". Advice: {record['advice']}")
    return tag("p", *told_, class_="outcome good" if good else "outcome bad")


class Rows(list[dict[str, Any]]):
    """Entries that are alike, for a table of their own."""

    @property
    def columns(self) -> dict[str, list[Any]]:
        """By the names of what they hold, None where one has it not."""
        names = dict.fromkeys(name for row in self for name in row)
        return {name: [row.get(name) for row in self] for name in names}


def _told(record: Mapping[str, Any]) -> list[Markup]:
    """What a record says itself in sentences."""
    texts = [record.get(name) for name in ("told", "verdict", "about", "ground")]
    verdicts = Counter(verdict["verdict"] for verdict in record.get("verdicts", ()))
    if verdicts:
        counts = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())
        texts.insert(0, f"{verdicts.total()} claims are judged: {counts}.")
    advice = record.get("advice") if "outcome" not in record else None
    return [tag("p", text) for text in (*texts, advice) if isinstance(text, str)]


def _entries(path: Keys, value: Any) -> Iterator[tuple[str, Any, str]]:
    """A number with words and unit, those inside of a mapping, or `Rows`."""
    name = path[-1]
    if name in ELSEWHERE or is_gait(value):
        return
    if _is_plain(value):
        yield _words(path), _shown(name, value), _unit(path)
    elif isinstance(value, Mapping):
        inner = () if name in NESTED else path
        if len(value) > 1 and all(isinstance(each, Mapping) for each in value.values()):
            several = Rows({"which": key, **_flat(each)} for key, each in value.items())
            yield _words(path, _unit(path)), several, ""
        elif len(value) > 1 and all(map(_is_rows, value.values())):
            named = ((_words((key,), _unit((key,))), each) for key, each in value.items())
            several = Rows({"which": key, **_flat(row)} for key, each in named for row in each)
            yield _words(path), several, ""
        else:
            for key, each in value.items():
                yield from _entries((*inner, str(key)), each)
    elif _is_rows(value):
        yield _words(path, _unit(path)), Rows(map(_flat, value)), ""


def _is_rows(value: Any) -> bool:
    """Whether something is a list of mappings."""
    listed = isinstance(value, list) and bool(value)
    return listed and all(isinstance(each, Mapping) for each in value)


def _flat(entry: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """What is plain in an entry of a list, by dotted name."""
    found: dict[str, Any] = {}
    for name, value in entry.items():
        if name in ELSEWHERE and name != "outcome":
            continue
        if isinstance(value, Mapping):
            found |= _flat(value, before if name in NESTED else f"{before}{name}.")
        elif _is_plain(value) or value is None:
            found[f"{before}{name}"] = _shown(name, value)
    return found


def _words(path: Keys, unit: str = "") -> str:
    words = ": ".join(WORDS[name][0] if name in WORDS else plain(name) for name in path)
    return f"{words} ({unit})" if unit else words


def _unit(path: Keys) -> str:
    """That of the last of the names that has one; an order of convergence has none."""
    if "orders" in path:
        return ""
    if len(path) > 1 and path[-1] in WORDS:
        return firm(WORDS[path[-1]][1])
    return unit_of("_".join(path)) or next(filter(None, map(unit_of, reversed(path))), "")


def _is_plain(value: Any) -> bool:
    if isinstance(value, list):
        return 0 < len(value) <= LONGEST_LIST and not any(
            isinstance(each, list | dict) for each in value
        )
    return is_number(value) or isinstance(value, bool | str)


def _shown(name: str, value: Any) -> Any:
    if isinstance(value, list):
        if name in RANGES and len(value) == 2:
            return f"{told(value[0])} to {told(value[1])}"
        return told(value)
    return value
