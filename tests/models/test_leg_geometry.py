"""Legs as a description tells them: where they hang, what they measure, and what is no leg."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexspine import InputError, Robot, load_robot
from flexspine.models.leg_geometry import Leg, legs_of
from flexspine.models.locking import locked

# A trunk of one link with a leg hanging at its start and one at its end.
WALKER = """
[links.trunk]
length = 0.6
mass = 5.0
com = 0.3
inertia = 0.2
[links.hind_thigh]
parent = "trunk"
at = 0.05
length = 0.2
mass = 0.2
com = 0.1
inertia = 0.001
[links.hind_shank]
parent = "hind_thigh"
length = 0.3
mass = 0.1
com = 0.1
inertia = 0.001
[links.fore_thigh]
parent = "trunk"
length = 0.22
mass = 0.2
com = 0.1
inertia = 0.001
[links.fore_shank]
parent = "fore_thigh"
length = 0.35
mass = 0.1
com = 0.1
inertia = 0.001
[joints.hip]
link = "hind_thigh"
actuated = true
[joints.knee]
link = "hind_shank"
actuated = true
[feet.hoof]
link = "hind_shank"
[feet.hand]
link = "fore_shank"
at = 0.31
[legs.hind]
foot = "hoof"
thigh = "hind_thigh"
trunk = "trunk"
knee_back = false
[legs.fore]
foot = "hand"
thigh = "fore_thigh"
trunk = "trunk"
"""


def described(folder: Path, text: str) -> Robot:
    file = folder / "mine.toml"
    file.write_text(text)
    return load_robot(file)


def changed(old: str, new: str) -> str:
    assert WALKER.count(old) == 1
    return WALKER.replace(old, new)


def test_sc618_has_legs_at_both_ends_of_its_trunk() -> None:
    """0.6 m apart, of 0.16 m and 0.25 m; the first is walked from its toe upwards."""
    for robot in (load_robot("sc618"), locked(load_robot("sc618"), "spine")):
        legs = legs_of(robot)
        assert list(legs) == ["hind_1", "hind_2", "fore_1", "fore_2"]
        hips = [leg.hip for leg in legs.values()]
        assert hips == pytest.approx([-0.3, -0.3, 0.3, 0.3], abs=1e-15)
        for leg in legs.values():
            assert (leg.thigh_length, leg.shank_length) == pytest.approx((0.16, 0.25), abs=1e-15)
            assert leg.reach == pytest.approx(0.41)
            assert leg.knee_back
            assert leg.upwards == (leg.name == "hind_1")
    assert [leg.foot for leg in legs.values()] == ["toe_1", "toe_2", "toe_3", "toe_4"]
    assert [leg.shank for leg in legs.values()] == ["shank_1", "shank_2", "shank_3", "shank_4"]


def test_legs_measure_what_the_description_says(tmp_path: Path) -> None:
    """Hips from the middle between them; a shank reaches to its foot."""
    legs = legs_of(described(tmp_path, WALKER))
    assert legs["hind"] == Leg("hind", "hoof", "hind_shank", "hind_thigh", "trunk", 0.2, 0.3,
                               pytest.approx(-0.275), False, False)  # fmt: skip
    assert legs["fore"] == Leg("fore", "hand", "fore_shank", "fore_thigh", "trunk", 0.22,
                               pytest.approx(0.31), pytest.approx(0.275), False, True)  # fmt: skip


def test_knees_are_at_the_ends_that_legs_tell() -> None:
    """A thigh's length lies between hip and knee in any posture, a shank's below."""
    robot = load_robot("sc618")
    linkage, rng = robot.linkage, np.random.default_rng(1)
    for leg in legs_of(robot).values():
        ends = (leg.thigh_length, 0.0) if leg.upwards else (0.0, leg.thigh_length)
        for q in rng.uniform(-3, 3, (10, 12)):
            hip, knee = (linkage.point(q, leg.thigh, end) for end in ends)
            foot = linkage.foot(q, leg.foot)
            assert np.linalg.norm(hip - knee) == pytest.approx(leg.thigh_length)
            assert np.linalg.norm(foot - knee) == pytest.approx(leg.shank_length)
            # The hip is a point of the trunk.
            first = linkage.point(q, leg.trunk, 0.0)
            along = 0.0 if leg.hip < 0 else robot.numbers[f"{leg.trunk}.length"]
            assert np.linalg.norm(hip - first) == pytest.approx(along, abs=1e-12)


TAIL = """
[links.tail]
parent = "trunk"
length = 0.2
mass = 0.1
com = 0.1
inertia = 0.001
"""

NO_LEGS = {
    "a leg that hangs on no trunk": (
        changed('parent = "trunk"\nlength = 0.22', 'parent = "hind_thigh"\nlength = 0.22'),
        ("legs.fore", "fore_thigh", "does not end at the trunk"),
    ),
    "a shank that starts midway": (
        changed('parent = "fore_thigh"\n', 'parent = "fore_thigh"\nat = 0.1\n'),
        ("legs.fore", "fore_shank", "fore_thigh", "knee"),
    ),
    "a tail": (WALKER.replace("[joints.hip]", TAIL + "[joints.hip]"), ("links.tail", "no leg")),
    "one leg": (WALKER.partition("[legs.fore]")[0], ("1 legs",)),
    "no legs": (WALKER.partition("[legs.hind]")[0], ("0 legs",)),
}


@pytest.mark.parametrize("case", NO_LEGS)
def test_what_cannot_walk_is_refused_by_part(tmp_path: Path, case: str) -> None:
    text, told = NO_LEGS[case]
    robot = described(tmp_path, text)
    with pytest.raises(InputError) as refused:
        legs_of(robot)
    message = str(refused.value)
    for word in ("mine", *told):
        assert word in message
    assert refused.value.remedy


# A description, and what the message has to name.
BAD = {
    "an unknown entry": (
        changed("knee_back = false", "knee_bck = false"), ("legs.hind", "knee_bck", "knee_back")
    ),
    "an unknown foot": (
        changed('foot = "hoof"', 'foot = "hof"'), ("legs.hind", "'hof'", "did you mean 'hoof'")
    ),
    "no foot": (changed('foot = "hoof"\n', ""), ("legs.hind", "no foot")),
    "an unknown thigh": (
        changed('thigh = "fore_thigh"', 'thigh = "for_thigh"'),
        ("legs.fore", "did you mean 'fore_thigh'"),
    ),
    "a thigh that is a number": (
        changed('thigh = "fore_thigh"', "thigh = 3"), ("legs.fore", "thigh")
    ),
    "no trunk": (changed('trunk = "trunk"\nknee_back', "knee_back"), ("legs.hind", "no trunk")),
    "the other leg's thigh": (
        changed('thigh = "fore_thigh"', 'thigh = "hind_thigh"'),
        ("legs.fore", "hind_thigh", "does not meet", "fore_shank"),
    ),
    "a thigh that is the trunk": (
        changed('thigh = "fore_thigh"', 'thigh = "trunk"'), ("legs.fore", "three links")
    ),
    "a knee that is a word": (
        changed("knee_back = false", 'knee_back = "no"'), ("legs.hind", "knee_back = 'no'")
    ),
    "a leg that is a number": (WALKER.partition("[legs.hind]")[0] + "[legs]\nhind = 3\n",
                               ("legs.hind", "table")),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_wrong_leg_is_refused_by_name(tmp_path: Path, case: str) -> None:
    text, told = BAD[case]
    with pytest.raises(InputError) as refused:
        described(tmp_path, text)
    message = str(refused.value)
    assert "mine.toml" in message
    assert "\n" not in message
    for word in told:
        assert word in message
    assert refused.value.remedy
