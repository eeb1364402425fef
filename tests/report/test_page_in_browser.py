"""A page in a browser: it draws, plays, asks for nothing and complains of nothing."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from flexspine import load_model, simulate, to_dataset, write_report
from flexspine.gaits.record import run_record
from flexspine.report.document import document
from tests.report.branches import branch_record
from tests.report.test_document import write

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra dev)")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs the program chromium")

# How many dots of the canvas are drawn.
DRAWN = """() => {
  const canvas = document.querySelector("canvas");
  const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((value, place) => place % 4 === 3 && value > 0).length;
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = simulate(load_model("kamimura2015-flexible"), strides=2)
    folder = write(tmp_path_factory.mktemp("page"), to_dataset(run), summary=run_record(run))
    (folder / "gaits.csv").write_text("number,name\n3,c\n1,a\n10,b\n")
    (folder / "report.html").write_text(document(folder), encoding="utf-8")
    return folder / "report.html"


@pytest.fixture
def complaints() -> list[str]:
    return []


@pytest.fixture
def page(browser: Browser, file: Path, complaints: list[str]) -> Iterator[Page]:
    """The page, on a machine that reaches nothing but files."""
    opened = browser.new_page(viewport={"width": 1000, "height": 800})

    def route(asked: Any) -> None:
        url = asked.request.url
        if url.startswith(("file:", "data:", "blob:")):
            asked.continue_()
        else:
            complaints.append(f"asked for {url}")
            asked.abort()

    opened.route("**/*", route)
    opened.on("console", lambda said: complaints.append(f"{said.type}: {said.text}"))
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.goto(file.as_uri())
    opened.wait_for_selector(".plot .main-svg")
    yield opened
    opened.close()


def move(page: Page, frame: int) -> None:
    page.eval_on_selector(
        ".player input",
        "(input, frame) => { input.value = frame; input.dispatchEvent(new Event('input')); }",
        frame,
    )


def clock(page: Page) -> float:
    told = page.inner_text(".player output")
    return float(told.removeprefix("t = ").removesuffix(" s"))


def test_it_draws_and_asks_for_nothing(page: Page, complaints: list[str]) -> None:
    assert page.evaluate(DRAWN) > 2000
    assert page.locator(".plot .scatterlayer .trace").count() >= 12
    page.wait_for_timeout(300)
    assert complaints == []


def test_the_slider_moves_animal_clock_and_cursor(page: Page, complaints: list[str]) -> None:
    last = int(page.get_attribute(".player input", "max") or 0)
    seen = []
    for frame in (0, last // 3, last):
        move(page, frame)
        left = page.eval_on_selector(".cursor", "cursor => parseFloat(cursor.style.left)")
        seen.append((clock(page), left, page.locator("canvas").screenshot()))
    times, places, pictures = zip(*seen, strict=True)
    # Two strides of the preset, each of 0.2527 s.
    assert times == pytest.approx((0, 2 * 0.2527 / 3, 2 * 0.2527), abs=2e-3)
    assert places[1] - places[0] == pytest.approx((places[2] - places[0]) / 3, rel=0.02)
    assert len(set(pictures)) == 3
    assert complaints == []


def test_keys_step_and_play_runs_to_the_end(page: Page, complaints: list[str]) -> None:
    page.focus("canvas")
    page.keyboard.press("ArrowRight")
    once = clock(page)
    assert once > 0
    page.keyboard.press("ArrowRight")
    assert clock(page) == pytest.approx(2 * once, abs=1.1e-3)
    page.keyboard.press("ArrowLeft")
    assert clock(page) == once
    page.select_option(".player select", "2")
    page.click(".player button")
    sync_api.expect(page.locator(".player button")).to_have_text("Play")
    assert clock(page) == pytest.approx(2 * 0.2527, abs=2e-3)
    assert complaints == []


def test_a_table_is_sorted_by_numbers_and_back(page: Page) -> None:
    head = page.locator("table.sortable th button", has_text="number")
    column = "rows => rows.map(row => row.cells[0].textContent)"
    rows = "section:has(h3:text('gaits.csv')) table.sortable tbody tr"
    head.click()
    assert page.eval_on_selector_all(rows, column) == ["1", "3", "10"]
    head.click()
    assert page.eval_on_selector_all(rows, column) == ["10", "3", "1"]


def test_nothing_is_wider_than_a_phone(page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 800})
    page.wait_for_timeout(300)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A branch, and a table of two cases with lines that no one can mistake."""
    folder = tmp_path_factory.mktemp("tables")
    (folder / "branch.json").write_text(json.dumps(branch_record()))
    rows = [f"{case},{x},{2 * x},{10.0**x}" for case in "ab" for x in range(5)]
    (folder / "rows.csv").write_text("\n".join(["case,x,twice,power", *rows]) + "\n")
    return write_report(folder)


def drawn(page: Page) -> list[tuple[str, list[float], list[float]]]:
    """The lines of the plot of a table: name, across, up."""
    data = "document.querySelector('.scatter .plot').data"
    found: list[list[Any]] = page.evaluate(f"{data}.map(one => [one.name ?? '', one.x, one.y])")
    return [(str(name), across, up) for name, across, up in found]


def test_a_branch_and_a_table_are_drawn_as_chosen(
    browser: Browser, tables: Path, complaints: list[str]
) -> None:
    page = browser.new_page(viewport={"width": 1000, "height": 800})
    page.on("console", lambda said: complaints.append(f"{said.type}: {said.text}"))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(tables.as_uri())
    page.wait_for_selector(".scatter .main-svg")
    assert page.locator("[data-branch] .scatterlayer .trace").count() >= 10
    assert "spine stiffness k_t (N m/rad)" in page.locator("[data-branch] .plot").inner_html()
    assert drawn(page) == [(case, [0, 1, 2, 3, 4], [0, 2, 4, 6, 8]) for case in "ab"]
    page.select_option(".scatter select[name=up]", "power")
    page.select_option(".scatter select[name=scale]", "log up")
    page.select_option(".scatter select[name=only]", label="case: b")
    assert drawn(page) == [("b", [0, 1, 2, 3, 4], [1, 10, 100, 1000, 10000])]
    axis = "document.querySelector('.scatter .plot')._fullLayout.yaxis.type"
    assert page.evaluate(axis) == "log"
    page.select_option(".scatter select[name=colour]", "x")
    assert drawn(page)[0][1] == [0, 1, 2, 3, 4]
    assert complaints == []
    page.close()
