"""Gaits and branches on disk."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from flexspine import examine, find_gaits, load_gait, load_model, save_gait, trace_branch
from flexspine.errors import OutputError, PresetError

BOUNDS = (4.45, 4.55)


def test_a_gait_comes_back_from_its_file_bit_for_bit(tmp_path: Path) -> None:
    gait = examine(load_model("kamimura2015-locked"))
    save_gait(gait, tmp_path / "gait.json")
    again = load_gait(tmp_path / "gait.json")
    assert again.model.apex == gait.model.apex
    assert again.touchdown_angles == gait.touchdown_angles
    assert np.array_equal(again.trajectory.end.states, gait.trajectory.end.states)
    assert again.confirmed


def test_a_loosely_integrated_gait_comes_back_as_one(tmp_path: Path) -> None:
    fixed = {"energy": 290.0, "height": 0.32, "mean_speed": 4.5}
    model = load_model("kamimura2015-flexible")
    gait = find_gaits(model, fixed, symmetric=True, starts=20, tolerance=1e-7)[0]
    save_gait(gait, tmp_path / "gait.json")
    assert load_gait(tmp_path / "gait.json").flaw is None


def test_a_gait_cannot_be_saved_where_nothing_can_be_written(tmp_path: Path) -> None:
    gait = examine(load_model("kamimura2015-locked"))
    with pytest.raises(OutputError, match="nowhere"):
        save_gait(gait, tmp_path / "nowhere" / "gait.json")


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"gaits": []}', '{"model": "rigid-bounder"}'])
def test_what_is_no_gait_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "gait.json").write_text(content)
    with pytest.raises(PresetError, match=r"gait\.json"):
        load_gait(tmp_path / "gait.json")


def test_a_gait_of_another_form_is_not_misread(tmp_path: Path) -> None:
    file = tmp_path / "gait.json"
    save_gait(examine(load_model("kamimura2015-locked")), file)
    record = json.loads(file.read_text())
    file.write_text(json.dumps({**record, "schema_version": record["schema_version"] + 1}))
    with pytest.raises(PresetError, match="schema_version 2"):
        load_gait(file)
    del record["schema_version"]  # as people write one by hand
    file.write_text(json.dumps(record))
    assert load_gait(file).confirmed


def test_a_step_that_was_cut_off_is_made_again(tmp_path: Path) -> None:
    gait, store = examine(load_model("kamimura2015-rigid")), tmp_path / "trace.jsonl"
    whole = trace_branch(gait, bounds=BOUNDS, store=str(store))
    text = store.read_text()
    store.write_text(text[: int(0.6 * len(text))])
    resumed = trace_branch(gait, bounds=BOUNDS, store=store)
    assert [p.point.tolist() for p in resumed.points] == [p.point.tolist() for p in whole.points]
    assert [m.value for m in resumed.landmarks] == [m.value for m in whole.landmarks]
    assert store.read_text() == text


@pytest.mark.parametrize(
    "line",
    [
        "5",
        "[]",
        "{}",
        '{"way": 1, "points": [{}], "count": 1, "marks": [], "step": 0.1, "end": null}',
        "\x00",
    ],
)
def test_a_damaged_trace_is_refused_by_name(tmp_path: Path, line: str) -> None:
    gait, store = examine(load_model("kamimura2015-rigid")), tmp_path / "trace.jsonl"
    trace_branch(gait, bounds=BOUNDS, store=store)
    store.write_text(store.read_text() + line + "\n")
    with pytest.raises(OutputError, match=r"trace\.jsonl"):
        trace_branch(gait, bounds=BOUNDS, store=store)


def test_a_trace_of_other_settings_is_left_as_it_is(tmp_path: Path) -> None:
    gait, store = examine(load_model("kamimura2015-rigid")), tmp_path / "trace.jsonl"
    trace_branch(gait, bounds=BOUNDS, store=store)
    text = store.read_text()
    assert json.loads(text.splitlines()[0])["over"] == "mean_speed"
    with pytest.raises(OutputError, match="other settings"):
        trace_branch(gait, bounds=(4.4, 4.55), store=store)
    assert store.read_text() == text


def test_a_point_that_the_last_step_took_back_stays_away(tmp_path: Path) -> None:
    gait, store = examine(load_model("kamimura2015-rigid")), tmp_path / "trace.jsonl"
    whole = trace_branch(gait, bounds=BOUNDS, store=store)
    header, *lines = [json.loads(line) for line in store.read_text().splitlines()]
    assert lines[-1]["way"] == 1
    lines[-1]["count"] -= 1
    store.write_text("".join(json.dumps(line) + "\n" for line in (header, *lines)))
    resumed = trace_branch(gait, bounds=BOUNDS, store=store)
    assert len(resumed.points) == len(whole.points) - 1
