"""Whatever is thrown at `simulate`, it answers: an outcome, or one clear error. It never hangs."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from flexspine import load_model, simulate
from flexspine.errors import InputError
from flexspine.models.actuation import ACTUATORS
from flexspine.parameters import quantities

OUTCOMES = {"completed", "fell", "no_apex", "grazed", "chattered", "timed_out", "diverged"}
PRESETS = ("kamimura2015-flexible", "kamimura2015-rigid", "kamimura2015-locked")


def within(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


@st.composite
def sane(draw: st.DrawFn) -> tuple[str, dict[str, Any], dict[str, float], dict[str, float]]:
    """Parameters within a factor of three of the published ones, and any state near an apex."""
    preset = draw(st.sampled_from(PRESETS))
    model = load_model(preset)
    changes = {
        about.name: draw(within(0.33, 3)) * value
        for about in quantities(type(model.parameters))
        if (value := nominal(about.name)) is not None
    }
    apex = {
        name: draw(
            within(0.25, 0.6) if name == "height" else
            within(-2, 8) if name == "speed" else
            within(-15, 15) if name.endswith("_rate") else
            within(-0.6, 0.6)
        )
        for name in model.apex
    }  # fmt: skip
    touchdown = {side: draw(within(-1.2, 1.2)) for side in ("fore", "hind")}
    return preset, changes, apex, touchdown


def nominal(name: str) -> float | None:
    if name == "gravity":
        return 9.81
    scale = {
        "mass": 10.0,
        "inertia": 0.5,
        "spine_offset": 0.138,
        "hip_offset": 0.138,
        "spine.stiffness": 250.0,
        "leg.stiffness": 6340.0,
        "leg.damping": 20.0,
        "leg.rest_length": 0.36,
        "spine.damping": 1.0,
    }
    return next((value for ending, value in scale.items() if name.endswith(ending)), None)


def check(preset: str, changes: dict[str, Any], apex: dict[str, float], angles: Any) -> None:
    try:
        run = simulate(
            load_model(preset, changes, apex=apex, touchdown=angles), strides=2, max_steps=3000
        )
    except InputError as refused:
        assert refused.message
        assert refused.remedy
        assert "\n" not in str(refused)
        return
    assert run.outcome.name in OUTCOMES
    assert run.outcome.message
    assert run.outcome.advice
    times = [event.time for event in run.trajectory.events]
    assert times == sorted(times)
    assert run.trajectory.duration >= 0
    if run.outcome.name != "diverged":
        assert np.all(np.isfinite(run.trajectory.end.states))


@settings(max_examples=200)
@given(sane())
def test_sane_bounders_always_end_in_an_outcome(
    case: tuple[str, dict[str, Any], dict[str, float], dict[str, float]],
) -> None:
    check(*case)


@settings(max_examples=200)
@given(st.data())
def test_any_numbers_at_all_end_in_an_outcome_or_one_error(data: st.DataObject) -> None:
    """Within the bounds that the parameters declare, and beyond them."""
    model = load_model(data.draw(st.sampled_from(PRESETS)))
    number = st.one_of(
        st.floats(),
        st.integers(-3, 3),
        st.sampled_from([1e-300, 1e300, 1e9, 1e-9, "text", None, True]),
    )
    about = quantities(type(model.parameters))
    names = [each.name for each in about if each.name not in ACTUATORS]
    changes = data.draw(st.dictionaries(st.sampled_from(names), number, max_size=3))
    apex = data.draw(st.dictionaries(st.sampled_from(list(model.apex)), st.floats(), max_size=3))
    angles = data.draw(st.dictionaries(st.sampled_from(("fore", "hind")), st.floats(), max_size=2))
    check(model.name, changes, apex, angles)


@settings(max_examples=150)
@given(sane(), st.data())
def test_actuated_bounders_end_in_an_outcome_or_one_error(
    case: tuple[str, dict[str, Any], dict[str, float], dict[str, float]], data: st.DataObject
) -> None:
    """Small numbers and absurd ones; all actuators at once, as each set of them is compiled."""
    preset, changes, apex, touchdown = case
    names = [name for name in ACTUATORS if preset == PRESETS[0] or not name.startswith("spine.")]
    number = st.one_of(within(-0.2, 0.2), st.sampled_from([-20.0, -0.99, 3.0, 50.0])).filter(bool)
    check(preset, {**changes, **{n: data.draw(number) for n in names}}, apex, touchdown)


@settings(max_examples=200)
@given(
    st.dictionaries(
        st.sampled_from(("com_y", "com_x_rate", "com_y_rate", "fore_pitch", "hind_pitch_rate")),
        within(-20, 20),
    ),
    st.dictionaries(st.sampled_from(("fore", "hind")), within(-3, 3)),
)
def test_any_state_and_contact_ends_in_an_outcome(
    state: dict[str, float], toes: dict[str, float]
) -> None:
    model = load_model("kamimura2015-flexible")
    try:
        run = simulate(model, state={"com_y": 0.4, **state}, toes=toes, max_steps=3000)
    except InputError as refused:
        assert "ground" in refused.message or "lift-off" in refused.message
        return
    assert run.outcome.name in OUTCOMES
