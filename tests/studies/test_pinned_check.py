"""Pinned motion against MuJoCo's, against Pinocchio's, and checks that have to fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flexspine import load_robot
from flexspine.engines.mujoco_planar import PinnedMujoco
from flexspine.errors import ParameterError, StateError, UnknownNameError
from flexspine.hybrid.integrate import integrate
from flexspine.mechanics.linkage import Linkage
from flexspine.mechanics.rerooting import rerooted
from flexspine.models import pinned
from flexspine.models.pinned import crouch, swing
from flexspine.models.robot_file import _robot
from flexspine.report.pinned_figure import plot_pinned
from flexspine.studies import pinned_check
from flexspine.studies.pinned_check import PinnedCheck, check_pinned
from tests.mechanics.test_linkage import Engine
from tests.report.layout import assert_no_text_overlaps

Array = NDArray[np.float64]

ARM = {
    "links": {
        "upper": {"length": 0.4, "mass": 1.0, "com": 0.15, "inertia": 0.02},
        "lower": {"parent": "upper", "length": 0.3, "mass": 0.5, "com": 0.2, "inertia": 0.01},
    },
    "joints": {"elbow": {"link": "lower", "stiffness": 3.0}},
    "feet": {"hand": {"link": "lower"}, "shoulder": {"link": "upper", "at": 0.0}},
}


@pytest.fixture(scope="module")
def check() -> PinnedCheck:
    return check_pinned(load_robot("sc618"))


def test_the_motion_is_mujocos_and_errors_shrink_with_order_four(check: PinnedCheck) -> None:
    assert check.foot == "toe_1"
    assert [case.name for case in check.cases] == ["without dampers", "with dampers"]
    for case in check.cases:
        ours, theirs = case.angles, case.theirs[-1].angles
        half = int(np.argmin(np.abs(case.times - 0.5)))
        assert case.times[half] == pytest.approx(0.5, abs=1e-12)
        assert case.times[-1] == pytest.approx(1.0, abs=1e-12)
        assert np.abs(ours[half] - theirs[half]).max() <= 1e-6
        assert np.ptp(ours[: half + 1], axis=0).max() > 1, "it moves"
        found = [np.abs(each.angles - ours)[: half + 1].max() for each in case.theirs]
        halved = np.log2(np.array(found[:-1]) / found[1:])
        assert case.steps == pytest.approx([5e-4, 2.5e-4, 1.25e-4, 6.25e-5, 3.125e-5])
        assert 3.5 <= halved.mean() <= 4.5
        assert case.order == pytest.approx(halved.mean(), abs=0.3)
    assert check.agrees


def test_energy_is_balanced(check: PinnedCheck) -> None:
    without, dampers = check.cases
    for case in check.cases:
        most = case.energies.kinetic.max()
        assert most > 50
        assert np.abs(case.imbalance).max() <= 1e-10 * most
        assert np.abs(case.their_imbalance[-1][case.times <= 0.5]).max() <= 1e-6 * most
    assert np.array_equal(without.energies.dissipated, np.zeros_like(without.times))
    assert (np.diff(dampers.energies.dissipated) >= 0).all()
    assert dampers.energies.dissipated[-1] > 10


@pytest.mark.parametrize("foot", ["toe_2", "toe_4"])
def test_any_foot_can_be_pinned(foot: str) -> None:
    """Without dampers; by toe_3 it is compared with Pinocchio's, with and without."""
    robot = load_robot("sc618")
    bare = robot.with_values({f"{joint}.damping": 0.0 for joint in robot.joints})
    found = check_pinned(bare, foot, seconds=0.5)
    assert found.foot == foot
    assert found.agrees, [case.compared for case in found.cases]


def test_the_pinned_foot_stays_where_it_is(check: PinnedCheck) -> None:
    for case in check.cases:
        q = case.run.coordinates(case.times)
        assert np.abs(case.run.linkage.foot(q, "toe_1")).max() <= 1e-12


# s; twice the usual one.
COARSE = 1e-3


def test_at_twice_the_step_the_motion_is_mujocos_too() -> None:
    assert check_pinned(load_robot("sc618"), seconds=0.5, step=COARSE).agrees


Change = Callable[[Linkage], Linkage]


def heavier(linkage: Linkage) -> Linkage:
    """One link's inertia is 0.1 % larger."""
    links = [
        replace(link, inertia=1.001 * link.inertia) if link.name == "fore_trunk" else link
        for link in linkage.links
    ]
    return replace(linkage, links=tuple(links))


def _spine(linkage: Linkage, **factors: float) -> Linkage:
    joints = [
        replace(joint, **{k: f * getattr(joint, k) for k, f in factors.items()})
        if joint.name == "spine"
        else joint
        for joint in linkage.joints
    ]
    return replace(linkage, joints=tuple(joints))


def rest_turned(linkage: Linkage) -> Linkage:
    return _spine(linkage, rest=-1.0)


def spring_turned(linkage: Linkage) -> Linkage:
    return _spine(linkage, stiffness=-1.0)


def gravity_off(linkage: Linkage) -> Linkage:
    return replace(linkage, gravity=linkage.gravity * (1 + 1e-5))


@pytest.mark.parametrize("change", [heavier, rest_turned, spring_turned, gravity_off])
def test_what_is_wrong_on_one_side_is_found(
    change: Change, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        pinned_check, "PinnedMujoco", lambda linkage, foot: PinnedMujoco(change(linkage), foot)
    )
    found = check_pinned(load_robot("sc618"), seconds=0.5, step=COARSE)
    assert not any(case.agrees for case in found.cases)


def test_a_damper_that_is_wrong_on_one_side_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        pinned_check,
        "PinnedMujoco",
        lambda linkage, foot: PinnedMujoco(_spine(linkage, damping=1.001), foot),
    )
    found = check_pinned(load_robot("sc618"), seconds=0.5, step=COARSE)
    assert [case.agrees for case in found.cases] == [True, False]
    assert not found.agrees


@pytest.mark.parametrize("foot", ["toe_1", "toe_3"])
@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_the_motion_is_pinocchios(foot: str, damping: float) -> None:
    """Its articulated-body algorithm, integrated by SciPy."""
    robot = load_robot("sc618", {"spine.damping": damping})
    tree = rerooted(robot.linkage, foot)
    assert foot != "toe_1" or tree == robot.linkage, "the description itself, walked by nobody"
    engine, n = Engine(tree, pinned=True), len(tree.links)
    stiffness, rest, loss = np.zeros((3, n))
    for joint in tree.joints:
        place = tree.place[joint.name]
        stiffness[place], rest[place], loss[place] = joint.stiffness, joint.rest, joint.damping

    def rates(_time: float, state: Array) -> Array:
        turns, speeds = state[:n], state[n:]
        torques = -stiffness * (turns - rest) - loss * speeds
        found = pinocchio.aba(engine.model, engine.data, turns, speeds, torques)
        return np.concatenate([speeds, found])

    start = crouch(robot)
    order = [robot.linkage.place[link.name] for link in tree.links]
    relative = np.linalg.solve(tree.to_absolute[:n, :n], start[order])
    solved = solve_ivp(
        rates, (0.0, 0.5), [*relative, *np.zeros(n)], method="DOP853", rtol=1e-12, atol=1e-12
    )
    theirs = tree.to_absolute[:n, :n] @ solved.y[:n, -1]
    ours = swing(robot, foot, start, 0.5).angles(np.array([0.5]))[0][order]
    assert np.abs(ours - theirs).max() <= 1e-8


def test_a_robot_without_legs_starts_bent_and_is_compared_at_larger_steps() -> None:
    arm = _robot("arm", ARM, "test")
    assert crouch(arm) == pytest.approx([0.3, 0.0]), "0.3 rad one way and the other"
    assert check_pinned(arm, "shoulder", step=5e-3).agrees
    assert check_pinned(arm, "hand", step=5e-3).agrees
    (only,) = check_pinned(arm, step=5e-3).cases
    assert only.name == "without dampers", "it has none"


def test_a_robot_that_does_not_move_proves_nothing() -> None:
    still = _robot("arm", {**ARM, "gravity": 0.0}, "test")
    still = still.with_values({"elbow.stiffness": 0})
    (case,) = check_pinned(still, step=5e-3).cases
    assert case.order is None
    assert not case.agrees


def test_the_crouch_is_level_with_bent_knees() -> None:
    """Every foot is below its hip, and every knee behind the line between them."""
    robot = load_robot("sc618")
    linkage, angles = robot.linkage, crouch(load_robot("sc618"))
    q = np.linalg.solve(linkage.to_absolute, [*angles, 0.0, 0.0])
    hind, fore = linkage.point(q, "hind_trunk", 0.0), linkage.point(q, "fore_trunk", 0.3)
    assert fore - hind == pytest.approx([0.6, 0.0])
    knees = {"toe_1": ("thigh_1", 0.0), "toe_2": ("thigh_2", 0.16), "toe_3": ("thigh_3", 0.16),
             "toe_4": ("thigh_4", 0.16)}  # fmt: skip
    for toe, hip in (("toe_1", hind), ("toe_2", hind), ("toe_3", fore), ("toe_4", fore)):
        knee, foot = linkage.point(q, *knees[toe]), linkage.foot(q, toe)
        assert foot[1] < knee[1] < hip[1]
        assert np.hypot(*(knee - foot)) == pytest.approx(0.25)
        assert knee[0] < min(hip[0], foot[0])


NO_TIMES = [("seconds", 0.4), ("seconds", np.nan), ("seconds", 1e9), ("step", 0.0), ("step", 0.3)]


@pytest.mark.parametrize(("name", "value"), NO_TIMES)
def test_times_that_are_not_usable_are_refused(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match="usable"):
        check_pinned(load_robot("sc618"), **{name: value})  # type: ignore[arg-type]


def test_an_unknown_foot_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="unknown foot 'toe_9'"):
        check_pinned(load_robot("sc618"), "toe_9")


def test_a_motion_that_cannot_be_integrated_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pinned, "integrate", partial(integrate, max_steps=1000))
    with pytest.raises(StateError, match="pinned by 'toe_1'"):
        swing(load_robot("sc618", {"spine.stiffness": 1e9, "fore_trunk.inertia": 0,
                                   "fore_trunk.mass": 1e-6}), "toe_1",
              np.arange(10.0), 10.0)  # fmt: skip


@pytest.fixture(scope="module")
def figure(check: PinnedCheck) -> Figure:
    return plot_pinned(check)


def test_the_figure_shows_both_motions(figure: Figure, check: PinnedCheck) -> None:
    assert len(figure.axes) == 8
    first = figure.axes[0]
    drawn = [line.get_ydata() for line in first.get_lines()[: len(check.cases[0].steps)]]
    assert np.allclose(drawn, np.maximum(check.cases[0].differences, 1e-16))
    steps = next(axes for axes in figure.axes if axes.get_xlabel().startswith("MuJoCo's step"))
    orders = [text.get_text() for text in steps.get_legend().get_texts()]
    assert orders == [f"{case.name}: order {case.order:.2f}" for case in check.cases]


def test_no_text_runs_over_another(figure: Figure) -> None:
    assert_no_text_overlaps(figure)


def test_a_single_case_is_drawn() -> None:
    figure = plot_pinned(check_pinned(_robot("arm", ARM, "test"), step=5e-3))
    assert len(figure.axes) == 5
    assert_no_text_overlaps(figure)
