"""A robot with a joint locked is the same body with that joint held straight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import InputError, Robot, load_robot
from flexspine.models.locking import locked
from tests.mechanics.test_linkage import Engine

Array = NDArray[np.float64]

# A branch at either side of the joint, a mass behind its start, and a foot on the link beyond it.
TREE = """
[links.a]
length = 0.5
mass = 1.0
com = 0.2
inertia = 0.02
[links.b]
parent = "a"
at = 0.4
length = 0.3
mass = 0.5
com = -0.1
inertia = 0.01
[links.c]
parent = "b"
at = 0.2
length = 0.6
mass = 2.0
com = 0.1
inertia = 0.03
[links.d]
parent = "a"
at = 0.1
length = 0.2
mass = 0.3
com = 0.1
inertia = 0.001
[joints.k]
link = "b"
stiffness = 7.0
rest = 0.1
[joints.l]
link = "c"
stiffness = 3.0
damping = 0.5
[feet.f]
link = "b"
at = 0.25
mass = 0.4
[feet.g]
link = "c"
mass = 0.2
[feet.h]
link = "a"
at = 0.0
"""


@pytest.fixture(params=["sc618", "tree"])
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Robot, Robot, str]:
    """A flexible robot, the same locked, and the joint."""
    if request.param == "sc618":
        robot, joint = load_robot("sc618"), "spine"
    else:
        file = tmp_path / "tree.toml"
        file.write_text(TREE)
        robot, joint = load_robot(file), "k"
    return robot, locked(robot, joint), joint


def held_straight(robot: Robot, rigid: Robot, joint: str) -> Array:
    """The flexible robot's coordinates from the rigid one's.

    The angle of the joint is zero; what hung on the link beyond it keeps its relative angle.
    """
    links, fewer = list(robot.parents), list(rigid.parents)
    straight = np.zeros((len(links) + 2, len(fewer) + 2))
    for row, link in enumerate(links):
        if link != robot.joints[joint][0]:
            straight[row, fewer.index(link)] = 1.0
    straight[-2:, -2:] = np.eye(2)
    return straight


def states(rigid: Robot) -> list[tuple[Array, Array]]:
    rng = np.random.default_rng(2)
    size = len(rigid.parents) + 2
    return [(rng.uniform(-3, 3, size), rng.normal(0, 3, size)) for _ in range(50)]


def test_its_inertia_is_that_of_the_robot_held_straight(pair: tuple[Robot, Robot, str]) -> None:
    """T' D T, with Pinocchio's D of the robot that can bend."""
    robot, rigid, joint = pair
    straight, engine = held_straight(*pair), Engine(robot.linkage)
    assert len(rigid.parents) == len(robot.parents) - 1
    assert joint not in rigid.joints
    assert rigid.linkage.mass == pytest.approx(robot.linkage.mass, rel=1e-14)
    for q, rates in states(rigid):
        whole = engine.mass_matrix(straight @ q)
        expected = straight.T @ whole @ straight
        np.testing.assert_allclose(
            rigid.linkage.mass_matrix(q), expected, rtol=0, atol=1e-12 * np.abs(expected).max()
        )
        speed = straight @ rates
        energy = speed @ whole @ speed / 2
        assert rigid.linkage.kinetic_energy(q, rates) == pytest.approx(energy, rel=1e-12)


def test_all_of_it_is_where_it_was(pair: tuple[Robot, Robot, str]) -> None:
    """Feet, the ends of links that are left, the centre of mass; and so is its weight's energy."""
    robot, rigid, joint = pair
    straight, engine = held_straight(*pair), Engine(robot.linkage)
    beyond = robot.joints[joint][0]
    for q, rates in states(rigid):
        bent = straight @ q
        for foot in robot.feet:
            place, _, _ = engine.foot(foot, bent, straight @ rates)
            np.testing.assert_allclose(rigid.linkage.foot(q, foot), place, atol=1e-14 * 30)
        for link in rigid.parents:
            np.testing.assert_allclose(
                rigid.linkage.point(q, link, 0.0), robot.linkage.point(bent, link, 0.0), atol=3e-14
            )
        end = robot.linkage.point(bent, beyond, robot.numbers[f"{beyond}.length"])
        joined = robot.parents[beyond]
        whole = rigid.numbers[f"{joined}.length"]
        np.testing.assert_allclose(rigid.linkage.point(q, joined, whole), end, atol=3e-14)
        np.testing.assert_allclose(rigid.linkage.com(q), robot.linkage.com(bent), atol=3e-14)
        springs = robot.numbers[f"{joint}.stiffness"] * robot.numbers[f"{joint}.rest"] ** 2 / 2
        expected = robot.linkage.potential_energy(bent) - springs
        assert rigid.linkage.potential_energy(q) == pytest.approx(expected, abs=1e-11)


def test_legs_are_carried_by_the_whole_trunk() -> None:
    """Those of the fore trunk, too; motors and other springs stay as they are."""
    robot = load_robot("sc618")
    rigid = locked(robot, "spine")
    assert {leg.trunk for leg in rigid.legs.values()} == {"hind_trunk"}
    assert {name: leg.foot for name, leg in rigid.legs.items()} == {
        name: leg.foot for name, leg in robot.legs.items()
    }
    assert rigid.joints == {name: each for name, each in robot.joints.items() if name != "spine"}
    assert rigid.friction == robot.friction
    assert "spine" in rigid.name
    assert not [name for name in rigid.numbers if name.startswith(("spine.", "fore_trunk."))]


@pytest.mark.parametrize("name", ["spin", "hind_trunk", ""])
def test_what_is_no_joint_cannot_be_locked(name: str) -> None:
    with pytest.raises(InputError, match=f"unknown joint '{name}'") as refused:
        locked(load_robot("sc618"), name)
    assert refused.value.remedy
