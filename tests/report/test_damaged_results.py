"""Whatever is in a directory, its page is made, or one line tells why not."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from flexspine import load_model, simulate, to_dataset, write_report
from flexspine.errors import InputError
from flexspine.gaits.record import run_record
from flexspine.models.files import write_netcdf
from flexspine.report.document import document
from tests.report.branches import branch_record
from tests.report.pages import Page, assert_needs_nothing_else

# What a program of somebody else, or a slip, may have put in the place of anything.
ODD = (None, "text", -3, True, [], [1], {}, {"a": None}, [[]], [{"a": {"b": []}}])

VERDICT = {
    "claim": 1, "statement": "lower peaks", "verdict": "holds", "finding": "by 3 %",
    "numbers": {"ratio": 0.97}, "command": None, "runs": [{"mean_speed": 4.0, "gait": "a.json"}],
}  # fmt: skip


@pytest.fixture(autouse=True)
def _without_plotly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its megabytes are in every page, and of no account here."""
    monkeypatch.setattr("plotly.offline.get_plotlyjs", str)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    run = simulate(load_model("scout2"), strides=1)
    write_netcdf(to_dataset(run, interval=0.01), folder / "trajectory.nc")
    (folder / "summary.json").write_text(json.dumps(run_record(run)))
    (folder / "rows.csv").write_text("a,b\n1,2\n3,4\n5,7\n")
    return folder


@pytest.fixture
def results(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "results"))


@pytest.mark.parametrize("kept", [0.0, 0.02, 0.5, 0.99])
@pytest.mark.parametrize("name", ["trajectory.nc", "summary.json", "gaits.parquet"])
def test_a_file_that_ends_early_is_named_and_the_rest_shown(
    results: Path, name: str, kept: float
) -> None:
    file = results / name
    content = file.read_bytes() if file.exists() else b"PAR1" + bytes(300)
    file.write_bytes(content[: int(kept * len(content))])
    page = Page(document(results))
    assert_needs_nothing_else(page)
    assert (kept == 0 and name == "gaits.parquet") or f"cannot read '{file}'" in page.text
    assert "rows.csv" in page.text


def test_bytes_that_are_wrong_are_told(results: Path) -> None:
    """Here and there in the file, so that headers and data are hit."""
    content = (results / "trajectory.nc").read_bytes()
    for part in range(10):
        place = part * len(content) // 10
        wrong = content[:place] + bytes(range(64)) + content[place + 64 :]
        (results / "trajectory.nc").write_bytes(wrong)
        assert_needs_nothing_else(Page(document(results)))


def test_a_table_that_is_none_is_told(results: Path) -> None:
    (results / "gaits.csv").write_bytes(b"a,b\n1,2,3\n\xff\xfe\n")
    (results / "empty.csv").write_text("")
    page = Page(document(results))
    assert f"cannot read '{results / 'gaits.csv'}'" in page.text
    assert "empty.csv 0 rows." in page.text


@pytest.mark.parametrize("change", [{"parameters": "{"}, {"apex": "[1]"}])
def test_a_dataset_of_another_shape_costs_only_its_section(
    results: Path, change: dict[str, str]
) -> None:
    data = to_dataset(simulate(load_model("scout2"), strides=1), interval=0.01)
    write_netcdf(data.assign_attrs(change), results / "trajectory.nc")
    page = Page(document(results))
    assert "This cannot be shown: not as flexspine writes it" in page.text
    assert "run-0-reel" in page.data


def test_a_dataset_without_its_variables_costs_only_its_section(results: Path) -> None:
    data = to_dataset(simulate(load_model("scout2"), strides=1), interval=0.01)
    write_netcdf(data[["com_y"]], results / "trajectory.nc")
    page = Page(document(results))
    assert "This cannot be shown" in page.text
    assert "scout2" in page.text


def changed(record: Any) -> Iterator[Any]:
    """A record with something odd in the place of each of its parts, two levels down."""
    for key, value in record.items():
        for odd in ODD:
            yield {**record, key: odd}
        yield {each: record[each] for each in record if each != key}
        if isinstance(value, dict):
            yield from ({**record, key: inner} for inner in changed(value))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            yield from ({**record, key: [inner, *value[1:]]} for inner in changed(value[0]))


RECORDS: dict[str, dict[str, Any]] = {
    "summary": {
        "schema_version": 1, "outcome": "fell", "message": "it fell", "advice": "do",
        "peak_grf": {"fore": 1.0}, "settings": {"seconds": 2.0},
        "cells": [{"speed": 4.0, "limits": {"push": 1.0}}, {"speed": 4.5, "limits": {}}],
        "animals": {"one": {"preset": "scout2", "parameters": {"gravity": 9.81}}, "two": {}},
    },
    "study": {"schema_version": 1, "setting": {"energy": 290.0}, "verdicts": [VERDICT]},
    "manifest": {
        "schema_version": 1, "finished": True, "made_with": {"flexspine": "0.1.0"},
        "plan": {
            "task": "runs", "axes": {"speed": {"within": 0.1}},
            "models": [{"name": "scout2", "model": "rigid-bounder", "parameters": {},
                        "apex": {"height": 0.3}, "touchdown": {"fore": 0.4}}],
        },
    },
    "gait": {
        "schema_version": 1, "preset": "scout2", "model": "rigid-bounder", "family": "one",
        "parameters": {"gravity": 9.81}, "apex": {"height": 0.3}, "peak_grf": {"fore": 1.0},
        "touchdown_angles": {"fore": 0.4}, "mean_speed": 4.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", [*RECORDS, "branch"])
def test_a_record_of_another_shape_is_no_fault(tmp_path: Path, name: str) -> None:
    record = branch_record() if name == "branch" else RECORDS[name]
    (tmp_path / "sound.json").write_text('{"schema_version": 1, "distance": 77.5}')
    for odd in changed(record):
        (tmp_path / f"{name}.json").write_text(json.dumps(odd))
        assert ">77.5<" in document(tmp_path)


def test_a_folder_in_the_place_of_a_file_is_only_named(results: Path) -> None:
    (results / "study.json").mkdir()
    (results / "gone.png").symlink_to(results / "nowhere.png")
    (results / "loop.nc").symlink_to(results / "loop.nc")
    text = Page(document(results)).text
    assert "study.json/" in text
    assert "gone.png" in text
    assert "loop.nc" in text


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("notes.txt", "of somebody", "no results of flexspine"),
        ("other.json", '{"a": 1}', "no results of flexspine"),
        ("list.json", "[1, 2]", "no results of flexspine"),
        ("gaits.csv", "a,b\n1,2\n", "no results of flexspine"),
        ("summary.json", '{"schema_version": 1, ', "cannot read"),
        ("trajectory.nc", "nothing", "cannot read"),
        ("manifest.json", "[" * 100_000, "cannot read"),
    ],
)
def test_a_directory_without_results_is_refused(
    tmp_path: Path, name: str, content: str, told: str
) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=told):
        write_report(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == [name]
