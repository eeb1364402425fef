"""Gaits of animals that lose energy and get it back from actuators."""

from __future__ import annotations

from itertools import combinations

import pytest

from flexspine import Gait, Model, find_gaits, load_model, summarize, trace_branch
from flexspine.gaits.search import Search, pose_problems
from tests import second_implementation as reference
from tests.models.test_second_actuation import body_of

# The published flexible gait's.
SETTING = {"energy": 290.0, "height": 0.32, "mean_speed": 4.5}

# m; from nothing to more than any damper here asks for.
RANGE = (0.0, 0.02)

# Of the other program: a stride of it errs by 1e-12.
CLOSED = 1e-9


def animal(**changes: float) -> Model:
    """The published flexible one, in equations with its spine's damper and with thrust."""
    model = load_model("kamimura2015-flexible", changes)
    return model.keeping(["spine.damping", "legs.extension"])


@pytest.fixture(scope="module")
def damped() -> Search:
    """What starts as a user would choose them lead to."""
    return find_gaits(animal(**{"spine.damping": 1.0}), SETTING, free={"legs.extension": RANGE})


def published_like(found: Search) -> Gait:
    """The gait that is nearest to the published one."""
    published = load_model("kamimura2015-flexible").touchdown["fore"]
    return min(found, key=lambda gait: abs(gait.model.touchdown["fore"] - published))


def test_a_damped_animal_has_gaits_in_which_its_legs_make_good_what_it_loses(
    damped: Search,
) -> None:
    """One on the fore and one on the hind leg first; both legs push by some millimetres."""
    assert {gait.family.split()[0] for gait in damped} == {"fore-first", "hind-first"}
    for gait in damped:
        assert not gait.symmetric
        assert 1e-3 < gait.model.numbers["legs.extension"] < 5e-3
    gait, model = published_like(damped), load_model("kamimura2015-flexible")
    assert gait.model.touchdown == pytest.approx(model.touchdown, abs=0.02)
    assert gait.model.apex == pytest.approx(model.apex, abs=0.6)


def test_such_gaits_close_in_the_second_implementation_and_gain_what_they_lose(
    damped: Search,
) -> None:
    assert len(damped) > 0
    for gait in damped:
        body, apex = body_of(gait.model), dict(gait.model.apex)
        theirs = reference.stride(body, apex, dict(gait.model.touchdown))
        assert theirs.ended == "apex"
        assert tuple(theirs.phases) == gait.phases
        assert {name: theirs.end[name] for name in apex} == pytest.approx(apex, abs=CLOSED)
        assert theirs.energy_start == pytest.approx(SETTING["energy"], abs=CLOSED)
        assert theirs.end["distance"] / theirs.time == pytest.approx(4.5, abs=CLOSED)
        given = sum(work.positive for work in theirs.works.values())
        assert given == pytest.approx(theirs.dissipated, abs=CLOSED)
        assert given > 1
        linkage = reference.Linkage(body)
        cost = given / (linkage.mass * linkage.gravity * theirs.end["distance"])
        assert summarize(gait.run).cost_of_transport == pytest.approx(cost, abs=CLOSED)


def test_a_gait_is_found_from_an_actuator_that_works_already(damped: Search) -> None:
    """The range may begin at nothing all the same: a length is no scale."""
    model = animal(**{"spine.damping": 1.0, "legs.extension": 0.005})
    found = find_gaits(model, SETTING, free={"legs.extension": RANGE}, starts=50)
    gait, expected = published_like(found), published_like(damped)
    assert gait.model.touchdown == pytest.approx(expected.model.touchdown, abs=CLOSED)
    numbers, known = gait.model.numbers, expected.model.numbers
    assert numbers["legs.extension"] == pytest.approx(known["legs.extension"], abs=CLOSED)


def test_a_branch_leads_through_the_point_where_an_actuator_does_nothing(damped: Search) -> None:
    """From legs that push differently to legs that push differently the other way round."""
    way = {"over": "fore.leg.extension", "fixed": SETTING, "free": ["legs.extension"]}
    there = trace_branch(published_like(damped), **way, bounds=(-1e-3, 1e-3))
    assert there.ends == tuple(f"reached fore.leg.extension = {end}" for end in (-0.001, 0.001))
    back = trace_branch(there.gaits[-1], **way, bounds=(-1e-3, 1e-3), most_points=100)
    assert back.ends == there.ends
    (again,), (before,) = back.at(0.0), there.at(0.0)
    assert again.gait.model.apex == pytest.approx(before.gait.model.apex, abs=CLOSED)


def test_an_animal_without_losses_has_its_own_gaits_each_of_them_once() -> None:
    """An actuator set free stays at rest, up to rounding."""
    found = find_gaits(animal(), SETTING, free={"legs.extension": (-0.01, 0.01)})
    for gait in found:
        assert gait.model.numbers["legs.extension"] == pytest.approx(0, abs=1e-12)
    published = load_model("kamimura2015-flexible").touchdown["fore"]
    assert any(abs(gait.model.touchdown["fore"] - published) < CLOSED for gait in found)
    for one, other in combinations(found, 2):
        assert abs(one.period - other.period) > 1e-4


def test_a_passive_animal_with_a_free_actuator_is_searched_for_general_gaits(
    flexible: Model,
) -> None:
    problems = pose_problems(flexible, SETTING, free={"legs.extension": RANGE})
    assert [problem.symmetric for problem in problems] == [False]
