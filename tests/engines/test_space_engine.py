"""A robot in space is the planar one while it keeps to the plane, and a free body when not."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import load_robot
from flexspine.engines.contact import ContactLaw
from flexspine.engines.mjcf import Start, specification, standing_start
from flexspine.engines.space_engine import SpaceEngine
from flexspine.errors import ParameterError
from flexspine.models.locking import locked
from flexspine.models.robot import Robot
from flexspine.models.space import SpaceRobot

Array = NDArray[np.float64]

# Every spring and damper that can be in space, none of them alike.
SPRINGS = {
    f"{joint}.{kind}": number
    for place, joint in enumerate(("knee_1", "knee_2", "knee_3", "hip_1", "hip_3", "hip_4"))
    for kind, number in (
        ("stiffness", 3.0 + place), ("damping", 0.3 + place / 10), ("rest", 0.2 * place - 0.5)
    )
}  # fmt: skip


def sprung() -> Robot:
    return load_robot("sc618", {**SPRINGS, "hind_trunk.com": 0.11, "thigh_2.com": 0.05})


class InPlane:
    """A robot that MuJoCo keeps to its plane, put into the states of the planar one."""

    def __init__(self, robot: Robot) -> None:
        self.linkage = robot.linkage
        self.space = SpaceRobot(robot, plane=True)
        self.engine = SpaceEngine(self.space, ground=False)

    def put(self, q: Array, rates: Array) -> Array:
        """Go to a planar state; returns by what the engine's velocities follow from ours."""
        engine, linkage = self.engine, self.linkage
        place, pitch = self.space.root(q)
        angles = {name: float(angle) for name, angle in self.space.angles(q).items()}
        engine.place(Start((float(place[0]), float(place[1])), float(pitch), angles))
        first = self.space.trunk[0]
        turn = np.zeros((engine.model.nv, linkage.size))
        base = linkage.point_jacobian(q, first, 0.0)
        turn[self.at("root_x")], turn[self.at("root_z")] = base
        turn[self.at("root_pitch")] = linkage.to_absolute[linkage.place[first]]
        for number in range(linkage.size):
            unit = np.eye(linkage.size)[number]
            for name, rate in self.space.rates(unit).items():
                turn[self.at(name), number] = rate
        engine.data.qvel[:] = turn @ rates
        engine.forward()
        return turn

    def at(self, joint: str) -> int:
        return int(self.engine.model.joint(joint).dofadr[0])


@pytest.mark.parametrize("body", ["sc618", "sprung", "locked"])
def test_in_the_plane_mass_matrix_and_forces_are_those_of_the_planar_equations(body: str) -> None:
    robot = {"sc618": load_robot("sc618"), "sprung": sprung()}.get(body)
    robot = locked(load_robot("sc618"), "spine") if robot is None else robot
    plane = InPlane(robot)
    engine, linkage = plane.engine, plane.linkage
    rng = np.random.default_rng(2)
    for _ in range(100):
        q, rates = rng.uniform(-2, 2, linkage.size), rng.normal(0, 4, linkage.size)
        turn = plane.put(q, rates)
        theirs = np.zeros((engine.model.nv, engine.model.nv))
        mujoco.mj_fullM(engine.model, engine.data, theirs)
        ours = linkage.mass_matrix(q)
        assert np.abs(turn.T @ theirs @ turn - ours).max() < 1e-10 * np.abs(ours).max()
        # Accelerations without motors or ground, carried over by their works.
        forces = linkage.velocity_forces(q, rates) + linkage.potential_forces(q)
        forces = forces + linkage.damping_forces(rates)
        ours_too = np.linalg.solve(ours, -forces)
        # v = turn q', so that a = turn q'' + turn' q'.
        step = 1e-6
        later, sooner = (plane.put(q + way * step * rates, rates) for way in (1, -1))
        drift = (later - sooner) / (2 * step) @ rates
        plane.put(q, rates)
        expected = turn @ ours_too + drift
        scale = np.abs(expected).max()
        # Central differences leave 1e-9 of it.
        assert np.abs(engine.data.qacc - expected).max() < 1e-7 * scale


def test_places_and_energies_are_those_of_the_plane() -> None:
    plane = InPlane(sprung())
    linkage, rng = plane.linkage, np.random.default_rng(3)
    radius = plane.space.numbers.foot_radius
    for _ in range(50):
        q, rates = rng.uniform(-2, 2, linkage.size), rng.normal(0, 4, linkage.size)
        plane.put(q, rates)
        seen = plane.engine.look()
        assert seen["com"][[0, 2]] == pytest.approx(linkage.com(q), abs=1e-12)
        velocity = linkage.com_jacobian(q) @ rates
        assert seen["com_rate"][[0, 2]] == pytest.approx(velocity, abs=1e-11)
        assert seen["kinetic_energy"] == pytest.approx(linkage.kinetic_energy(q, rates), rel=1e-12)
        assert seen["potential_energy"] == pytest.approx(linkage.potential_energy(q), rel=1e-11)
        for number, ball in enumerate(plane.space.balls):
            # The point of contact of a shank that stands upright is the planar foot.
            shank = [part.name for part in plane.space.parts].index(ball.part)
            end = seen["link_end"][shank][[0, 2]]
            assert end == pytest.approx(linkage.foot(q, ball.foot), abs=1e-12)
            way = end - seen["link_start"][shank][[0, 2]]
            centre = end - radius * way / np.hypot(*way)
            assert seen["foot"][number][[0, 2]] == pytest.approx(centre - [0, radius], abs=1e-12)


@pytest.mark.parametrize("yaw", [0.0, 80.0])
def test_a_passive_robot_in_the_air_keeps_energy_and_momentum(yaw: float) -> None:
    robot = load_robot("sc618", {"spine.damping": 0.0, "space.yaw_stiffness": yaw})
    engine = SpaceEngine(SpaceRobot(robot), ground=False, step=2e-5)
    engine.model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    engine.set_down(standing_start(engine.space))
    rng = np.random.default_rng(4)
    engine.data.qvel[:] = rng.normal(0, 2, engine.model.nv)
    engine.forward()
    root = engine.model.body("hind_trunk").id

    def momenta() -> tuple[Array, Array, float]:
        mujoco.mj_subtreeVel(engine.model, engine.data)
        data, mass = engine.data, robot.linkage.mass
        linear = mass * data.subtree_linvel[root]
        return linear.copy(), data.subtree_angmom[root].copy(), float(data.energy.sum())

    before, seconds = momenta(), 0.2
    for _ in range(round(seconds / engine.step)):
        engine.advance()
    engine.forward()
    after = momenta()
    weight = robot.linkage.mass * robot.linkage.gravity
    assert after[0] - before[0] == pytest.approx([0, 0, -weight * seconds], abs=1e-8)
    assert after[1] == pytest.approx(before[1], abs=1e-8)
    assert after[2] == pytest.approx(before[2], rel=1e-9)


def test_a_foot_meets_the_law_that_is_written_down() -> None:
    engine = SpaceEngine(SpaceRobot(load_robot("sc618")))
    rng = np.random.default_rng(5)
    start = standing_start(engine.space)
    for _ in range(20):
        engine.set_down(start)
        engine.data.qpos[2] -= rng.uniform(0, 3e-3)
        engine.data.qvel[:3] = [0, 0, rng.uniform(-0.5, 0)]
        engine.forward()
        pressed = 0
        for number in range(engine.data.ncon):
            row = int(engine.data.contact.efc_address[number])
            force = float(engine.data.efc_force[row])
            # The foot does not turn here, so that its acceleration is J q''.
            jacobian = engine.data.efc_J.reshape(-1, engine.model.nv)[row]
            speed, gain = jacobian @ engine.data.qvel, jacobian @ engine.data.qacc
            foot = engine.model.geom(int(engine.data.contact.geom[number, 1])).name
            law = engine.laws[foot]
            depth = -float(engine.data.contact.dist[number])
            due = law.stiffness * depth - law.damping * speed - law.dragged * gain
            assert force == pytest.approx(due, rel=1e-4)
            pressed += 1
        assert pressed == 4
        assert law.stiffness == 5e4
        assert law.damping == 1e3
        # Far less than the foot's own 0.18 kg.
        assert law.dragged < 0.02


def test_a_robot_that_stands_is_borne_by_the_ground() -> None:
    robot = load_robot("sc618")
    engine = SpaceEngine(SpaceRobot(robot))
    start = standing_start(engine.space)
    engine.set_down(start)
    aims = np.array([start.angles[name] for name in engine.space.motors])
    for _ in range(24000):
        off = aims - engine.angles[engine.driven]
        engine.data.ctrl[:] = 300 * off - 2 * engine.rates[engine.driven]
        engine.advance()
    assert np.abs(engine.data.qvel).max() < 1e-4
    weight = robot.linkage.mass * robot.linkage.gravity
    assert engine.forces()[:, 2].sum() == pytest.approx(weight, rel=1e-4)
    # The ground is a spring there.
    assert engine.normals == pytest.approx(5e4 * engine.depths, rel=1e-3)
    assert engine.forces()[:2, 1].sum() == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize(("tangent", "slides"), [(0.25, False), (0.35, True)])
def test_feet_stick_within_the_cone_and_slide_beyond_it(tangent: float, slides: bool) -> None:
    engine = SpaceEngine(SpaceRobot(load_robot("sc618", {"friction": 0.3})))
    start = standing_start(engine.space)
    engine.set_down(start)
    aims = np.array([start.angles[name] for name in engine.space.motors])
    # A slope is gravity that leans.
    angle = np.arctan(tangent)
    engine.model.opt.gravity[:] = 9.81 * np.array([np.sin(angle), 0, -np.cos(angle)])
    before = engine.look()["foot"][:, 0]
    for _ in range(2000):
        off = aims - engine.angles[engine.driven]
        engine.data.ctrl[:] = 1000 * off - 3 * engine.rates[engine.driven]
        engine.advance()
    went = engine.look()["foot"][:, 0] - before
    # Without friction it would be g t^2 sin / 2 = 0.3 m; what is left is a tenth of g.
    assert (went.min() > 0.05) if slides else (np.abs(went).max() < 0.02)


def test_what_is_written_is_what_runs() -> None:
    space = SpaceRobot(load_robot("sc618"))
    spec = specification(mujoco, space)
    ours, written = spec.compile(), mujoco.MjModel.from_xml_string(spec.to_xml())
    assert (written.nq, written.nv, written.nu) == (20, 19, 12)
    assert written.npair == 4
    # Files carry six digits.
    assert written.body_mass.sum() == pytest.approx(space.robot.linkage.mass, rel=1e-5)
    assert written.qpos0 == pytest.approx(ours.qpos0, abs=1e-4)
    assert written.jnt_axis == pytest.approx(ours.jnt_axis, abs=1e-4)
    assert written.jnt_stiffness == pytest.approx(ours.jnt_stiffness)
    assert written.pair_solref == pytest.approx(ours.pair_solref, rel=1e-4)
    assert written.opt.impratio == ours.opt.impratio


def test_the_drawn_robot_stands_on_its_feet() -> None:
    engine = SpaceEngine(SpaceRobot(load_robot("sc618")))
    engine.forward()
    # The posture of the description itself, before anybody has set the robot down.
    assert engine.lowest > 0.05
    assert np.abs(engine.depths) == pytest.approx(np.zeros(4), abs=5e-3)
    hips = engine.look()["link_start"][[2, 4, 6, 8]]
    assert hips[:, 1] == pytest.approx([0.13, -0.13, 0.13, -0.13])
    assert hips[:, 2] == pytest.approx(np.full(4, 0.8 * 0.41), abs=1e-12)


def test_held_it_stands_by_itself_and_limp_it_sinks() -> None:
    space = SpaceRobot(load_robot("sc618"))
    heights = []
    for hold in (True, False):
        model = specification(mujoco, space, hold=hold).compile()
        data = mujoco.MjData(model)
        for _ in range(round(1.0 / model.opt.timestep)):
            mujoco.mj_step(model, data)
        heights.append(data.subtree_com[1, 2])
    assert heights[0] > 0.27
    assert heights[1] < 0.1


def test_two_legs_in_one_place_are_refused(tmp_path: Path) -> None:
    text = (files("flexspine") / "robots" / "sc618.toml").read_text()
    (tmp_path / "odd.toml").write_text(text.replace('side = "right"', 'side = "left"', 1))
    with pytest.raises(ParameterError, match=r"legs\.hind_2 and legs\.hind_1 are at one hip"):
        SpaceRobot(load_robot(tmp_path / "odd.toml"))


def test_abduction_swings_the_foot_to_the_left() -> None:
    engine = SpaceEngine(SpaceRobot(load_robot("sc618")), ground=False)
    start = standing_start(engine.space)
    for leg, foot in (("hind_1", 0), ("fore_2", 3)):
        engine.place(start)
        engine.forward()
        before = engine.look()["foot"][foot].copy()
        engine.place(start._replace(angles=start.angles | {f"{leg}_abduction": 0.3}))
        engine.forward()
        after = engine.look()["foot"][foot]
        assert after[1] > before[1] + 0.05
        assert after[0] == pytest.approx(before[0], abs=1e-12)


def test_boxes_give_bodies_their_inertia() -> None:
    parts = {part.name: part for part in SpaceRobot(load_robot("sc618")).parts}
    # 8.1 kg of 0.3 x 0.3 x 0.15 m: m/12 times sums of squares.
    box = 8.1 / 12 * np.array([0.09 + 0.0225, 0.09 + 0.0225, 0.09 + 0.09])
    assert parts["hind_trunk"].inertia == pytest.approx(box)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"hip_2.stiffness": 5.0}, "hip_2.stiffness acts between two thighs"),
        ({"hip_2.damping": 5.0}, "hip_2.damping acts between two thighs"),
    ],
)
def test_springs_between_thighs_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        SpaceRobot(load_robot("sc618", change))


def test_a_law_without_damping_is_a_spring() -> None:
    ground = SpaceRobot(
        load_robot("sc618", {"space.ground_damping": 0.0, "space.ground_stiffness": 1e4})
    ).numbers
    law = ContactLaw.of(ground, 2.0)
    assert (law.stiffness, law.damping) == (1e4, 0.0)
    assert law.solref[1] == 0.0


def test_a_robot_that_is_described_in_the_plane_only_is_refused(tmp_path: Path) -> None:
    text = (files("flexspine") / "robots" / "sc618.toml").read_text()
    plain = tmp_path / "flat.toml"
    plain.write_text(text[: text.index("[space]")])
    with pytest.raises(ParameterError, match=r"'flat' is described in the plane only.*\[space\]"):
        SpaceRobot(load_robot(plain))
    one_sided = tmp_path / "odd.toml"
    one_sided.write_text(text.replace('side = "right"', "", 1))
    with pytest.raises(ParameterError, match=r"legs\.hind_2 is on no side"):
        SpaceRobot(load_robot(one_sided))
