"""Impacts against textbook ones, and against what contact laws say of any."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import load_robot
from flexspine.mechanics.complementarity import Contact, Verdict
from flexspine.mechanics.impact import Impact, impact
from flexspine.mechanics.linkage import Foot, Link, Linkage

Array = NDArray[np.float64]

LENGTH, MASS = 0.7, 2.0


def rod() -> Linkage:
    """A uniform rod with a foot at either end."""
    inertia = MASS * LENGTH**2 / 12
    link = Link("rod", LENGTH, MASS, LENGTH / 2, inertia)
    return Linkage((link,), (), (Foot("low", "rod", 0.0), Foot("high", "rod", LENGTH)), 9.81)


def falling(angle: float, speed: float) -> tuple[Array, Array]:
    """A rod that falls without turning."""
    return np.array([angle, 0.0, 0.0]), np.array([0.0, 0.0, -speed])


@pytest.mark.parametrize("angle", [0.1, 0.7, 1.2, np.pi / 2, 2.0])
def test_a_rod_on_smooth_ground(angle: float) -> None:
    """m v / (1 + 3 cos^2 a): the ground takes the velocity of the end away, and nothing else."""
    found = impact(rod(), *falling(angle, 3.0), ["low"], 0.0)
    assert found.verdict is Verdict.ONE
    push = MASS * 3.0 / (1 + 3 * np.cos(angle) ** 2)
    assert found.impulses == pytest.approx(np.array([[0.0, push]]), abs=1e-13)


@pytest.mark.parametrize("angle", [0.3, 1.1, 2.0])
def test_a_rod_whose_end_sticks_turns_about_it(angle: float) -> None:
    """Angular momentum about that end, m L^2/3 w, is that before, m v L/2 cos a."""
    found = impact(rod(), *falling(angle, 2.0), ["low"], None)
    spin = -3 * 2.0 * np.cos(angle) / (2 * LENGTH)
    assert found.contacts == (Contact.STICK,)
    assert found.rates == pytest.approx([spin, 0.0, 0.0], abs=1e-13)


def test_it_depends_on_friction_whether_the_end_sticks() -> None:
    """At a the impulse to stick is inclined by tan = 3 sin a cos a / (1 + 3 sin^2 a)."""
    angle = 0.6
    sine, cosine = np.sin(angle), np.cos(angle)
    limit = 3 * sine * cosine / (1 + 3 * sine**2)
    for friction, sticks in ((limit * 0.999, False), (limit * 1.001, True)):
        found = impact(rod(), *falling(angle, 1.0), ["low"], friction)
        assert (found.contacts[0] is Contact.STICK) == sticks
        tangent, normal = found.impulses[0]
        assert abs(tangent) <= friction * normal * (1 + 1e-12)
        assert tangent / normal == pytest.approx(min(friction, limit), rel=1e-9)


def test_a_foot_that_rises_is_let_go() -> None:
    q, rates = np.array([np.pi / 2, 0.0, 0.0]), np.array([0.0, 0.3, 0.2])
    found = impact(rod(), q, rates, ["low"], 0.8)
    assert found.contacts == (Contact.OPEN,)
    assert np.array_equal(found.rates, rates)
    assert not found.impulses.any()


def test_a_flat_fall_stops_both_ends() -> None:
    found = impact(rod(), *falling(0.0, 1.5), ["low", "high"], 0.5)
    assert found.verdict is Verdict.ONE
    assert found.impulses[:, 1] == pytest.approx([MASS * 1.5 / 2] * 2)
    assert found.rates == pytest.approx([0.0, 0.0, 0.0], abs=1e-14)


def random_impacts(
    friction: float | None, count: int, seed: int
) -> Iterator[tuple[Linkage, Array, Array, list[str], Impact]]:
    """Of one to four feet of the ten-link robot, in any posture."""
    linkage = load_robot("sc618").linkage
    names = [foot.name for foot in linkage.feet]
    rng = np.random.default_rng(seed)
    for _ in range(count):
        feet = rng.permutation(names)[: rng.integers(1, 5)].tolist()
        q, rates = rng.uniform(-np.pi, np.pi, 12), rng.normal(size=12)
        yield linkage, q, rates, feet, impact(linkage, q, rates, feet, friction)


@pytest.mark.parametrize(("friction", "seed"), [(0.8, 1), (0.5, 2), (0.2, 3), (0.0, 4)])
def test_random_impacts_obey_the_laws_of_contact(friction: float, seed: int) -> None:
    several = 0
    for linkage, q, rates, feet, found in random_impacts(friction, 1500, seed):
        assert found.verdict is not Verdict.NONE
        several += found.verdict is Verdict.SEVERAL
        jacobian = linkage.foot_jacobian(q, feet)
        after = (jacobian @ found.rates).reshape(-1, 2)
        impulses = found.impulses
        # Momentum: what the feet got is what the body has.
        change = linkage.mass_matrix(q) @ (found.rates - rates)
        np.testing.assert_allclose(change, jacobian.T @ impulses.ravel(), atol=1e-12)
        tangent, normal = impulses.T
        assert normal.min() >= 0 or abs(normal.min()) <= 1e-11 * np.abs(impulses).max()
        assert after[:, 1].min() >= -1e-11
        assert np.abs(normal * after[:, 1]).max() <= 1e-9
        assert np.all(np.abs(tangent) <= friction * normal + 1e-9)
        sliding = np.abs(after[:, 0]) > 1e-9
        assert np.all(tangent[sliding] * after[sliding, 0] <= 1e-9)
        slack = friction * normal - np.abs(tangent)
        assert np.abs(slack[sliding]).max(initial=0.0) <= 1e-9
        for does, velocity in zip(found.contacts, after, strict=True):
            if does is Contact.STICK:
                assert np.abs(velocity).max() <= 1e-12 * max(1.0, np.abs(rates).max())
        energy = linkage.kinetic_energy(q, rates)
        assert linkage.kinetic_energy(q, found.rates) <= energy * (1 + 1e-13)
    # Folded postures have more than one solution at high friction; few do.
    assert several <= 15


def test_without_sliding_solutions_are_often_missing_or_several() -> None:
    """12 to 34 % of random states have none where feet either stick or let go."""
    verdicts = [found.verdict for *_, found in random_impacts(None, 2000, 5)]
    assert 0.08 < verdicts.count(Verdict.NONE) / len(verdicts) < 0.34
    assert verdicts.count(Verdict.SEVERAL) > 0


def test_where_there_is_no_solution_nothing_happens() -> None:
    for _, _, rates, _, found in random_impacts(None, 200, 5):
        if found.verdict is Verdict.NONE:
            assert np.array_equal(found.rates, rates)
            assert not found.impulses.any()
