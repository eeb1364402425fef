"""Code that LLVM has optimized computes what plain code does, which all other tests run."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from flexspine import load_model
from flexspine.errors import InputError
from flexspine.hybrid.compile import EFFORT, CompiledSystem, effort

PROGRAM = """
import json
from flexspine import examine, floquet_multipliers, load_model, simulate_many
gait = examine(load_model("kamimura2015-flexible"))
found = [gait.period, *gait.peak_grf.values()]
many = simulate_many(load_model("scout2"), {"height": [0.32, 0.325, 0.33]})
found += [*many["duration"], *many["energy_end"], *many["peak_grf_fore"]]
found += sorted(abs(floquet_multipliers(gait).multipliers))  # the last six
print(json.dumps([float(number) for number in found]))
"""


def numbers(level: str) -> list[float]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "FLEXSPINE_OPTIMIZATION": level},
        capture_output=True,
        text=True,
        check=True,
    )
    found: list[float] = json.loads(done.stdout)
    return found


def test_the_usual_level_computes_what_plain_code_does() -> None:
    """Multipliers to their error bars: a double one is known to the root of rounding only."""
    plain, usual = numbers("0"), numbers("")
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
