"""The product against an independent implementation: SciPy DOP853, other coordinates, own events.

`tests/second_implementation.py` was written from the specification alone.
"""

from __future__ import annotations

from itertools import pairwise
from math import pi

import numpy as np
import pytest

from flexspine import Model, load_model, simulate, summarize
from tests import second_implementation as reference

AGREEMENT = 1e-8
STRIDE_LIMIT = 3.0


def flexible(rng: np.random.Generator, damped: bool) -> tuple[Model, reference.Flexible]:
    """A random flexible bounder with unequal halves, near the published one in size."""
    halves = {}
    changes: dict[str, float] = {}
    for side in ("fore", "hind"):
        halves[side] = reference.Half(
            mass=rng.uniform(6, 14),
            inertia=rng.uniform(0.2, 0.6),
            spine_offset=rng.uniform(0.08, 0.2),
            hip_offset=rng.uniform(0.08, 0.2),
            leg_stiffness=rng.uniform(4000, 9000),
            leg_damping=rng.uniform(10, 120) if damped else 0.0,
            leg_rest_length=rng.uniform(0.32, 0.4),
        )
        half = halves[side]
        changes |= {
            f"{side}.mass": half.mass,
            f"{side}.inertia": half.inertia,
            f"{side}.spine_offset": half.spine_offset,
            f"{side}.hip_offset": half.hip_offset,
            f"{side}.leg.stiffness": half.leg_stiffness,
            f"{side}.leg.damping": half.leg_damping,
            f"{side}.leg.rest_length": half.leg_rest_length,
        }
    body = reference.Flexible(
        **halves,
        spine_stiffness=rng.uniform(100, 500),
        spine_damping=rng.uniform(0.5, 4) if damped else 0.0,
        spine_rest_angle=rng.uniform(-0.1, 0.1),
        gravity=rng.uniform(8, 11),
    )
    changes |= {
        "spine.stiffness": body.spine_stiffness,
        "spine.damping": body.spine_damping,
        "spine.rest_angle": body.spine_rest_angle,
        "gravity": body.gravity,
    }
    apex = {
        "height": rng.uniform(0.36, 0.42),
        "fore_pitch": rng.uniform(-0.1, 0.15),
        "hind_pitch": rng.uniform(-0.15, 0.1),
        "speed": rng.uniform(1.0, 5.0),
        "fore_pitch_rate": rng.uniform(-4, 4),
        "hind_pitch_rate": rng.uniform(-4, 4),
    }
    touchdown = {"fore": rng.uniform(0.1, 0.6), "hind": rng.uniform(0.1, 0.6)}
    model = load_model("kamimura2015-flexible", changes, apex=apex, touchdown=touchdown)
    return model, body


def rigid(rng: np.random.Generator, damped: bool) -> tuple[Model, reference.Rigid]:
    legs = {
        side: (rng.uniform(4000, 9000), rng.uniform(10, 120) if damped else 0.0, 0.36)
        for side in ("fore", "hind")
    }
    body = reference.Rigid(
        mass=rng.uniform(15, 25),
        inertia=rng.uniform(0.8, 3),
        fore_hip=rng.uniform(0.2, 0.35),
        hind_hip=rng.uniform(0.2, 0.35),
        fore_leg=legs["fore"],
        hind_leg=legs["hind"],
        gravity=9.81,
    )
    changes = {
        "body.mass": body.mass,
        "body.inertia": body.inertia,
        "fore.hip_offset": body.fore_hip,
        "hind.hip_offset": body.hind_hip,
    }
    for side, (stiffness, damping, length) in legs.items():
        changes |= {
            f"{side}.leg.stiffness": stiffness,
            f"{side}.leg.damping": damping,
            f"{side}.leg.rest_length": length,
        }
    apex = {
        "height": rng.uniform(0.36, 0.42),
        "pitch": rng.uniform(-0.15, 0.15),
        "speed": rng.uniform(1.0, 5.0),
        "pitch_rate": rng.uniform(-3, 3),
    }
    touchdown = {"fore": rng.uniform(0.1, 0.6), "hind": rng.uniform(0.1, 0.6)}
    return load_model("kamimura2015-rigid", changes, apex=apex, touchdown=touchdown), body


def assert_same_run(model: Model, body: reference.Flexible | reference.Rigid) -> list[str]:
    """Compare one stride in every respect; returns its phases."""
    theirs = reference.stride(body, dict(model.apex), dict(model.touchdown), until=STRIDE_LIMIT)
    mine = simulate(model)
    assert {"apex": "completed", "fell": "fell", "time": "no_apex"}[theirs.ended] == (
        mine.outcome.name
    )
    assert list(mine.phases) == theirs.phases
    my_events = [
        (event.time, name)
        for event in mine.trajectory.events
        for name in event.names
        if name.endswith(("touchdown", "lift-off"))
    ]
    assert [name for _, name in my_events] == [name for _, name in theirs.events]
    np.testing.assert_allclose(
        [t for t, _ in my_events], [t for t, _ in theirs.events], rtol=0, atol=AGREEMENT
    )
    end = dict(zip(mine.model.state_names, mine.trajectory.end.states, strict=True))
    public = {"height": "com_y", "speed": "com_x_rate", "climb": "com_y_rate", "distance": "com_x"}
    for name, value in theirs.end.items():
        assert end[public.get(name, name)] == pytest.approx(value, abs=AGREEMENT), name
    summary = summarize(mine)
    for side, peak in theirs.peak_grf.items():
        assert summary.peak_grf[side] == pytest.approx(peak, rel=1e-7, abs=1e-5)
    return theirs.phases


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.parametrize("damped", [False, True], ids=["undamped", "damped"])
def test_random_flexible_bounders_agree(seed: int, damped: bool) -> None:
    assert_same_run(*flexible(np.random.default_rng(seed), damped))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("damped", [False, True], ids=["undamped", "damped"])
def test_random_rigid_bounders_agree(seed: int, damped: bool) -> None:
    assert_same_run(*rigid(np.random.default_rng(100 + seed), damped))


def test_the_random_runs_visit_every_phase_and_both_orders() -> None:
    """The two tests above are worth what their runs cover."""
    seen: set[tuple[str, str]] = set()
    for seed in range(24):
        model, _ = flexible(np.random.default_rng(seed), damped=False)
        phases = simulate(model).phases
        seen |= set(pairwise(phases))
    assert {("DF", "FS"), ("DF", "HS"), ("FS", "DS"), ("HS", "DS"), ("DS", "HS"), ("DS", "FS")} <= (
        seen
    )


@pytest.mark.parametrize("contacts", [{"fore": 0.3}, {"hind": -0.1}, {"fore": 0.3, "hind": -0.1}])
def test_a_run_may_start_with_legs_on_the_ground(
    contacts: dict[str, float], flexible: Model
) -> None:
    start = {
        "com_y": 0.30,
        "com_y_rate": -0.4,
        "com_x_rate": 3.0,
        "fore_pitch": 0.05,
        "hind_pitch": -0.05,
        "fore_pitch_rate": -1.0,
        "hind_pitch_rate": 1.0,
    }
    run = simulate(flexible, state=start, toes=contacts)
    half = reference.Half(10.4, 0.36, 0.138, 0.138, 6340.0, 0.0, 0.36)
    theirs = reference.stride(
        reference.Flexible(half, half, 260.0, 0.0, 0.0, 9.81),
        {
            "height": 0.30,
            "climb": -0.4,
            "speed": 3.0,
            "fore_pitch": 0.05,
            "hind_pitch": -0.05,
            "fore_pitch_rate": -1.0,
            "hind_pitch_rate": 1.0,
        },
        dict(flexible.touchdown),
        contacts=contacts,
    )
    assert list(run.phases) == theirs.phases
    assert run.trajectory.duration == pytest.approx(theirs.time, abs=AGREEMENT)
    assert run.trajectory.end.states[0] == pytest.approx(theirs.end["distance"], abs=AGREEMENT)


def test_a_leg_that_lands_while_lengthening_bears_nothing(flexible: Model) -> None:
    """Foot far behind at high speed: contact would pull, so the leg is released at once."""
    model = flexible.with_values(
        {"fore.leg.damping": 50.0}, touchdown={"fore": -0.45 * pi / 2, "hind": 0.5}
    )
    run = simulate(model)
    touch = [event for event in run.trajectory.events if "fore touchdown" in event.names]
    assert touch
    assert touch[0].names == ("fore touchdown", "fore lift-off")
    assert summarize(run).peak_grf["fore"] == 0
