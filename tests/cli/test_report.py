"""`flexspine report` from end to end."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from flexspine.studies import store
from tests.cli.conftest import Cli, run_here
from tests.cli.test_gait import assert_one_clear_line
from tests.report.pages import Page, assert_needs_nothing_else


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a run leaves behind; tests take a copy."""
    folder = tmp_path_factory.mktemp("made") / "run"
    assert run_here("bound", "--no-animation", "--out", folder).returncode == 0
    return folder


@pytest.fixture
def results(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "run"))


def test_a_run_becomes_a_page_beside_it(cli: Cli, results: Path) -> None:
    done = cli("report", "run")
    assert (done.returncode, done.stderr) == (0, "")
    file = results / "report.html"
    told = f"run/report.html ({file.stat().st_size / 1e6:.1f} MB)\n"
    assert done.stdout == told
    page = Page(file.read_text(encoding="utf-8"))
    assert_needs_nothing_else(page)
    assert "flexspine bound --no-animation --out" in page.text
    record = json.loads((results / "summary.json").read_text())
    assert {record["duration"], record["mean_speed"]} <= page.numbers
    images = [str(image["src"]) for image in page.of("img")]
    assert len(images) == 2
    assert all(image.startswith("data:image/png;base64,") for image in images)


def test_the_command_is_kept_as_it_was_given(cli: Cli, tmp_path: Path) -> None:
    given = ("bound", "--preset", "scout2", "--no-animation", "--json", "--out", "my run")
    assert cli(*given).returncode == 0
    told = "flexspine bound --preset scout2 --no-animation --json --out 'my run'\n"
    assert (tmp_path / "my run" / "command.txt").read_text() == told


def test_what_cannot_be_read_is_named_on_the_page(cli: Cli, results: Path) -> None:
    (results / "trajectory.nc").write_bytes(b"nothing")
    done = cli("report", "run")
    assert (done.returncode, done.stderr) == (0, "")
    page = Page((results / "report.html").read_text(encoding="utf-8"))
    assert "cannot read 'run/trajectory.nc'" in page.text


def test_again_gives_the_same_and_does_not_show_itself(cli: Cli, results: Path) -> None:
    assert cli("report", "run").returncode == 0
    before = (results / "report.html").read_bytes()
    assert cli("report", "run").returncode == 0
    assert (results / "report.html").read_bytes() == before


def test_its_place_may_be_told_in_any_way(cli: Cli, results: Path) -> None:
    for _ in range(2):
        assert cli("report", "run", "--out", results / "page.html").returncode == 0
    page = Page((results / "page.html").read_text(encoding="utf-8"))
    assert "trajectory.csv" in page.text
    assert "page.html" not in page.text


def test_json_and_another_place(cli: Cli, results: Path, tmp_path: Path) -> None:
    done = cli("report", "run", "--out", "pages/bound.html", "--json")
    record = json.loads(done.stdout)
    file = tmp_path / "pages" / "bound.html"
    assert record["file"] == "pages/bound.html"
    assert record["bytes"] == file.stat().st_size
    assert not (results / "report.html").exists()


BAD = {
    "no directory": (("missing",), "no directory"),
    "nothing in it": (("empty",), "no results of flexspine"),
    "a name for something else": (("run", "--out", "page.pdf"), "ends in .html"),
    "a directory in its place": (("run", "--out", "folder.html"), "is a directory"),
    "a file for a directory": (("run", "--out", "run/summary.json/page.html"), "cannot write to"),
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.usefixtures("results")
def test_bad_input_is_one_clear_line(cli: Cli, tmp_path: Path, case: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "folder.html").mkdir()
    arguments, told = BAD[case]
    assert_one_clear_line(cli("report", *arguments), told)


def test_a_full_disk_leaves_the_page_that_was_there(
    cli: Cli, results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (results / "report.html").write_text("earlier")

    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store.os, "fsync", full)
    done = cli("report", "run")
    assert done.returncode == 3
    assert (results / "report.html").read_text() == "earlier"
    assert sorted(path.name for path in results.iterdir() if "partial" in path.name) == []
