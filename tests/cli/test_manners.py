"""What all verbs have in common: help, names of options, defaults, units, and being quiet."""

from __future__ import annotations

import importlib
import inspect
import json
import re
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

import flexspine
from flexspine.cli.app import run
from tests.cli.conftest import Cli
from tests.cli.verbs import COMMANDS, ROOT, called, calls, examples, options

each_verb = pytest.mark.parametrize("verb", COMMANDS)

# One line of 'flexspine --help' at 80 columns.
SUMMARY = 63

WITHOUT_OUT = {"rerun", "forces", "presets", "equations", "doctor", "cache clear"}
# They have bodies of their own, take what is in a file, or have nothing to set.
WITHOUT_SET = {
    "study", "robustness", "sweep", "rerun", "report", "presets", "equations", "doctor",
    "verify engines", "cache clear",
}  # fmt: skip
RANDOM = {"gait", "control", "terrain", "robustness", "optimise", "run3d", "spines", "tune"}

# Options that several verbs have and that are not the same in all of them, with the reason.
DIFFERENT = {
    "--compare": "speeds of the study; spines side by side",
    "--damping": "of spines; of the law of a controller",
    "--draws": "designs; walks",
    "--energy": "of a preset's gait; of all gaits of the study",
    "--foot": "several that stand; the one that is pinned",
    "--free": "unknown within bounds; unknown",
    "--gait": "one file; several; a walk in space",
    "--height": "of the CoM; of the hips",
    "--keep": "quantities; parameters",
    "--out": "what is written",
    "--over": "one quantity; two coordinates",
    "--points": "of a basin; of a map; of a front",
    "--preset": "one; several",
    "--push": "on a bounder; on the hind trunk",
    "--runs": "at least one; 10,000",
    "--seconds": "what is done so long",
    "--sensing": "natural units; rad",
    "--set": "examples of names",
    "--speed": "of gaits; of feet; wanted",
    "--stiffness": "of spines: several, or a range; of the law of a controller",
    "--strides": "how many usually",
}

# What is not done unless it is asked for, and numbers that are those of something else.
WITHOUT_DEFAULT = {
    "--apex": "the preset's own",
    "--energy": "the preset's own",
    "--fix": "nothing more",
    "--free": "nothing",
    "--gait": "the preset's own",
    "--height": "the preset's own",
    "--keep": "nothing",
    "--limit": "none",
    "--lock": "nothing",
    "--out": "nothing is written",
    "--pinned": "it is not",
    "--scheduler": "processes of this machine",
    "--seconds": "strides are counted",
    "--set": "nothing",
    "--speed": "the preset's own",
    "--symmetric": "both are looked for",
    "--touchdown": "the preset's own",
    "--with": "those of the ground",
    "--within": "everywhere",
}

UNITS = re.compile(r"\b(in (m|s|J|Hz|rad|N s|N m|N m/rad|N m s/rad|m/s|1/s|1/s\^2)|SI)\b")
WITHOUT_UNIT = {"--acting", "--effort", "--longest-step", "--sensing", "--tolerance"}

# Defaults that the help tells in words, and what they are in the code.
DEFAULTS = {
    ("basin", "--points"): "studies.basin.POINTS",
    ("basin", "--strides"): "studies.basin.STRIDES",
    ("bound", "--interval"): "models.dataset.DEFAULT_INTERVAL",
    ("bound", "--tolerance"): "models.simulation.DEFAULT_TOLERANCE",
    ("branch", "--longest-step"): "gaits.tracing.LONGEST_STEP",
    ("control", "--effort"): "control.stabilize.EFFORT",
    ("gait", "--starts"): "gaits.search.DEFAULT_STARTS",
    ("limits", "--stiffness"): "cli.limits.STIFFNESSES",
    ("limits", "--speed"): "cli.limits.SPEEDS",
    ("map", "--lines"): "studies.gait_map.LINES",
    ("map", "--points"): "studies.gait_map.POINTS",
    ("optimise", "--draws"): "studies.optimise.DRAWS",
    ("optimise", "--points"): "studies.optimise.POINTS",
    ("robustness", "--speed"): "cli.robustness.SPEED",
    ("spines", "--stiffness"): "studies.walk_map.STIFFNESSES",
    ("trot", "--controller"): "control.laws.Tracking.name",
    ("tune", "--draws"): "studies.tuning.DRAWS",
    ("tune", "--rounds"): "studies.tuning.ROUNDS",
    ("tune", "--seconds"): "studies.tuning.SECONDS",
    ("verify pinned", "--seconds"): "studies.pinned_check.SECONDS",
    ("verify pinned", "--step"): "studies.pinned_check.STEP",
}


def told(verb: str, name: str) -> tuple[Any, ...]:
    option = options(verb)[name]
    return option.help, option.metavar, option.default, option.show_default, option.multiple


def in_code(place: str) -> Any:
    module, _, name = place.rpartition(".")
    if module.rpartition(".")[2][:1].isupper():  # of a class
        return getattr(in_code(module), name)
    return getattr(importlib.import_module(f"flexspine.{module}"), name)


@each_verb
def test_help_tells_what_it_does_and_its_exit_codes(verb: str) -> None:
    summary, *paragraphs = COMMANDS[verb].help.split("\n\n")
    assert len(summary) <= SUMMARY
    assert summary.endswith(".")
    codes = [text for text in paragraphs if text.startswith("Exit code 0: ")]
    assert len(codes) == 1
    assert "3: " in codes[0]
    assert codes[0].endswith("130: interrupted.")


@each_verb
def test_examples_can_be_typed_as_they_are(verb: str) -> None:
    lines = examples(verb)
    assert lines
    assert any(called(words)[0] == verb for line in lines for words in calls(line))
    for line in lines:
        assert len(line) <= 75, "is broken at 80 columns"
        for words in calls(line):
            name, arguments = called(words)
            context = COMMANDS[name].make_context(name, arguments)
            assert not {"DIR", "FILE", "NAME"} & set(words)
            for option in context.params.get("set_") or ():
                assert "=" in option


@each_verb
def test_help_fits_a_terminal_of_80_columns(
    cli: Cli, verb: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    done = cli(*verb.split(), "--help")
    assert done.returncode == 0
    assert "…" not in done.stdout, "a word was cut"
    assert done.stdout.count("Examples:") == 1


def test_every_verb_is_in_a_panel_by_subject(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    shown = cli("--help").stdout
    assert "─ Commands ─" not in shown
    for name, command in ROOT.commands.items():
        summary = command.help.split("\n\n")[0]
        assert re.search(rf"│ {name} +{re.escape(summary)} +│", shown), name


@each_verb
def test_every_verb_has_the_options_that_all_have(verb: str) -> None:
    own = options(verb)
    assert "--json" in own
    assert ("--out" in own) != (verb in WITHOUT_OUT)
    assert ("--set" in own) != (verb in WITHOUT_SET)
    assert ("--seed" in own) == (verb in RANDOM)
    assert not {"--dir", "--output", "--model", "--duration", "--time", "--seeds"} & own.keys()


def test_an_option_is_the_same_in_all_verbs_or_is_known_to_differ() -> None:
    kinds: dict[str, set[tuple[Any, ...]]] = {}
    for verb in COMMANDS:
        for name in options(verb):
            kinds.setdefault(name, set()).add(told(verb, name))
    assert {name for name, found in kinds.items() if len(found) > 1} == DIFFERENT.keys()


def test_what_differs_is_told_in_the_same_way() -> None:
    for verb in COMMANDS:
        own = options(verb)
        for name in ("--out", "--set", "--preset", "--gait"):
            if name not in own:
                continue
            help_, metavar, *_ = told(verb, name)
            assert {
                "--out": help_.startswith("Write ") and metavar[:3] in ("DIR", "FIL"),
                "--set": help_.startswith("Set a parameter by its dotted name, e.g. "),
                "--preset": help_.startswith("A preset (see 'flexspine presets') or a TOML file"),
                "--gait": metavar in ("FILE", "NAME"),
            }[name], verb


@each_verb
def test_defaults_and_units_are_told(verb: str) -> None:
    declared = inspect.signature(COMMANDS[verb].callback, eval_str=True).parameters
    for name, option in options(verb).items():
        kind = str(declared[option.name].annotation)
        if name not in WITHOUT_UNIT and re.search(r"\bfloat\b", kind):
            assert UNITS.search(option.help), name
        if option.multiple:
            assert re.search(r"; (repeat it|give two)|^Two of", option.help), name
        if option.default is None and not option.required:
            assert isinstance(option.show_default, str) or name in WITHOUT_DEFAULT, name
        assert "(default" not in option.help, "told in two ways"


@pytest.mark.parametrize(("verb", "name"), DEFAULTS)
def test_defaults_are_those_of_the_code(verb: str, name: str) -> None:
    value, shown = in_code(DEFAULTS[verb, name]), options(verb)[name].show_default
    several = value if isinstance(value, tuple) else (value,)
    if isinstance(several[0], str):
        assert shown == value
    else:
        assert [float(each) for each in shown.split(", ")] == list(several)


@pytest.mark.parametrize(
    "arguments",
    [
        ("bound", "--out", ""),
        ("sweep", "plan.toml", "--out="),
        ("export", "mjcf", "--out", " "),
        ("bound", "--interval", "0.01"),
        ("control", "--uniform"),
        ("branch", "--from", "4", "--to", "inf"),
        ("gait", "--height", "-1"),
        ("study", "--energy", "nan"),
        ("study", "--compare", "inf"),
        ("robustness", "push", "--largest", "-1"),
        ("robustness", "push", "--speed", "4", "--gait", "gait.json"),
        ("robustness", "push", "--processes", "0"),
        ("limits", "--processes", "0"),
        ("optimise", "--out", "best", "--speed", "inf"),
        ("verify", "engines", "--seconds", "nan"),
        ("run3d", "--plane", "--set", "space.yaw_stiffness=3"),
        ("run3d", "--plane", "--set", "servo.out_damping=3"),
        ("export", "mjcf", "--plane", "--set", "space.yaw_damping=3"),
        ("export", "mjcf", "--locked", "--set", "spine.stiffness=3"),
        ("trot", "--compare", "--tolerance", "1e-9"),
        ("forces", "--set", "spine.stiffness=stiff"),
    ],
)
def test_what_cannot_be_meant_is_one_line(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    done = cli(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    named = next(each for each in reversed(arguments) if each.startswith("--"))
    assert named.rstrip("=") in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_empty_name_is_no_default(cli: Cli) -> None:
    for verb in (("map", "--out", "map", "--preset", ""), ("trot", "--controller", "")):
        done = cli(*verb)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert "''" in done.stderr


def test_a_wrong_value_is_named(cli: Cli) -> None:
    for arguments in (("--strides", "two"), ("--strides=two",)):
        assert "--strides 'two' is not usable" in cli("bound", *arguments).stderr


def test_results_beside_the_command_do_not_hide_a_walk(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "trot").mkdir()  # of 'flexspine trot --out trot'
    assert cli("run3d", "--seconds", "0.02", "--json").returncode == 0


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_for_terminals_and_results_are_for_pipes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even where stderr is a terminal, results that are piped go down the pipe."""
    monkeypatch.chdir(tmp_path)
    out, err = StringIO(), Terminal()
    with redirect_stdout(out), redirect_stderr(err):
        assert run(["doctor"]) == 0
    assert "published gait" in out.getvalue()
    assert "\x1b" not in out.getvalue()
    assert "looking" in err.getvalue()
    assert "published gait" not in err.getvalue()


def test_no_progress_where_colours_are_forced_into_a_pipe(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    done = cli("bound", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    json.loads(done.stdout)


def test_ends_of_terrain_come_with_progress(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    out, err = StringIO(), Terminal()
    few = ["terrain", "rough", "--strides", "2", "--runs", "2", "--processes", "1", "--json"]
    with redirect_stdout(out), redirect_stderr(err):
        assert run(few) == 0
    assert json.loads(out.getvalue())["ensemble"]["runs"] == 2
    assert "running 2 times" in err.getvalue()


def test_an_interruption_while_starting_is_one_object_too(tmp_path: Path) -> None:
    """A signal while the command line itself is being imported."""
    script = (
        "import builtins, os, signal, sys\n"
        "import flexspine.__main__ as main\n"
        "sys.argv = ['flexspine', 'bound', '--json']\n"
        "usual = builtins.__import__\n"
        "def slow(name, *rest, **more):\n"
        "    if name == 'flexspine.cli.app':\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "    return usual(name, *rest, **more)\n"
        "builtins.__import__ = slow\n"
        "main.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True)
    assert done.returncode == 130
    assert json.loads(done.stdout)["error"] == "interrupted"
    assert done.stderr == b"flexspine: interrupted\n"


def test_presets_lists_what_every_option_takes(cli: Cli) -> None:
    listed = json.loads(cli("presets", "--json").stdout)
    names = {kind: {row["name"] for row in listed[kind]} for kind in ("presets", "robots", "walks")}
    assert names["presets"] == set(flexspine.preset_names())
    assert names["robots"] == set(flexspine.robot_names()) == {"sc618"}
    assert names["walks"] == {f"sc618-{walk}" for walk in flexspine.walk_names("sc618")}
    shown = cli("presets").stdout
    for option in ("--preset", "--robot", "--gait"):
        assert option in shown


def test_presets_shows_robots_and_walks_and_files_of_them(cli: Cli, tmp_path: Path) -> None:
    robot = json.loads(cli("presets", "sc618", "--json").stdout)
    table = {row["name"]: row for row in robot["values"]}
    assert table.keys() == flexspine.load_robot("sc618").numbers.keys()
    assert (table["spine.stiffness"]["value"], table["spine.stiffness"]["unit"]) == (240, "N m/rad")
    walk = cli("presets", "sc618-trot").stdout
    assert re.search(r"gait\.frequency +2\.339 +Hz +\(0, 20\] +of strides", walk)
    own = Path(flexspine.__file__).parent / "walks" / "sc618-bound.toml"
    (tmp_path / "mine.toml").write_text(own.read_text())
    assert "mine (bound): Bound" in cli("presets", "mine.toml").stdout
    assert "did you mean 'sc618-bound'?" in cli("presets", "sc618-boun").stderr


def test_exported_robots_are_one_object_too(cli: Cli, tmp_path: Path) -> None:
    record = json.loads(cli("export", "mjcf", "--json").stdout)
    assert record["mjcf"].startswith("<mujoco")
    record = json.loads(cli("export", "mjcf", "--out", "robot.xml", "--json").stdout)
    assert record["bytes"] == (tmp_path / record["file"]).stat().st_size
