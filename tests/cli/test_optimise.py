"""`flexspine optimise` from end to end."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from flexspine import load_gait
from flexspine.report.pareto_figure import plot_fronts
from flexspine.studies import optimise as study
from tests.cli.conftest import Cli
from tests.report.layout import assert_no_text_overlaps

# A conservative animal of which the stiffness alone varies: a front in two seconds.
ALONE = ("--vary", "spine.stiffness=250:280", "--keep", "spine.damping", "--keep", "legs.extension")
FORCES = ("--minimise", "peak_grf", "--minimise", "spectral_radius")
SMALL = ("optimise", *ALONE, *FORCES, "--draws", "0", "--points", "2", "--processes", "1")
CONSTANT = (*SMALL, "--speed", "4.25", "--spine", "constant")
FILES = {
    "command.txt", "optimise.json", "front.csv", "front.parquet", "pareto.png",
    "gait-reference.json",
}  # fmt: skip
FIELDS = {
    "gait", "objectives", "varied", "net_work", "dissipated", "relative_drift", "residual",
    "phases", "family", "period", "stable", "floquet_multipliers", "multiplier_errors",
    "largest_multiplier_error",
}  # fmt: skip


def test_a_front_is_written_with_its_gaits(cli: Cli, tmp_path: Path) -> None:
    done = cli(*CONSTANT, "--out", "results", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert record["mean_speed"] == pytest.approx(4.25)
    assert record["minimised"] == ["peak_grf", "spectral_radius"]
    assert record["ranges"] == {"constant": {"spine.stiffness": [250, 280]}}
    assert record["told"] is None
    (points,) = (front["points"] for front in record["fronts"].values())
    assert [point["gait"] for point in points] == ["constant-1", "constant-2"]
    out = tmp_path / "results"
    assert {f.name for f in out.iterdir()} == {
        *FILES,
        "gait-constant-1.json",
        "gait-constant-2.json",
    }
    assert json.loads((out / "optimise.json").read_text()) == record
    rows = list(csv.DictReader((out / "front.csv").read_text().splitlines()))
    for point, row in zip(points, rows, strict=True):
        assert point.keys() == FIELDS
        gait = load_gait(out / f"gait-{point['gait']}.json")
        assert gait.flaw is None
        assert gait.model.numbers["spine.stiffness"] == point["varied"]["spine.stiffness"]
        assert float(row["peak_grf"]) == point["objectives"]["peak_grf"]
        assert float(row["level_spectral_radius"]) == point["objectives"]["spectral_radius"]
        assert max(gait.peak_grf.values()) == pytest.approx(float(row["peak_grf"]), rel=1e-9)
        assert point["relative_drift"] < 1e-12
        assert len(point["floquet_multipliers"]) == len(point["multiplier_errors"]) == 6
    assert points[-1]["varied"]["spine.stiffness"] == 280


def test_it_reads_well(cli: Cli) -> None:
    done = cli(*CONSTANT, "--points", "1", "--out", "results")
    assert done.returncode == 0, done.stderr
    assert "stiffness 280" in done.stdout
    assert "results in results" in done.stdout


def test_an_interrupted_search_goes_on(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[float] = []

    def certify(*_arguments: Any) -> Any:
        calls.append(0.0)
        raise KeyboardInterrupt

    out = tmp_path / "results"
    with monkeypatch.context() as patched:
        patched.setattr(study, "certify", certify)
        done = cli(*CONSTANT, "--out", "results")
    assert (done.returncode, len(calls)) == (130, 1)
    assert "the same command goes on from it" in done.stderr
    (store,) = out.iterdir()
    pieces = store.read_text().splitlines()
    assert len(pieces) > 4
    other = cli(*CONSTANT, "--seed", "1", "--out", "results")
    assert other.returncode == 2
    assert "other settings" in other.stderr
    assert store.read_text().splitlines() == pieces
    monkeypatch.setattr("flexspine.studies.frontier.descend", None)  # nothing is left to be done
    assert cli(*CONSTANT, "--out", "results", "--json").returncode == 0
    assert not store.exists()


BAD = {
    "one objective": (["--minimise", "peak_grf"], "two objectives"),
    "the same twice": (["--minimise", "peak_grf", "--minimise", "peak_grf"], "two different"),
    "an unknown one": (["--minimise", "peak", "--minimise", "peak_grf"], "'peak'"),
    "no range": (["--vary", "spine.stiffness"], "NAME=LOW:HIGH"),
    "a range upside down": (["--vary", "spine.stiffness=300:200"], "LOW:HIGH"),
    "an unknown parameter": (["--vary", "spine.stifness=200:300"], "'spine.stiffness'"),
    "beyond bounds": (["--vary", "spine.damping=-1:1"], "spine.damping"),
    "a range without the gait": (["--vary", "height=0.4:0.5"], "height = 0.32"),
    "kept but never varied": (["--keep", "gravity"], "'gravity'"),
    "nothing to choose": (
        ["--keep", "spine.damping", "--keep", "spine.stiffness", "--spine", "constant"],
        "nothing to choose",
    ),
    "no shift": (["--shift", "0.5"], "--shift"),
    "too much of a shift": (["--shift=-2:0.5"], "stiffness_shift"),
    "a rigid body": (["--preset", "kamimura2015-rigid"], "no spine that bends"),
    "a preset and a gait": (["--preset", "slip", "--gait", "absent.json"], "--gait"),
    "an absent gait": (["--gait", "absent.json"], "absent.json"),
    "backward": (["--speed", "-1"], "speed = -1"),
    "no process": (["--processes", "0"], "--processes"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_clear_line(cli: Cli, tmp_path: Path, case: str) -> None:
    arguments, told = BAD[case]
    done = cli("optimise", *arguments, "--out", "results")
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("flexspine: ")
    assert done.stderr.count("\n") == 1
    assert told in done.stderr
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind"


def test_a_speed_without_a_gait_is_exit_code_1(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flexspine.studies.design.SEARCHES", 8)
    done = cli(*SMALL, "--speed", "9", "--out", "results", "--json")
    assert done.returncode == 1
    record = json.loads(done.stdout)
    assert record["error"] == "no_gait"
    assert "9 m/s" in record["message"]
    assert list(tmp_path.iterdir()) == []


def test_ranges_without_a_gait_are_exit_code_1(cli: Cli, tmp_path: Path) -> None:
    lossy = ("--vary", "legs.extension=0:1e-6", "--spine", "constant", "--draws", "0")
    done = cli("optimise", *lossy, "--processes", "1", "--out", "results")
    assert done.returncode == 1
    assert "give wider ranges" in done.stderr
    assert list(tmp_path.iterdir()) == []


def front(first: list[float], second: list[float], stable: bool, **shifts: float) -> Any:
    """A front that was made up."""
    return {
        "points": [
            {
                "gait": f"made-up-{number}",
                "objectives": {
                    "peak_grf": y,
                    "cost_of_transport": x,
                    "spectral_radius": 1 + y / 99,
                },
                "varied": {
                    "spine.stiffness": 400.0,
                    **{f"spine.stiffness_shift.{n}": v for n, v in shifts.items()},
                },
                "phases": ["DF", "FS", "DS", "HS", "DF"],
                "stable": stable,
            }
            for number, (x, y) in enumerate(zip(second, first, strict=True))
        ],
        "refused": [],
    }


def test_the_figure_draws_both_fronts(cli: Cli, tmp_path: Path) -> None:
    assert cli(*CONSTANT, "--points", "1", "--out", "results").returncode == 0
    record = json.loads((tmp_path / "results" / "optimise.json").read_text())
    shifts = {"fore": 0.25, "between": 0.5, "hind": -0.25, "both": 0.1}
    phased = {f"spine.stiffness_shift.{name}": [-0.5, 0.5] for name in shifts}
    record |= {
        "minimised": ["peak_grf", "cost_of_transport"],
        "ranges": {"constant": {"spine.damping": [0.2, 1]}, "by phase": phased},
        "gains": {"peak_grf": [0.25, -1e-9], "cost_of_transport": [-1e-9, 0.0]},
        "fronts": {
            "constant": front([700, 600], [0.01, 0.02], stable=False),
            "by phase": front([690, 580, 400], [0.01, 0.02, 0.2], stable=True, **shifts),
        },
    }
    figure = plot_fronts(record)
    assert_no_text_overlaps(figure)
    forces, radii, stiffness = figure.axes
    drawn = {tuple(line.get_xydata()[0]) for line in forces.lines if len(line.get_xdata()) == 1}
    assert drawn == {(0.01, 700), (0.02, 600), (0.01, 690), (0.02, 580), (0.2, 400)}
    assert forces.get_xscale() == "log"
    by_label = {line.get_label(): line for line in stiffness.lines}
    assert list(by_label["fore stance"].get_ydata()) == [500] * 3
    assert list(by_label["hind stance"].get_ydata()) == [300] * 3
    assert "between stances" not in by_label, "both legs stand between the stances"
    text = " ".join(text.get_text() for text in figure.texts)
    assert "peak GRF up to 25.0 % lower, cost of transport up to 0.0 % lower" in text
    assert "filled: stable" in text
    filled = [line.get_markerfacecolor() for line in radii.lines if len(line.get_xdata()) == 1]
    assert filled.count("white") == 2
