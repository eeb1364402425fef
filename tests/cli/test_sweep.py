"""`flexspine sweep` and `flexspine rerun`: exit codes, messages, and what is written where."""

from __future__ import annotations

import json
import os
import pty
import shutil
import stat
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import flexspine
from flexspine.cli import app
from tests.cli.conftest import COMMAND, Cli
from tests.studies.test_plan import BAD

PLAN = """model = ["scout2", "kamimura2015-flexible"]
method = "random"
samples = 10
chunk = 4
[options]
strides = 2
[axes]
speed = { around = 0.02 }
"""

Run = Callable[..., int]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """The command in this process, in an empty directory with nothing but a plan."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN)

    def one(*arguments: str | Path) -> int:
        return app.run([*map(str, arguments)])

    return one


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished sweep; who changes it makes a copy."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "plan.toml").write_text(PLAN)
    flexspine.sweep(folder / "plan.toml", folder / "out")
    return folder / "out"


@pytest.fixture
def copied(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "out"))


def part(out: Path, number: int, model: str = "scout2") -> Path:
    return out / "rows" / f"model={model}" / f"part-{number:06d}.parquet"


def assert_one_clear_line(capsys: pytest.CaptureFixture[str], *told: str) -> None:
    """On stderr, with what is wrong and what to do."""
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.startswith("flexspine: ")
    assert errors.count("\n") == 1
    assert "; " in errors
    assert "Traceback" not in errors
    for text in told:
        assert text in errors


def everything_in(folder: Path) -> dict[str, bytes | None]:
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


# What it says.


def test_people_are_told_what_came_of_it_and_programs_too(cli: Cli, tmp_path: Path) -> None:
    """In a pipe nothing is shown on the way."""
    (tmp_path / "plan.toml").write_text(PLAN)
    done = cli("sweep", "plan.toml", "--out", "deep/out", "--processes", "1")
    assert (done.returncode, done.stderr) == (0, "")
    told = done.stdout.splitlines()
    assert len(told) == 2
    assert told[0].startswith("20 rows (")
    assert "strides in" in told[0]
    assert told[1] == "rows in deep/out/rows"
    again = cli("sweep", "plan.toml", "--out", "deep/out", "--json")
    assert (again.returncode, again.stderr) == (0, "")
    record = json.loads(again.stdout)
    assert again.stdout.count("\n") == 1
    assert record["schema_version"] == 1
    assert record["flexspine"] == flexspine.__version__
    assert record["models"] == ["scout2", "kamimura2015-flexible"]
    assert (record["task"], record["out"]) == ("runs", "deep/out")
    counts = ("points", "chunks", "made", "rows")
    assert [record[name] for name in counts] == [20, 6, 0, 20]
    assert sum(record["outcomes"].values()) == 20
    rows = pq.read_table(tmp_path / "deep" / "out" / "rows")
    assert record["strides"] == sum(rows["strides"].to_pylist())
    manifest = json.loads((tmp_path / "deep" / "out" / "manifest.json").read_text())
    assert record["digest"] == manifest["digest"]
    assert record["seconds"] < 60


def test_progress_is_shown_to_a_person_and_not_in_the_result(tmp_path: Path) -> None:
    one = PLAN.replace('["scout2", "kamimura2015-flexible"]', '"scout2"')
    (tmp_path / "plan.toml").write_text(one)
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [COMMAND, "sweep", "plan.toml", "--out", "out", "--processes", "1", "--json"],
        cwd=tmp_path,
        env={**os.environ, "TERM": "xterm"},
        stdout=subprocess.PIPE,
        stderr=theirs,
    )
    os.close(theirs)
    shown = b""
    with os.fdopen(ours, "rb", buffering=0) as terminal, suppress(OSError):  # at its end
        while read := terminal.read(4096):
            shown += read
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert json.loads(output)["made"] == 3
    assert b"points" in shown
    assert b"/10" in shown


def test_the_example_is_a_million_strides() -> None:
    example = Path(__file__).parents[2] / "examples" / "million_strides.toml"
    plan = flexspine.read_plan(example)
    strides = plan.points * len(plan.models) * plan.options["strides"]
    assert strides >= 1_000_000
    assert plan.chunks > 1


@pytest.mark.parametrize("verb", ["sweep", "rerun"])
def test_help_has_an_example_and_the_exit_codes(
    run: Run, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    assert run(verb, "--help") == 0
    told = capsys.readouterr().out
    assert f"flexspine {verb} " in told
    assert "130: interrupted" in " ".join(told.split())


# Bad input.


@pytest.mark.parametrize("case", BAD)
def test_a_bad_plan_is_one_clear_line(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    content, told = BAD[case]
    plan = tmp_path / "plan.toml"
    plan.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert run("sweep", "plan.toml", "--out", "deep/out") == 2
    assert_one_clear_line(capsys, told, "plan.toml")
    assert list(tmp_path.iterdir()) == [plan], "nothing may be left behind"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("absent.toml", "--out", "out"), "absent.toml"),
        ((".", "--out", "out"), "directory"),
        (("plan.toml",), "--out"),
        (("plan.toml", "--out", "out", "--processes", "0"), "processes = 0"),
        (("plan.toml", "--out", "out", "--processes", "-1"), "processes = -1"),
        (("plan.toml", "--out", "out", "--processes", "two"), "--processes"),
        (("plan.toml", "--out", "out", "--scheduler", "nowhere"), "nowhere"),
        (("plan.toml", "--out", "out", "--scheduler", "tcp://nowhere"), "tcp://nowhere"),
        (("plan.toml", "--out", "plan.toml"), "plan.toml"),
        (("plan.toml", "--out", "plan.toml/out"), "plan.toml/out"),
        (("plan.toml", "--out", "/proc/flexspine"), "/proc/flexspine"),
        (("plan.toml", "--out", "."), "something else"),
        (("plan.toml", "--out", "out", "--seed", "3"), "--seed"),
    ],
)
def test_bad_arguments_are_one_clear_line(
    run: Run,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    told: str,
) -> None:
    assert run("sweep", *arguments) == 2
    assert_one_clear_line(capsys, told)
    assert everything_in(tmp_path) == {"plan.toml": PLAN.encode()}, "nothing may be left behind"


def test_bad_input_is_an_object_for_programs(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sweep", "absent.toml", "--out", "out", "--json") == 2
    output, errors = capsys.readouterr()
    record = json.loads(output)
    assert record.keys() == {"schema_version", "error", "message", "remedy"}
    assert "absent.toml" in record["message"]
    assert errors == ""


@pytest.mark.skipif(os.geteuid() == 0, reason="everything is open to root")
def test_files_and_directories_that_are_closed_are_named(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=stat.S_IRUSR | stat.S_IXUSR)
    assert run("sweep", "plan.toml", "--out", "closed/out") == 2
    assert_one_clear_line(capsys, "closed/out")
    assert list(closed.iterdir()) == []
    (tmp_path / "plan.toml").chmod(0)
    assert run("sweep", "plan.toml", "--out", "out") == 2
    assert_one_clear_line(capsys, "plan.toml")
    assert not (tmp_path / "out").exists()


CHANGES: dict[str, tuple[Callable[[str], str], tuple[str, ...]]] = {
    "seed": (lambda text: "seed = 3\n" + text, ("seed", "0", "3")),
    "samples": (lambda text: text.replace("= 10", "= 9"), ("samples", "10", "9")),
    "method": (lambda text: text.replace("random", "sobol"), ("method", "random", "sobol")),
    "chunk": (lambda text: text.replace("chunk = 4", "chunk = 5"), ("chunk", "4", "5")),
    "strides": (lambda text: text.replace("strides = 2", "strides = 3"), ("options.strides", "3")),
    "tolerance": (
        lambda text: text.replace("strides", "tolerance = 1e-11\nstrides"),
        ("options.tolerance", "1e-12", "1e-11"),
    ),
    "range": (lambda text: text.replace("0.02", "0.03"), ("axes.speed", "0.02", "0.03")),
    "axis": (lambda text: text.replace("speed", "height"), ("axes", "speed")),
    "more axes": (lambda text: text + "height = {around = 0.1}\n", ("axes.height", "0.1")),
    "order of axes": (
        lambda text: text.replace("speed =", "height = {around = 0}\nspeed ="),
        ("axes.height",),
    ),
    "value": (lambda text: text + "[set]\ngravity = 9.8\n", ("gravity", "9.81", "9.8")),
    "model": (
        lambda text: text.replace("kamimura2015-flexible", "kamimura2015-rigid"),
        ("models", "kamimura2015-flexible", "kamimura2015-rigid"),
    ),
    "fewer models": (
        lambda text: text.replace('["scout2", "kamimura2015-flexible"]', '"scout2"'),
        ("models", "kamimura2015-flexible"),
    ),
    "task": (
        lambda text: text.replace('"\nsamples', '"\ntask = "searches"\nsamples').replace(
            "strides = 2", "starts = 2"
        ),
        ("task", "runs", "searches"),
    ),
}


@pytest.mark.parametrize("case", CHANGES)
def test_another_configuration_is_refused_and_what_differs_is_named(
    run: Run, tmp_path: Path, copied: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    change, told = CHANGES[case]
    (tmp_path / "plan.toml").write_text(change(PLAN))
    before = everything_in(copied)
    assert run("sweep", "plan.toml", "--out", "out") == 2
    assert_one_clear_line(capsys, "another configuration", "'out'", *told)
    assert everything_in(copied) == before


# Doing it again.


def test_done_again_it_is_the_same(
    run: Run, finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = everything_in(finished)
    assert run("rerun", finished, "--processes", "1") == 0
    assert capsys.readouterr() == ("the same: all 6 chunks\n", "")
    assert run("rerun", finished, "--processes", "1", "--json") == 0
    output, errors = capsys.readouterr()
    record = json.loads(output)
    assert errors == ""
    assert record["same"] is True
    assert (record["chunks"], record["differing"], record["changed"]) == (6, [], {})
    assert everything_in(finished) == before


def with_one_value_changed(file: Path) -> None:
    """As someone would who mends a value by hand: the file's own notes stay as they are."""
    table = pq.ParquetFile(file).read()
    place = table.schema.get_field_index("duration")
    values = table["duration"].to_pylist()
    values[1] *= 1 + 1e-15
    assert values != table["duration"].to_pylist()
    changed = table.set_column(place, "duration", pa.array(values))
    pq.write_table(changed.replace_schema_metadata(table.schema.metadata), file)


def with_another_outcome(file: Path) -> None:
    table = pq.ParquetFile(file).read()
    place = table.schema.get_field_index("outcome")
    pq.write_table(table.set_column(place, "outcome", pa.array(["fell"] * len(table))), file)


def with_a_row_less(file: Path) -> None:
    pq.write_table(pq.ParquetFile(file).read().slice(1), file)


def with_other_rows(file: Path) -> None:
    shutil.copy(file.with_name("part-000000.parquet"), file)


@pytest.mark.parametrize(
    "tamper", [with_one_value_changed, with_another_outcome, with_a_row_less, with_other_rows]
)
def test_rows_that_were_changed_are_found(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str], tamper: Callable[[Path], None]
) -> None:
    file = part(copied, 1)
    tamper(file)
    before = everything_in(copied)
    assert run("rerun", "out", "--processes", "1") == 1
    output, errors = capsys.readouterr()
    assert output.startswith("not the same: 1 of 6 chunks differ")
    assert str(file.relative_to(copied)) in output
    assert errors == ""
    assert run("rerun", "out", "--processes", "1", "--json") == 1
    record = json.loads(capsys.readouterr().out)
    assert record["same"] is False
    assert record["differing"] == [1]
    assert everything_in(copied) == before


def test_what_it_was_made_with_is_told_where_it_differs(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((copied / "manifest.json").read_text())
    manifest["made_with"] |= {"processor": "an abacus"}
    (copied / "manifest.json").write_text(json.dumps(manifest))
    with_one_value_changed(part(copied, 2))
    assert run("rerun", "out", "--processes", "1") == 1
    assert "processor was an abacus, is " in capsys.readouterr().out
    assert run("rerun", "out", "--processes", "1", "--json") == 1
    assert json.loads(capsys.readouterr().out)["changed"]["processor"]["was"] == "an abacus"


def test_an_unfinished_sweep_is_repeated_as_far_as_it_got(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for model, number in (("scout2", 1), ("kamimura2015-flexible", 0)):
        part(copied, number, model).unlink()
    assert run("rerun", "out", "--processes", "1") == 1
    assert "0 of 4 chunks differ, 2 are missing" in capsys.readouterr().out
    manifest = json.loads((copied / "manifest.json").read_text())
    del manifest["finished"]
    (copied / "manifest.json").write_text(json.dumps(manifest))
    assert run("rerun", "out", "--processes", "1") == 0
    assert capsys.readouterr().out == "the same: all 4 chunks\n"
    with_one_value_changed(part(copied, 2))
    assert run("rerun", "out", "--processes", "1", "--json") == 1
    record = json.loads(capsys.readouterr().out)
    assert (record["chunks"], record["differing"]) == (4, [2])
    assert not part(copied, 1).exists()


DAMAGES: dict[str, Callable[[Path], Any]] = {
    "empty": lambda file: file.write_bytes(b""),
    "cut": lambda file: file.write_bytes(file.read_bytes()[:700]),
    "no Parquet": lambda file: file.write_text("rows"),
    "without its digest": lambda file: pq.write_table(
        pq.ParquetFile(file).read().replace_schema_metadata(None), file
    ),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_a_damaged_file_is_named_and_made_anew_once_it_is_gone(
    run: Run, finished: Path, copied: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    file = part(copied, 1)
    DAMAGES[case](file)
    assert run("sweep", "plan.toml", "--out", "out", "--processes", "1") == 2
    assert_one_clear_line(capsys, str(file.relative_to(copied)), "damaged", "delete it")
    if case != "without its digest":
        assert run("rerun", "out", "--processes", "1") == 2
        assert_one_clear_line(capsys, str(file.relative_to(copied)), "damaged", "delete it")
    file.unlink()
    assert run("sweep", "plan.toml", "--out", "out", "--processes", "1", "--json") == 0
    assert json.loads(capsys.readouterr().out)["made"] == 1
    assert everything_in(copied / "rows") == everything_in(finished / "rows")


def test_bytes_that_went_bad_within_a_file_are_noticed(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The end of a Parquet file, where its digest is, tells nothing of its rows."""
    file = part(copied, 1)
    content = bytearray(file.read_bytes())
    content[200:212] = b"XXXXXXXXXXXX"
    file.write_bytes(content)
    assert run("rerun", "out", "--processes", "1") in (1, 2)
    assert str(file.relative_to(copied)) in "".join(capsys.readouterr())


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", "null", '"text"', "{}", '{"key": 1, "plan": 2, "made_with": 3}', "\xff"],
)
@pytest.mark.parametrize("verb", ["sweep", "rerun"])
def test_a_damaged_manifest_is_one_clear_line(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str], verb: str, content: str
) -> None:
    (copied / "manifest.json").write_text(content, encoding="latin-1")
    before = everything_in(copied)
    arguments = ("out",) if verb == "rerun" else ("plan.toml", "--out", "out")
    assert run(verb, *arguments) == 2
    assert_one_clear_line(capsys, "'out'", "manifest", "damaged")
    assert everything_in(copied) == before


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        (("plan", "samples"), 400),
        (("plan", "samples"), "many"),
        (("plan", "seed"), 1),
        (("plan", "options", "tolerance"), "small"),
        (("plan", "axes"), []),
        (("plan", "models"), []),
        (("plan", "models"), [3]),
        (("made_with",), 3),
        (("made_with",), None),
    ],
)
def test_a_manifest_that_was_changed_is_refused(
    run: Run,
    copied: Path,
    capsys: pytest.CaptureFixture[str],
    entry: tuple[str, ...],
    value: Any,
) -> None:
    manifest = json.loads((copied / "manifest.json").read_text())
    inner = manifest
    for name in entry[:-1]:
        inner = inner[name]
    inner[entry[-1]] = value
    (copied / "manifest.json").write_text(json.dumps(manifest))
    assert run("rerun", "out", "--processes", "1") == 2
    assert_one_clear_line(capsys)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("absent",), "absent"),
        (("plan.toml",), "plan.toml"),
        (("empty",), "flexspine sweep"),
        (("out", "--processes", "0"), "processes = 0"),
        (("out", "--processes", "-1"), "processes = -1"),
        (("out", "--scheduler", "nowhere"), "nowhere"),
        ((), "DIR"),
    ],
)
def test_bad_arguments_of_rerun_are_one_clear_line(
    run: Run,
    tmp_path: Path,
    copied: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    told: str,
) -> None:
    (tmp_path / "empty").mkdir()
    before = everything_in(tmp_path)
    assert copied.name == "out"
    assert run("rerun", *arguments) == 2
    assert_one_clear_line(capsys, told)
    assert everything_in(tmp_path) == before


def test_a_sweep_without_a_finished_chunk_cannot_be_repeated(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree(copied / "rows")
    assert run("rerun", "out") == 2
    assert_one_clear_line(capsys, "'out'", "no finished chunk")


def test_files_that_are_not_of_a_sweep_are_named(
    run: Run, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whoever reads the rows would read them as well."""
    stray = part(copied, 9)
    shutil.copy(part(copied, 1), stray)
    for words in (("rerun", "out"), ("sweep", "plan.toml", "--out", "out")):
        assert run(*words, "--processes", "1") == 2
        assert_one_clear_line(capsys, str(stray.relative_to(copied)), "not of this sweep")


HOPELESS = {
    "too many to fix": (
        'task = "searches"\n[options]\nfixed = {energy=230, height=0.35, pitch_rate=3}\n'
        "[axes]\nmean_speed = [3.0]",
        2, "1 too many to fix",
    ),
    "too few fixed": (
        'task = "searches"\n[options]\nfixed = {energy=200}\n[axes]\nmean_speed = [3.0]',
        2, "families",
    ),
    "no gait to follow": (
        'task = "gaits"\n[set]\nheight = 0.3\n[axes]\nmean_speed = [3.0, 3.1]',
        2, "no gait to follow",
    ),
    "none found": (
        'task = "searches"\n[options]\nstarts = 1\nfixed = {energy=230, height=0.05}\n'
        "[axes]\nmean_speed = [3.0]",
        1, "1 none",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", HOPELESS)
def test_searches_and_gaits_that_lead_nowhere_do_not_end_well(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    text, code, told = HOPELESS[case]
    (tmp_path / "plan.toml").write_text(f'model = "scout2"\n{text}')
    assert run("sweep", "plan.toml", "--out", "out", "--processes", "1") == code
    assert told in "".join(capsys.readouterr())
    assert (tmp_path / "out").exists() == (code == 1)
