from __future__ import annotations

import subprocess
import sys

import pytest

import flexspine
from flexspine.errors import FlexspineError, InputError, MachineError


def test_importing_flexspine_loads_no_heavy_library() -> None:
    code = (
        "import sys, flexspine;"
        "print([m for m in ('heyoka','numpy','scipy','xarray','sympy','matplotlib','pydantic')"
        " if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


@pytest.mark.parametrize("name", flexspine.__all__)
def test_every_public_name_is_there_and_documented(name: str) -> None:
    thing = getattr(flexspine, name)
    assert thing.__doc__ or name == "__version__"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="simulat"):
        _ = flexspine.simulat  # type: ignore[attr-defined]


def test_exit_codes_follow_from_the_kind_of_error() -> None:
    assert InputError("a", "b").exit_code == 2
    assert MachineError("a", "b").exit_code == 3
    assert str(FlexspineError("what", "do this")) == "what; do this"
