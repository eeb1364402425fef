"""Walks as files: what they may say, and what is refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexspine import load_robot
from flexspine.control.gains import load_walk, walk_names
from flexspine.errors import InputError, ParameterError, UnknownNameError
from flexspine.models.leg_geometry import legs_of

WALK = """
rhythm = "bound"

[gait]
speed = 0.5
frequency = 2.0
duty = 0.4
height = 0.3
clearance = 0.03
lag = 0.4
hind_ahead = -0.01
fore_ahead = 0.02

[servo]
stiffness = 200.0
damping = 1.0
out_stiffness = 150.0
out_damping = 1.2
"""


def read(folder: Path, text: str) -> object:
    (folder / "mine.toml").write_text(text)
    return load_walk(folder / "mine.toml", "sc618")


def test_a_file_becomes_a_rhythm(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(WALK)
    walk = load_walk(tmp_path / "mine.toml", "any robot")
    rhythm = walk.pattern(legs_of(load_robot("sc618")))
    assert dict(rhythm.offsets) == {"hind_1": 0.0, "hind_2": 0.0, "fore_1": 0.4, "fore_2": 0.4}
    # Feet that stand move at the wanted speed: a stride's share of 0.4 in 0.5 s.
    assert rhythm.stride / (0.4 * 0.5) == pytest.approx(0.5)
    assert rhythm.speed == pytest.approx(0.5)
    assert rhythm.ahead["hind_2"] == -0.01
    assert rhythm.ahead["fore_1"] == 0.02
    assert walk.gains.servo.rate == 400.0


def test_walks_come_along_for_the_robot() -> None:
    assert walk_names("sc618") == ["bound", "trot"]
    for name in walk_names("sc618"):
        walk = load_walk(name, "sc618")
        assert walk.rhythm == name
        assert "seed" in walk.source.source


def test_numbers_change_by_dotted_name() -> None:
    walk = load_walk("trot", "sc618").with_values({"gait.frequency": 2.5, "servo.limit": 20.0})
    assert (walk.gains.gait.frequency, walk.gains.servo.limit) == (2.5, 20.0)
    assert walk.source.of("gait.frequency") == "set by user"
    assert walk.source.of("gait.duty") == walk.source.source
    with pytest.raises(UnknownNameError, match=r"did you mean 'gait\.speed'"):
        walk.with_values({"gait.sped": 1.0})
    with pytest.raises(ParameterError, match="duty"):
        walk.with_values({"gait.duty": 1.5})


BAD = {
    "no rhythm": (WALK.replace('rhythm = "bound"', ""), "rhythm = None"),
    "an unknown rhythm": (WALK.replace("bound", "canter"), "canter"),
    "an unknown entry": ("spam = 1\n" + WALK, "spam"),
    "an unknown number": (WALK.replace("duty", "dutty"), "did you mean"),
    "a missing number": (WALK.replace("frequency = 2.0\n", ""), "frequency"),
    "a number out of bounds": (WALK.replace("duty = 0.4", "duty = 40"), "duty"),
    "a text for a number": (WALK.replace("duty = 0.4", 'duty = "half"'), "duty"),
    "a number for a table": ('rhythm = "trot"\ngait = 3\n', "'gait' is not a table"),
    "no TOML": ("rhythm = ", "not valid TOML"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_with_a_file_is_told_in_one_line(tmp_path: Path, case: str) -> None:
    text, told = BAD[case]
    with pytest.raises(InputError) as raised:
        read(tmp_path, text)
    assert told in str(raised.value)
    assert "mine.toml" in str(raised.value)


def test_a_directory_of_results_is_no_walk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "trot").mkdir()
    there = load_walk("trot", "sc618").gains
    monkeypatch.chdir(tmp_path)
    assert load_walk("trot", "sc618").gains == there


def test_walks_that_are_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'trot'"):
        load_walk("trott", "sc618")
    with pytest.raises(InputError, match=r"robot 'mine' has no gait 'trot'.*sc618-trot"):
        load_walk("trot", "mine")
    assert load_walk("sc618-trot", "mine").gains == load_walk("trot", "sc618").gains
    with pytest.raises(InputError, match="cannot read"):
        load_walk(tmp_path / "none.toml", "sc618")
