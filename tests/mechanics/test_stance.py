"""Pinned feet: what Newton and Euler say of the whole body, and what pinned means."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import load_robot
from flexspine.mechanics.stance import constrained, tracked

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
