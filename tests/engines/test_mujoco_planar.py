"""Robots in MuJoCo have our masses and forces, once its coordinates are ours."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import MachineError, load_robot
from flexspine.engines.mujoco_planar import PinnedMujoco
from flexspine.mechanics.linkage import Foot, Link, Linkage
from tests.mechanics.test_linkage import uneven

Array = NDArray[np.float64]

# Relative; both sides round.
SAME = 1e-10

PINNED = [("sc618", foot) for foot in ("toe_1", "toe_2", "toe_3", "toe_4")]
PINNED += [("uneven", foot) for foot in ("f", "g", "h")]


class Pinned:
    """A linkage whose foot is held by constraints, in the coordinates of its model in MuJoCo."""

    def __init__(self, linkage: Linkage, foot: str) -> None:
        self.linkage, self.foot = linkage, foot
        self.engine = PinnedMujoco(linkage, foot)
        self.model, self.data = self.engine.model, self.engine.data

    def states(self, count: int = 200) -> Iterator[tuple[Array, Array, Array]]:
        """Random states: our ``q``, our rates, and by what our rates follow from MuJoCo's."""
        rng = np.random.default_rng(5)
        for _ in range(count):
            self.data.qpos[:] = rng.uniform(-np.pi, np.pi, self.model.nq)
            self.data.qvel[:] = rng.normal(0.0, 5.0, self.model.nv)
            mujoco.mj_forward(self.model, self.data)
            q, by = self._ours()
            yield q, by @ self.data.qvel, by

    def _ours(self) -> tuple[Array, Array]:
        """Absolute angles as MuJoCo turned its bodies, and the base that keeps the foot at zero."""
        linkage, n = self.linkage, len(self.linkage.links)
        absolute, turning = np.zeros(n + 2), np.zeros((n + 2, n))
        for i, link in enumerate(linkage.links):
            body = self.model.body(link.name).id
            frame = self.data.xmat[body].reshape(3, 3)
            absolute[i] = np.arctan2(frame[1, 0], frame[0, 0])
            spin = np.zeros((3, n))
            mujoco.mj_jacBody(self.model, self.data, None, spin, body)
            turning[i] = spin[2]
        back = np.linalg.inv(linkage.to_absolute)
        q = back @ absolute
        q[-2:] -= linkage.foot(q, self.foot)
        by = back @ turning
        by[-2:] -= linkage.foot_jacobian(q, [self.foot]) @ by
        return q, by


@pytest.fixture(params=PINNED, ids="-".join)
def pinned(request: pytest.FixtureRequest) -> Pinned:
    name, foot = request.param
    # Angles are only known up to whole turns here, which springs would feel; see below.
    linkage = load_robot("sc618").linkage if name == "sc618" else uneven()
    return Pinned(linkage, foot)


def close(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=SAME * np.abs(expected).max())


def test_mass_matrices_are_ours(pinned: Pinned) -> None:
    matrix = np.zeros((pinned.model.nv, pinned.model.nv))
    for q, _, by in pinned.states():
        mujoco.mj_fullM(pinned.model, pinned.data, matrix)
        close(matrix, by.T @ pinned.linkage.mass_matrix(q) @ by)


def test_passive_forces_are_ours(pinned: Pinned) -> None:
    """Of motion, weight, springs and dampers; what moves the base comes with its acceleration."""
    linkage = pinned.linkage
    for q, rates, by in pinned.states():
        base = np.zeros(linkage.size)
        base[-2:] = -linkage.foot_bias(q, rates, [pinned.foot])
        turns = np.zeros(linkage.size)
        for joint in linkage.joints:
            place = linkage.place[joint.name]
            # Whole turns that the orientation of bodies does not tell.
            apart = by[place] @ pinned.data.qpos - q[place]
            turns[place] = joint.stiffness * 2 * np.pi * np.rint(apart / (2 * np.pi))
        forces = linkage.velocity_forces(q, rates) + linkage.potential_forces(q) + turns
        forces += linkage.damping_forces(rates) + linkage.mass_matrix(q) @ base
        close(pinned.data.qfrc_bias - pinned.data.qfrc_passive, by.T @ forces)


def test_energies_are_ours(pinned: Pinned) -> None:
    for q, rates, by in pinned.states(50):
        assert pinned.data.energy[1] == pytest.approx(
            float(pinned.linkage.kinetic_energy(q, rates)), rel=SAME
        )
        weight = pinned.linkage.mass * pinned.linkage.gravity * pinned.linkage.com(q)[1]
        springs = sum(
            joint.stiffness
            * (by[pinned.linkage.place[joint.name]] @ pinned.data.qpos - joint.rest) ** 2
            / 2
            for joint in pinned.linkage.joints
        )
        assert pinned.data.energy[0] == pytest.approx(float(weight) + springs, rel=1e-9)


def test_nothing_but_rigid_bodies_springs_and_dampers_acts(pinned: Pinned) -> None:
    for _ in pinned.states(5):
        assert pinned.data.nefc == 0, "no contact, no limit, no equality"
    assert pinned.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert pinned.model.nq == len(pinned.linkage.links), "held by its joints alone"


def test_a_point_mass_on_a_rod_is_a_mathematical_pendulum() -> None:
    """All mass in a foot at its end: it swings by w^2 = g / l where angles are small."""
    rod = Linkage(
        (Link("rod", 2.0, 1e-9, 1.0, 0.0),),
        (),
        (Foot("pivot", "rod", 0.0), Foot("bob", "rod", 2.0, 3.0)),
        9.81,
    )
    start, period = np.array([-np.pi / 2 + 1e-3]), 2 * np.pi * np.sqrt(2.0 / 9.81)
    motion = PinnedMujoco(rod, "pivot").run(start, period / 1000, 1000, 250)
    swung = motion.angles[:, 0] + np.pi / 2
    assert swung == pytest.approx([1e-3, 0.0, -1e-3, 0.0, 1e-3], abs=1e-8)
    assert motion.energies[0] == pytest.approx(-3.0 * 9.81 * 2.0 * np.cos(1e-3), rel=1e-8)
    assert np.ptp(motion.energies) <= 1e-9


def test_a_run_that_diverges_says_so_by_nan_and_leaves_no_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    linkage = load_robot("sc618", {"spine.stiffness": 1e8}).linkage
    motion = PinnedMujoco(linkage, "toe_1").run(np.arange(10.0), 0.01, 100, 10)
    assert np.isnan(motion.angles[-1]).all()
    assert np.isfinite(motion.angles[0]).all()
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_a_run_can_be_done_again() -> None:
    engine = PinnedMujoco(load_robot("sc618").linkage, "toe_1")
    start = np.linspace(0, 1, 10)
    first = engine.run(start, 1e-3, 100, 50)
    assert np.array_equal(engine.run(start, 1e-3, 100, 50).angles, first.angles)
    assert first.angles[0] == pytest.approx(start, abs=1e-14)


def test_a_missing_mujoco_is_told_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MachineError, match=r"'mujoco' is not installed; pip install 'mujoco>"):
        PinnedMujoco(uneven(), "f")


@pytest.mark.parametrize("version", ["3.16.9", "4.0.0", "2.3.7", "4.1.0"])
def test_other_versions_are_refused(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco, "__version__", version)
    with pytest.raises(MachineError, match=f"mujoco {version} is installed"):
        PinnedMujoco(uneven(), "f")


@pytest.mark.parametrize("version", ["3.17.0", "3.18.1", "3.100.0"])
def test_versions_in_between_will_do(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco, "__version__", version)
    PinnedMujoco(uneven(), "f")
