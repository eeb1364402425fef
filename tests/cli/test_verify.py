"""``flexspine verify pinned`` end to end."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import mujoco
import pytest

from flexspine.cli import app, verify
from flexspine.engines.mujoco_planar import PinnedMujoco
from flexspine.mechanics.linkage import Linkage
from flexspine.studies import pinned_check
from tests.cli.conftest import Cli
from tests.models.test_robot_file import PENDULUM

QUICK = ("verify", "pinned", "--seconds", "0.5")


def test_the_robot_moves_as_in_mujoco(cli: Cli, tmp_path: Path) -> None:
    done = cli("verify", "pinned", "--out", "results/pinned", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record["agrees"] is True
    assert (record["robot"], record["foot"], record["mujoco"]) == (
        "sc618", "toe_1", mujoco.__version__
    )  # fmt: skip
    for case, name in zip(record["cases"], ["without dampers", "with dampers"], strict=True):
        assert case["name"] == name
        assert 3.5 <= case["order"] <= 4.5
        assert case["differences"][-1]["difference"] <= 1e-6
        start, *_, end = case["energy"]
        for parts in case["energy"]:
            total = parts["kinetic"] + parts["potential"] + parts["dissipated"]
            assert total == pytest.approx(start["kinetic"] + start["potential"], abs=1e-8)
        assert (end["dissipated"] > 10) is (name == "with dampers")
    out = tmp_path / "results" / "pinned"
    assert {path.name for path in out.iterdir()} == {
        "command.txt", "pinned.csv", "pinned.png", "summary.json",
    }  # fmt: skip
    assert json.loads((out / "summary.json").read_text()) == record
    assert (out / "pinned.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((out / "pinned.csv").read_text().splitlines()))
    assert len(rows) == 2 * 1001
    assert float(rows[1000]["time"]) == pytest.approx(1.0)
    assert float(rows[0]["difference_at_step_3.125e-05"]) <= 1e-14


def test_numbers_are_printed_for_people(cli: Cli) -> None:
    done = cli(*QUICK, "--foot", "toe_3", "--set", "spine.damping=0")
    assert done.returncode == 0, done.stderr
    assert "sc618 pinned by toe_3" in done.stdout
    assert "AGREES" in done.stdout
    assert "imbalance" in done.stdout
    assert "with dampers" not in done.stdout, "there are none"


def test_a_robot_from_a_file_at_a_larger_step(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "pendulum.toml").write_text(PENDULUM)
    swings = (*QUICK, "--robot", "pendulum.toml", "--set", "bob.inertia=0.1")
    assert cli(*swings, "--step", "0.02").returncode == 0
    small = cli(*swings, "--step", "1e-4")
    assert small.returncode == 1
    assert "NOT DECIDED, try a larger --step" in small.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--foot", "toe_11"), "unknown foot 'toe_11'; did you mean 'toe_1'?"),
        (("--robot", "sc619"), "unknown robot 'sc619'; did you mean 'sc618'?"),
        (("--set", "spine.stifness=3"), "did you mean 'spine.stiffness'?"),
        (("--set", "spine"), "is not NAME=VALUE"),
        (("--seconds", "0.1"), "0.1 s are not usable"),
        (("--step", "nan"), "a step of nan s is not usable"),
    ],
    ids=lambda part: part if isinstance(part, str) else part[0],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    cli: Cli, tmp_path: Path, arguments: tuple[str, str], told: str
) -> None:
    done = cli("verify", "pinned", *arguments, "--out", "results")
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert not (tmp_path / "results").exists()


def test_a_missing_mujoco_is_exit_code_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(verify, "interruptible", lambda: None)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert app.run([*QUICK]) == 3
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err == (
        "flexspine: the package 'mujoco' is not installed; pip install 'mujoco>=3.17,<4', "
        "or flexspine with the extra 'engine'\n"
    )
    assert app.run([*QUICK, "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["error"] == "environment"


def test_a_mujoco_that_will_not_do_is_exit_code_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(verify, "interruptible", lambda: None)
    monkeypatch.setattr(mujoco, "__version__", "4.0.0")
    assert app.run([*QUICK]) == 3
    told = capsys.readouterr().err
    assert "mujoco 4.0.0 is installed" in told
    assert told.count("\n") == 1


def test_a_motion_that_differs_is_exit_code_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def wrong(linkage: Linkage, foot: str) -> PinnedMujoco:
        engine = PinnedMujoco(linkage, foot)
        engine.model.opt.gravity[1] *= 1.001
        return engine

    monkeypatch.setattr(verify, "interruptible", lambda: None)
    monkeypatch.setattr(pinned_check, "PinnedMujoco", wrong)
    assert app.run([*QUICK]) == 1
    assert "DOES NOT AGREE" in capsys.readouterr().out
