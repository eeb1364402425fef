"""Results as one HTML page that needs nothing beside it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

from flexspine.errors import OUT_OF_SPACE, InputError, OutputError
from flexspine.report.page.branches import branch_section
from flexspine.report.page.gaits import gait_section
from flexspine.report.page.holdings import Holdings, survey
from flexspine.report.page.markup import Markup, code, folded, joined, table, tag
from flexspine.report.page.parameters import of_record, of_run
from flexspine.report.page.pictures import picture_section
from flexspine.report.page.reading import DAMAGED
from flexspine.report.page.reproduce import reproduce_section
from flexspine.report.page.runs import run_section
from flexspine.report.page.summary import record_summary
from flexspine.report.page.tables import table_section
from flexspine.report.page.titles import title_of
from flexspine.report.page.verdicts import verdict_section
from flexspine.studies.store import write_whole

Progress = Callable[[str, float], None]
Section = tuple[str, str, Callable[[], Markup]]

PAGE = "report.html"
SUFFIXES = (".html", ".htm")

# What a page may load: what is in it.
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
POLICY += " blob:; media-src data:"

# Where scripts draw with Plotly.
DRAWN = 'class="plot"'


def write_report(
    directory: str | Path, file: str | Path | None = None, *, progress: Progress | None = None
) -> Path:
    """Write a directory of results as one HTML page, and return where (``report.html`` in it).

    The page opens offline and loads nothing; what cannot be read is named on it. ``progress`` is
    told what is done and the share of it. Raises `InputError` for a directory without results of
    flexspine, and `OutputError` where no page can be written.
    """
    path = Path(directory)
    place = path / PAGE if file is None else Path(file)
    if place.suffix.lower() not in SUFFIXES:
        raise OutputError(
            f"cannot write a page as '{place.name}'", "give a name that ends in .html"
        )
    if place.is_dir():
        raise OutputError(f"'{place}' is a directory", "give another name")
    page = document(path, leave=place, progress=progress).encode()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        write_whole(place, page)
    except OSError as failure:
        if failure.errno in OUT_OF_SPACE:
            raise
        raise OutputError(
            f"cannot write to '{place}' ({failure.strerror})", "give another name"
        ) from None
    return place


def document(path: Path, *, leave: Path | None = None, progress: Progress | None = None) -> str:
    """Return the page of a directory of results; the file ``leave`` in it is none of them.

    ``progress`` is told what is done and the share of it. Raises `InputError` for a directory
    without results of flexspine that can be read.
    """
    show = progress or (lambda _what, _share: None)
    show("reading", 0.0)
    holdings = survey(path, leave)
    planned = list(_sections(holdings))
    parts = []
    for number, (name, title, build) in enumerate(planned):
        show(f"writing {title.lower()}", number / len(planned))
        parts.append((f"{name}-{number}", title, guarded(build)))
    items = [tag("li", tag("a", title, href=f"#{name}")) for name, title, _ in parts]
    body = [tag("section", tag("h2", title), part, id=name) for name, title, part in parts]
    title = title_of(holdings)
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Markup(_text("page.css"))),
    )
    top = tag(
        "header",
        tag("h1", title),
        tag("p", f"Results in {holdings.name}/", class_="note"),
        *(tag("p", message, class_="outcome bad") for message in holdings.unreadable.values()),
        tag("nav", tag("ol", *items), aria_label="contents"),
    )
    scripts = _scripts(drawn=any(DRAWN in part for _, _, part in parts))
    ending = [tag("script", Markup(script)) for script in scripts]
    whole = tag("html", head, tag("body", top, tag("main", *body), *ending), lang="en")
    return f"<!DOCTYPE html>\n{whole}\n"


def guarded(build: Callable[[], Markup]) -> Markup:
    """Return a part of the page, or why there is none.

    A file may have a known name and anything in it, and the rest of the page is worth having.
    """
    try:
        return build()
    except InputError as failure:
        why = failure.message
    except DAMAGED as failure:
        why = f"not as flexspine writes it, {failure!r}"
    return tag("p", f"This cannot be shown: {why}.", class_="outcome bad")


def _sections(holdings: Holdings) -> Iterator[Section]:
    """What there is, the most telling first."""
    if holdings.records:
        yield "summary", "Summary", partial(_summary, holdings)
    for record in holdings.records.values():
        if record.get("verdicts"):
            yield "verdicts", "Verdicts", partial(verdict_section, record["verdicts"])
    for number, (name, dataset) in enumerate(holdings.runs.items()):
        title = _named("Motion", name, holdings.runs)
        yield "run", title, partial(run_section, dataset, f"run-{number}")
    for number, (name, record) in enumerate(holdings.branches.items()):
        title = _named("Branch", name, holdings.branches)
        yield "branch", title, partial(branch_section, record, f"branch-{number}")
    if holdings.gaits:
        yield "gaits", "Gaits", partial(gait_section, holdings.gaits)
    if holdings.films:
        yield "films", "Films", partial(picture_section, holdings.films)
    if holdings.pictures:
        yield "pictures", "Pictures", partial(picture_section, holdings.pictures)
    if holdings.tables or holdings.rows is not None:
        yield "tables", "Tables", partial(table_section, holdings)
    for name, dataset in holdings.runs.items():
        yield "parameters", _named("Parameters", name, holdings.runs), partial(of_run, dataset)
    if holdings.models:
        yield "parameters", "Parameters", partial(_parameters, holdings.models)
    for name, text in holdings.texts.items():
        yield "text", name, partial(code, text)
    yield "reproduce", "How to do it again", partial(reproduce_section, holdings)
    if holdings.others:
        yield "others", "Other files", partial(_others, holdings)


def _named(title: str, name: str, several: Collection[str]) -> str:
    return title if len(several) == 1 else f"{title} ({name})"


def _summary(holdings: Holdings) -> Markup:
    tabled = {len(holdings.gaits), *(table.rows for table in holdings.tables.values())}
    several = len(holdings.records) > 1
    return joined(
        part
        for name, record in holdings.records.items()
        for part in (
            *([tag("h3", name)] if several else []),
            guarded(partial(record_summary, name, record, tabled)),
        )
    )


def _parameters(models: Mapping[str, dict[str, Any]]) -> Markup:
    """Those of each model, folded where there are several."""
    if len(models) == 1:
        return of_record(next(iter(models.values())))
    return joined(folded(name, of_record(model)) for name, model in models.items())


def _others(holdings: Holdings) -> Markup:
    rows = [
        (f"{file.name}/" if file.is_dir() else file.name, _size(file)) for file in holdings.others
    ]
    note = tag("p", "In the directory, but not shown here.", class_="note")
    return joined([note, table(("name", "size"), rows)])


def _size(file: Path) -> str | None:
    """In kB, nothing of what is no file."""
    return f"{file.stat().st_size / 1000:.0f} kB" if file.is_file() else None


def _scripts(*, drawn: bool) -> list[str]:
    """Plotly once, then ours; without plots only what puts tables in order."""
    if not drawn:
        return [_text("page.js")]
    from plotly.offline import get_plotlyjs

    names = ("player.js", "plots.js", "scatter.js", "page.js")
    return [get_plotlyjs(), *map(_text, names)]


def _text(name: str) -> str:
    return files("flexspine.report.page").joinpath(name).read_text(encoding="utf-8")
