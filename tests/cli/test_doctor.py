"""`flexspine doctor`: what works, what is missing, and what is wrong."""

from __future__ import annotations

import json
import sys

import pytest

from flexspine.cli import self_check
from tests.cli.conftest import Cli

CHECKS = ["flexspine", "packages", "extra engine", "extra cluster", "compiled code"]
CHECKS += ["published gait", "video", "pictures by MuJoCo"]


def test_it_works_here(cli: Cli) -> None:
    done = cli("doctor", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["works"]
    assert [check["name"] for check in record["checks"]] == CHECKS
    told = {check["name"]: check for check in record["checks"]}
    assert "0.2527321084" in told["published gait"]["told"]
    assert told["compiled code"]["passed"]


def test_wrong_numbers_are_exit_code_3(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(self_check, "PERIOD", 0.2527321086)
    done = cli("doctor")
    assert done.returncode == 3
    line = next(line for line in done.stdout.splitlines() if "published gait" in line)
    assert line.startswith("WRONG")
    assert "are right" in line


def test_what_is_missing_is_told_with_how_to_get_it(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def version(name: str) -> str:
        if name in ("mujoco", "distributed"):
            raise self_check.PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(self_check, "version", version)
    needs = ["numpy>=1", "mujoco>=3 ; extra == 'engine'", "distributed; extra == 'cluster'"]
    monkeypatch.setattr(self_check, "requires", lambda _name: needs)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = cli("doctor")
    assert done.returncode == 0
    assert "pip install 'flexspine[engine]'" in done.stdout
    assert "pip install 'flexspine[cluster]'" in done.stdout
    assert "pip install 'mujoco>=3.17,<4'" in done.stdout
    assert "numpy 1.0" in done.stdout


def test_an_ffmpeg_that_is_not_there_is_missing(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/no/such/ffmpeg")
    done = cli("doctor")
    assert done.returncode == 0
    line = next(line for line in done.stdout.splitlines() if line[6:].startswith("video"))
    assert line.startswith("- ")
    assert "--no-animation" in line


def test_a_package_that_is_needed_and_missing_is_wrong(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(self_check, "requires", lambda _name: ["no-such-package>=1"])
    done = cli("doctor")
    assert done.returncode == 3
    assert "no-such-package is missing" in done.stdout
