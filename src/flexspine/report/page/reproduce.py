"""How to get these results again."""

from __future__ import annotations

from typing import Any

from flexspine._version import __version__
from flexspine.report.page.holdings import Holdings
from flexspine.report.page.markup import Markup, code, folded, joined, table, tag, told
from flexspine.report.page.words import plain, unit_of

# What made a record, as far as it says.
MADE_WITH = (
    "flexspine",
    "preset",
    "model",
    "robot",
    "seed",
    "tolerance",
    "mujoco",
    "mujoco_version",
)
OF_RUNS = ("flexspine_version", "heyoka_version", "mujoco_version", "preset", "robot", "tolerance")


def reproduce_section(holdings: Holdings) -> Markup:
    """Return the commands that are recorded, and the versions, seed and settings."""
    parts = []
    if holdings.command:
        note = "This command made the results; files that it names are relative to where it ran:"
        parts += [tag("p", note), code(holdings.command)]
    if holdings.manifest is not None:
        parts.append(_sweep(holdings, holdings.manifest))
    commands = [
        verdict["command"]
        for record in holdings.records.values()
        for verdict in record.get("verdicts", [])
        if verdict.get("command")
    ]
    if commands:
        listed = [tag("li", tag("code", command)) for command in dict.fromkeys(commands)]
        parts += [tag("p", "Commands behind the verdicts:"), tag("ul", *listed)]
    if holdings.gaits:
        example = f"flexspine bound --gait {next(iter(holdings.gaits))} --strides 3 --out run"
        parts.append(tag("p", "A gait runs again by ", tag("code", example), "."))
    made = [*_of_records(holdings), *_of_runs(holdings)]
    if not holdings.command and holdings.manifest is None:
        note = "The command that made the results is not recorded."
        parts.append(tag("p", note, class_="note"))
    if made:
        parts.append(table(("file", "what", "value", "unit"), made))
    parts.append(tag("p", f"This page was made by flexspine {__version__}.", class_="note"))
    return joined(parts)


def _sweep(holdings: Holdings, manifest: dict[str, Any]) -> Markup:
    """A sweep is made again from its manifest."""
    plan: dict[str, Any] = manifest.get("plan", {})
    models = [_name(model) for model in plan.get("models", [])]
    asked = {
        **{name: value for name, value in plan.items() if name not in ("models", "axes")},
        **{f"axis {name}": value for name, value in plan.get("axes", {}).items()},
    }
    command = tag("code", f"flexspine rerun {holdings.name}")
    parts = [
        tag("p", command, " does it again and tells whether it comes out the same, bit for bit."),
        table(("what", "value"), [("models", told(models)), *asked.items()]),
    ]
    if manifest.get("made_with"):
        versions = table(("package", "version"), manifest["made_with"].items())
        parts.append(folded("made with", versions))
    if not manifest.get("finished", False):
        parts.append(
            tag("p", "It is not finished; the same command goes on.", class_="outcome bad")
        )
    return joined(parts)


def _name(model: Any) -> str:
    return str(model.get("name", "")) if isinstance(model, dict) else str(model)


def _of_records(holdings: Holdings) -> list[tuple[str, str, Any, str]]:
    rows: list[tuple[str, str, Any, str]] = []
    for file, record in holdings.records.items():
        made = {name: record[name] for name in MADE_WITH if record.get(name) is not None}
        rows += [(file, plain(name), value, "") for name, value in made.items()]
        # Those of a run stand with its parameters.
        asked = {} if holdings.runs else {**record.get("settings", {}), **record.get("setting", {})}
        rows += [(file, name, value, unit_of(name)) for name, value in asked.items()]
    return rows


def _of_runs(holdings: Holdings) -> list[tuple[str, str, Any, str]]:
    return [
        (file, plain(name), dataset.attrs[name], "")
        for file, dataset in holdings.runs.items()
        for name in OF_RUNS
        if name in dataset.attrs
    ]
