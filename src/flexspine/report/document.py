"""Results as one HTML page that needs nothing beside it."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

from flexspine.report.caption import heading
from flexspine.report.page.holdings import Holdings, survey
from flexspine.report.page.markup import Markup, code, folded, joined, table, tag
from flexspine.report.page.parameters import of_run, of_values
from flexspine.report.page.reproduce import reproduce_section
from flexspine.report.page.runs import run_section
from flexspine.report.page.summary import record_summary
from flexspine.report.page.tables import table_section
from flexspine.report.page.verdicts import verdict_section

Progress = Callable[[str, float], None]
Section = tuple[str, str, Markup]

# What a page may load: what is in it.
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
POLICY += " blob:"

# What results are, by the name of their record.
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

# Of a gait, beside its name: words and key.
OF_GAIT = {
    "mean speed (m/s)": "mean_speed",
    "energy (J)": "energy",
    "period (s)": "period",
    "stride length (m)": "stride_length",
    "cost of transport": "cost_of_transport",
    "spectral radius": "level_spectral_radius",
    "family": "family",
}


def document(path: Path, *, leave: Path | None = None, progress: Progress | None = None) -> str:
    """Return the page of a directory of results; the file ``leave`` in it is none of them.

    ``progress`` is told what is done and the share of it. Raises `InputError` for a directory
    without results of flexspine, or with some that cannot be read.
    """
    show = progress or (lambda _what, _share: None)
    show("reading", 0.0)
    holdings = survey(path, leave)
    sections = []
    for number, (name, title, body) in enumerate(_sections(holdings, show)):
        sections.append((f"{name}-{number}", title, body))
    title = _title(holdings)
    contents = tag(
        "nav",
        tag("ol", *(tag("li", tag("a", words, href=f"#{name}")) for name, words, _ in sections)),
        aria_label="contents",
    )
    body = tag(
        "main",
        *(tag("section", tag("h2", words), part, id=name) for name, words, part in sections),
    )
    scripts = _scripts() if holdings.runs else [_text("page.js")]
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Markup(_text("page.css"))),
    )
    folder = tag("p", f"Results in {path.resolve().name}/", class_="note")
    whole = tag(
        "html",
        head,
        tag(
            "body",
            tag("header", tag("h1", title), folder, contents),
            body,
            *(tag("script", Markup(script)) for script in scripts),
        ),
        lang="en",
    )
    return f"<!DOCTYPE html>\n{whole}\n"


def _title(holdings: Holdings) -> str:
    """The name of what the results are of."""
    for name, record in holdings.records.items():
        stem = name.removesuffix(".json")
        if stem in TITLES:
            return TITLES[stem]
        if "about" in record:
            return f"Surviving a {record['about']}"
    for dataset in holdings.runs.values():
        return heading(dataset)
    if holdings.manifest is not None:
        return f"Sweep {holdings.path.resolve().name}"
    return f"Results in {holdings.path.resolve().name}"


def _sections(holdings: Holdings, show: Progress) -> Iterator[Section]:
    """What there is, the most telling first."""
    if holdings.records:
        yield "summary", "Summary", _summary(holdings)
    for record in holdings.records.values():
        if record.get("verdicts"):
            yield "verdicts", "Verdicts", verdict_section(record["verdicts"])
    for number, (name, dataset) in enumerate(holdings.runs.items()):
        show(f"drawing {name}", number / len(holdings.runs))
        yield "run", _named("Motion", name, holdings), run_section(dataset, f"run-{number}")
    if holdings.gaits:
        yield "gaits", "Gaits", _gaits(holdings.gaits)
    if holdings.pictures:
        show("embedding pictures", 0.0)
        yield "pictures", "Pictures", joined(map(_picture, holdings.pictures))
    if holdings.tables or holdings.rows is not None:
        show("writing tables", 0.0)
        yield "tables", "Tables", table_section(holdings.tables, holdings.rows)
    for name, dataset in holdings.runs.items():
        yield "parameters", _named("Parameters", name, holdings), of_run(dataset)
    for name, text in holdings.texts.items():
        yield "text", name, code(text)
    yield "reproduce", "How to do it again", reproduce_section(holdings)
    if holdings.others:
        yield "others", "Other files", _others(holdings)


def _named(title: str, name: str, holdings: Holdings) -> str:
    return title if len(holdings.runs) == 1 else f"{title} ({name})"


def _summary(holdings: Holdings) -> Markup:
    several = len(holdings.records) > 1
    return joined(
        part
        for name, record in holdings.records.items()
        for part in (*([tag("h3", name)] if several else []), record_summary(name, record))
    )


def _picture(file: Path) -> Markup:
    kind = "png" if file.suffix.lower() == ".png" else "jpeg"
    text = base64.b64encode(file.read_bytes()).decode("ascii")
    image = tag("img", src=f"data:image/{kind};base64,{text}", alt=file.name)
    return tag("figure", image, tag("figcaption", file.name))


def _gaits(gaits: dict[str, dict[str, Any]]) -> Markup:
    rows = [
        (name, gait.get("preset"), *(gait.get(key) for key in OF_GAIT.values()))
        for name, gait in gaits.items()
    ]
    parameters = (
        folded(name, of_values(str(gait.get("model")), gait)) for name, gait in gaits.items()
    )
    whole = table(("file", "preset", *OF_GAIT), rows, sortable=True)
    return joined([whole, folded("parameters of each", *parameters)])


def _others(holdings: Holdings) -> Markup:
    rows = [
        (f"{file.name}/" if file.is_dir() else file.name, None if file.is_dir() else _size(file))
        for file in holdings.others
    ]
    note = tag("p", "In the directory, but not shown here.", class_="note")
    return joined([note, table(("name", "size"), rows)])


def _size(file: Path) -> str:
    return f"{file.stat().st_size / 1000:.0f} kB"


def _scripts() -> list[str]:
    """Plotly once, then ours."""
    from plotly.offline import get_plotlyjs

    return [get_plotlyjs(), *map(_text, ("player.js", "plots.js", "page.js"))]


def _text(name: str) -> str:
    return files("flexspine.report.page").joinpath(name).read_text(encoding="utf-8")
