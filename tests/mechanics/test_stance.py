"""Pinned feet: what Newton and Euler say of the whole body, and what pinned means."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import nnls

from flexspine import load_robot
from flexspine.mechanics.complementarity import Contact, Verdict
from flexspine.mechanics.stance import constrained, stopped, supported, tracked
from tests.mechanics.test_linkage import Engine

Array = NDArray[np.float64]

ROBOT = load_robot("sc618").linkage
TOES = [foot.name for foot in ROBOT.feet]
HIND, FORE = TOES[:2], TOES[2:]

SETS = [[], *([toe] for toe in TOES), *map(list, combinations(TOES, 2)), TOES[:3], TOES]


def states(count: int, seed: int) -> Iterator[tuple[Array, Array, Array]]:
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(-1.5, 1.5, 12), rng.normal(0, 2, 12), rng.normal(0, 5, 8)


def momentum(q: Array, rates: Array) -> Array:
    """Of the whole body: x, y and about the origin, link by link."""
    total = np.zeros(3)
    spins = ROBOT.angles(rates)
    parts = [(link.name, link.com, link.mass, link.inertia) for link in ROBOT.links]
    parts += [(foot.link, foot.at, foot.mass, 0.0) for foot in ROBOT.feet]
    for name, distance, mass, inertia in parts:
        place = ROBOT.point(q, name, distance)
        arms, angles = ROBOT.arms(name, distance), ROBOT.angles(q)
        velocity = rates[-2:] + np.array(
            [-np.sin(angles) @ (arms * spins), np.cos(angles) @ (arms * spins)]
        )
        spin = mass * (place[0] * velocity[1] - place[1] * velocity[0])
        total += [*(mass * velocity), spin + inertia * spins[ROBOT.place[name]]]
    return total


@pytest.mark.parametrize("feet", SETS, ids=lambda feet: "+".join(feet) or "none")
def test_only_weight_and_the_feet_push_the_body(feet: list[str]) -> None:
    """Motors, springs and dampers are inside: they change no momentum of the whole."""
    h = 1e-5
    for q, rates, torques in states(20, 1):
        found = constrained(ROBOT, q, rates, feet, torques)
        ahead, behind = (
            momentum(
                q + s * rates * h + found.accelerations * h * h / 2,
                rates + s * found.accelerations * h,
            )
            for s in (1, -1)
        )
        change = (ahead - behind) / (2 * h)
        places = [ROBOT.foot(q, name) for name in feet]
        push = np.array([*found.forces.sum(axis=0), 0.0])
        push[1] -= ROBOT.mass * ROBOT.gravity
        push[2] -= ROBOT.com(q)[0] * ROBOT.mass * ROBOT.gravity
        for place, force in zip(places, found.forces, strict=True):
            push[2] += place[0] * force[1] - place[1] * force[0]
        size = 1 + np.abs(found.accelerations).max()
        np.testing.assert_allclose(change, push, atol=1e-6 * size)


@pytest.mark.parametrize("feet", SETS[1:], ids="+".join)
def test_pinned_feet_do_not_accelerate(feet: list[str]) -> None:
    for q, rates, torques in states(50, 2):
        found = constrained(ROBOT, q, rates, feet, torques)
        acceleration = ROBOT.foot_jacobian(q, feet) @ found.accelerations
        acceleration += ROBOT.foot_bias(q, rates, feet)
        size = 1 + np.abs(found.accelerations).max()
        assert np.abs(acceleration).max() <= 1e-12 * size


REGULAR = [[], *([toe] for toe in TOES), *([hind, fore] for hind in HIND for fore in FORE)]


@pytest.mark.parametrize("feet", REGULAR, ids=lambda feet: "+".join(feet) or "none")
def test_motors_accelerate_their_joints_as_wanted(feet: list[str]) -> None:
    rng = np.random.default_rng(3)
    for q, rates, _ in states(20, 3):
        wanted = rng.normal(0, 10, 8)
        found = tracked(ROBOT, q, rates, feet, wanted)
        size = 1 + np.abs(found.accelerations).max()
        reached = ROBOT.actuation.T @ found.accelerations
        np.testing.assert_allclose(reached, wanted, atol=1e-9 * size)
        # With these torques, and nothing but pinned feet, the body moves like that.
        again = constrained(ROBOT, q, rates, feet, found.torques)
        np.testing.assert_allclose(again.accelerations, found.accelerations, atol=1e-7 * size)
        np.testing.assert_allclose(again.forces, found.forces, atol=1e-6 * size)


@pytest.mark.parametrize("feet", [HIND, FORE, TOES[:3], TOES[1:], TOES], ids="+".join)
def test_feet_of_one_hip_or_more_than_two_hold_what_is_to_move(feet: list[str]) -> None:
    for q, rates, _ in states(5, 4):
        with pytest.raises(np.linalg.LinAlgError, match="hold"):
            tracked(ROBOT, q, rates, feet, np.zeros(8))


def test_it_is_singular_where_toes_and_spine_are_in_line() -> None:
    """|(fore toe - hind toe) x (spine - hind toe)| is the determinant that tells."""
    passive = [ROBOT.place["shank_1"], ROBOT.place["spine"], 10, 11]
    for q, _, _ in states(50, 5):
        jacobian = ROBOT.foot_jacobian(q, ["toe_1", "toe_3"])[:, passive]
        hind, fore = ROBOT.foot(q, "toe_1"), ROBOT.foot(q, "toe_3")
        spine = ROBOT.point(q, "hind_trunk", 0.3)
        across, up = fore - hind, spine - hind
        area = abs(across[0] * up[1] - across[1] * up[0])
        assert abs(np.linalg.det(jacobian)) == pytest.approx(area, abs=1e-13)


ENGINE = Engine(ROBOT)


def at_rest(rates: Array, rows: Array) -> Array:
    """The rates without what these rows move."""
    return rates - np.linalg.pinv(rows) @ (rows @ rates)


def free(q: Array, rates: Array, torques: Array) -> tuple[Array, Array]:
    """The mass matrix and the accelerations without any ground."""
    spine = ROBOT.place["spine"]
    applied = -ENGINE.forces(q, rates)
    applied[spine] -= 240.0 * (q[spine] + 0.05) + 2.0 * rates[spine]
    motors = [joint.name for joint in ROBOT.joints if joint.actuated]
    applied[[ROBOT.place[name] for name in motors]] += torques
    inertia = ENGINE.mass_matrix(q)
    return inertia, np.linalg.solve(inertia, applied)


def standing(
    count: int, seed: int
) -> Iterator[tuple[Array, Array, Array, list[str], Array, Array]]:
    """Random states with one to four feet at rest: q, rates, torques, feet, J and J' q'."""
    rng = np.random.default_rng(seed)
    for q, rates, torques in states(count, seed):
        feet = sorted(rng.permutation(TOES)[: rng.integers(1, 5)].tolist())
        jacobian = np.vstack([ENGINE.foot(foot, q, rates)[1] for foot in feet])
        slow = at_rest(rates, jacobian)
        bias = np.concatenate([ENGINE.foot(foot, q, slow)[2] for foot in feet])
        yield q, slow, torques, feet, jacobian, bias


def test_on_ice_the_body_strays_least_from_where_it_would_fall() -> None:
    """Gauss: of accelerations by which no foot sinks, those nearest to the free ones.

    The distance is measured by the mass matrix; its dual are least squares with forces that push.
    """
    lifted = 0
    for q, rates, torques, feet, jacobian, bias in standing(300, 6):
        moving = [None] * len(feet)
        found, accelerations = supported(ROBOT, q, rates, feet, torques, 0.0, moving)
        inertia, alone = free(q, rates, torques)
        rows = jacobian[1::2]
        root = np.linalg.cholesky(inertia)
        spread = np.linalg.solve(root, rows.T)
        sinking = rows @ alone + bias[1::2]
        # |spread f + c|^2 with spread' c = sinking is the dual's.
        centre = spread @ np.linalg.solve(spread.T @ spread, sinking)
        forces, _ = nnls(spread, -centre)
        expected = alone + np.linalg.solve(inertia, rows.T @ forces)
        size = np.abs(expected).max()
        np.testing.assert_allclose(accelerations, expected, rtol=0, atol=1e-9 * size)
        most = np.abs(forces).max(initial=1.0)
        np.testing.assert_allclose(found.pushes[:, 1], forces, rtol=0, atol=1e-9 * most)
        assert np.abs(found.pushes[:, 0]).max() <= 1e-12 * most
        lifted += sum(does is Contact.OPEN for does in found.contacts)
    assert lifted > 50


@pytest.mark.parametrize("friction", [0.2, 0.8])
def test_feet_at_rest_stay_slip_or_lift_off_as_forces_allow(friction: float) -> None:
    """Newton, Signorini and Coulomb, by accelerations."""
    seen = dict.fromkeys(Contact, 0)
    for q, rates, torques, feet, jacobian, bias in standing(500, 7):
        moving = [None] * len(feet)
        found, accelerations = supported(ROBOT, q, rates, feet, torques, friction, moving)
        assert found.verdict is not Verdict.NONE
        inertia, alone = free(q, rates, torques)
        size = np.abs(accelerations).max()
        gained = inertia @ (accelerations - alone)
        most = np.abs(found.pushes).max(initial=1.0)
        np.testing.assert_allclose(gained, jacobian.T @ found.pushes.ravel(), atol=1e-9 * most)
        moves = (jacobian @ accelerations + bias).reshape(-1, 2)
        for does, (tangent, normal), (along, up) in zip(
            found.contacts, found.pushes, moves, strict=True
        ):
            seen[does] += 1
            assert normal >= -1e-9 * most
            assert up >= -1e-9 * size
            assert abs(normal * up) <= 1e-9 * most * size
            assert abs(tangent) <= friction * normal + 1e-9 * most
            if does is Contact.STICK:
                assert abs(along) <= 1e-9 * size
            elif does is not Contact.OPEN:
                way = 1 if does is Contact.SLIDE_FORWARD else -1
                assert way * along >= -1e-9 * size
                assert tangent == pytest.approx(-way * friction * normal, abs=1e-9 * most)
    assert min(seen.values()) > 30


def test_feet_that_slide_keep_the_direction_of_their_friction() -> None:
    """Whatever way they accelerate; the others are at rest."""
    rng = np.random.default_rng(8)
    braked = kept = 0
    for q, rates, torques in states(500, 8):
        feet = sorted(rng.permutation(TOES)[:2].tolist())
        jacobian = np.vstack([ENGINE.foot(foot, q, rates)[1] for foot in feet])
        slow = at_rest(rates, jacobian[1:])  # the first slides, and neither rises
        bias = np.concatenate([ENGINE.foot(foot, q, slow)[2] for foot in feet])
        way = 1 if jacobian[0] @ slow > 0 else -1
        moving = Contact.SLIDE_FORWARD if way > 0 else Contact.SLIDE_BACK
        found, accelerations = supported(ROBOT, q, slow, feet, torques, 0.3, [moving, None])
        assert found.verdict is not Verdict.NONE
        assert found.contacts[0] in (moving, Contact.OPEN)
        inertia, alone = free(q, slow, torques)
        most = np.abs(found.pushes).max(initial=1.0)
        gained = inertia @ (accelerations - alone)
        np.testing.assert_allclose(gained, jacobian.T @ found.pushes.ravel(), atol=1e-9 * most)
        tangent, normal = found.pushes[0]
        assert tangent == pytest.approx(-way * 0.3 * normal, abs=1e-9 * most)
        moves = (jacobian @ accelerations + bias).reshape(-1, 2)
        assert moves[:, 1].min() >= -1e-9 * np.abs(accelerations).max()
        if found.contacts[0] is moving:
            assert normal >= 0
            assert abs(moves[0, 1]) <= 1e-9 * np.abs(accelerations).max()
            braked += way * moves[0, 0] < 0
            kept += way * moves[0, 0] > 0
    assert braked > 50
    assert kept > 50


def test_what_is_stopped_changes_the_motion_least() -> None:
    """What is left moves freely on: the change has no momentum along any of it."""
    rng = np.random.default_rng(9)
    for q, rates, _ in states(100, 9):
        feet = rng.permutation(TOES)[: rng.integers(1, 5)].tolist()
        rows = np.vstack([ENGINE.foot(foot, q, rates)[1] for foot in feet])
        rows = rows[rng.random(len(rows)) < 0.7]
        if not len(rows):
            continue
        again = np.vstack([rows, rows[:1]])  # what is named twice is stopped once
        inertia = ENGINE.mass_matrix(q)
        for named in (rows, again):
            after = stopped(ROBOT, q, rates, named)
            size = np.abs(rates).max()
            assert np.abs(rows @ after).max() <= 1e-10 * size
            change = inertia @ (after - rates)
            assert (
                np.abs(null_space(rows).T @ change).max() <= 1e-10 * np.abs(inertia @ rates).max()
            )
            lost = (rates @ inertia @ rates - after @ inertia @ after) / 2
            assert lost == pytest.approx((after - rates) @ change / 2, abs=1e-10)
