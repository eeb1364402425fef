"""What a search finds, against published gaits, the spring-mass runner and another program."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import radians, sin
from typing import Any

import numpy as np
import pytest

from flexspine import Gait, Model, examine, find_gaits, load_model, simulate
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.gaits.search import Search, same_orbit
from tests import second_implementation as reference
from tests.models.test_published_gaits import STARTS
from tests.models.test_reference_tables import SLIP

SETTING = {"energy": 290.0, "height": 0.32, "mean_speed": 4.5}

# Of a coordinate (SI) of a gait that is found, against one that is known to 1e-12.
KNOWN = 1e-9

# Natural units; what a gait may miss its start by.
CLOSED = 1e-11


def flexible_body(stiffness: float, fore_mass: float = 10.4) -> reference.Flexible:
    fore, hind = (
        reference.Half(mass, 0.36, 0.138, 0.138, 6340.0, 0.0, 0.36) for mass in (fore_mass, 10.4)
    )
    return reference.Flexible(fore, hind, stiffness, 0.0, 0.0, 9.81)


def flexible_at(stiffness: float) -> Model:
    return load_model("kamimura2015-flexible", {"spine.stiffness": stiffness})


@pytest.fixture(scope="module")
def published_search() -> Search:
    return flexible_search(260.0, 4.5)


@dataclass(frozen=True)
class Found:
    """A gait that was looked for at a stiffness and a speed, and the other program's run of it."""

    gait: Gait
    speed: float
    theirs: reference.Result


@pytest.fixture(scope="module")
def gaits(published_search: Search) -> list[Found]:
    """Among slow gaits the spine arches or both legs stand."""
    slow = [
        (stiffness, speed, flexible_search(stiffness, speed))
        for stiffness, speed in ((260.0, 4.0), (200.0, 4.0), (260.0, 3.0))
    ]
    return [
        Found(gait, speed, second_run(gait, flexible_body(stiffness)))
        for stiffness, speed, found in [(260.0, 4.5, published_search), *slow]
        for gait in found
    ]


def flexible_search(stiffness: float, speed: float) -> Search:
    fixed = {**SETTING, "mean_speed": speed}
    return find_gaits(flexible_at(stiffness), fixed, symmetric=True, starts=40)


def second_run(gait: Gait, body: reference.Flexible) -> reference.Result:
    return reference.stride(body, dict(gait.model.apex), gait.touchdown_angles)


def is_published(gait: Gait, name: str) -> bool:
    """Whether a gait is the published one of a preset, to KNOWN."""
    apex, touchdown = STARTS[name]
    model = gait.model
    return all(abs(model.apex[key] - value) < KNOWN for key, value in apex.items()) and all(
        abs(model.touchdown[side] - value) < KNOWN for side, value in touchdown.items()
    )


def test_the_published_flexible_gait_is_found_among_others(published_search: Search) -> None:
    (gait,) = [g for g in published_search if is_published(g, "kamimura2015-flexible")]
    assert gait.period == pytest.approx(0.252732108498, abs=1e-11)
    assert gait.peak_grf == pytest.approx({"fore": 530.460494, "hind": 530.460494}, abs=1e-6)
    assert gait.family == "fore-first DF-FS-DF-HS-DF, spine sagging at the apex"
    others = [g for g in published_search if g.family == gait.family and g is not gait]
    assert min(max(g.peak_grf.values()) for g in others) < 0.75 * 530.460494
    assert any(g.family.startswith("hind-first") for g in published_search)


@pytest.mark.parametrize("name", ["kamimura2015-rigid", "kamimura2015-locked"])
def test_the_published_gaits_without_a_spine_joint_are_found(name: str) -> None:
    found = find_gaits(load_model(name), SETTING, symmetric=True, starts=20)
    (gait,) = [g for g in found if is_published(g, name)]
    assert gait.mean_speed == pytest.approx(4.5, abs=1e-11)
    assert gait.energy == pytest.approx(290, abs=1e-9)


def test_a_search_without_values_takes_those_of_the_model_itself() -> None:
    found = find_gaits(load_model("kamimura2015-rigid"), starts=10)
    (gait,) = [g for g in found if is_published(g, "kamimura2015-rigid")]
    assert gait.symmetric


def test_every_gait_found_closes_in_the_second_implementation(gaits: list[Found]) -> None:
    """With the speed, energy and peak forces that it claims."""
    assert len(gaits) > 15
    for found in gaits:
        apex, theirs = dict(found.gait.model.apex), found.theirs
        assert theirs.ended == "apex"
        assert tuple(theirs.phases) == found.gait.phases
        assert {name: theirs.end[name] for name in apex} == pytest.approx(apex, abs=1e-9)
        assert theirs.end["distance"] / theirs.time == pytest.approx(found.speed, abs=1e-9)
        assert theirs.energy_start == pytest.approx(290, abs=1e-9)
        assert theirs.peak_grf == pytest.approx(found.gait.peak_grf, rel=1e-8)


def test_every_gait_found_is_confirmed_by_simulating_it_anew(gaits: list[Found]) -> None:
    for gait in (found.gait for found in gaits):
        assert gait.residual <= CLOSED
        assert gait.confirmed
        first, last = simulate(gait.model).apexes
        scales = gait.model.scales
        assert max(abs(last[n] - first[n]) / scales[n] for n in first) <= CLOSED


def test_a_symmetric_gait_is_its_own_mirror_image(gaits: list[Found]) -> None:
    """Each leg leaves at minus the angle at which the other lands; both bear the same peak."""
    for found in gaits:
        assert found.gait.symmetric
        landed, left = found.gait.touchdown_angles, found.gait.liftoff_angles
        assert left["fore"] == pytest.approx(-landed["hind"], abs=1e-9)
        assert left["hind"] == pytest.approx(-landed["fore"], abs=1e-9)
        peaks = found.theirs.peak_grf
        assert peaks["fore"] == pytest.approx(peaks["hind"], rel=1e-9)


def test_the_family_tells_how_the_spine_bends_which_leg_leads_and_whether_both_stand(
    gaits: list[Found],
) -> None:
    """A spine sags where its joint is below the middle of the hips, both 0.276 m from it."""
    seen = set()
    for gait in (found.gait for found in gaits):
        apex = gait.model.apex
        sag = 0.276 * (sin(apex["fore_pitch"]) - sin(apex["hind_pitch"])) / 2
        lead, phases, shape = gait.family.replace(",", "").split(" ", 2)
        assert shape == f"spine {'sagging' if sag > 0 else 'arched'} at the apex"
        first, *_ = gait.trajectory.events
        assert first.names == (f"{lead.removesuffix('-first')} touchdown",)
        assert phases.split("-") == list(gait.phases)
        seen.add((lead, "DS" in phases, shape.split()[1]))
    assert seen == {
        ("fore-first", False, "arched"),
        ("hind-first", False, "arched"),
        ("fore-first", True, "sagging"),
        ("hind-first", True, "sagging"),
        ("fore-first", False, "sagging"),
        ("hind-first", False, "sagging"),
    }


def test_both_apexes_of_the_running_spring_mass_model_are_found() -> None:
    """The set of slip.csv: 80 kg, 20 kN/m, 22 deg and the energy of 5 m/s at 1 m."""
    legs = {f"{side}.leg.stiffness": 10_000.0 for side in ("fore", "hind")}
    model = load_model("slip", {"body.mass": 80.0, "gravity": 9.81, **legs})
    angle = radians(22)
    fixed = {"energy": 80 * (12.5 + 9.81), "touchdown.fore": angle, "touchdown.hind": angle}
    found = find_gaits(model, fixed, starts=20, bounds={"pitch_rate": (-0.5, 0.5)})
    heights = sorted(gait.model.apex["height"] for gait in found)
    assert heights == pytest.approx([0.940267144380, 1.337686381370], abs=KNOWN)
    assert {gait.family for gait in found} == {"pronking DF-DS-DF"}


@pytest.mark.parametrize("row", SLIP, ids=lambda row: f"{row[0]:g}kg")
def test_the_spring_mass_runner_of_the_table_is_found(row: list[float]) -> None:
    mass, stiffness, length, gravity, angle, speed, height, _ = row
    legs = {
        f"{side}.leg.{name}": value
        for side in ("fore", "hind")
        for name, value in (("stiffness", stiffness / 2), ("rest_length", length))
    }
    model = load_model("slip", {"body.mass": mass, "gravity": gravity, **legs})
    energy = mass * (speed**2 / 2 + gravity * height)
    fixed = {"energy": energy, "touchdown.fore": angle, "touchdown.hind": angle}
    found = find_gaits(model, fixed, starts=20, symmetric=True)
    gaits = [g for g in found if abs(g.model.apex["height"] - height) < KNOWN]
    assert [g.model.apex["speed"] for g in gaits] == pytest.approx([speed], abs=KNOWN)
    assert gaits[0].model.apex["pitch_rate"] == pytest.approx(0, abs=KNOWN)


def fingerprint(found: Search) -> list[tuple[float, ...]]:
    """Numbers that are equal only if every bit of the gaits is."""
    return [
        (*g.model.apex.values(), *g.model.touchdown.values(), g.period, *g.trajectory.end.states)
        for g in found
    ]


def test_the_same_seed_finds_the_same_gaits_bit_for_bit(published_search: Search) -> None:
    again = flexible_search(260.0, 4.5)
    assert fingerprint(again) == fingerprint(published_search)
    assert again.tally == published_search.tally
    assert again.dropped == published_search.dropped


def test_another_seed_finds_the_same_gaits(published_search: Search) -> None:
    """From other starts: equal to what rounding leaves, not bit for bit."""
    other = find_gaits(flexible_at(260.0), SETTING, symmetric=True, starts=60, seed=1)
    assert fingerprint(other) != fingerprint(published_search)
    ours, theirs = (
        sorted([*g.model.apex.values(), *g.model.touchdown.values()] for g in found)
        for found in (published_search, other)
    )
    assert np.array(theirs) == pytest.approx(np.array(ours), abs=KNOWN)


def test_progress_runs_from_start_to_end() -> None:
    told: list[float] = []
    find_gaits(load_model("kamimura2015-rigid"), SETTING, starts=5, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


def other_apex(gait: Gait) -> Model:
    """The same orbit, seen from the top of its flight between the two stances."""
    run = simulate(gait.model)
    system = gait.model.system
    climb = gait.model.state_names.index("com_y_rate")
    after, before = (
        next(event.after for event in run.trajectory.events if name in event.names)
        for name in ("fore lift-off", "hind touchdown")
    )
    share = after.states[climb] / (after.states[climb] - before.states[climb])
    duration = after.time + share * (before.time - after.time)
    top = simulate(gait.model, duration=duration).trajectory.end.states
    rows = {n: system.states.index(s) for n, s in system.section.coordinates.items()}
    return gait.model.with_values(apex={n: float(top[row]) for n, row in rows.items()})


PUBLISHED = ["kamimura2015-flexible", "kamimura2015-rigid", "kamimura2015-locked"]


@pytest.mark.parametrize("name", PUBLISHED)
def test_an_orbit_is_the_same_seen_from_either_apex(name: str) -> None:
    """Fore-first from one apex, hind-first from the other, which is not the same height."""
    gait = examine(load_model(name))
    other = examine(other_apex(gait))
    assert other.flaw is None
    assert other.model.apex["height"] - gait.model.apex["height"] > 0.01
    assert other.period == pytest.approx(gait.period, abs=1e-11)
    assert gait.family.startswith("fore-first")
    assert other.family.startswith("hind-first")
    assert same_orbit(gait, other)
    assert same_orbit(other, gait)


def test_distinct_orbits_are_told_apart(published_search: Search) -> None:
    for one, other in combinations(published_search, 2):
        assert not same_orbit(one, other)
        assert abs(one.period - other.period) > 1e-4


@pytest.mark.parametrize("name", PUBLISHED)
def test_no_orbit_is_found_twice_where_both_its_apexes_solve_the_equations(name: str) -> None:
    """With the height unknown a start may lead to either apex, of which one is higher."""
    angle = STARTS[name][1]["fore"]
    fixed = {"energy": 290.0, "mean_speed": 4.5, "touchdown.fore": angle}

    def published(found: Search) -> list[Gait]:
        hind = STARTS[name][1]["hind"]
        return [gait for gait in found if abs(gait.model.touchdown["hind"] - hind) < KNOWN]

    def search(low: float, high: float) -> Search:
        bounds = {"height": (low, high)}
        return find_gaits(load_model(name), fixed, symmetric=True, starts=60, bounds=bounds)

    (lower,) = published(search(0.31, 0.33))
    top = other_apex(lower).apex["height"]
    (higher,) = published(search(top - 0.01, top + 0.01))
    assert higher.period == pytest.approx(lower.period, abs=1e-11)
    whole = search(0.31, top + 0.01)
    assert len(published(whole)) == 1
    assert all(abs(a.period - b.period) > 1e-4 for a, b in combinations(whole, 2))


def test_a_parameter_may_be_unknown_too() -> None:
    """The stiffness at which a gait has the published touchdown angle is the published one."""
    fixed = {**SETTING, "touchdown.fore": STARTS["kamimura2015-flexible"][1]["fore"]}
    free = {"spine.stiffness": (150.0, 350.0)}
    found = find_gaits(flexible_at(200.0), fixed, free=free, symmetric=True, starts=40)
    (gait,) = [g for g in found if is_published(g, "kamimura2015-flexible")]
    assert gait.model.numbers["spine.stiffness"] == pytest.approx(260, abs=1e-6)


def test_bounds_keep_all_but_the_gaits_within_out(published_search: Search) -> None:
    low, high = 0.4, 0.5
    within = [g for g in published_search if low < g.model.touchdown["fore"] < high]
    assert 0 < len(within) < len(published_search)
    found = find_gaits(
        flexible_at(260.0),
        SETTING,
        symmetric=True,
        starts=40,
        bounds={"touchdown.fore": (low, high)},
    )
    assert [g.model.touchdown["fore"] for g in found] == pytest.approx(
        [g.model.touchdown["fore"] for g in within], abs=KNOWN
    )


def test_unequal_halves_have_gaits_without_symmetry() -> None:
    """A heavier fore half: nothing mirrors any more, and the other program agrees."""
    model = flexible_at(260.0).with_values({"fore.mass": 11.0})
    found = find_gaits(model, SETTING, starts=60)
    assert len(found) > 0
    for gait in found:
        assert not gait.symmetric
        assert gait.confirmed
        assert gait.mean_speed == pytest.approx(4.5, abs=1e-9)
        assert abs(gait.peak_grf["fore"] / gait.peak_grf["hind"] - 1) > 1e-3
        apex = dict(gait.model.apex)
        theirs = reference.stride(flexible_body(260.0, 11.0), apex, gait.touchdown_angles)
        assert {name: theirs.end[name] for name in apex} == pytest.approx(apex, abs=1e-9)
        assert theirs.energy_start == pytest.approx(290, abs=1e-9)


@pytest.mark.parametrize(
    ("values", "starts"),
    [
        pytest.param({"energy": 30.0}, 10, id="less energy than height alone takes"),
        pytest.param({"mean_speed": 12.0}, 10, id="more speed than energy allows"),
    ],
)
def test_where_there_is_no_gait_the_advice_tells_how_every_start_fared(
    values: dict[str, float], starts: int
) -> None:
    found = find_gaits(flexible_at(260.0), {**SETTING, **values}, symmetric=True, starts=starts)
    assert len(found) == 0
    assert "found" not in found.tally
    assert sum(found.tally.values()) == starts
    told, _, remedy = found.advice.rpartition("; ")
    assert told.startswith(f"{starts} starts: ")
    for reason, count in {**found.tally, **found.dropped}.items():
        assert f"{count} {reason}" in told
    assert "give" in remedy


REFUSED: dict[str, tuple[dict[str, Any], type[Exception], list[str]]] = {
    "misspelt quantity": (
        {"fixed": {"energi": 290}},
        UnknownNameError,
        ["energi", "did you mean 'energy'"],
    ),
    "too few": ({"fixed": {"energy": 290}}, ParameterError, ["energy", "2 dimensions", "fix more"]),
    "none": ({"fixed": {}}, ParameterError, ["nothing", "fix more"]),
    "too many": (
        {"fixed": {**SETTING, "touchdown.fore": 0.4, "touchdown.hind": 0.5}},
        ParameterError,
        ["touchdown.hind", "2 too many", "fix fewer"],
    ),
    "misspelt parameter": (
        {"fixed": SETTING, "free": {"spine.stifness": (1, 2)}},
        UnknownNameError,
        ["spine.stifness", "did you mean 'spine.stiffness'"],
    ),
    "bounds of what is fixed": (
        {"fixed": SETTING, "bounds": {"height": (0.1, 0.5)}},
        ParameterError,
        ["height", "not unknown", "touchdown.fore"],
    ),
    "what symmetry decides": (
        {"fixed": {"energy": 290, "mean_speed": 4.5, "hind_pitch": 0.1}, "symmetric": True},
        ParameterError,
        ["hind_pitch", "general"],
    ),
    "bounds the wrong way round": (
        {"fixed": SETTING, "bounds": {"touchdown.fore": (0.5, 0.1)}},
        ParameterError,
        ["touchdown.fore", "0.5"],
    ),
    "no number": (
        {"fixed": {**SETTING, "height": float("nan")}},
        ParameterError,
        ["height", "nan"],
    ),
    "a word": ({"fixed": {**SETTING, "height": "high"}}, ParameterError, ["height", "high"]),
}


@pytest.mark.parametrize(("arguments", "error", "words"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_searched_for_is_refused_with_a_remedy(
    arguments: dict[str, Any], error: type[Exception], words: list[str]
) -> None:
    with pytest.raises(error) as raised:
        find_gaits(flexible_at(260.0), **arguments, starts=1)
    for word in words:
        assert word in str(raised.value)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"fore.mass": 11.0}, "ends differ"),
        ({"hind.leg.stiffness": 6000.0}, "ends differ"),
        ({"spine.damping": 1.0}, "dampers"),
        ({"fore.leg.damping": 1.0, "hind.leg.damping": 1.0}, "dampers"),
    ],
)
def test_an_animal_without_symmetry_is_not_searched_for_symmetric_gaits(
    changes: dict[str, float], reason: str
) -> None:
    with pytest.raises(ParameterError) as raised:
        find_gaits(flexible_at(260.0).with_values(changes), SETTING, symmetric=True, starts=1)
    assert reason in str(raised.value)
    assert "look for general ones" in str(raised.value)


def test_a_damped_animal_has_no_gait_at_a_given_energy() -> None:
    """What it loses nothing gives back, so one more equation than unknowns is left."""
    with pytest.raises(ParameterError, match=r"1 too many to fix, as this animal loses energy"):
        find_gaits(flexible_at(260.0).with_values({"spine.damping": 1.0}), SETTING, starts=1)


def test_values_of_a_start_that_is_no_gait_are_not_taken() -> None:
    model = load_model("kamimura2015-flexible", apex={"speed": 4.0})
    with pytest.raises(ParameterError, match=r"is no gait .*; say what is fixed"):
        find_gaits(model, starts=1)


def test_a_speed_that_energy_forbids_is_told() -> None:
    wanted = {"energy": 290.0, "height": 0.32, "mean_speed": 9.0}
    search = find_gaits(load_model("kamimura2015-flexible"), wanted, symmetric=True, starts=2)
    assert not search.gaits
    # Half of 20.8 kg times 81 m^2/s^2.
    assert "there is none: at 9 m/s kinetic energy alone is 842.4 J; give" in search.advice
