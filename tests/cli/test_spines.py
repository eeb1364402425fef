"""`flexspine spines` and `flexspine verify engines` from end to end."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from flexspine.studies import pinned_check, replay_check, template_check
from flexspine.studies.replay_check import SoftGround
from tests.cli.conftest import Cli
from tests.cli.test_gait import assert_one_clear_line

FEW = (
    "--stiffness", "480", "--stiffness", "60", "--speed", "0.4", "--speed", "0.3",
    "--seconds", "0.9", "--processes", "1",
)  # fmt: skip


def test_spines_are_compared_kept_and_repeated(cli: Cli, tmp_path: Path) -> None:
    done = cli("spines", *FEW, "--out", "here", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["asked_speeds"] == [0.3, 0.4]
    assert record["stiffnesses"] == [60.0, 480.0]
    assert record["walks"] == 8
    table = pd.read_parquet(tmp_path / "here" / "rows")
    for number, speed in enumerate((0.3, 0.4)):
        there = table[table["at_gait_speed"] == speed]
        ours = there[there["model"] == "sc618-trot"].set_index("at_spine_stiffness")
        theirs = there[there["model"] == "sc618-trot-locked"]
        row = record["compared"]["peak_normal"][number]
        assert row["best"] == ours["peak_normal"].min()
        assert row["best_stiffness"] == ours["peak_normal"].idxmin()
        assert row["locked"] == pytest.approx(theirs["peak_normal"].mean())
        # Faster is better; less of all else.
        fastest = record["compared"]["speed"][number]
        assert fastest["best"] == ours["speed"].max()
    with (tmp_path / "here" / "spines.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["body"] for row in rows] == ["flexible"] * 4 + ["locked"] * 4
    assert {row["spine_stiffness"] for row in rows[4:]} == {""}
    with Image.open(tmp_path / "here" / "spines.png") as picture:
        assert picture.width > 900
    assert cli("rerun", "here", "--processes", "1").returncode == 0
    assert json.loads(cli("spines", *FEW, "--out", "here", "--json").stdout)["made"] == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--stiffness", "-5"), "stiffness"),
        (("--speed", "nan"), "speed"),
        (("--gait", "amble"), "amble"),
        (("--seconds", "0"), "seconds"),
        (("--set", "spine.stifness=3"), "spine.stiffness"),
    ],
)
def test_bad_input_is_one_clear_line_and_nothing_is_written(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], told: str
) -> None:
    assert_one_clear_line(cli("spines", *arguments, "--out", "here"), told)
    assert not (tmp_path / "here").exists()


def test_engines_agree_and_say_where_not(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = (SoftGround(0.035, 5e4, 1e3, 2.5e-4), SoftGround(0.001, 5e5, 3e3, 1e-4))
    monkeypatch.setattr(replay_check.check_replay, "__kwdefaults__",
                        {**replay_check.check_replay.__kwdefaults__, "grounds": few})  # fmt: skip
    monkeypatch.setattr(template_check.check_template, "__defaults__", (template_check.LEVELS[:3],))
    monkeypatch.setattr(pinned_check, "HALVINGS", 3)
    done = cli("verify", "engines", "--seconds", "1", "--out", "here", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["agrees"]
    assert [part for part in record if isinstance(record[part], dict)] == [
        "pinned", "trot", "bounder",
    ]  # fmt: skip
    soft, stiff = record["trot"]["grounds"]
    assert stiff["angle"] < soft["angle"] / 10
    levels = record["bounder"]["levels"]
    for name in ("place", "angle", "contact"):
        shrunk = [each[name] for each in levels]
        assert shrunk == sorted(shrunk, reverse=True)
        assert record["bounder"]["orders"][name] == pytest.approx(1, abs=0.1)
    assert "roll" in record["trot"]["why"]
    assert json.loads((tmp_path / "here" / "engines.json").read_text()) == record
    with Image.open(tmp_path / "here" / "engines.png") as picture:
        assert np.asarray(picture.convert("L")).min() < 50
