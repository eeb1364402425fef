"""How to get these results again."""

from __future__ import annotations

from typing import Any

from flexspine._version import __version__
from flexspine.report.page.holdings import Holdings
from flexspine.report.page.markup import Markup, folded, joined, table, tag, told

# What made a record, as far as it says.
MADE_WITH = ("flexspine", "preset", "model", "robot", "seed", "tolerance", "mujoco_version")
OF_RUNS = ("flexspine_version", "heyoka_version", "mujoco_version", "preset", "robot", "tolerance")


def reproduce_section(holdings: Holdings) -> Markup:
    """Return the commands that are recorded, or else the versions, seed and settings."""
    parts = [_sweep(holdings)] if holdings.manifest is not None else []
    commands = [
        verdict["command"]
        for record in holdings.records.values()
        for verdict in record.get("verdicts", [])
        if verdict.get("command")
    ]
    commands += [r["command"] for r in holdings.records.values() if r.get("command")]
    if commands:
        listed = [tag("li", tag("code", command)) for command in dict.fromkeys(commands)]
        parts += [tag("p", "Commands that are recorded:"), tag("ul", *listed)]
    if holdings.gaits:
        example = f"flexspine bound --gait {next(iter(holdings.gaits))} --strides 3 --out run"
        parts.append(tag("p", "A gait runs again by ", tag("code", example), "."))
    made = [*_of_records(holdings), *_of_runs(holdings)]
    if made:
        if not (commands or holdings.manifest):
            note = "The command is not recorded; this made the results:"
            parts.append(tag("p", note, class_="note"))
        parts.append(table(("file", "what", "value"), made))
    parts.append(tag("p", f"This page was made by flexspine {__version__}.", class_="note"))
    return joined(parts)


def _sweep(holdings: Holdings) -> Markup:
    """A sweep is made again from its manifest."""
    manifest = holdings.manifest or {}
    plan: dict[str, Any] = manifest.get("plan", {})
    models = [_name(model) for model in plan.get("models", [])]
    asked = {
        **{name: value for name, value in plan.items() if name not in ("models", "axes")},
        **{f"axis {name}": value for name, value in plan.get("axes", {}).items()},
    }
    command = tag("code", f"flexspine rerun {holdings.path.name}")
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


def _of_records(holdings: Holdings) -> list[tuple[str, str, Any]]:
    rows: list[tuple[str, str, Any]] = []
    for file, record in holdings.records.items():
        rows += [(file, name, record[name]) for name in MADE_WITH if record.get(name) is not None]
        for group in ("settings", "setting"):
            rows += [(file, name, value) for name, value in record.get(group, {}).items()]
    return rows


def _of_runs(holdings: Holdings) -> list[tuple[str, str, Any]]:
    return [
        (file, name.replace("_", " "), dataset.attrs[name])
        for file, dataset in holdings.runs.items()
        for name in OF_RUNS
        if name in dataset.attrs
    ]
