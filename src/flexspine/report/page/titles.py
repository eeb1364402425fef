"""The title of a page: what its results are of."""

from __future__ import annotations

from typing import Any

from flexspine.report.caption import heading
from flexspine.report.page.holdings import Holdings
from flexspine.report.page.reading import DAMAGED

# By the name of their record.
TITLES = {
    "study": "Rigid against flexible spines: the published claims",
    "branch": "A branch of gaits",
    "gaits": "Gaits",
    "limits": "The largest disturbances survived",
    "optimise": "Pareto fronts of gaits",
    "engines": "Motions beside MuJoCo's",
    "tune": "A search for the numbers of a walk",
    "comparison": "Flexible and locked spine, side by side",
}

# By what only their summary has.
MARKS = {
    "basins": "Basins of attraction of gaits",
    "lines": "A map of gaits over mean speed and spine stiffness",
    "walks": "Walks in space over spine stiffness and speed",
    "cases": "A pinned robot beside MuJoCo's",
}


def title_of(holdings: Holdings) -> str:
    """Return what the results are of, or else the name of their directory."""
    for name, record in holdings.records.items():
        stem = name.removesuffix(".json")
        if stem in TITLES:
            return TITLES[stem]
        if isinstance(record.get("about"), str):
            return f"Surviving a {record['about']}"
        for mark, title in MARKS.items():
            if mark in record:
                return title
    try:
        for dataset in holdings.runs.values():
            return heading(dataset) + _circumstances(dataset.attrs, holdings)
        if holdings.manifest is not None:
            plan = holdings.manifest["plan"]
            models = ", ".join(model["name"] for model in plan["models"])
            return f"Sweep {holdings.name}: {plan['task']} of {models}"
    except DAMAGED:
        pass
    return f"Results in {holdings.name}"


def _circumstances(attrs: dict[str, Any], holdings: Holdings) -> str:
    """The ground of a run if it is not flat, and whether it was steered."""
    steered = any("inputs" in record for record in holdings.records.values())
    ground = f", {attrs['ground']}" if "ground" in attrs else ""
    return f"{ground}{', under feedback' if steered else ''}"
