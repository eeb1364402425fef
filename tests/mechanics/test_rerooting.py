"""Linkages walked from one of their feet are the same mechanisms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexspine import load_robot
from flexspine.errors import UnknownNameError
from flexspine.mechanics.linkage import Linkage
from flexspine.mechanics.rerooting import rerooted
from tests.mechanics.test_linkage import close, states, uneven

Array = NDArray[np.float64]

MECHANISMS = [("sc618", foot) for foot in ("toe_1", "toe_2", "toe_3", "toe_4")]
MECHANISMS += [("uneven", foot) for foot in ("f", "g", "h")]


@pytest.fixture(params=MECHANISMS, ids="-".join)
def walked(request: pytest.FixtureRequest) -> tuple[Linkage, Linkage, str]:
    name, foot = request.param
    linkage = load_robot("sc618").linkage if name == "sc618" else uneven()
    return linkage, rerooted(linkage, foot), foot


def carried(linkage: Linkage, other: Linkage, angles: Array, base: Array) -> Array:
    """The other's ``q``, or its rates, with the same absolute angles and a base of its own."""
    by_name = dict(zip((link.name for link in linkage.links), angles, strict=True))
    absolute = [by_name[link.name] for link in other.links]
    return np.linalg.solve(other.to_absolute, np.concatenate([absolute, base]))


def test_the_same_motion_has_the_same_energies_and_losses(
    walked: tuple[Linkage, Linkage, str],
) -> None:
    linkage, other, foot = walked
    for q, rates in states(linkage, 100):
        speed = linkage.foot_jacobian(q, [foot]) @ rates
        there = carried(linkage, other, linkage.angles(q), linkage.foot(q, foot))
        moving = carried(linkage, other, linkage.angles(rates), speed)
        kinetic = linkage.kinetic_energy(q, rates)
        close(other.kinetic_energy(there, moving), kinetic)
        weighed = linkage.mass * linkage.gravity * 10
        close(other.potential_energy(there), linkage.potential_energy(q), weighed)
        close(moving @ other.damping_forces(moving), rates @ linkage.damping_forces(rates), 1e-3)


def test_every_point_stays_where_it_is(walked: tuple[Linkage, Linkage, str]) -> None:
    linkage, other, foot = walked
    assert other.foot_arms(foot) == pytest.approx(np.zeros(len(linkage.links))), "its base"
    lengths = {link.name: link.length for link in other.links}
    for q, _ in states(linkage, 20):
        there = carried(linkage, other, linkage.angles(q), linkage.foot(q, foot))
        for each in linkage.feet:
            close(other.foot(there, each.name), linkage.foot(q, each.name), 1.0)
        for link in linkage.links:
            end = linkage.point(q, link.name, link.length)
            close(other.point(there, link.name, lengths[link.name]), end, 1.0)
        close(other.com(there), linkage.com(q), 1.0)


def test_walked_from_where_it_was_nothing_changes() -> None:
    linkage = load_robot("sc618").linkage
    assert rerooted(linkage, "toe_1") == linkage


def test_joints_that_are_walked_the_other_way_keep_their_names_and_turn_their_rest() -> None:
    """From a fore toe, the spine moves the hind trunk and sags at a negative angle."""
    joints = {each.name: each for each in rerooted(load_robot("sc618").linkage, "toe_3").joints}
    assert (joints["spine"].link, joints["spine"].rest) == ("hind_trunk", 0.05)
    assert joints["knee_3"].link == "thigh_3"
    assert joints["knee_4"].link == "shank_4"


def test_an_unknown_foot_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'toe_1'"):
        rerooted(load_robot("sc618").linkage, "toe_11")
