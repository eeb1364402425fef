"""Gaits with a damper in the spine that an actuator keeps going, followed in the damping."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexspine import Branch, Gait, examine, load_model, simulate, to_dataset, trace_branch
from flexspine.errors import ParameterError, UnknownNameError
from flexspine.gaits.newton import solve
from flexspine.gaits.parameter_scale import ParameterScale
from flexspine.gaits.problem import Problem
from tests import second_implementation as reference
from tests.models.test_second_actuation import body_of

DAMPING, EXTENSION = "spine.damping", "legs.extension"

LEG_STIFFNESS, LEG_LENGTH, SPINE_STIFFNESS = 6340.0, 0.36, 260.0

WEIGHT = 2 * 10.4 * 9.81


@pytest.fixture(scope="module")
def published() -> Gait:
    return examine(load_model("kamimura2015-flexible"))


@pytest.fixture(scope="module")
def damped(published: Gait) -> Branch:
    """From the published gait on until the damper all but locks the spine."""
    return trace_branch(
        published, DAMPING, bounds=(0, 1000), free=(EXTENSION,), longest_step=0.1
    )  # fmt: skip


@pytest.fixture(scope="module")
def slower(published: Gait) -> Branch:
    """At 4.25 m/s with a spine of 200 N m/rad."""
    softer = trace_branch(published, "spine.stiffness", bounds=(200, 260), longest_step=0.1)
    slow = trace_branch(softer.points[0].gait, bounds=(4.25, 4.51), longest_step=0.1)
    return trace_branch(
        slow.points[0].gait, DAMPING, bounds=(0, 5), free=(EXTENSION,), longest_step=0.1
    )


def amplitude(gait: Gait) -> float:
    return gait.model.numbers[EXTENSION]


def test_gaits_keep_energy_height_and_speed_along_the_branch(damped: Branch) -> None:
    assert damped.ends == (f"reached {DAMPING} = 0", f"reached {DAMPING} = 1000")
    assert len(damped.points) < 150
    for point in damped.points:
        assert point.gait.energy == pytest.approx(290, abs=1e-9)
        assert point.gait.model.apex["height"] == pytest.approx(0.32, abs=1e-12)
        assert point.gait.mean_speed == pytest.approx(4.5, abs=1e-11)
        assert point.gait.residual < 1e-11


def test_actuators_give_what_the_damper_takes(damped: Branch) -> None:
    for point in damped.points:
        taken = point.gait.run.trajectory.end.states[
            point.gait.model.state_names.index("dissipated_energy")
        ]
        given = sum(work.net for work in point.gait.summary.work.values())
        assert given == pytest.approx(taken, abs=1e-9)


def test_gaits_close_and_cost_the_same_in_the_second_implementation(damped: Branch) -> None:
    for point in damped.points[15:60:15]:
        gait, apex = point.gait, dict(point.gait.model.apex)
        theirs = reference.stride(body_of(gait.model), apex, gait.touchdown_angles)
        assert {name: theirs.end[name] for name in apex} == pytest.approx(apex, abs=1e-9)
        given = sum(work.positive for work in theirs.works.values())
        assert given == pytest.approx(theirs.dissipated, abs=1e-9)
        assert theirs.peak_grf == pytest.approx(gait.peak_grf, rel=1e-7)
        cost = given / (WEIGHT * theirs.end["distance"])
        assert gait.summary.cost_of_transport == pytest.approx(cost, abs=1e-11)


def test_what_the_damper_takes_is_the_integral_of_its_power(damped: Branch) -> None:
    for point in damped.points[10:-1:20]:
        stride = to_dataset(point.gait.run, interval=2e-5)
        rate = (stride["fore_pitch_rate"] - stride["hind_pitch_rate"]).values
        taken = point.value * np.trapezoid(rate**2, stride["time"].values)
        given = sum(work.net for work in point.gait.summary.work.values())
        assert given == pytest.approx(taken, rel=1e-6)


def test_the_cost_of_transport_is_the_work_of_longer_springs_by_weight_and_distance(
    damped: Branch,
) -> None:
    """Legs get longer where they are shortest: their springs' energy jumps."""
    for point in damped.points[10:-1:20]:
        stride, longer = to_dataset(point.gait.run, interval=1e-5), amplitude(point.gait)
        work = 0.0
        for side in ("fore", "hind"):
            loaded = stride[f"{side}_grf"].values > 0
            shortest = stride[f"{side}_leg_length"].values[loaded].min()
            before = LEG_LENGTH - shortest
            work += LEG_STIFFNESS / 2 * ((before + longer) ** 2 - before**2)
        assert point.gait.summary.cost_of_transport == pytest.approx(
            work / (WEIGHT * point.gait.stride_length), rel=1e-6
        )


def test_without_damping_the_published_gait_comes_back(damped: Branch, published: Gait) -> None:
    """Followed back from the most damped one."""
    back = trace_branch(
        damped.points[20].gait, DAMPING, bounds=(0, 2), free=(EXTENSION,), longest_step=0.1
    )
    last = back.points[0].gait
    assert back.points[0].value == 0
    assert last.model.apex == pytest.approx(published.model.apex, abs=1e-9)
    assert last.touchdown_angles == pytest.approx(published.touchdown_angles, abs=1e-9)
    assert last.period == pytest.approx(0.252732108498, abs=1e-11)
    assert amplitude(last) == pytest.approx(0.0, abs=1e-12)
    assert last.summary.cost_of_transport == pytest.approx(0.0, abs=1e-12)


def test_a_little_damping_costs_what_the_undamped_spine_would_dissipate(
    damped: Branch, published: Gait
) -> None:
    """To first order the motion is that without a damper."""
    stride = to_dataset(published.run, interval=2e-5)
    rate = (stride["fore_pitch_rate"] - stride["hind_pitch_rate"]).values
    lost = np.trapezoid(rate**2, stride["time"].values) / (WEIGHT * published.stride_length)
    point = damped.points[1]
    assert 0 < point.value < 0.02
    assert point.gait.summary.cost_of_transport == pytest.approx(point.value * lost, rel=0.01)


def test_a_firm_damper_locks_the_spine_where_its_spring_holds_the_mean_torque(
    damped: Branch,
) -> None:
    """The limit is the gait of a spine that is stiff at that bend."""
    firm = damped.points[-1].gait
    stride = to_dataset(firm.run)
    time = stride["time"].values
    bend = float(np.trapezoid(stride["spine_angle"].values, time) / (time[-1] - time[0]))
    stiff = load_model(
        "kamimura2015-flexible", {"spine.stiffness": 1e6, "spine.rest_angle": bend}
    ).with_values(apex=dict(firm.model.apex), touchdown=dict(firm.model.touchdown))
    stored = SPINE_STIFFNESS * bend**2 / 2
    fixed = {"energy": 290 - stored, "height": 0.32, "mean_speed": 4.5}
    problem = Problem(stiff, fixed, symmetric=True, tolerance=firm.tolerance)
    attempt = solve(problem, problem.point(stiff))
    assert attempt.solved
    locked = examine(problem.at(attempt.point))
    assert locked.flaw is None
    assert firm.peak_grf["fore"] == pytest.approx(locked.peak_grf["fore"], rel=5e-4)
    assert firm.touchdown_angles == pytest.approx(locked.touchdown_angles, abs=2e-4)
    held = to_dataset(locked.run)
    whole = np.trapezoid(held["spine_angle"].values - bend, held["time"].values)
    torque = 1e6 * whole / locked.period
    assert torque == pytest.approx(SPINE_STIFFNESS * bend, rel=1e-3)


def test_what_a_firm_damper_costs_falls_as_one_over_damping(damped: Branch) -> None:
    firm, firmer = damped.at(500.0)[0], damped.points[-1]
    ratio = firm.gait.summary.cost_of_transport / firmer.gait.summary.cost_of_transport
    assert ratio == pytest.approx(2, rel=0.01)


def test_a_damped_gait_with_a_multiplier_below_one_comes_back_after_a_push(
    damped: Branch,
) -> None:
    """With a softer spine, and to rounding error: no energy is conserved that could stay off."""
    softer = trace_branch(
        damped.at(1.0)[0].gait, "spine.stiffness", bounds=(160, 261), free=(EXTENSION,),
        longest_step=0.1,
    )  # fmt: skip
    point = softer.points[0]
    assert point.value == 160
    assert point.stability.stable
    apex = dict(point.gait.model.apex)
    pushed = point.gait.model.with_values(apex={**apex, "height": apex["height"] + 3e-3})
    run = simulate(pushed, strides=200)
    assert run.outcome.completed
    assert run.apexes[-1] == pytest.approx(apex, abs=1e-9)


def test_damping_makes_one_branch_of_two_undamped_gaits(slower: Branch) -> None:
    """At lower speed: both are gaits of the second implementation, the damping has a most."""
    assert slower.ends == (f"reached {DAMPING} = 0",) * 2
    (fold,) = (mark for mark in slower.landmarks if mark.kind == "fold")
    assert fold.value == pytest.approx(max(point.value for point in slower.points), rel=1e-3)
    ends = [slower.points[at].gait for at in (0, -1)]
    assert abs(ends[0].peak_grf["fore"] - ends[1].peak_grf["fore"]) > 10
    for gait in ends:
        assert amplitude(gait) == pytest.approx(0, abs=1e-12)
        theirs = reference.stride(body_of(gait.model), dict(gait.model.apex), gait.touchdown_angles)
        for name, value in gait.model.apex.items():
            assert theirs.end[name] == pytest.approx(value, abs=1e-7)
        assert theirs.end["distance"] / theirs.time == pytest.approx(4.25, abs=1e-8)


def test_a_damped_branch_tells_which_leg_ends_it(slower: Branch) -> None:
    """Beyond its stiffest gait the fore leg, which has left the ground, would land once more."""
    stiffer = trace_branch(
        slower.at(0.1)[0].gait, "spine.stiffness", bounds=(199, 500), free=(EXTENSION,),
        longest_step=0.1,
    )  # fmt: skip
    assert stiffer.ends[1].startswith("second touchdown")
    last = stiffer.points[-1].gait
    stride = to_dataset(last.run, interval=1e-5)
    clearance = stride["fore_hip_y"] - LEG_LENGTH * np.cos(last.touchdown_angles["fore"])
    swinging = clearance.sel(time=slice(0.12, 0.22)).values  # s; between two rises
    assert 0 <= swinging.min() < 1e-6


def test_where_nothing_is_lost_the_multiplier_of_energy_is_no_landmark(
    damped: Branch, slower: Branch
) -> None:
    for branch in (damped, slower):
        assert all(mark.value > 1e-6 for mark in branch.landmarks)


def test_a_branch_with_a_free_parameter_goes_on_where_it_was(
    published: Gait, tmp_path: Path
) -> None:
    whole, part = tmp_path / "whole.jsonl", tmp_path / "part.jsonl"

    def trace(store: Path) -> Branch:
        return trace_branch(published, DAMPING, bounds=(0, 1), free=(EXTENSION,), store=store)

    expected = trace(whole)
    lines = whole.read_text().splitlines(keepends=True)
    part.write_text("".join(lines[: len(lines) // 2]) + lines[len(lines) // 2][:40])
    found = trace(part)
    assert [p.point.tolist() for p in found.points] == [p.point.tolist() for p in expected.points]
    assert part.read_text() == whole.read_text()


REFUSED = {
    "nothing that gives energy": ((), ParameterError, "legs.extension"),
    "unknown": (("legs.extensin",), UnknownNameError, "legs.extension"),
    "no parameter": (("height",), UnknownNameError, "height"),
    "what is followed": ((DAMPING,), ParameterError, "twice"),
    "one too many": ((EXTENSION, "legs.stiffening"), ParameterError, "fewer parameters free"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_free_is_refused_with_a_remedy(published: Gait, case: str) -> None:
    free, error, told = REFUSED[case]
    with pytest.raises(error, match=told):
        trace_branch(published, DAMPING, bounds=(0, 1), free=free)


@pytest.mark.parametrize("vanishes", [False, True])
@pytest.mark.parametrize("value", [1e-3, 0.8, 500.0])
def test_a_parameter_comes_back_from_its_coordinate(vanishes: bool, value: float) -> None:
    scale, step = ParameterScale(2.0, vanishes), 1e-6
    at = scale.coordinate(value)
    assert scale.value(at) == pytest.approx(value, rel=1e-12)
    slope = (scale.value(at + step) - scale.value(at - step)) / (2 * step)
    assert scale.slope(value) == pytest.approx(slope, rel=1e-8)


def test_a_damper_counts_evenly_from_zero_on_and_by_decades_far_from_it() -> None:
    scale = ParameterScale(1.0, vanishes=True)
    assert scale.coordinate(0.0) == 0
    assert scale.coordinate(-1e-3) == pytest.approx(-1e-3, rel=1e-6)
    decade = scale.coordinate(1e4) - scale.coordinate(1e3)
    assert decade == pytest.approx(np.log(10), rel=1e-5)
