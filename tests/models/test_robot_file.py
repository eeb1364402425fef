"""Descriptions of robots: what they may say, and what is refused, by the line that is wrong."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexspine import InputError, Robot, load_robot, robot_names
from flexspine.models.robot_file import _robot

PENDULUM = """
[links.rod]
length = 2.0
mass = 3.0
com = 1.0
inertia = 1.0

[links.bob]
parent = "rod"
length = 0.5
mass = 1.0
com = 0.1
inertia = 0.0

[joints.hinge]
link = "bob"
stiffness = 5.0
actuated = true

[feet.tip]
link = "bob"
"""


def described(folder: Path, text: str) -> Robot:
    file = folder / "mine.toml"
    file.write_text(text)
    return load_robot(file)


def test_every_robot_that_comes_along_can_be_made() -> None:
    assert "sc618" in robot_names()
    for name in robot_names():
        robot = load_robot(name)
        assert robot.source.title
        q = np.random.default_rng(0).uniform(-1, 1, robot.linkage.size)
        assert np.all(np.linalg.eigvalsh(robot.linkage.mass_matrix(q)) > 0)


def test_sc618_weighs_what_its_sizes_and_densities_make() -> None:
    """Trunk, four thighs and shanks of square section, four spheres."""
    trunk = 0.6 * 0.3 * 0.15 * 600
    legs = 4 * (0.16 + 0.25) * 0.04**2 * 660
    feet = 4 * 1000 * 4 / 3 * np.pi * 0.035**3
    assert load_robot("sc618").linkage.mass == pytest.approx(trunk + legs + feet, rel=1e-5)


def test_what_is_left_out_is_at_the_end_and_without_a_spring(tmp_path: Path) -> None:
    robot = described(tmp_path, PENDULUM)
    assert robot.name == "mine"
    assert robot.numbers["bob.at"] == 2.0
    assert robot.numbers["tip.at"] == 0.5
    assert (robot.numbers["gravity"], robot.friction) == (9.81, 0.8)
    assert (robot.numbers["hinge.damping"], robot.numbers["hinge.rest"]) == (0.0, 0.0)
    (joint,) = robot.linkage.joints
    assert (joint.name, joint.stiffness, joint.actuated) == ("hinge", 5.0, True)


def test_numbers_change_by_dotted_name() -> None:
    robot = load_robot("sc618", {"spine.stiffness": 300, "gravity": 1.62})
    assert robot.numbers["spine.stiffness"] == 300
    assert robot.linkage.gravity == 1.62
    assert robot.source.provenance["spine.stiffness"] == "set by user"
    assert load_robot("sc618").numbers["spine.stiffness"] == 240
    with pytest.raises(InputError, match=r"did you mean 'spine\.stiffness'"):
        robot.with_values({"spine.stifness": 1})
    with pytest.raises(InputError, match="spine: parameter 'stiffness' = -1"):
        robot.with_values({"spine.stiffness": -1})


def changed(old: str, new: str) -> str:
    assert old in PENDULUM
    return PENDULUM.replace(old, new)


def test_a_description_tells_where_its_numbers_come_from(tmp_path: Path) -> None:
    text = '[provenance]\n"hinge.stiffness" = "measured"\ngravity = "standard value"\n'
    robot = described(tmp_path, PENDULUM + text)
    source = robot.with_values({"rod.mass": 4}).source
    assert source.of("hinge.stiffness") == "measured"
    assert source.of("gravity") == "standard value"
    assert source.of("rod.mass") == "set by user"
    assert source.of("bob.at") == "the end of rod as described"
    assert source.of("bob.mass") == f"file {tmp_path / 'mine.toml'}"


def test_sc618_admits_what_was_chosen() -> None:
    source = load_robot("sc618").source
    for name in ("spine.stiffness", "spine.damping", "spine.rest", "friction", "space.hip_width"):
        assert source.of(name).startswith("chosen")
    assert "600 kg/m3" in source.of("hind_trunk.mass")


# A description, and what the message has to name.
BAD = {
    "the origin of nothing": (
        PENDULUM + '[provenance]\n"hinge.stifness" = "measured"\n',
        ("provenance", "did you mean 'hinge.stiffness'"),
    ),
    "an origin that is no text": (
        PENDULUM + '[provenance]\n"hinge.stiffness" = 3\n',
        ("provenance", "hinge.stiffness", "text"),
    ),
    "origins that are no table": ('provenance = "mine"\n' + PENDULUM, ("provenance", "table")),
    "a loop": (changed("[links.rod]", '[links.rod]\nparent = "bob"'), ("links.rod", "loop")),
    "itself": (changed('parent = "rod"', 'parent = "bob"'), ("links.bob", "bob -> bob", "loop")),
    "an orphan": (changed('parent = "rod"', ""), ("links.bob", "no parent")),
    "an unknown parent": (changed('"rod"', '"rot"'), ("links.bob", "did you mean 'rod'")),
    "a number as parent": (changed('"rod"', "3"), ("links.bob", "parent = 3")),
    "a parent that comes later": (
        PENDULUM + '[links.more]\nparent = "last"\nlength = 1\nmass = 1\ncom = 0\ninertia = 0\n'
        '[links.last]\nparent = "rod"\nlength = 1\nmass = 1\ncom = 0\ninertia = 0\n',
        ("links.more", "before its parent 'last'"),
    ),
    "zero mass": (changed("mass = 3.0", "mass = 0"), ("rod", "mass", "= 0")),
    "no mass": (changed("mass = 3.0\n", ""), ("rod", "mass")),
    "a negative inertia": (changed("inertia = 1.0", "inertia = -1"), ("rod", "inertia")),
    "no number": (changed("length = 2.0", 'length = "2"'), ("rod", "length", "'2'")),
    "nan": (changed("com = 1.0", "com = nan"), ("rod", "com")),
    "an unknown entry of a link": (changed("com = 1.0", "comm = 1.0"), ("rod", "comm")),
    "a joint of an unknown link": (changed('link = "bob"\nst', 'link = "bib"\nst'),
                                   ("joints.hinge", "bib", "did you mean 'bob'")),
    "a joint of the first link": (changed('link = "bob"\nst', 'link = "rod"\nst'),
                                  ("joints.hinge", "'rod' has no parent")),
    "a joint of nothing": (changed('link = "bob"\nst', "st"), ("joints.hinge", "no link")),
    "two joints of a link": (PENDULUM + '[joints.again]\nlink = "bob"\n',
                             ("joints.again", "'hinge'")),
    "a motor that is a word": (changed("actuated = true", 'actuated = "yes"'),
                               ("joints.hinge", "actuated = 'yes'")),
    "no feet": (changed('[feet.tip]\nlink = "bob"\n', ""), ("no feet",)),
    "a foot of an unknown link": (changed('[feet.tip]\nlink = "bob"', '[feet.tip]\nlink = "x"'),
                                  ("feet.tip", "'x'")),
    "a foot nowhere": (changed('[feet.tip]\nlink = "bob"', "[feet.tip]"), ("feet.tip", "no link")),
    "one name twice": (changed("[feet.tip]", "[feet.rod]"), ("rod",)),
    "a dot in a name": (changed("[feet.tip]", '[feet."t.ip"]'), ("t.ip", "dot")),
    "no links": ("[feet.tip]\n", ("no links",)),
    "links that are a number": ("links = 3\n", ("links",)),
    "a link that is a number": ("[links]\nrod = 3\n", ("links.rod",)),
    "an unknown entry": (PENDULUM.replace("\n[links.rod]", "gravty = 3\n[links.rod]", 1),
                         ("gravty", "gravity")),
    "a title that is a number": ("title = 3\n" + PENDULUM, ("title",)),
    "notes that are a text": ('notes = "all"\n' + PENDULUM, ("notes",)),
    "a space that is a number": ("space = 3\n" + PENDULUM, ("'space' is not a table",)),
    "an unknown entry of space": (PENDULUM + "[space]\nhip_widht = 0.1\n",
                                  ("space", "hip_widht")),
    "a width that is missing": (PENDULUM + "[space]\nhip_width = 0.1\n", ("space", "trunk_width")),
    "a negative width": (PENDULUM + "[space]\nhip_width = -0.1\n", ("space", "hip_width", "-0.1")),
    "a link named space": (changed('[links.bob]', "[links.space]"), ("named 'space'",)),
    "no TOML": ("links = [", ("not valid TOML",)),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_wrong_description_is_refused_by_name(tmp_path: Path, case: str) -> None:
    text, told = BAD[case]
    with pytest.raises(InputError) as raised:
        described(tmp_path, text)
    message = str(raised.value)
    assert "mine.toml" in message
    assert "\n" not in message
    for word in told:
        assert word in message
    assert raised.value.remedy


def test_robots_that_are_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'sc618'"):
        load_robot("sc681")
    for path in (tmp_path, tmp_path / "absent.toml", "a\0b.toml"):
        with pytest.raises(InputError):
            load_robot(path)


VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.just([]),
    st.just("rod"), st.just("bob"),
)  # fmt: skip
ENTRIES = ["parent", "link", "length", "mass", "com", "inertia", "at", "stiffness", "actuated"]


@given(
    where=st.sampled_from(["links.rod", "links.bob", "joints.hinge", "feet.tip", "links", "x"]),
    entry=st.sampled_from(ENTRIES),
    value=VALUES,
)
@settings(max_examples=200)
def test_any_entry_makes_a_robot_or_is_refused(where: str, entry: str, value: object) -> None:
    content = tomllib.loads(PENDULUM)
    place: Any = content
    for name in where.split("."):
        place = place.setdefault(name, {})
    if value is None:
        place.pop(entry, None)
    else:
        place[entry] = value
    content.pop("x", None)
    try:
        robot = _robot("any", content, "here")
    except InputError as refused:
        assert refused.message
        assert refused.remedy
        return
    assert np.isfinite(robot.linkage.mass_matrix(np.zeros(robot.linkage.size))).all()
