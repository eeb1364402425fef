from __future__ import annotations

import builtins
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cached_property

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


PUBLIC = {name: getattr(flexspine, name) for name in flexspine.__all__ if name != "__version__"}


def docstrings(name: str) -> Iterator[tuple[str, str]]:
    """The docstrings of a public name and of its public members, by where they stand."""
    yield name, inspect.getdoc(PUBLIC[name]) or ""
    for member, value in vars(PUBLIC[name]).items() if inspect.isclass(PUBLIC[name]) else ():
        described = isinstance(value, (property, cached_property, classmethod))
        if not member.startswith("_") and (described or inspect.isfunction(value)):
            yield f"{name}.{member}", inspect.getdoc(value) or ""


@pytest.mark.parametrize("name", PUBLIC)
def test_public_docstrings_name_public_things(name: str) -> None:
    """What stands in single backticks becomes a link in the reference."""
    for where, text in docstrings(name):
        assert text, where
        for link in re.findall(r"(?<!`)`([^`]+)`(?!`)", text):
            first, *rest = link.split(".")
            thing = PUBLIC.get(first, getattr(builtins, first, None))
            for part in rest:
                thing = getattr(thing, part, None)
            assert thing is not None, f"{where} names '{link}'"
