"""Verdicts on the claims about the articulated robot."""

from __future__ import annotations

from functools import partial

import pytest

from flexspine.studies import robot_claims
from flexspine.studies.pinned_check import COMPARED, check_pinned
from flexspine.studies.robot_claims import robot_verdicts
from flexspine.studies.verdict import Verdict


@pytest.fixture(scope="module")
def judged() -> dict[int, Verdict]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(robot_claims, "SECONDS", 2.8)
        patch.setattr(robot_claims, "check_pinned", partial(check_pinned, seconds=COMPARED))
        return {verdict.number: verdict for verdict in robot_verdicts()}


def test_the_equations_are_those_of_an_independent_engine(judged: dict[int, Verdict]) -> None:
    assert judged[10].verdict == "holds"
    for case in judged[10].numbers.values():
        assert case["difference"] < 1e-6
        assert 3.5 < case["order"] < 4.5


def test_errors_decay_exponentially_only_under_continuous_feedback(
    judged: dict[int, Verdict],
) -> None:
    numbers = judged[11].numbers
    assert judged[11].verdict == "depends on"
    assert numbers["phases"] >= 5
    assert numbers["off"] < 1e-10 < 1e-3 < numbers["largest"]
    assert 1e-4 < numbers["held"] < 3e-3


def test_torques_shift_forces_on_more_than_two_feet(judged: dict[int, Verdict]) -> None:
    assert judged[12].verdict == "depends on"
    two, three, four = judged[12].numbers.values()
    assert [each["dimension"] for each in (two, three, four)] == [0, 2, 4]
    assert two["normal"][1] - two["normal"][0] < 1e-9
    assert three["normal"][1] - three["normal"][0] > 50


def test_every_verdict_tells_what_repeats_it(judged: dict[int, Verdict]) -> None:
    assert all(each.command.startswith("flexspine ") for each in judged.values())


def test_without_mujoco_the_first_stays_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    monkeypatch.setattr(robot_claims, "SECONDS", 0.5)
    monkeypatch.setattr(robot_claims, "PUSH_TIME", 0.2)
    first = robot_verdicts()[0]
    assert first.verdict == "undecided"
    assert "engine" in first.finding
