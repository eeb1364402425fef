"""Verdicts on the claims of a study, with numbers and the runs behind them."""

from __future__ import annotations

from typing import Any

from flexspine.report.page.markup import Markup, folded, joined, table, tag, told


def verdict_section(verdicts: list[dict[str, Any]]) -> Markup:
    """Return a table of the claims and what the runs say about them."""
    rows = [
        (
            verdict["claim"],
            verdict["statement"],
            tag("strong", verdict["verdict"], class_=f"verdict {verdict['verdict'].split()[0]}"),
            joined([verdict["finding"], _numbers(verdict.get("numbers", {}))]),
            _behind(verdict),
        )
        for verdict in verdicts
    ]
    return table(("", "claim", "verdict", "what the runs show", "runs behind it"), rows)


def _numbers(numbers: dict[str, Any]) -> Markup:
    if not numbers:
        return Markup()
    return folded(
        "numbers", table(("name", "value"), [(_words(n), told(v)) for n, v in numbers.items()])
    )


def _behind(verdict: dict[str, Any]) -> Markup:
    """The gaits that are quoted, or the command that repeats the runs."""
    if verdict.get("command"):
        return tag("code", verdict["command"])
    runs = [
        tag("li", tag("code", run["gait"]), f" at {run['mean_speed']:.4g} m/s")
        for run in verdict.get("runs", ())
    ]
    return folded(f"{len(runs)} gaits", tag("ul", *runs)) if runs else Markup("none")


def _words(name: str) -> str:
    return name.replace("_", " ")
