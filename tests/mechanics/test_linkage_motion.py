"""The motion of a linkage in symbols, against the same solved in numbers."""

from __future__ import annotations

from functools import cache

import heyoka as hy
import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray

from flexspine import load_robot
from flexspine.hybrid.lowering import Lowering
from flexspine.mechanics.linkage import Linkage
from flexspine.mechanics.linkage_motion import SETTLING, LinkageMotion, MaybeStanding, Standing
from flexspine.mechanics.stance import constrained, passive_forces
from tests.mechanics.test_linkage import uneven

Array = NDArray[np.float64]

STANCES = [[], ["toe_2"], ["toe_1", "toe_3"], ["toe_1", "toe_2", "toe_4"]]


def absolute(linkage: Linkage, q: Array) -> Array:
    """Absolute angles and the base."""
    return np.concatenate([linkage.angles(q), q[-2:]])


FRICTION = 0.7


class Compiled:
    """Accelerations and forces as a function of states, torques, anchors, and flags if any."""

    def __init__(self, linkage: Linkage, feet: list[str], flagged: bool = False) -> None:
        motion = LinkageMotion(linkage, FRICTION)
        torques = {j.name: sp.Symbol(f"t_{j.name}") for j in linkage.joints if j.actuated}
        anchors = {name: sp.symbols(f"x_{name} y_{name}") for name in feet}
        flags = [sp.symbols(f"stands_{name} slides_{name}") for name in feet]
        standing: list[Standing] = [Standing(name, anchors[name]) for name in feet]
        if flagged:
            standing = [
                MaybeStanding(name, anchors[name], *flag)
                for name, flag in zip(feet, flags, strict=True)
            ]
        definitions, accelerations, pushes = motion.stance(standing, torques)
        forces = [part for name in feet for part in pushes[name]]
        inputs = [*motion.coordinates, *motion.rates, *torques.values()]
        inputs += [part for anchor in anchors.values() for part in anchor]
        inputs += [part for flag in flags for part in flag] if flagged else []
        variables = [hy.expression(f"v{i}") for i in range(len(inputs))]
        known = dict(zip(inputs, variables, strict=True))
        lower = Lowering(known, tuple(motion.values), definitions, 0)
        outputs = [lower(each) for each in (*accelerations, *forces)]
        self.function = hy.cfunc(outputs, vars=variables)
        self.numbers = np.array([float(c.xreplace(motion.values)) for c in lower.coefficients])
        self.size = linkage.size

    def __call__(self, *states: Array) -> tuple[Array, Array]:
        found = self.function(np.concatenate(states), pars=self.numbers)
        return found[: self.size], found[self.size :].reshape(-1, 2)


@cache
def robot_on(feet: tuple[str, ...], flagged: bool = False) -> Compiled:
    """The ten-link robot on these feet."""
    return Compiled(load_robot("sc618").linkage, list(feet), flagged)


def assert_same_motion(
    compiled: Compiled, linkage: Linkage, feet: list[str], torque: float
) -> None:
    rng = np.random.default_rng(11)
    for _ in range(100):
        q, rates = rng.uniform(-1.5, 1.5, linkage.size), rng.normal(0, 2, linkage.size)
        torques = rng.normal(0, torque, linkage.actuation.shape[1])
        anchors = np.array([linkage.foot(q, name) for name in feet]).ravel()
        if feet:
            # What settles drift has nothing to do where there is none.
            rates -= np.linalg.pinv(jac := linkage.foot_jacobian(q, feet)) @ (jac @ rates)
        here = absolute(linkage, q), absolute(linkage, rates)
        accelerations, forces = compiled(*here, torques, anchors)
        expected = constrained(linkage, q, rates, feet, torques)
        size = np.abs(expected.accelerations).max()
        np.testing.assert_allclose(
            accelerations, absolute(linkage, expected.accelerations), atol=1e-11 * size
        )
        if feet:
            most = np.abs(expected.forces).max()
            np.testing.assert_allclose(forces, expected.forces, atol=1e-10 * most)


@pytest.mark.parametrize("feet", STANCES, ids=lambda feet: "+".join(feet) or "none")
def test_the_robot_moves_as_in_numbers(feet: list[str]) -> None:
    assert_same_motion(robot_on(tuple(feet)), load_robot("sc618").linkage, feet, 5.0)


@pytest.mark.parametrize("feet", [[], ["f"], ["f", "h"]], ids=lambda feet: "+".join(feet) or "none")
def test_an_uneven_tree_moves_as_in_numbers(feet: list[str]) -> None:
    assert_same_motion(Compiled(uneven(), feet), uneven(), feet, 1.0)


TOES = ("toe_1", "toe_2", "toe_3", "toe_4")


@pytest.mark.parametrize("standing", STANCES, ids=lambda feet: "+".join(feet) or "none")
def test_flags_tell_feet_that_stand_from_those_in_the_air(standing: list[str]) -> None:
    linkage = load_robot("sc618").linkage
    plain, flagged = robot_on(tuple(standing)), robot_on(TOES, flagged=True)
    flags = np.array([[float(toe in standing), 0.0] for toe in TOES]).ravel()
    rng = np.random.default_rng(4)
    for _ in range(20):
        q, rates = rng.uniform(-1.5, 1.5, 12), rng.normal(0, 2, 12)
        here = absolute(linkage, q), absolute(linkage, rates), rng.normal(0, 5, 8)
        anchors = {toe: linkage.foot(q, toe) for toe in TOES}
        few = np.array([anchors[toe] for toe in standing]).ravel()
        expected = plain(*here, few)
        found = flagged(*here, np.array(list(anchors.values())).ravel(), flags)
        size = np.abs(expected[0]).max()
        np.testing.assert_allclose(found[0], expected[0], atol=1e-11 * size)
        for toe, force in zip(TOES, found[1], strict=True):
            wanted = expected[1][standing.index(toe)] if toe in standing else [0.0, 0.0]
            np.testing.assert_allclose(force, wanted, atol=1e-9 * size)


@pytest.mark.parametrize("slides", [{"toe_1": 1}, {"toe_1": -1, "toe_4": 1}], ids=str)
def test_feet_that_slide_obey_friction_and_momentum(slides: dict[str, int]) -> None:
    """And do not rise; those that stick do not move."""
    linkage = load_robot("sc618").linkage
    feet = ["toe_1", "toe_4"]
    compiled = robot_on(TOES, flagged=True)
    flags = np.array([[float(toe in feet), slides.get(toe, 0)] for toe in TOES]).ravel()
    rng = np.random.default_rng(7)
    for _ in range(50):
        q, rates = rng.uniform(-1.5, 1.5, 12), rng.normal(0, 2, 12)
        torques = rng.normal(0, 5, 8)
        jacobian = linkage.foot_jacobian(q, feet)
        kept = [row for i, foot in enumerate(feet) for row in (2 * i, 2 * i + 1)
                if row % 2 or foot not in slides]  # fmt: skip
        rates -= np.linalg.pinv(jacobian[kept]) @ (jacobian[kept] @ rates)
        anchors = np.array([linkage.foot(q, name) for name in TOES]).ravel()
        here = absolute(linkage, q), absolute(linkage, rates)
        accelerations, all_forces = compiled(*here, torques, anchors, flags)
        forces = all_forces[[TOES.index(foot) for foot in feet]]
        moved = np.linalg.solve(linkage.to_absolute, accelerations)
        inertia = linkage.mass_matrix(q) @ moved + passive_forces(linkage, q, rates)
        given = linkage.actuation @ torques + jacobian.T @ forces.ravel()
        np.testing.assert_allclose(inertia, given, atol=1e-10 * np.abs(forces).max())
        drift = jacobian @ moved + linkage.foot_bias(q, rates, feet)
        assert np.abs(drift[kept]).max() <= 1e-10 * np.abs(accelerations).max()
        for foot, way in slides.items():
            tangent, normal = forces[feet.index(foot)]
            assert tangent == pytest.approx(-way * FRICTION * normal)


def test_drift_of_a_foot_dies_away() -> None:
    """Off its anchor by e and moving by v, it accelerates by -2 w v - w^2 e."""
    linkage = load_robot("sc618").linkage
    compiled = robot_on(("toe_2",))
    rng = np.random.default_rng(5)
    q, rates = rng.uniform(-1.5, 1.5, 12), rng.normal(0, 2, 12)
    off = np.array([1e-3, -2e-3])
    place = linkage.foot(q, "toe_2")
    here = absolute(linkage, q), absolute(linkage, rates)
    accelerations, _ = compiled(*here, np.zeros(8), place - off)
    moved = np.linalg.solve(linkage.to_absolute, accelerations)
    jacobian = linkage.foot_jacobian(q, ["toe_2"])
    found = jacobian @ moved + linkage.foot_bias(q, rates, ["toe_2"])
    expected = -2 * SETTLING * (jacobian @ rates) - SETTLING**2 * off
    assert found == pytest.approx(expected, rel=1e-9)


def test_one_build_serves_robots_of_other_numbers() -> None:
    """The expressions name no numbers; only what vanishes leaves them."""
    texts = [
        sp.srepr(LinkageMotion(load_robot("sc618", {"spine.stiffness": k}).linkage).forces({})[5])
        for k in (200, 300)
    ]
    assert texts[0] == texts[1]
    locked = LinkageMotion(load_robot("sc618", {"spine.stiffness": 0}).linkage).forces({})[5]
    assert sp.srepr(locked) != texts[0]


def test_feet_are_where_they_are_in_numbers() -> None:
    linkage = load_robot("sc618").linkage
    motion = LinkageMotion(linkage)
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.5, 1.5, 12)
    known = dict(zip(motion.coordinates, absolute(linkage, q), strict=True))
    for foot in linkage.feet:
        place = [sp.sympify(part) for part in motion.foot(foot.name)]
        found = [
            float(part.subs(motion.definitions).subs(motion.values).subs(known)) for part in place
        ]
        assert found == pytest.approx(linkage.foot(q, foot.name), abs=1e-14)


def test_a_robot_pinned_by_one_foot_keeps_its_energy_and_its_foot() -> None:
    """Without a damper; let go from a crouch it swings wildly for ten seconds."""
    linkage = load_robot("sc618", {"spine.damping": 0}).linkage
    motion = LinkageMotion(linkage)
    toe = Standing("toe_1", (sp.S.Zero, sp.S.Zero))
    definitions, accelerations, _ = motion.stance([toe], {})
    inputs = [*motion.coordinates, *motion.rates]
    variables = [hy.expression(f"v{i}") for i in range(24)]
    known = dict(zip(inputs, variables, strict=True))
    lower = Lowering(known, tuple(motion.values), definitions, 0)
    rates = [lower(each) for each in accelerations]
    field = [
        *zip(variables[:12], variables[12:], strict=True),
        *zip(variables[12:], rates, strict=True),
    ]
    q = np.zeros(12)
    turns = {"knee_1": -0.9, "hip_1": -1.02, "hip_2": -3.04, "knee_2": 0.9, "hip_3": -2.12,
             "knee_3": 0.9, "hip_4": -2.02, "knee_4": 0.9}  # fmt: skip
    q[0] = 1.92
    for name, turn in turns.items():
        q[linkage.place[name]] = turn
    integrator = hy.taylor_adaptive(
        field,
        [*absolute(linkage, q), *np.zeros(12)],
        tol=1e-12,
        compact_mode=True,
        pars=[float(c.xreplace(motion.values)) for c in lower.coefficients],
    )
    relative = np.linalg.inv(np.array([absolute(linkage, row) for row in np.eye(12)]).T)
    start = float(linkage.potential_energy(q))
    most, drift = 0.0, 0.0
    for second in np.linspace(0.1, 10, 100):
        integrator.propagate_until(second)
        here, speed = relative @ integrator.state[:12], relative @ integrator.state[12:]
        kinetic = float(linkage.kinetic_energy(here, speed))
        most = max(most, kinetic)
        drift = max(drift, abs(kinetic + float(linkage.potential_energy(here)) - start))
        assert np.abs(linkage.foot(here, "toe_1")).max() <= 1e-12
    assert most > 10
    assert drift <= 1e-10 * most
