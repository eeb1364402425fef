"""Planar linkages against Pinocchio, and against what mechanics says of any body."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio
import pytest
from numpy.typing import NDArray

from flexspine import load_robot
from flexspine.mechanics.linkage import Foot, Joint, Link, Linkage

Array = NDArray[np.float64]

# Relative; both sides round.
SAME = 1e-12


class Engine:
    """The same tree in Pinocchio: prismatic x and y, then a revolute joint for every link.

    ``pinned``: its base stays where it is, without x and y.
    """

    def __init__(self, linkage: Linkage, pinned: bool = False) -> None:
        self.linkage, self.model = linkage, pinocchio.Model()
        self.model.gravity.linear = np.array([0.0, -linkage.gravity, 0.0])
        still = pinocchio.SE3.Identity()
        base = 0
        if not pinned:
            base = self.model.addJoint(base, pinocchio.JointModelPX(), still, "x")
            base = self.model.addJoint(base, pinocchio.JointModelPY(), still, "y")
        joints: dict[str, int] = {}
        for link in linkage.links:
            place = pinocchio.SE3(np.eye(3), np.array([link.at, 0.0, 0.0]))
            parent = base if link.parent is None else joints[link.parent]
            place = still if link.parent is None else place
            joints[link.name] = self.model.addJoint(
                parent, pinocchio.JointModelRZ(), place, link.name
            )
            self._add(joints[link.name], link.mass, link.com, link.inertia)
        for foot in linkage.feet:
            self._add(joints[foot.link], foot.mass, foot.at, 0.0)
        self.frames = {
            foot.name: self.model.addFrame(
                pinocchio.Frame(
                    foot.name,
                    joints[foot.link],
                    pinocchio.SE3(np.eye(3), np.array([foot.at, 0.0, 0.0])),
                    pinocchio.FrameType.OP_FRAME,
                )
            )
            for foot in linkage.feet
        }
        self.data = self.model.createData()
        order = self.ours(np.arange(self.model.nv))
        self.upper = np.minimum.outer(order, order), np.maximum.outer(order, order)

    def _add(self, joint: int, mass: float, distance: float, inertia: float) -> None:
        tensor = np.diag([0.0, inertia, inertia]) if inertia else np.zeros((3, 3))
        body = pinocchio.Inertia(mass, np.array([distance, 0.0, 0.0]), tensor)
        self.model.appendBodyToJoint(joint, body, pinocchio.SE3.Identity())

    @staticmethod
    def theirs(q: Array) -> Array:
        """Pinocchio has the base first."""
        return np.concatenate([q[-2:], q[:-2]])

    @staticmethod
    def ours(vector: Array) -> Array:
        return np.concatenate([vector[2:], vector[:2]])

    def mass_matrix(self, q: Array) -> Array:
        """Of which Pinocchio makes the upper half."""
        found: Array = pinocchio.crba(self.model, self.data, self.theirs(q))[self.upper]
        return found

    def forces(self, q: Array, rates: Array) -> Array:
        """Velocity and weight forces together."""
        return self.ours(
            pinocchio.nonLinearEffects(self.model, self.data, self.theirs(q), self.theirs(rates))
        )

    def foot(self, name: str, q: Array, rates: Array) -> tuple[Array, Array, Array]:
        """Place, Jacobian and bias acceleration of a foot, in the world."""
        mine, speed = self.theirs(q), self.theirs(rates)
        frame, world = self.frames[name], pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pinocchio.forwardKinematics(self.model, self.data, mine, speed, np.zeros_like(mine))
        pinocchio.updateFramePlacements(self.model, self.data)
        place = self.data.oMf[frame].translation[:2].copy()
        bias = pinocchio.getFrameClassicalAcceleration(self.model, self.data, frame, world)
        bias = bias.linear[:2].copy()
        jacobian = pinocchio.computeFrameJacobian(self.model, self.data, mine, frame, world)[:2]
        return place, np.concatenate([jacobian[:, 2:], jacobian[:, :2]], axis=1), bias


def uneven() -> Linkage:
    """A tree with links that start midway and before their parents' start, and a light one."""
    return Linkage(
        (
            Link("a", 0.5, 1.0, 0.2, 0.02),
            Link("b", 0.3, 0.5, 0.4, 0.01, "a", 0.1),
            Link("c", 0.2, 2.0, -0.1, 0.03, "a", 0.5),
            Link("d", 0.6, 0.01, 0.3, 0.0, "c", -0.2),
        ),
        (Joint("k", "b", 3.0, 0.1, 0.2, actuated=True), Joint("l", "d", 5.0)),
        (Foot("f", "d", 0.6, 0.3), Foot("g", "a", 0.25, 0.1), Foot("h", "b", 0.0)),
        1.62,
    )


@pytest.fixture(params=["sc618", "uneven"])
def linkage(request: pytest.FixtureRequest) -> Linkage:
    return load_robot("sc618").linkage if request.param == "sc618" else uneven()


def states(linkage: Linkage, count: int = 1000) -> Iterator[tuple[Array, Array]]:
    rng = np.random.default_rng(7)
    q = rng.uniform(-np.pi, np.pi, (count, linkage.size))
    rates = rng.normal(0.0, 5.0, (count, linkage.size))
    return zip(q, rates, strict=True)


def close(found: Array, expected: Array, least: float = 0.0) -> None:
    """Relative to the largest, or to what it is a difference of."""
    size = max(float(np.abs(expected).max()), least)
    np.testing.assert_allclose(found, expected, rtol=0, atol=SAME * size)


def test_masses_and_forces_are_pinocchios(linkage: Linkage) -> None:
    engine = Engine(linkage)
    assert linkage.mass == pytest.approx(pinocchio.computeTotalMass(engine.model), rel=1e-15)
    springs = np.zeros(linkage.size)
    for q, rates in states(linkage):
        close(linkage.mass_matrix(q), engine.mass_matrix(q))
        for joint in linkage.joints:
            place = linkage.place[joint.name]
            springs[place] = joint.stiffness * (q[place] - joint.rest)
        ours = linkage.velocity_forces(q, rates) + linkage.potential_forces(q)
        close(ours, engine.forces(q, rates) + springs)


def test_feet_are_pinocchios(linkage: Linkage) -> None:
    engine = Engine(linkage)
    for q, rates in states(linkage):
        for foot in linkage.feet:
            place, jacobian, bias = engine.foot(foot.name, q, rates)
            close(linkage.foot(q, foot.name), place)
            close(linkage.foot_jacobian(q, [foot.name]), jacobian)
            spin = float((linkage.angles(rates) ** 2).max())
            close(linkage.foot_bias(q, rates, [foot.name]), bias, spin * linkage.links[0].length)


def test_energies_are_pinocchios(linkage: Linkage) -> None:
    engine = Engine(linkage)
    for q, rates in states(linkage, 100):
        mine, speed = engine.theirs(q), engine.theirs(rates)
        kinetic = pinocchio.computeKineticEnergy(engine.model, engine.data, mine, speed)
        weight = pinocchio.computePotentialEnergy(engine.model, engine.data, mine)
        springs = sum(
            joint.stiffness * (q[linkage.place[joint.name]] - joint.rest) ** 2 / 2
            for joint in linkage.joints
        )
        assert linkage.kinetic_energy(q, rates) == pytest.approx(kinetic, rel=SAME)
        assert linkage.potential_energy(q) == pytest.approx(
            weight + springs, abs=SAME * (abs(springs) + linkage.mass * 30)
        )
        com = pinocchio.centerOfMass(engine.model, engine.data, mine)[:2]
        close(linkage.com(q), com)


def test_many_states_at_once_are_as_each_alone(linkage: Linkage) -> None:
    pairs = list(states(linkage, 17))
    q, rates = (np.array(column) for column in zip(*pairs, strict=True))
    feet = [foot.name for foot in linkage.feet]
    for i, (one, speed) in enumerate(pairs):
        close(linkage.mass_matrix(q)[i], linkage.mass_matrix(one))
        for name, both in (("velocity_forces", (q, rates)), ("potential_forces", (q,))):
            alone = getattr(linkage, name)(*(part[i] for part in both))
            np.testing.assert_allclose(getattr(linkage, name)(*both)[i], alone, atol=1e-10)
        close(linkage.foot_jacobian(q, feet)[i], linkage.foot_jacobian(one, feet))
        close(linkage.foot_bias(q, rates, feet)[i], linkage.foot_bias(one, speed, feet))
        close(linkage.com(q)[i], linkage.com(one))


def test_motors_act_on_their_joints() -> None:
    """Eight of the ten-link robot, none on its first shank nor on its spine."""
    linkage = load_robot("sc618").linkage
    expected = np.zeros((12, 8))
    for column, row in enumerate((1, 2, 3, 4, 6, 7, 8, 9)):
        expected[row, column] = 1.0
    assert np.array_equal(linkage.actuation, expected)


def test_the_robot_stands_as_its_angles_say() -> None:
    """All legs straight up and a level trunk: hips 0.41 m up and 0.6 m apart, toes under them."""
    robot = load_robot("sc618").linkage
    up = np.pi / 2
    q = np.zeros(12)
    q[0], q[robot.place["hip_1"]] = up, -up
    q[robot.place["hip_2"]] = np.pi
    q[robot.place["hip_3"]] = q[robot.place["hip_4"]] = -up
    for foot, x in (("toe_1", 0.0), ("toe_2", 0.0), ("toe_3", 0.6), ("toe_4", 0.6)):
        assert robot.foot(q, foot) == pytest.approx([x, 0.0], abs=1e-15)
    assert robot.point(q, "fore_trunk", 0.3) == pytest.approx([0.6, 0.41])
    assert robot.com(q)[0] == pytest.approx(0.3)
    q[robot.place["spine"]] = 0.1
    assert robot.point(q, "fore_trunk", 0.3)[1] > 0.41, "a positive spine angle means that it sags"
