"""Compiled code on disk: whatever happens to it, runs go on and say nothing."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

PROGRAM = """
from flexspine import load_model, simulate
print(simulate(load_model("slip"), duration=0.01).trajectory.end.states[1])
"""


# Permissions do not bind the superuser, unless it gives up the power to ignore them.
_POWERS = "-dac_override,-dac_read_search"
BOUND_BY_PERMISSIONS = (
    ("setpriv", f"--bounding-set={_POWERS}", f"--inh-caps={_POWERS}") if os.geteuid() == 0 else ()
)


def run_with(cache: Path, *prefix: str, program: str = PROGRAM) -> str:
    done = subprocess.run(
        [*prefix, sys.executable, "-c", program],
        env={**os.environ, "FLEXSPINE_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert done.stderr == ""
    return done.stdout


def entries(cache: Path) -> int:
    """How many pieces of code heyoka's store holds."""
    with closing(sqlite3.connect(cache / "cache.db")) as store:
        return int(store.execute("select count(*) from cache").fetchone()[0])


def files(cache: Path) -> dict[str, int]:
    return {path.name: path.stat().st_size for path in cache.iterdir()}


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """What the first start prints, and the store that it leaves behind; tests take a copy."""
    cache = tmp_path_factory.mktemp("first")
    return run_with(cache), cache


@pytest.fixture
def expected(first: tuple[str, Path], tmp_path: Path) -> str:
    """What is printed, with a filled store in ``tmp_path``."""
    printed, cache = first
    shutil.copytree(cache, tmp_path, dirs_exist_ok=True)
    return printed


def test_a_second_start_finds_what_the_first_compiled(tmp_path: Path, expected: str) -> None:
    compiled = entries(tmp_path)
    assert compiled > 2
    assert run_with(tmp_path) == expected
    assert entries(tmp_path) == compiled


@pytest.mark.parametrize("damage", ["garbage", "truncated", "flipped"])
def test_a_corrupt_cache_is_rebuilt_silently(tmp_path: Path, expected: str, damage: str) -> None:
    (store,) = (path for path in tmp_path.iterdir() if path.stat().st_size > 100_000)
    content = bytearray(store.read_bytes())
    if damage == "garbage":
        content = bytearray(os.urandom(len(content)))
    elif damage == "truncated":
        del content[9000:]
    else:
        for i in range(8000, len(content), 997):
            content[i] ^= 0xFF
    store.write_bytes(content)
    assert run_with(tmp_path) == expected
    assert run_with(tmp_path) == expected
    assert sum(files(tmp_path).values()) > 100_000, "rebuilt, not merely bypassed"


@pytest.mark.usefixtures("expected")
def test_nothing_but_the_store_is_ever_deleted(tmp_path: Path) -> None:
    from flexspine.hybrid.cache import clear_cache

    (tmp_path / "thesis.txt").write_text("precious")
    (tmp_path / "cache.db").write_bytes(b"not a database at all" * 1000)
    run_with(tmp_path)
    assert (tmp_path / "thesis.txt").read_text() == "precious"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLEXSPINE_CACHE_DIR", str(tmp_path))
        clear_cache()
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_store_that_another_process_locks_is_left_to_it(tmp_path: Path, expected: str) -> None:
    compiled = entries(tmp_path)
    with closing(sqlite3.connect(tmp_path / "cache.db", isolation_level=None)) as holder:
        holder.execute("begin exclusive")
        assert run_with(tmp_path) == expected
        holder.execute("rollback")
    assert entries(tmp_path) == compiled


def test_what_comes_new_drives_out_the_oldest_beyond_a_limit(tmp_path: Path, expected: str) -> None:
    limit = 200_000
    other = PROGRAM.replace("0.01", "0.01, tolerance=1e-9")
    told = run_with(
        tmp_path, program=f"from flexspine.hybrid import cache as c; c.LIMIT = {limit}\n{other}"
    )
    assert float(told) == pytest.approx(float(expected), abs=1e-6)
    with closing(sqlite3.connect(tmp_path / "cache.db")) as store:
        assert 0 < store.execute("select sum(size) from cache").fetchone()[0] <= limit


def test_a_cache_that_cannot_be_made_is_done_without(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a directory")
    run_with(blocked / "cache")
    run_with(blocked)
    assert blocked.read_text() == "not a directory"


def test_a_read_only_cache_is_done_without(tmp_path: Path, expected: str) -> None:
    for path in (*tmp_path.iterdir(), tmp_path):
        path.chmod(0o500 if path.is_dir() else 0o400)
    try:
        assert run_with(tmp_path, *BOUND_BY_PERMISSIONS) == expected
        with pytest.raises(subprocess.CalledProcessError):
            subprocess.run([*BOUND_BY_PERMISSIONS, "touch", tmp_path / "new"], check=True)
    finally:
        tmp_path.chmod(0o700)


def test_processes_that_share_a_new_cache_agree(tmp_path: Path) -> None:
    env = {**os.environ, "FLEXSPINE_CACHE_DIR": str(tmp_path)}
    started = [
        subprocess.Popen(
            [sys.executable, "-c", PROGRAM], env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        for _ in range(3)
    ]
    answers = [process.communicate(timeout=240) for process in started]
    assert [process.returncode for process in started] == [0] * 3
    assert len({out for out, _ in answers}) == 1
    assert {err for _, err in answers} == {b""}
