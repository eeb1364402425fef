"""The planar trot in MuJoCo: what agrees, and what tells that something is wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from flexspine import load_robot
from flexspine.engines.replay import replay
from flexspine.models.space import SpaceRobot
from flexspine.studies.replay_check import ReplayCheck, SoftGround, check_replay

# As the check has them, but for the stiffest, which takes long.
GROUNDS = (SoftGround(0.035, 5e4, 1e3, 2.5e-4), SoftGround(0.001, 5e5, 3e3, 1e-4))


@cache
def check() -> ReplayCheck:
    return check_replay(load_robot("sc618"), seconds=1.2, grounds=GROUNDS)


def test_points_on_stiff_ground_move_as_ours_and_spheres_on_soft_ground_do_not() -> None:
    soft, stiff = check().cases
    assert check().agrees
    assert stiff.angle < 5e-4 < 3e-3 < soft.angle
    assert stiff.height < 2e-4 < 1e-3 < soft.height
    assert stiff.spine is not None
    assert stiff.spine < 1e-3
    # Springs and dampers have next to nothing to do beside the torques of the motion.
    assert stiff.correction < 0.05 * np.abs(check().motion.torques).max()


def test_what_is_told_is_measured() -> None:
    """Against the motion itself, by a straight line through both."""
    case = check().cases[1]
    off = case.replay.com - case.com[: len(case.replay.times)]
    assert case.gained == off[-1, 0]
    assert case.height == pytest.approx(np.linalg.norm(off[:, 1]) / np.sqrt(len(off)))
    # The feet bear the weight on the whole, in MuJoCo as with us.
    weight = check().run.robot.linkage.mass * 9.81
    later = case.replay.times > 0.4
    assert case.replay.normal[later].sum(axis=1).mean() == pytest.approx(weight, rel=0.02)


@pytest.mark.parametrize("change", [{"hind_trunk.mass": 8.5}, {"spine.stiffness": 300.0}])
def test_a_robot_with_other_numbers_does_not_agree(change: dict[str, float]) -> None:
    ground, ours = GROUNDS[1], check().cases[1]
    there = load_robot("sc618", change).with_values(
        {
            "space.foot_radius": ground.radius,
            "space.ground_stiffness": ground.stiffness,
            "space.ground_damping": ground.damping,
        }
    )
    found = replace(ours, replay=replay(there, check().motion, step=ground.step))
    assert found.correction > 1.5 * ours.correction
    assert found.normal > 1.05 * ours.normal


def test_torques_of_hinges_do_the_work_of_planar_motors() -> None:
    space = SpaceRobot(load_robot("sc618"), plane=True)
    linkage, rng = space.robot.linkage, np.random.default_rng(1)
    for _ in range(20):
        rates = rng.normal(0, 3, linkage.size)
        torques = rng.normal(0, 5, len(space.robot.motors))
        turning = np.array([space.rates(rates)[name] for name in space.motors])
        ours = torques @ (linkage.actuation.T @ rates)
        assert space.by_motor @ torques @ turning == pytest.approx(ours, rel=1e-12)
