"""Code that LLVM has optimized computes what plain code does, which all other tests run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from flexspine import load_model
from flexspine.errors import InputError
from flexspine.hybrid.compile import EFFORT, CompiledSystem, effort

PROGRAM = """
from flexspine import examine, floquet_multipliers, load_model, simulate_many

def numbers():
    gait = examine(load_model("kamimura2015-flexible"))
    found = [gait.period, *gait.peak_grf.values()]
    many = simulate_many(load_model("slip"), {"height": [1.22, 1.23, 1.24]})
    found += [*many["duration"], *many["energy_end"], *many["peak_grf_fore"]]
    found += sorted(abs(floquet_multipliers(gait).multipliers))  # the last six
    return [float(number) for number in found]
"""


def numbers_at(level: str) -> list[float]:
    done = subprocess.run(
        [sys.executable, "-c", f"{PROGRAM}\nprint(numbers())"],
        env={**os.environ, "FLEXSPINE_OPTIMIZATION": level},
        capture_output=True,
        text=True,
        check=True,
    )
    found: list[float] = json.loads(done.stdout)
    return found


def test_the_usual_level_computes_what_plain_code_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Multipliers to their error bars: a double one is known to the root of rounding only."""
    monkeypatch.setenv("FLEXSPINE_OPTIMIZATION", "0")
    here: dict[str, Any] = {}
    exec(PROGRAM, here)
    plain, usual = here["numbers"](), numbers_at("")
    assert len(usual) >= 18
    assert usual[:-6] == pytest.approx(plain[:-6], rel=1e-10)
    assert usual[-6:] == pytest.approx(plain[-6:], rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("level", ["0", "3"])
def test_a_level_is_taken_from_the_environment(monkeypatch: pytest.MonkeyPatch, level: str) -> None:
    monkeypatch.setenv("FLEXSPINE_OPTIMIZATION", level)
    flight = CompiledSystem(load_model("slip").system, 1e-12).mode("DF")
    assert flight.integrator.llvm_state.opt_level == int(level)
    monkeypatch.delenv("FLEXSPINE_OPTIMIZATION")
    assert effort() == EFFORT


@pytest.mark.parametrize("level", ["4", "-1", "fast", "1.0"])
def test_what_is_no_level_is_refused(monkeypatch: pytest.MonkeyPatch, level: str) -> None:
    monkeypatch.setenv("FLEXSPINE_OPTIMIZATION", level)
    with pytest.raises(InputError, match="is no level") as refused:
        effort()
    assert "0, 1, 2 or 3" in refused.value.remedy
