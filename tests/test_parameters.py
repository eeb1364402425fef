from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from flexspine.errors import ParameterError, UnknownNameError
from flexspine.models.bounder import BounderKind
from flexspine.models.flexible_bounder import FlexibleBounderParameters
from flexspine.models.presets import load_model
from flexspine.models.registry import KINDS
from flexspine.parameters import build, flattened, nested, quantities, replaced, values

PUBLISHED = load_model("kamimura2015-flexible").parameters


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_parameter_has_a_unit_a_meaning_and_finite_bounds(kind: BounderKind) -> None:
    for about in quantities(kind.parameters):
        assert about.unit
        assert about.meaning
        assert math.isfinite(about.lower)
        assert math.isfinite(about.upper)


def test_parameters_are_frozen() -> None:
    with pytest.raises(ValidationError):
        PUBLISHED.spine.stiffness = 1.0


def test_replacing_one_value_leaves_the_others() -> None:
    changed = values(replaced(PUBLISHED, {"spine.stiffness": 200}))
    expected = {**values(PUBLISHED), "spine.stiffness": 200.0}
    assert changed == expected


def test_an_unknown_name_is_refused_with_a_suggestion() -> None:
    with pytest.raises(UnknownNameError) as refused:
        replaced(PUBLISHED, {"spine.stifness": 1.0})
    assert str(refused.value) == (
        "unknown parameter 'spine.stifness'; did you mean 'spine.stiffness'?"
    )


@pytest.mark.parametrize(
    "value", [-1.0, 0.0, math.nan, math.inf, -math.inf, 1e300, "3", None, True]
)
def test_a_mass_that_is_no_mass_is_refused_by_name(value: object) -> None:
    with pytest.raises(ParameterError, match=r"parameter 'fore\.mass' = .* kg"):
        replaced(PUBLISHED, {"fore.mass": value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fore.inertia", 0.0),
        ("hind.leg.stiffness", -5.0),
        ("hind.leg.damping", -1.0),
        ("fore.leg.rest_length", 0.0),
        ("spine.stiffness", -1e-9),
        ("spine.rest_angle", 2.0),
        ("gravity", 0.0),
    ],
)
def test_values_beyond_their_bounds_are_refused(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=name):
        replaced(PUBLISHED, {name: value})


def test_a_missing_value_is_named() -> None:
    given_values = values(PUBLISHED)
    del given_values["hind.leg.rest_length"]
    with pytest.raises(ParameterError, match=r"'hind\.leg\.rest_length' has no value"):
        build(FlexibleBounderParameters, given_values)


def test_what_is_missing_is_told_at_once() -> None:
    """But for what has a default."""
    kept = {n: v for n, v in values(PUBLISHED).items() if not n.startswith("hind")}
    names = (
        r"hind\.mass, hind\.inertia, hind\.spine_offset, hind\.hip_offset, "
        r"hind\.leg\.stiffness, hind\.leg\.rest_length"
    )
    with pytest.raises(ParameterError, match=f"parameters {names} have no value"):
        build(FlexibleBounderParameters, kept)


@given(st.dictionaries(st.from_regex(r"[a-z]{1,3}\.[a-z]{1,3}", fullmatch=True), st.floats()))
def test_nesting_and_flattening_undo_each_other(flat: dict[str, float]) -> None:
    assert flattened(nested(flat)).keys() == flat.keys()
