from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest

import flexspine
from flexspine.cli import results
from flexspine.studies import damping, pinned_check, robot_claims, spines
from tests.cli.conftest import Cli


def test_presets_are_listed_with_their_source(cli: Cli) -> None:
    done = cli("presets")
    assert done.returncode == 0
    for name in flexspine.preset_names():
        assert name in done.stdout
    assert "Poulakakis" in done.stdout
    rows = json.loads(cli("presets", "--json").stdout)["presets"]
    assert {row["name"] for row in rows} == set(flexspine.preset_names())


def test_a_preset_shows_every_value_with_unit_and_provenance(cli: Cli) -> None:
    done = cli("presets", "kamimura2015-flexible")
    assert "printed 0.069 m; doubled" in done.stdout
    assert "doubt: " in done.stdout
    record = json.loads(cli("presets", "kamimura2015-flexible", "--json").stdout)
    table = {row["name"]: row for row in record["values"]}
    assert table["spine.stiffness"]["value"] == 260
    assert table["spine.stiffness"]["unit"] == "N m/rad"
    assert table["apex.fore_pitch_rate"]["unit"] == "rad/s"
    assert all(row["provenance"] and row["unit"] for row in record["values"])


def test_an_unknown_preset_is_refused(cli: Cli) -> None:
    done = cli("presets", "scout3")
    assert done.returncode == 2
    assert "did you mean 'scout2'?" in done.stderr


def test_equations_are_printed_for_models_and_presets(cli: Cli) -> None:
    done = cli("equations", "flexible-bounder")
    assert done.returncode == 0
    assert "Kinetic and potential energy" in done.stdout
    assert r"\ddot{\theta}_{f}" in done.stdout
    record = json.loads(cli("equations", "scout2", "--phase", "FS", "--json").stdout)
    assert record["model"] == "rigid-bounder"
    assert "s_h" not in record["text"], "the hind leg is in the air"
    assert cli("equations", "flexible-bounder", "--format", "text").stdout.count("\\[") == 0


@pytest.mark.parametrize("arguments", [["flexible-boundr"], ["rigid-bounder", "--phase", "XX"]])
def test_equations_of_nothing_are_refused(cli: Cli, arguments: list[str]) -> None:
    done = cli("equations", *arguments)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


def test_equations_print_where_unicode_cannot(command: Cli) -> None:
    done = command("equations", "rigid-bounder", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == 0
    assert done.stdout.isascii()


def test_the_cache_can_be_cleared(command: Cli, tmp_path: Path) -> None:
    own = str(tmp_path / "cache")
    made = command("bound", "--preset", "scout2", "--json", FLEXSPINE_CACHE_DIR=own)
    assert made.returncode == 0
    cleared = json.loads(command("cache", "clear", "--json", FLEXSPINE_CACHE_DIR=own).stdout)
    assert cleared["freed_bytes"] > 100_000
    assert list((tmp_path / "cache").iterdir()) == []
    assert command("cache", "clear", FLEXSPINE_CACHE_DIR=own).returncode == 0


def test_help_has_an_example_for_every_verb(cli: Cli) -> None:
    for verb in (["bound"], ["presets"], ["equations"], ["cache", "clear"]):
        done = cli(*verb, "--help")
        assert done.returncode == 0
        assert f"flexspine {' '.join(verb)}" in done.stdout


def test_the_version_is_told(cli: Cli) -> None:
    assert cli("--version").stdout.strip() == flexspine.__version__


def test_a_full_disk_is_exit_code_3_and_keeps_older_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from flexspine.cli import app

    kept = tmp_path / "results" / "summary.json"
    kept.parent.mkdir()
    kept.write_text("older")

    def full(stage: Path, *_rest: object) -> None:
        (stage / "trajectory.nc").write_text("half")
        raise OSError(28, "No space left on device", "trajectory.nc")

    monkeypatch.setattr(results, "_write_all", full)
    assert app.run(["bound", "--out", str(kept.parent)]) == 3
    assert "No space left" in capsys.readouterr().err
    assert [path.name for path in kept.parent.iterdir()] == ["summary.json"]
    assert kept.read_text() == "older"


@pytest.fixture
def in_small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short branches and short walks for the study."""
    monkeypatch.setattr(spines, "Setting", partial(spines.Setting, softest=240.0))
    monkeypatch.setattr(spines, "STIFF_POINTS", 4)
    short = partial(damping.DampedSetting, most=1.0, stiffest=270.0)
    monkeypatch.setattr(damping, "DampedSetting", short)
    monkeypatch.setattr(pinned_check, "HALVINGS", 3)
    monkeypatch.setattr(robot_claims, "SECONDS", 1.0)
    monkeypatch.setattr(robot_claims, "PUSH_TIME", 0.5)


@pytest.mark.usefixtures("in_small")
def test_the_study_writes_tables_figures_and_verdicts(cli: Cli, tmp_path: Path) -> None:
    """Of one stiffness, one speed for the sweeps, one damping."""
    small = ("--stiffness", "260", "--compare", "4.5", "--speeds", "4.45:4.55", "--damping", "0.5")
    result = cli("study", *small, "--out", "results", "--json")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    record = json.loads(result.stdout)
    assert [verdict["claim"] for verdict in record["verdicts"]] == [*range(1, 13)]
    assert {branch["actuator"] for branch in record["damped"]} == {
        "legs.extension", "legs.stiffening", "legs.hip_lever",
    }  # fmt: skip
    assert record["damped"][-1]["spine.damping"] == pytest.approx(0.5)
    out = tmp_path / "results"
    for name in ("gaits", "stiffness", "damping", "landmarks"):
        assert (out / f"{name}.csv").stat().st_size > 0
        assert (out / f"{name}.parquet").stat().st_size > 0
    assert {path.name for path in out.glob("*.png")} == {
        "damping.png",
        "energy_shares.png",
        "peak_grf_over_speed.png",
        "peak_grf_over_stiffness.png",
        "profiles.png",
        "stability_over_speed.png",
        "stability_over_stiffness.png",
    }
    assert not [path for path in out.iterdir() if path.is_dir()]
    for verdict in record["verdicts"]:
        for run in verdict["runs"]:
            assert (out / run["gait"]).exists()
    quoted = record["verdicts"][0]["runs"][0]
    again = cli("bound", "--gait", out / quoted["gait"], "--json")
    assert json.loads(again.stdout)["mean_speed"] == pytest.approx(quoted["mean_speed"], abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--speeds", "4.6:4.2"), "--speeds"),
        (("--speeds", "fast"), "--speeds"),
        (("--energy", "100"), "energy"),
        (("--damping", "0"), "damping"),
        (("--stiffness", "1e5", "--speeds", "4.49:4.51", "--compare", "4.5"), "k_t"),
    ],
)
def test_a_study_without_gaits_to_compare_is_refused(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], named: str
) -> None:
    result = cli("study", *arguments, "--out", "results")
    assert result.returncode == 2
    assert named in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "results").exists()
