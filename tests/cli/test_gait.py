"""`flexspine gait` from end to end, and `flexspine bound` with what it saves."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from matplotlib.figure import Figure
from PIL import Image

from flexspine.report import figure
from tests.cli.conftest import COMMAND, Cli, Result, run_here

FIELDS = {
    "schema_version",
    "flexspine",
    "apex",
    "touchdown_angles",
    "liftoff_angles",
    "period",
    "mean_speed",
    "energy",
    "peak_grf",
    "phases",
    "floquet_multipliers",
    "spectral_radius",
    "residual",
}

# Kamimura et al. 2015, k_t = 260 N m/rad at 4.5 m/s; the digits are of an independent computation.
PUBLISHED_PITCH, PUBLISHED_TOUCHDOWN = 0.10385204124646978, 0.4612813446910027


class Found(NamedTuple):
    """What a search printed, and the folder it wrote into."""

    done: Result
    record: dict[str, Any]
    folder: Path


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """The gaits at the speed of the published one, undrawn; the folder held older files."""
    folder = tmp_path_factory.mktemp("search")
    for name in ("gait-77.json", "gait-77.png", "gait-mine.json"):
        (folder / name).write_text("older")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(figure, "plot_run", lambda _dataset: Figure())
        done = run_here(
            "gait", "--preset", "kamimura2015-flexible", "--set", "spine.stiffness=260",
            "--energy", "290", "--height", "0.32", "--speed", "4.5", "--out", folder, "--json",
        )  # fmt: skip
    return Found(done, json.loads(done.stdout), folder)


def published(gaits: list[dict[str, Any]]) -> dict[str, Any]:
    """The published one among gaits."""
    return min(gaits, key=lambda gait: abs(gait["touchdown_angles"]["fore"] - PUBLISHED_TOUCHDOWN))


def test_json_is_one_object_with_everything_promised(found: Found) -> None:
    assert found.done.returncode == 0
    assert found.done.stderr == ""
    record = found.record
    assert record.keys() >= {"schema_version", "gaits", "advice", "tally", "dropped"}
    assert record["fixed"] == {"energy": 290, "height": 0.32, "mean_speed": 4.5}
    assert sum(record["tally"].values()) == 200
    assert len(record["gaits"]) >= 4
    for gait in record["gaits"]:
        assert gait.keys() >= FIELDS
        assert gait["peak_grf"].keys() == gait["touchdown_angles"].keys() == {"fore", "hind"}
        assert gait["mean_speed"] == pytest.approx(4.5, abs=1e-11)
        assert gait["energy"] == pytest.approx(290, abs=1e-9)
        assert gait["apex"]["height"] == 0.32
        assert gait["residual"] < 1e-11
        sizes = [abs(complex(*pair)) for pair in gait["floquet_multipliers"]]
        assert sizes == sorted(sizes, reverse=True)
        assert len(sizes) == len(gait["apex"])
        assert gait["spectral_radius"] == sizes[0]
        # Conserved energy makes one of them 1.
        assert min(abs(complex(*pair) - 1) for pair in gait["floquet_multipliers"]) < 1e-8


def test_the_published_gait_is_among_them(found: Found) -> None:
    gait = published(found.record["gaits"])
    assert gait["apex"]["fore_pitch"] == pytest.approx(PUBLISHED_PITCH, abs=1e-11)
    assert gait["touchdown_angles"]["fore"] == pytest.approx(PUBLISHED_TOUCHDOWN, abs=1e-11)
    assert gait["peak_grf"]["fore"] == pytest.approx(530.460494, abs=5e-7)
    assert gait["peak_grf"]["hind"] == pytest.approx(530.460494, abs=5e-7)
    assert gait["phases"] == ["DF", "FS", "DF", "HS", "DF"]
    assert gait["floquet_multipliers"][0] == pytest.approx([1.32785, 0], abs=5e-6)
    assert gait["symmetric"]
    assert not gait["stable"]


def test_every_gait_is_written_by_itself_and_older_ones_go(found: Found) -> None:
    numbers = range(1, len(found.record["gaits"]) + 1)
    assert {path.name for path in found.folder.iterdir()} == {
        "gaits.json", "gait-mine.json", "command.txt",
        *(f"gait-{number}.{kind}" for number in numbers for kind in ("json", "png")),
    }  # fmt: skip
    assert json.loads((found.folder / "gaits.json").read_text()) == found.record
    for number, gait in zip(numbers, found.record["gaits"], strict=True):
        assert json.loads((found.folder / f"gait-{number}.json").read_text()) == gait
        picture = (found.folder / f"gait-{number}.png").read_bytes()
        assert picture.startswith(b"\x89PNG")


def test_a_saved_gait_runs_and_is_drawn(cli: Cli, found: Found, tmp_path: Path) -> None:
    file = next(
        path
        for path in found.folder.glob("gait-[0-9].json")
        if json.loads(path.read_text()) == published(found.record["gaits"])
    )
    saved = json.loads(file.read_text())
    done = cli("bound", "--gait", file, "--json", "--out", "results", "--no-animation")
    assert done.returncode == 0
    run = json.loads(done.stdout)
    assert run["outcome"] == "completed"
    assert run["strides"] == 1
    assert run["period"] == pytest.approx(saved["period"], abs=1e-12)
    assert run["peak_grf"] == pytest.approx(saved["peak_grf"])
    for apex in run["apexes"]:
        assert apex == pytest.approx(saved["apex"], abs=1e-10)
    assert (tmp_path / "results" / "figure.png").exists()
    run = json.loads(cli("bound", "--gait", file, "--strides", "3", "--json").stdout)
    assert run["strides"] == 3


def test_a_period_of_two_strides_is_run_as_a_whole(cli: Cli, found: Found, tmp_path: Path) -> None:
    saved = {**published(found.record["gaits"]), "strides": 2}
    (tmp_path / "two.json").write_text(json.dumps(saved))
    assert json.loads(cli("bound", "--gait", "two.json", "--json").stdout)["strides"] == 2
    run = json.loads(cli("bound", "--gait", "two.json", "--seconds", "0.1", "--json").stdout)
    assert run["duration"] == 0.1


def test_a_table_for_people(cli: Cli) -> None:
    done = cli("gait", "--symmetric")
    assert done.returncode == 0
    assert done.stderr == ""
    for told in ("530.460", "+1.32784867", "DF-FS-DF-HS-DF", "condition", "fore_pitch_rate"):
        assert told in done.stdout


def test_no_gait_is_exit_code_1_with_advice(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "gait-1.json").write_text("older")
    arguments = ("gait", "--height", "0.05", "--symmetric", "--starts", "2", "--out", ".")
    done = cli(*arguments, "--json")
    assert done.returncode == 1
    record = json.loads(done.stdout)
    assert record["gaits"] == []
    assert record["tally"] == {"fell": 2}
    assert done.stderr.startswith("flexspine: no gait found: ")
    assert done.stderr.count("\n") == 1
    assert record["advice"] in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"command.txt", "gaits.json"}
    shown = cli(*arguments)
    assert (shown.returncode, shown.stdout) == (1, "")


def test_what_is_not_given_is_of_the_unchanged_preset(cli: Cli) -> None:
    record = json.loads(
        cli("gait", "--set", "spine.stiffness=240", "--speed", "4.4", "--starts", "1", "--json",
            "--symmetric").stdout
    )  # fmt: skip
    assert record["fixed"] == pytest.approx({"energy": 290, "height": 0.32, "mean_speed": 4.4})


def test_other_quantities_fixed_find_the_same_gait(cli: Cli) -> None:
    done = cli(
        "gait", "--energy", "290", "--fix", "height=0.32", "--symmetric", "--json",
        "--fix", f"touchdown.fore={PUBLISHED_TOUCHDOWN}", "--within", "fore_pitch=-0.2:0.5",
    )  # fmt: skip
    record = json.loads(done.stdout)
    assert record["fixed"].keys() == {"energy", "height", "touchdown.fore"}
    pitches = [gait["apex"]["fore_pitch"] for gait in record["gaits"]]
    assert any(pitch == pytest.approx(PUBLISHED_PITCH, abs=1e-10) for pitch in pitches)
    assert all(-0.2 <= pitch <= 0.5 for pitch in pitches)


def test_a_parameter_can_be_the_unknown(cli: Cli) -> None:
    done = cli(
        "gait", "--energy", "290", "--height", "0.32", "--speed", "4.5", "--symmetric", "--json",
        "--fix", f"touchdown.fore={PUBLISHED_TOUCHDOWN}", "--free", "spine.stiffness=100:500",
        "--within", "fore_pitch=-0.2:0.5",
    )  # fmt: skip
    gaits = json.loads(done.stdout)["gaits"]
    stiffnesses = [gait["parameters"]["spine.stiffness"] for gait in gaits]
    assert any(stiffness == pytest.approx(260, abs=1e-6) for stiffness in stiffnesses)


def test_a_damped_gait_is_found_with_what_keeps_it_going(cli: Cli, tmp_path: Path) -> None:
    """Next to the published one; what it spends is what the damper takes."""
    done = cli(
        "gait", "--set", "spine.damping=1", "--free", "legs.extension=0:0.01",
        "--within", "touchdown.fore=0.44:0.49", "--within", "touchdown.hind=0.54:0.6",
        "--within", "fore_pitch=0.06:0.12", "--within", "hind_pitch=-0.12:-0.06",
        "--starts", "4", "--out", "damped",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    record = json.loads((tmp_path / "damped" / "gaits.json").read_text())
    assert record["free"] == ["legs.extension"]
    (gait,) = record["gaits"]
    with Image.open(tmp_path / "damped" / "gait-1.png") as picture:
        assert len(picture.getcolors(picture.width * picture.height) or ()) > 100, "it is drawn"
    run = json.loads(cli("bound", "--gait", "damped/gait-1.json", "--json").stdout)
    assert run["energy"]["relative_drift"] < 1e-12
    assert run["apexes"][-1]["height"] == pytest.approx(0.32, abs=1e-10)
    for told in (gait["parameters"]["legs.extension"], gait["cost_of_transport"]):
        assert told > 0
        assert f"{told:.8g}" in done.stdout


BAD = {
    "unknown preset": (["--preset", "kamimra2015-flexible"], "kamimura2015-flexible"),
    "unknown parameter": (["--set", "spine.stifness=3"], "spine.stiffness"),
    "unknown quantity": (["--fix", "heigt=0.32"], "height"),
    "too few fixed": (["--energy", "290", "--fix", "height=0.32"], "families of 1 dimension"),
    "too much free": (["--free", "spine.stiffness=200:300"], "fewer parameters free"),
    "too many fixed": (
        ["--energy", "290", "--height", "0.32", "--speed", "4.5", "--fix", "speed=4.4"],
        "1 too many",
    ),
    "given twice": (["--energy", "290", "--fix", "energy=290"], "energy is given twice"),
    "not a number": (["--energy", "nan"], "--energy"),
    "a text": (["--fix", "height=low"], "low"),
    "backward": (["--speed", "-3"], "--speed"),
    "no range": (["--within", "touchdown.fore=0.3"], "LOW:HIGH"),
    "empty range": (["--free", "spine.stiffness=300:200"], "LOW:HIGH"),
    "a range from zero": (["--free", "spine.stiffness=0:200"], "spine.stiffness"),
    "unknown free parameter": (["--free", "spine.stifness=200:300"], "spine.stiffness"),
    "bounds of a known": (["--within", "height=0.3:0.4"], "height"),
    "no starts": (["--starts", "0"], "--starts"),
    "no symmetry": (["--set", "fore.mass=9", "--symmetric"], "symmetric"),
}


def assert_one_clear_line(done: Result, told: str) -> None:
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("flexspine: ")
    assert done.stderr.count("\n") == 1
    assert told in done.stderr


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_clear_line(cli: Cli, tmp_path: Path, case: str) -> None:
    arguments, told = BAD[case]
    assert_one_clear_line(cli("gait", *arguments, "--out", "results"), told)
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind"


def test_bad_input_is_an_object_for_programs(cli: Cli) -> None:
    done = cli("gait", "--fix", "heigt=0.32", "--json")
    assert done.returncode == 2
    assert json.loads(done.stdout)["error"] == "unknown_name"


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "cannot read"),
        ("{", "not JSON"),
        ("[1, 2]", "not a gait"),
        ('{"model": "flexible-bounder"}', "no 'parameters'"),
        ('{"gaits": [{}, {}]}', "holds 2 gaits"),
        ('{"gaits": []}', "holds 0 gaits"),
    ],
)
def test_a_file_that_is_no_gait_is_refused(
    cli: Cli, tmp_path: Path, content: str | None, told: str
) -> None:
    if content is not None:
        (tmp_path / "gait.json").write_text(content)
    assert_one_clear_line(cli("bound", "--gait", "gait.json"), told)


@pytest.mark.parametrize(
    "more",
    [
        ["--preset", "slip"],
        ["--set", "gravity=9"],
        ["--apex", "height=1"],
        ["--touchdown", "fore=0"],
    ],
)
def test_a_saved_gait_cannot_be_changed(cli: Cli, found: Found, more: list[str]) -> None:
    assert_one_clear_line(cli("bound", "--gait", found.folder / "gait-1.json", *more), more[0])


def test_an_interrupt_leaves_nothing(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [COMMAND, "gait", "--starts", "100000", "--out", "results"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for _ in range(6000):
        if (tmp_path / "results").exists():
            break
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert (output, errors) == ("", "flexspine: interrupted\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", ["gait", "branch"])
def test_help_has_an_example(cli: Cli, verb: str) -> None:
    done = cli(verb, "--help")
    assert done.returncode == 0
    assert f"flexspine {verb} --" in done.stdout
