"""Branches of gaits against published curves, the spring-mass runner and differences of strides."""

from __future__ import annotations

from math import acos, cos, radians
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import (
    Branch,
    Gait,
    Landmark,
    Model,
    examine,
    find_gaits,
    load_model,
    simulate,
    switch_branch,
    to_dataset,
    trace_branch,
)
from flexspine.errors import ParameterError, UnknownNameError
from tests import second_implementation as reference
from tests.conftest import reference_rows
from tests.gaits.test_return_map import difference

CURVES = reference_rows("kamimura2015_fig4.csv")

# Half a box of the curves as they were read: N and m/s.
BOX_FORCE, BOX_SPEED = 8.0, 0.02

SPEEDS = (2.0, 5.0)
LEG_LENGTH = 0.36

Matrix = NDArray[np.float64]


def flexible_body(stiffness: float) -> reference.Flexible:
    half = reference.Half(10.4, 0.36, 0.138, 0.138, 6340.0, 0.0, LEG_LENGTH)
    return reference.Flexible(half, half, stiffness, 0.0, 0.0, 9.81)


@pytest.fixture(scope="module")
def published() -> Gait:
    return examine(load_model("kamimura2015-flexible"))


@pytest.fixture(scope="module")
def softer(published: Gait) -> Branch:
    """The published gait at 4.5 m/s with ever softer spines."""
    return trace_branch(published, "spine.stiffness", bounds=(200, 260))


@pytest.fixture(scope="module")
def branches(published: Gait, softer: Branch) -> dict[str, Branch]:
    """Over mean speed, by body: the spine stiffness, or the body without a joint."""
    starts = {"260": published}
    for stiffness in (200, 240):
        (point,) = softer.at(stiffness)
        starts[str(stiffness)] = point.gait
    for name in ("rigid", "locked"):
        starts[name] = examine(load_model(f"kamimura2015-{name}"))
    return {name: trace_branch(gait, bounds=SPEEDS) for name, gait in starts.items()}


@pytest.fixture(scope="module")
def doubled(branches: dict[str, Branch]) -> list[Gait]:
    """The two-stride gaits on either side of the period doubling."""
    branch = branches["260"]
    return switch_branch(branch.family, only(branch, "period doubling"))


def only(branch: Branch, kind: str) -> Landmark:
    (mark,) = [mark for mark in branch.landmarks if mark.kind == kind]
    return mark


def peak(gait: Gait) -> float:
    return max(gait.peak_grf.values())


@pytest.mark.parametrize("row", CURVES, ids=lambda row: f"{row[0]}{row[1]}-{row[2]}mps")
def test_the_branches_pass_through_every_point_of_the_published_curves(
    row: list[str], branches: dict[str, Branch]
) -> None:
    body, stiffness, speed, force = row
    branch = branches[stiffness or body]
    # Fine enough for a force that falls by 6 N per mm/s near the fold of the rigid body.
    off = sorted(np.linspace(-BOX_SPEED, BOX_SPEED, 41), key=abs)
    assert any(
        abs(peak(point.gait) - float(force)) <= BOX_FORCE
        for by in off
        for point in branch.at(float(speed) + float(by))
    )


@pytest.mark.parametrize("name", ["200", "260", "rigid", "locked"])
def test_every_point_of_a_branch_is_a_gait_of_the_setting(
    name: str, branches: dict[str, Branch]
) -> None:
    branch = branches[name]
    assert len(branch.points) > 50
    for point in branch.points:
        assert point.gait.flaw is None
        assert point.gait.residual <= 1e-11
        assert point.gait.model.apex["height"] == 0.32
        assert point.gait.energy == pytest.approx(290, abs=1e-9)
        assert point.value == pytest.approx(point.gait.mean_speed, abs=1e-14)


@pytest.mark.parametrize("name", ["200", "260"])
def test_points_of_a_branch_are_gaits_of_the_second_implementation(
    name: str, branches: dict[str, Branch]
) -> None:
    points = branches[name].points
    for point in points[1 : -1 : len(points) // 5]:
        apex = dict(point.gait.model.apex)
        theirs = reference.stride(flexible_body(float(name)), apex, point.gait.touchdown_angles)
        assert theirs.ended == "apex"
        # A gait far from stable magnifies the last digits of both programs.
        slack = 1e-10 * max(1.0, point.stability.spectral_radius)
        assert {n: theirs.end[n] for n in apex} == pytest.approx(apex, abs=slack)
        assert theirs.end["distance"] / theirs.time == pytest.approx(point.value, abs=1e-9)
        assert max(theirs.peak_grf.values()) == pytest.approx(peak(point.gait), rel=1e-8)


@pytest.mark.parametrize(("name", "low", "high"), [("260", 3.70, 3.75), ("240", 3.45, 3.55)])
def test_the_slow_end_is_where_the_fore_leg_would_touch_a_second_time(
    name: str, low: float, high: float, branches: dict[str, Branch]
) -> None:
    branch = branches[name]
    end = branch.landmarks[0]
    assert end.kind == "second touchdown"
    assert end.value == branch.points[0].value
    assert low <= end.value <= high
    assert branch.ends[0].startswith("second touchdown at mean_speed")
    # After its stance the fore hip comes up to where the leg is armed again, and not over it.
    assert graze(end.at.gait) < 1e-7


def test_the_softest_spine_of_the_curves_has_no_slow_end_above_2_5_metres_per_second(
    branches: dict[str, Branch],
) -> None:
    assert branches["200"].points[0].value < 2.5


def graze(gait: Gait) -> float:
    """How near the fore hip, turning in flight, comes to its height of touchdown (m).

    A run that touches this height without crossing it ends there.
    """
    run = simulate(gait.model)
    data = to_dataset(run, interval=1e-5)
    above = data.fore_hip_y.values - LEG_LENGTH * cos(gait.model.touchdown["fore"])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(above)))) + 1
    swinging = ~np.isin(data.phase.values, ("FS", "DS"))
    ends = [] if run.outcome.completed else [len(above) - 1]
    return min(abs(float(above[i])) for i in (*turns, *ends) if swinging[i])


def test_the_spine_joint_branches_end_where_the_fore_leg_would_land_just_after_the_apex(
    branches: dict[str, Branch],
) -> None:
    """Beyond the fold the fore hip sinks to its height of touchdown and turns there: grazing."""
    end = branches["260"].landmarks[-1]
    assert end.kind == "grazing"
    assert end.value == branches["260"].points[-1].value
    assert graze(end.at.gait) < 1e-7


def test_without_a_joint_branches_end_where_the_fore_leg_lands_at_the_apex(
    branches: dict[str, Branch],
) -> None:
    """A level body has its hips at the height of its centre of mass: l cos(gamma) = 0.32 m."""
    ends = [mark for mark in branches["locked"].landmarks if mark.kind == "no flight at the apex"]
    assert len(ends) == 2
    ends.append(only(branches["rigid"], "no flight at the apex"))
    for end in ends:
        angle = end.at.gait.model.touchdown["fore"]
        assert angle == pytest.approx(acos(0.32 / LEG_LENGTH), abs=1e-5)


def turning_points(branch: Branch) -> int:
    """How often the values of a branch turn round."""
    ways = np.sign(np.diff([point.value for point in branch.points]))
    return int(np.sum(ways[1:] != ways[:-1]))


def test_where_the_speed_turns_round_and_nowhere_else_is_a_fold(
    branches: dict[str, Branch],
) -> None:
    for branch in branches.values():
        folds = [mark for mark in branch.landmarks if mark.kind == "fold"]
        assert len(folds) == turning_points(branch)
        for fold in folds:
            assert fold.value >= max(point.value for point in branch.points)


def level_multipliers(gait: Gait) -> NDArray[np.complex128]:
    """Multipliers on the energy level, from differences of plain strides.

    The gradient of the energy at the apex, written down for two equal segments or one body.
    """
    model = gait.model
    apex, system = model.apex, model.system
    rows = [system.states.index(symbol) for symbol in system.section.coordinates.values()]
    stride = np.column_stack([difference(model, name)[rows] for name in apex])
    gradient = np.array([energy_slope(dict(apex), name) for name in apex])
    basis = np.linalg.svd(gradient[None])[2][1:]
    return np.linalg.eigvals(basis @ stride @ basis.T).astype(complex)


def energy_slope(apex: dict[str, float], name: str) -> float:
    """Of the published flexible body at 260 N m/rad, by the second implementation's energy."""
    linkage = reference.Linkage(flexible_body(260.0))
    above, below = (
        linkage.energy(linkage.pack(apex | {name: apex[name] + step})) for step in (1e-5, -1e-5)
    )
    return (above - below) / 2e-5


def test_a_fold_in_speed_and_a_multiplier_at_one_are_different_places(
    branches: dict[str, Branch],
) -> None:
    """At a fold the height is kept, at a multiplier +1 the touchdown angles are."""
    branch = branches["260"]
    fold, unit = only(branch, "fold"), only(branch, "multiplier +1")
    assert fold.value - unit.value > 0.03
    assert np.abs(level_multipliers(unit.at.gait) - 1).min() < 1e-6
    assert np.abs(level_multipliers(fold.at.gait) - 1).min() > 0.1


def test_at_a_period_doubling_a_multiplier_is_minus_one(branches: dict[str, Branch]) -> None:
    mark = only(branches["260"], "period doubling")
    assert mark.value == pytest.approx(4.49, abs=5e-3)
    assert np.abs(level_multipliers(mark.at.gait) + 1).min() < 1e-6


def test_at_a_neimark_sacker_point_a_pair_of_multipliers_is_on_the_unit_circle(
    branches: dict[str, Branch],
) -> None:
    multipliers = level_multipliers(only(branches["260"], "Neimark-Sacker").at.gait)
    pairs = multipliers[np.abs(multipliers.imag) > 1e-3]
    assert np.abs(np.abs(pairs) - 1).min() < 1e-6


def test_where_the_order_of_contacts_changes_two_of_them_coincide(
    branches: dict[str, Branch],
) -> None:
    """The hind leg lands just as the fore leg leaves; on one side before it, on the other after."""
    branch = branches["260"]
    mark = only(branch, "contact order")
    times = {n: event.time for event in mark.at.gait.trajectory.events for n in event.names}
    # Known to 1e-6 along the branch, on which these times move by 0.2 s per natural unit.
    assert times["hind touchdown"] == pytest.approx(times["fore lift-off"], abs=2e-7)
    place = next(
        i
        for i, point in enumerate(branch.points)
        if "DS" in point.gait.phases and point.value < only(branch, "fold").value
    )
    for points, phases in (
        (branch.points[:place], "DF-FS-DF-HS-DF"),
        (branch.points[place:], "DF-FS-DS-HS-DF"),
    ):
        assert {"-".join(point.gait.phases) for point in points} == {phases}
    assert "DF-FS-DF-HS-DF becomes DF-FS-DS-HS-DF" in mark.detail


SHARES = [0.1, 0.4, 0.8, 0.97]


@pytest.fixture(scope="module")
def others(branches: dict[str, Branch]) -> dict[float, Branch]:
    """One branch, traced from the gaits that are these shares of it away from its beginning."""
    points = branches["260"].points
    return {
        share: trace_branch(points[int(share * len(points))].gait, bounds=SPEEDS)
        for share in SHARES
    }


@pytest.mark.parametrize("share", SHARES[:-1])
def test_a_branch_is_the_same_curve_from_whichever_of_its_gaits_it_is_traced(
    share: float, branches: dict[str, Branch], others: dict[float, Branch]
) -> None:
    """One trace goes backward where the other goes forward; their steps differ."""
    branch, other = branches["260"], others[share]
    for value in (3.8, 4.1, 4.4, 4.49, 4.52, 4.56, 4.57):
        here, there = (
            sorted([*p.gait.model.apex.values(), *p.gait.model.touchdown.values()] for p in found)
            for found in (branch.at(value), other.at(value))
        )
        assert len(here) == (2 if value > 4.55 else 1)
        assert np.array(there) == pytest.approx(np.array(here), abs=1e-9)
    inner = [("period doubling", 1e-9), ("multiplier +1", 1e-9), ("fold", 1e-9)]
    for kind, slack in inner:
        assert only(other, kind).value == pytest.approx(only(branch, kind).value, abs=slack)


@pytest.mark.parametrize("share", SHARES)
def test_a_branch_has_the_same_ends_from_whichever_of_its_gaits_it_is_traced(
    share: float, branches: dict[str, Branch], others: dict[float, Branch]
) -> None:
    branch, other = branches["260"], others[share]
    found = sorted((mark.value, mark.kind) for mark in (other.landmarks[0], other.landmarks[-1]))
    known = sorted((mark.value, mark.kind) for mark in (branch.landmarks[0], branch.landmarks[-1]))
    assert [kind for _, kind in found] == [kind for _, kind in known]
    assert [value for value, _ in found] == pytest.approx([value for value, _ in known], abs=1e-8)


def test_symmetric_gaits_are_the_same_branch_when_symmetry_is_not_imposed(
    published: Gait, branches: dict[str, Branch]
) -> None:
    general = trace_branch(published, bounds=(4.3, 4.55), symmetric=False)
    assert general.ends == ("reached mean_speed = 4.3", "reached mean_speed = 4.55")
    for value in (4.3, 4.45, 4.51):
        (here,), (there,) = branches["260"].at(value), general.at(value)
        for name, coordinate in here.gait.model.apex.items():
            assert there.gait.model.apex[name] == pytest.approx(coordinate, abs=1e-10)


def test_gaits_at_a_value_have_exactly_this_value(branches: dict[str, Branch]) -> None:
    """Above the speed at which the branch ends and below the fold there are two."""
    branch = branches["260"]
    for value, count in ((3.5, 0), (4.0, 1), (4.56, 2), (4.6, 0)):
        found = branch.at(value)
        assert len(found) == count
        assert [point.gait.mean_speed for point in found] == pytest.approx(
            [value] * count, abs=1e-12
        )
    assert branch.at(branch.points[3].value) == [branch.points[3]]


def test_the_branch_over_stiffness_ends_on_its_bounds(softer: Branch) -> None:
    stiffnesses = [p.gait.model.numbers["spine.stiffness"] for p in softer.points]
    assert stiffnesses == sorted(stiffnesses)
    assert (stiffnesses[0], stiffnesses[-1]) == pytest.approx((200, 260), abs=1e-9)
    assert softer.ends == ("reached spine.stiffness = 200", "reached spine.stiffness = 260")
    for point in softer.points:
        assert point.gait.mean_speed == pytest.approx(4.5, abs=1e-11)


def test_at_a_period_doubling_begins_a_gait_that_returns_after_two_strides(
    doubled: list[Gait], branches: dict[str, Branch]
) -> None:
    """By the second implementation: the first stride misses by far, both together close."""
    assert len(doubled) == 2
    here = only(branches["260"], "period doubling").value
    for gait in doubled:
        assert gait.strides == 2
        assert gait.confirmed
        assert gait.mean_speed == pytest.approx(here, abs=1e-2)
        apex = dict(gait.model.apex)
        body, angles = flexible_body(260.0), gait.touchdown_angles
        first = reference.stride(body, apex, angles).end
        second = reference.stride(body, {name: first[name] for name in apex}, angles).end
        assert max(abs(first[name] - apex[name]) for name in apex) > 1e-3
        assert {name: second[name] for name in apex} == pytest.approx(apex, abs=1e-8)


def test_the_two_stride_branch_meets_the_other_one_at_the_period_doubling(
    doubled: list[Gait], branches: dict[str, Branch]
) -> None:
    """Its two sides are one orbit, a stride apart; between them it is the one-stride gait."""
    place = only(branches["260"], "period doubling")
    branch = trace_branch(doubled[0], bounds=(4.485, 4.6), most_points=60)
    meeting = only(branch, "branch point")
    assert meeting.value == pytest.approx(place.value, abs=1e-8)
    for name, value in place.at.gait.model.apex.items():
        assert meeting.at.gait.model.apex[name] == pytest.approx(value, abs=1e-7)
    for point in branch.points:
        assert point.gait.flaw is None
        assert point.gait.strides == 2
    folds = [mark for mark in branch.landmarks if mark.kind == "fold"]
    assert len(folds) == turning_points(branch)


def test_nothing_branches_off_at_a_fold(branches: dict[str, Branch]) -> None:
    branch = branches["260"]
    with pytest.raises(ParameterError, match="no branch crosses at a fold; take a symmetry"):
        switch_branch(branch.family, only(branch, "fold"))


def running_slip(height: float) -> Model:
    """The running set of slip.csv: 80 kg, 20 kN/m, 22 deg, energy of 5 m/s at 1 m."""
    speed = (25 + 2 * 9.81 * (1 - height)) ** 0.5
    angles = dict.fromkeys(("fore", "hind"), radians(22))
    return load_model(
        "slip",
        {"body.mass": 80.0, "gravity": 9.81}
        | {f"{side}.leg.stiffness": 10_000.0 for side in angles},
        apex={"speed": speed, "height": height},
        touchdown=angles,
    )


@pytest.fixture(scope="module")
def running() -> Branch:
    """Over energy, at fixed angles, from the stable gait of the spring-mass runner."""
    angles = {"touchdown.fore": radians(22), "touchdown.hind": radians(22)}
    stable = examine(running_slip(0.940267144380))
    return trace_branch(stable, "energy", bounds=(1500.0, 1800.0), fixed=angles)


def test_the_stable_and_the_unstable_spring_mass_gait_are_one_branch(running: Branch) -> None:
    """It folds at the least energy at which this leg runs at this angle."""
    points = sorted(
        running.at(80 * (12.5 + 9.81)), key=lambda point: point.gait.model.apex["height"]
    )
    heights = [point.gait.model.apex["height"] for point in points]
    assert heights == pytest.approx([0.940267144380, 1.337686381370], abs=1e-9)
    slopes = [-0.161308, 1.686968]
    for point, slope in zip(points, slopes, strict=True):
        assert np.abs(point.stability.level_multipliers - slope).min() < 1e-6
    fold = only(running, "fold")
    assert fold.value <= min(point.value for point in running.points)


def test_with_touchdown_angles_kept_a_fold_in_energy_is_a_multiplier_at_one(
    running: Branch,
) -> None:
    """The angles are kept for multipliers too, so what folds is what they tell of."""
    fold, unit = only(running, "fold"), only(running, "multiplier +1")
    assert unit.value == pytest.approx(fold.value, abs=1e-6)
    assert unit.at.point == pytest.approx(fold.at.point, abs=1e-6)


def test_legs_that_land_together_do_so_along_the_whole_branch(running: Branch) -> None:
    """A pronk stays one: no order of contacts to change."""
    assert {point.gait.family for point in running.points} == {"pronking DF-DS-DF"}
    assert [mark.kind for mark in running.landmarks if mark.kind == "contact order"] == []


def test_a_stiff_spine_tends_to_the_locked_body_as_one_over_its_stiffness() -> None:
    """At equal speed, energy and height; other gaits near them swing their spine many times.

    The published locked gait is known to 1e-12.
    """
    locked = load_model("kamimura2015-locked")
    limit = {
        "fore_pitch": 0.0,
        "speed": locked.apex["speed"],
        "fore_pitch_rate": locked.apex["pitch_rate"],
        "touchdown.fore": locked.touchdown["fore"],
        "touchdown.hind": locked.touchdown["hind"],
    }
    setting = {"energy": 290.0, "height": 0.32, "mean_speed": 4.5}
    stiffnesses = np.array([1e5, 1e6, 1e7])
    differences = []
    for stiffness in stiffnesses:
        model = load_model("kamimura2015-flexible", {"spine.stiffness": stiffness})
        near = {}
        for name, value in limit.items():
            room = (2000 if name.endswith("rate") else 100) / stiffness
            near[name] = (value - room, value + room)
        found = find_gaits(model, setting, symmetric=True, starts=8, bounds=near)
        assert len(found) > 0
        differences.append(
            min(
                max(
                    abs(gait.model.apex["speed"] - limit["speed"]),
                    abs(gait.model.touchdown["fore"] - limit["touchdown.fore"]),
                    abs(gait.model.touchdown["hind"] - limit["touchdown.hind"]),
                )
                for gait in found
            )
        )
    slopes = np.diff(np.log(differences)) / np.diff(np.log(stiffnesses))
    assert slopes == pytest.approx([-1, -1], abs=0.03)


def test_beyond_its_slow_end_a_gait_with_a_stiffer_spine_would_touch_twice(
    published: Gait,
) -> None:
    """At 4.5 m/s the branch over stiffness ends as the one over speed does at 260 N m/rad."""
    branch = trace_branch(published, "spine.stiffness", bounds=(250, 2000))
    end = branch.landmarks[-1]
    assert end.kind == "second touchdown"
    assert 260 < end.value < 2000
    assert graze(end.at.gait) < 1e-7


REFUSED: dict[str, tuple[dict[str, Any], type[Exception], list[str]]] = {
    "a start outside the bounds": (
        {"bounds": (3.0, 4.0)},
        ParameterError,
        ["mean_speed = 4.5", "not within 3 to 4", "start from a gait within"],
    ),
    "bounds the wrong way round": (
        {"bounds": (5.0, 3.0)},
        ParameterError,
        ["5 to 3", "low before high"],
    ),
    "a misspelt parameter": (
        {"over": "spine.stifness", "bounds": (100.0, 300.0)},
        UnknownNameError,
        ["spine.stifness", "did you mean 'spine.stiffness'"],
    ),
    "an unknown quantity": (
        {"over": "period", "bounds": (0.0, 1.0)},
        UnknownNameError,
        ["unknown", "'period'"],
    ),
    "what symmetry decides": (
        {"over": "hind_pitch", "bounds": (-1.0, 1.0)},
        ParameterError,
        ["hind_pitch", "follow general ones"],
    ),
    "what breaks the symmetry": (
        {"over": "fore.mass", "bounds": (10.0, 11.0)},
        ParameterError,
        ["fore.mass", "general"],
    ),
    "too few kept": (
        {"bounds": (4.0, 5.0), "fixed": {"energy": 290.0}},
        ParameterError,
        ["energy", "too few", "keep energy, height and mean_speed"],
    ),
    "too many kept": (
        {
            "bounds": (4.0, 5.0),
            "fixed": {"energy": 290.0, "height": 0.32, "touchdown.fore": 0.46},
        },
        ParameterError,
        ["touchdown.fore", "too many"],
    ),
    "a misspelt quantity": (
        {"bounds": (4.0, 5.0), "fixed": {"enrgy": 290.0, "height": 0.32}},
        UnknownNameError,
        ["enrgy", "did you mean 'energy'"],
    ),
}


@pytest.mark.parametrize(("arguments", "error", "words"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_followed_is_refused_with_a_remedy(
    arguments: dict[str, Any], error: type[Exception], words: list[str], published: Gait
) -> None:
    with pytest.raises(error) as raised:
        trace_branch(published, **arguments)
    for word in words:
        assert word in str(raised.value)


def test_a_damped_stride_is_on_no_branch() -> None:
    dampers = {"fore.leg.damping": 8.0, "hind.leg.damping": 5.0}
    damped = examine(load_model("kamimura2015-rigid", dampers))
    with pytest.raises(ParameterError, match="cannot start here; start it from a gait"):
        trace_branch(damped, bounds=(4.0, 5.0), fixed={"height": 0.32})


def test_a_doubled_branch_is_found_although_it_leaves_at_a_slant() -> None:
    """Over stiffness two doublings; each gait there needs both of its strides to return."""
    gait = examine(load_model("kamimura2015-flexible"))
    branch = trace_branch(gait, "spine.stiffness", bounds=(100, 300), longest_step=0.1)
    doublings = [mark for mark in branch.landmarks if mark.kind == "period doubling"]
    assert [mark.value for mark in doublings] == pytest.approx([159.838, 278.460], abs=1e-3)
    for mark in doublings:
        found = switch_branch(branch.family, mark)
        assert len(found) == 2
        for doubled in found:
            assert doubled.strides == 2
            assert doubled.residual <= 1e-11
            assert examine(doubled.model).residual > 1e-3


def test_the_branch_of_asymmetric_gaits_crosses_where_symmetry_breaks() -> None:
    gait = examine(load_model("kamimura2015-flexible"))
    branch = trace_branch(gait, "spine.stiffness", bounds=(130, 300), longest_step=0.1)
    mark = only(branch, "symmetry breaking")
    one, other = switch_branch(branch.family, mark)
    assert one.residual <= 1e-11
    assert abs(one.touchdown_angles["fore"] + one.liftoff_angles["hind"]) > 1e-5
    # They are each other's mirror image: the peaks change places.
    assert one.peak_grf["fore"] == pytest.approx(other.peak_grf["hind"], rel=1e-5)
    loop = trace_branch(one, "spine.stiffness", bounds=(130, 300), longest_step=0.1)
    assert loop.ends[0].startswith("closed")
