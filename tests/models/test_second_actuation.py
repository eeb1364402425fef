"""Dampers and actuators against the second implementation, which derives and counts them its way.

It takes torques by virtual power, and works by quadrature and from what springs hold.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from flexspine import Model, load_model, simulate, summarize
from flexspine.models.actuation import ACTUATORS, STRIDE_PHASES, Features
from flexspine.models.simulation import Run
from flexspine.parameters import values
from tests import second_implementation as reference
from tests.models import test_second_implementation as passive

# DOP853 errs by some 1e-13 of a state in each of the hundred steps of a stride, and strides here
# stretch deviations up to threefold: after four of them no difference reaches 1e-10.
AGREEMENT = 1e-9

# How much of each actuator is enough to change a stride, and little enough to survive it.
LIMITS = {
    "stiffening": 0.1,
    "extension": 0.006,
    "hip_lever": 0.02,
    "stiffness_shift": 0.3,
    "rest_shift": 0.06,
}
DAMPERS = {"fore.leg.damping": 40.0, "hind.leg.damping": 25.0, "spine.damping": 2.0}
ALL = (*ACTUATORS, *DAMPERS)


def of_model(model: Model, names: tuple[str, ...]) -> list[str]:
    """Those of these parameters that a model has."""
    return [name for name in names if name in values(model.parameters)]


def limit(name: str) -> float:
    return next(size for kind, size in LIMITS.items() if kind in name.split("."))


def actuated(model: Model, rng: np.random.Generator, share: float = 1.0) -> Model:
    """All actuators that a model has, by random amounts of either sign."""
    names = of_model(model, ACTUATORS)
    return model.with_values({name: share * limit(name) * rng.uniform(-1, 1) for name in names})


def damped(model: Model, rng: np.random.Generator, share: float) -> Model:
    """All dampers that a model has."""
    names = of_model(model, tuple(DAMPERS))
    return model.with_values({name: share * DAMPERS[name] * rng.uniform(0.2, 1) for name in names})


def body_of(model: Model) -> reference.Flexible | reference.Rigid:
    """The same animal for the second implementation."""
    given = values(model.parameters)
    legs = {
        side: (
            *(given[f"{side}.leg.{name}"] for name in ("stiffness", "damping", "rest_length")),
            *(
                given[f"legs.{name}"] + given[f"{side}.leg.{name}"]
                for name in ("stiffening", "extension", "hip_lever")
            ),
        )
        for side in ("fore", "hind")
    }
    if "body.mass" in given:
        mass, inertia = given["body.mass"], given["body.inertia"]
        hips = given["fore.hip_offset"], given["hind.hip_offset"]
    elif "spine.stiffness" not in given:
        mass, inertia, *hips = welded(given)
    else:
        parts = ("mass", "inertia", "spine_offset", "hip_offset")
        fore, hind = (
            reference.Half(*(given[f"{side}.{part}"] for part in parts), *legs[side])
            for side in ("fore", "hind")
        )
        spine = [given[f"spine.{name}"] for name in ("stiffness", "damping", "rest_angle")]
        shifts = [
            {part: given[f"spine.{kind}_shift.{part}"] for part in STRIDE_PHASES}
            for kind in ("stiffness", "rest")
        ]
        return reference.Flexible(fore, hind, *spine, given["gravity"], *shifts)
    return reference.Rigid(mass, inertia, *hips, legs["fore"], legs["hind"], given["gravity"])


def welded(given: dict[str, float]) -> tuple[float, float, float, float]:
    """Mass, inertia and hips' distances from the centre of mass of two halves in one line."""
    masses = [given["fore.mass"], given["hind.mass"]]
    along = [given["fore.spine_offset"], -given["hind.spine_offset"]]
    middle = float(np.average(along, weights=masses))
    inertia = given["fore.inertia"] + given["hind.inertia"]
    inertia += sum(m * (x - middle) ** 2 for m, x in zip(masses, along, strict=True))
    fore_hip = along[0] + given["fore.hip_offset"] - middle
    return sum(masses), inertia, fore_hip, middle - along[1] + given["hind.hip_offset"]


def assert_same_run(
    model: Model,
    strides: int = 1,
    state: dict[str, float] | None = None,
    toes: dict[str, float] | None = None,
) -> tuple[Run, reference.Result]:
    """Compare a run in every respect: events, states at the end and at apexes, forces, works."""
    body = body_of(model)
    run = simulate(model, strides=strides, state=state, toes=toes)
    theirs = reference.stride(
        body,
        as_apex(state) if state else dict(model.apex),
        dict(model.touchdown),
        contacts=toes,
        strides=strides,
    )
    assert run.outcome.name == {"apex": "completed", "fell": "fell"}[theirs.ended]
    assert list(run.phases) == theirs.phases
    assert_same_events(run, theirs)
    apexes = run.apexes if state else run.apexes[1:]
    for mine, other in zip(apexes, theirs.apexes, strict=True):
        assert mine == pytest.approx({name: other[name] for name in mine}, abs=AGREEMENT)
    end = dict(zip(model.state_names, run.trajectory.end.states, strict=True))
    assert as_apex(end) == pytest.approx(theirs.end, abs=AGREEMENT)
    assert end["dissipated_energy"] == pytest.approx(theirs.dissipated, abs=AGREEMENT)
    summary = summarize(run)
    # The peak of a force, some 1e3 N, is read off a polynomial between steps.
    assert summary.peak_grf == pytest.approx(theirs.peak_grf, abs=1e-7)
    assert summary.peak_grf_vertical == pytest.approx(theirs.peak_vertical_grf, abs=1e-7)
    for name, work in theirs.works.items():
        mine = summary.work.get(name, (0.0, 0.0))
        assert tuple(mine) == pytest.approx((work.positive, work.net), abs=AGREEMENT), name
    given = sum(work.positive for work in theirs.works.values())
    linkage = reference.Linkage(body)
    cost = given / (linkage.mass * linkage.gravity * theirs.end["distance"])
    assert summary.cost_of_transport == pytest.approx(cost, abs=AGREEMENT)
    # The other program's own books, of which neither energy nor works know the other.
    balance = theirs.energy_end - theirs.energy_start + theirs.dissipated
    net = sum(work.net for work in theirs.works.values())
    assert net == pytest.approx(balance, abs=AGREEMENT)
    return run, theirs


def as_apex(states: dict[str, float]) -> dict[str, float]:
    """States under the names of the second implementation."""
    names = {"com_y": "height", "com_x_rate": "speed", "com_x": "distance", "com_y_rate": "climb"}
    return {
        names.get(name, name): value
        for name, value in states.items()
        if name in names or "pitch" in name
    }


def assert_same_events(run: Run, theirs: reference.Result) -> None:
    """Touchdowns and lift-offs, and greatest compressions where something happens then."""
    expected = sorted((name, time) for time, name in theirs.events)
    thrusts = {name for name, _ in expected if "compression" in name}
    mine = sorted(
        (name, event.time)
        for event in run.trajectory.events
        for name in event.names
        if name.endswith(("touchdown", "lift-off")) or name in thrusts
    )
    assert [name for name, _ in mine] == [name for name, _ in expected]
    np.testing.assert_allclose(
        [t for _, t in mine], [t for _, t in expected], rtol=0, atol=AGREEMENT
    )


def random_flexible(seed: int) -> Model:
    rng = np.random.default_rng(seed)
    model, _ = passive.flexible(rng, True)
    return actuated(model, rng)


# A leg that stands twice, double stance, a fall.
@pytest.mark.parametrize("seed", [1, 4])
def test_random_flexible_animals_with_everything_agree(seed: int) -> None:
    assert_same_run(random_flexible(seed))


def test_hips_that_give_and_take_in_a_stance_cost_what_they_give() -> None:
    run, theirs = assert_same_run(random_flexible(19))
    work, summary = theirs.works["fore_hip_work"], summarize(run)
    assert work.positive > 0.5
    assert work.net < 0
    given = sum(each.positive for each in theirs.works.values())
    weight = run.model.mass * values(run.model.parameters)["gravity"]
    cost = given / (weight * theirs.end["distance"])
    assert summary.cost_of_transport == pytest.approx(cost, abs=AGREEMENT)


@pytest.mark.parametrize("seed", [3, 6, 17])
def test_random_rigid_animals_with_everything_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, _ = passive.rigid(rng, True)
    assert_same_run(actuated(model, rng).keeping(ALL))


@pytest.mark.parametrize(
    ("preset", "seed"),
    [
        ("kamimura2015-flexible", 14),
        ("kamimura2015-flexible", 24),
        ("kamimura2015-rigid", 2),
        ("kamimura2015-locked", 3),
        ("scout2", 31),
    ],
)
def test_strides_of_published_animals_with_everything_agree(preset: str, seed: int) -> None:
    """What apexes forget and what they carry on: four strides, their works added up."""
    rng = np.random.default_rng(seed)
    model = actuated(damped(load_model(preset), rng, 0.3), rng, 0.5)
    run, _ = assert_same_run(model.keeping(ALL), strides=4)
    assert run.outcome.completed


def alone() -> Model:
    """An animal without actuators or dampers, in the equations of one that has them all."""
    model, _ = passive.flexible(np.random.default_rng(29), False)
    return model.keeping(ALL)


@lru_cache
def run_alone() -> reference.Result:
    model = alone()
    return reference.stride(body_of(model), dict(model.apex), dict(model.touchdown))


def test_the_stride_of_the_animal_below_has_all_phases_of_the_spine() -> None:
    assert run_alone().phases == ["DF", "HS", "DF", "FS", "DS", "HS", "DF"]
    run, theirs = assert_same_run(alone())
    assert run.model.features == Features(True, True, True, True, True)
    assert all(work.net == 0 for work in theirs.works.values())


@pytest.mark.parametrize("name", ALL)
def test_each_actuator_and_each_damper_alone_agrees(name: str) -> None:
    amount = DAMPERS[name] if name in DAMPERS else limit(name)
    _, theirs = assert_same_run(alone().with_values({name: amount}))
    # Without an effect there were nothing to agree about.
    assert max(abs(theirs.end[key] - value) for key, value in run_alone().end.items()) > 1e-3
    assert {key for key, work in theirs.works.items() if work.net != 0} == at_work(name)
    assert (theirs.dissipated > 0.1) == (name in DAMPERS)


def at_work(name: str) -> set[str]:
    """The works of an actuator."""
    if name in DAMPERS:
        return set()
    of, *_, what = name.split(".")
    if of == "spine":
        return {"spine_work"}
    part = "hip" if what == "hip_lever" else "leg"
    return {f"{side}_{part}_work" for side in ("fore", "hind") if of in (side, "legs")}


def everything(flexible: Model) -> Model:
    """The published animal with all actuators and dampers."""
    return actuated(flexible.with_values(DAMPERS), np.random.default_rng(0), 0.5)


def test_a_leg_that_gets_shorter_than_it_is_compressed_lets_go_at_once(flexible: Model) -> None:
    """At its greatest compression; what its spring holds then is lost without a damper too."""
    model = flexible.with_values({"fore.leg.extension": -0.2}).keeping(["spine.damping"])
    run, theirs = assert_same_run(model)
    events = [event.names for event in run.trajectory.events]
    assert ("fore greatest compression", "fore lift-off") in events
    assert theirs.dissipated > 20


def test_a_leg_that_is_released_as_it_lands_ends_the_flight_of_the_spine(flexible: Model) -> None:
    """It bears nothing and yet has stood: the spine's next flight is that between the stances."""
    model = everything(flexible).with_values(touchdown={"fore": -0.7, "hind": 0.5})
    run, theirs = assert_same_run(model)
    assert run.trajectory.events[0].names == ("fore touchdown", "fore lift-off")
    assert theirs.works["spine_work"].net != 0


def test_legs_that_lengthen_from_the_start_push_when_they_have_been_compressed(
    flexible: Model,
) -> None:
    rates = {"com_x_rate": 3.0, "com_y_rate": 0.4, "fore_pitch_rate": 1.0, "hind_pitch_rate": 0.5}
    start = {"com_y": 0.3, "fore_pitch": 0.05, "hind_pitch": -0.05, **rates}
    assert_same_run(everything(flexible), state=start, toes={"fore": 0.2, "hind": -0.2})


def test_legs_that_push_together_give_as_much() -> None:
    """Both legs of a pronk reach their greatest compression at the same instant."""
    model = load_model("slip", {"legs.extension": 0.01, "legs.stiffening": 0.1}).keeping(ALL)
    run, theirs = assert_same_run(model, strides=2)
    assert run.phases == ("DF", "DS", "DF", "DS", "DF")
    fore, hind = (theirs.works[f"{side}_leg_work"].net for side in ("fore", "hind"))
    assert fore == pytest.approx(hind, abs=AGREEMENT)
    assert fore > 50
