"""What shells are offered, and that asking for it stays quick."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest

from flexspine import Pace, load_model, load_robot, load_walk, preset_names, walk_names
from flexspine.cli import limits, robustness, terrain
from flexspine.control.distribution import Aim
from flexspine.control.trot import CONTROLLERS
from flexspine.models.registry import KINDS
from flexspine.parameters import values
from flexspine.studies.limits import LIMITS
from flexspine.studies.objectives import OBJECTIVES
from flexspine.studies.spines import PRESETS
from flexspine.studies.wayfaring import KINDS as GROUNDS
from tests.cli.conftest import COMMAND, Cli

Offered = Callable[..., list[str]]


@pytest.fixture
def offered(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> Offered:
    """What bash is offered for the last of some words."""

    def ask(*words: str) -> list[str]:
        monkeypatch.setenv("_FLEXSPINE_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", " ".join(("flexspine", *words)))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        done = cli()
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.split()

    return ask


def names(pairs: list[str]) -> set[str]:
    assert all(pair.endswith("=") for pair in pairs)
    return {pair.removesuffix("=") for pair in pairs}


def test_verbs_and_options_are_offered(offered: Offered) -> None:
    assert offered("bo") == ["bound"]
    assert offered("verify", "") == ["engines", "pinned"]
    assert offered("bound", "--st") == ["--strides"]


@pytest.mark.parametrize("preset", preset_names())
def test_parameters_are_those_of_the_preset(offered: Offered, preset: str) -> None:
    model = load_model(preset)
    assert names(offered("bound", "--preset", preset, "--set", "")) == {*values(model.parameters)}
    assert names(offered("bound", "--preset", preset, "--apex", "")) == {*model.apex}
    followed = {*model.numbers, "energy", "mean_speed"}
    assert {*offered("branch", "--preset", preset, "--over", "")} == followed


def test_a_file_has_the_parameters_of_its_base(offered: Offered, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('base = "scout2"\n[parameters.body]\nmass = 30.0\n')
    found = offered("bound", "--preset", "mine.toml", "--set", "body.m")
    assert found == ["body.mass=", "body.mass=30.0"]
    assert offered("bound", "--preset", "nowhere.toml", "--set", "") == []
    (tmp_path / "round.toml").write_text('base = "round.toml"\n')
    assert offered("bound", "--preset", "round.toml", "--set", "") == []


def test_the_only_parameter_left_is_offered_with_its_value(offered: Offered) -> None:
    """Of two candidates a shell completes what they share, and adds no space."""
    assert offered("bound", "--set", "spine.d") == ["spine.damping=", "spine.damping=0.0"]
    assert offered("forces", "--set", "spine.r") == ["spine.rest=", "spine.rest=-0.05"]


def test_parameters_of_robots_and_their_walks_are_offered(offered: Offered) -> None:
    robot = {*load_robot("sc618").numbers}
    walk = {*values(load_walk("trot", "sc618").gains)}
    for verb in (("forces",), ("export", "mjcf"), ("verify", "pinned"), ("tune",)):
        assert names(offered(*verb, "--set", "")) == robot
    for verb in ("run3d", "spines"):
        assert names(offered(verb, "--set", "")) == robot | walk
    assert names(offered("trot", "--set", "")) == robot | {
        f"gait.{each.name}" for each in fields(Pace)
    }


def test_names_are_those_that_there_are(offered: Offered) -> None:
    presets, walks = preset_names(), [f"sc618-{name}" for name in walk_names("sc618")]
    assert offered("control", "--preset", "") == presets
    assert offered("basin", "--preset", "scout2", "--preset", "sl") == ["slip"]
    assert offered("trot", "--robot", "") == ["sc618"]
    assert offered("run3d", "--gait", "") == [*walk_names("sc618"), *walks]
    assert offered("presets", "") == [*presets, "sc618", *walks]
    assert {*offered("equations", "")} == {*KINDS, *presets}
    assert offered("equations", "slip", "--phase", "") == ["DF", "FS", "HS", "DS"]
    assert offered("forces", "--foot", "") == list(load_robot("sc618").feet)
    assert offered("forces", "--lock", "") == list(load_robot("sc618").joints)
    assert {*offered("forces", "--aim", "")} == {each.value for each in Aim}
    assert {*offered("trot", "--controller", "")} == {*CONTROLLERS}
    assert {*offered("optimise", "--minimise", "")} == {*OBJECTIVES}
    assert offered("control", "--method", "d") == ["deadbeat"]
    assert "touchdown.fore" in offered("control", "--steer", "touch")
    assert "legs.extension=" in offered("gait", "--free", "legs")
    assert names(offered("bound", "--touchdown", "")) == {"fore", "hind"}
    # Two, or the shell would add a space before the value.
    for words in (("bound", "--touchdown", "f"), ("gait", "--free", "legs.ext")):
        assert len(offered(*words)) == 2


def test_choices_are_those_of_the_code() -> None:
    assert {*terrain.GROUNDS} == GROUNDS.keys()
    assert {*terrain.NUMBERS} == {name for _, numbers in GROUNDS.values() for name in numbers}
    assert tuple(limit.name for limit in LIMITS) == limits.KNOWN
    assert tuple(name.replace(" ", "-") for name in PRESETS) == robustness.BODIES


def test_files_are_left_to_the_shell(offered: Offered, tmp_path: Path) -> None:
    (tmp_path / "gait-1.json").touch()
    assert offered("bound", "--gait", "gait") == []


def test_zsh_and_fish_are_told_titles_too(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "flexspine bound --preset sl")
    monkeypatch.setenv("_FLEXSPINE_COMPLETE", "complete_zsh")
    assert '"slip":"Spring-mass runner' in cli().stdout
    monkeypatch.setenv("_FLEXSPINE_COMPLETE", "complete_fish")
    monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "get-args")
    assert cli().stdout.startswith("slip\tSpring-mass runner")


def test_fish_is_told_by_exit_code_when_files_are_wanted(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_FLEXSPINE_COMPLETE", "complete_fish")
    monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "is-args")
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "flexspine bound --preset sl")
    assert cli().returncode == 0
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "flexspine bound --gait ")
    assert cli().returncode == 1


def test_asking_loads_nothing_heavy() -> None:
    """A start of heyoka or SymPy would be felt at every press of Tab."""
    script = (
        "import sys\n"
        "from flexspine.cli.app import run\n"
        "code = run([])\n"
        "print(code, *sorted({'heyoka', 'sympy', 'numpy', 'scipy', 'xarray', 'matplotlib',"
        " 'mujoco'} & sys.modules.keys()))\n"
    )
    asked = {"COMP_WORDS": "flexspine run3d --set servo.l", "COMP_CWORD": "3"}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "_FLEXSPINE_COMPLETE": "complete_bash", **asked},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["servo.limit=", "servo.limit=1000.0", "0"]


@pytest.mark.parametrize(
    ("shell", "file"),
    [
        ("bash", ".bash_completions/flexspine.sh"),
        ("zsh", ".zfunc/_flexspine"),
        ("fish", ".config/fish/completions/flexspine.fish"),
    ],
)
def test_it_is_shown_and_installed(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shell: str, file: str
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr("shellingham.detect_shell", lambda: (shell, f"/bin/{shell}"))
    shown = cli("--show-completion")
    assert shown.returncode == 0
    assert f"_FLEXSPINE_COMPLETE=complete_{shell}" in shown.stdout
    assert cli("--install-completion").returncode == 0
    assert (tmp_path / file).read_text().strip() == shown.stdout.strip()


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_by_what_is_installed(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shellingham.detect_shell", lambda: ("bash", "/bin/bash"))
    script = (
        cli("--show-completion").stdout
        + "COMP_WORDS=(flexspine bound --preset sc)\nCOMP_CWORD=3\n"
        + '_flexspine_completion flexspine\necho "${COMPREPLY[@]}"\n'
    )
    path = f"{COMMAND.parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", script],
        env={**os.environ, "PATH": path}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["scout2"]
