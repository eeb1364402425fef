"""What damping and compliance cost: the study in small, and its verdict on made-up gaits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexspine import examine, load_model, trace_branch
from flexspine.errors import ParameterError
from flexspine.gaits.continuation import Branch
from flexspine.studies import damping as damping_module
from flexspine.studies import tables
from flexspine.studies.damping import (
    ACTUATORS,
    DAMPING,
    STIFFNESS,
    DampedBranch,
    DampedSetting,
    DampingStudy,
    cost,
    study_damping,
)
from flexspine.studies.damping_claims import damping_verdict
from flexspine.studies.spines import FLEXIBLE, Setting, Specimen, SpineStudy

SMALL = DampedSetting(most=10.0, dampings=(1.0,), stiffest=265.0)

WEIGHT = 2 * 10.4 * 9.81


@pytest.fixture(scope="module")
def spines() -> SpineStudy:
    """The published spine alone, and no softer one than 200 N m/rad."""
    setting = Setting(speeds=(4.49, 4.51), stiffnesses=(260.0,), compared=(4.5,), softest=200.0)
    branch = trace_branch(examine(load_model("kamimura2015-flexible")), bounds=setting.speeds)
    return SpineStudy(setting, (Specimen(FLEXIBLE, 260.0, branch),), ())


@pytest.fixture(scope="module")
def study(spines: SpineStudy) -> DampingStudy:
    return study_damping(spines, SMALL)


def test_every_actuator_is_followed_from_the_published_gait(study: DampingStudy) -> None:
    assert [found.actuator for found in study.over_damping] == list(ACTUATORS)
    for found in study.over_damping:
        first = found.points[0]
        assert (first.value, found.kept) == (0, 260)
        assert first.gait.peak_grf["fore"] == pytest.approx(530.460494, abs=1e-5)
        assert cost(first.gait) == pytest.approx(0, abs=1e-12)
        assert found.points[-1].value == pytest.approx(10)


def test_all_gaits_are_compared_at_equal_energy_height_and_speed(study: DampingStudy) -> None:
    rows = tables.damping_table(study)
    assert len(rows) > 100
    for row in rows:
        assert row["energy"] == pytest.approx(290, rel=1e-11)
        assert row["apex_height"] == pytest.approx(0.32, abs=1e-12)
        assert row["mean_speed"] == pytest.approx(4.5, abs=1e-10)
        assert row["residual"] <= 1e-11


def test_the_table_tells_what_is_spent(study: DampingStudy) -> None:
    for row in tables.damping_table(study):
        by_hand = row["positive_work"] / (WEIGHT * row["stride_length"])
        assert row["cost_of_transport"] == pytest.approx(by_hand, abs=1e-14)
        taken_back = row["positive_work"] - row["net_work"]
        assert taken_back >= -1e-12
        if row["actuator"] == "legs.extension" and row["spine_damping"] > 0:
            assert taken_back == pytest.approx(0, abs=1e-12)
            assert row["amplitude"] > 0


def test_over_stiffness_the_damping_is_kept(study: DampingStudy) -> None:
    (found,) = study.over_stiffness
    assert found.kept == pytest.approx(1.0, abs=1e-12)
    stiffnesses = [point.value for point in found.points]
    assert (min(stiffnesses), max(stiffnesses)) == pytest.approx((200, 265))
    for point in found.points:
        assert point.gait.model.numbers[DAMPING] == pytest.approx(1.0, abs=1e-12)


def test_the_dearest_gait_is_located_between_points_of_the_branch(study: DampingStudy) -> None:
    """Gaits on either side of it cost less."""
    found = study.over_damping[0]
    top = found.extreme(max)
    assert cost(top.gait) >= max(cost(point.gait) for point in found.branch.points)
    for share in (0.96, 1.04):
        (beside,) = found.branch.at(share * top.value)
        assert cost(beside.gait) < cost(top.gait)


def test_a_dearest_gait_at_an_end_is_that_end(study: DampingStudy) -> None:
    found = study.over_damping[0]
    assert found.extreme(max, 0, 5) is found.branch.points[5]
    assert found.extreme(min) is found.branch.points[0]
    assert found.measured(2, 4) == [2, 3, 4]


def test_the_verdict_of_the_small_study_rests_on_its_gaits(study: DampingStudy) -> None:
    """Firm dampers cost less again, and of these spines the softest is not the cheapest."""
    verdict = damping_verdict(study)
    assert verdict.number == 8
    assert verdict.verdict == "depends on"
    for key, numbers in verdict.numbers.items():
        if key.startswith("damping"):
            assert numbers["end"]["cost_of_transport"] < numbers["dearest"]["cost_of_transport"]
            assert f"{numbers['dearest']['cost_of_transport']:.4f}" in verdict.finding
    assert all(gait.confirmed for gait in verdict.runs.values())
    assert "flexible-260-damped-10-by-hip_lever-at-4.5" in verdict.runs


def test_an_interrupted_study_goes_on_to_the_same_end(
    spines: SpineStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(damping_module, "MEASURED", 6)
    spines = replace(spines, setting=replace(spines.setting, softest=250.0))
    shorter = replace(SMALL, most=1.0)
    whole = study_damping(spines, shorter)

    def stop(what: str, _share: float) -> None:
        if ACTUATORS[1] in what:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study_damping(spines, shorter, tmp_path, stop)
    assert len(list(tmp_path.iterdir())) == 1
    told: list[tuple[str, float]] = []
    resumed = study_damping(spines, shorter, tmp_path, lambda *step: told.append(step))
    assert [share for _, share in told] == pytest.approx(np.arange(4) / 4)
    assert tables.damping_table(resumed) == tables.damping_table(whole)


@pytest.mark.parametrize("damping", [0.0, -1.0, float("nan"), 1e4])
def test_a_damping_that_is_not_usable_is_refused(damping: float) -> None:
    with pytest.raises(ParameterError, match="damping"):
        DampedSetting(dampings=(damping,))


def made_up(over: str, costs: Sequence[float], values: Sequence[float] = ()) -> DampedBranch:
    """A branch whose gaits cost this, at evenly spaced values unless others are given."""
    along = values or [float(number) for number in range(len(costs))]
    points = [
        SimpleNamespace(
            value=value,
            point=np.array([value]),
            stability=SimpleNamespace(spectral_radius=1.2),
            gait=SimpleNamespace(
                peak_grf={"fore": 500.0, "hind": 510.0},
                summary=SimpleNamespace(cost_of_transport=spent, spine_range=(0.0, 0.1)),
                model=SimpleNamespace(
                    numbers={STIFFNESS: 260.0, DAMPING: 1.0, ACTUATORS[0]: 0.01, over: value}
                ),
            ),
        )
        for value, spent in zip(along, costs, strict=True)
    ]
    branch = SimpleNamespace(over=over, points=tuple(points), at=lambda _: [])
    return DampedBranch(4.5, ACTUATORS[0], cast(Branch, branch))


RISES, TURNS = [0.0, 0.1, 0.2, 0.3], [0.0, 0.1, 0.2, 0.1]
SOFT_COSTS, SOFT_SAVES = [0.3, 0.2, 0.1, 0.1], [0.1, 0.2, 0.3, 0.3]

OUTCOMES: dict[str, tuple[list[float], list[float], str]] = {
    "both cost": (RISES, SOFT_COSTS, "holds"),
    "neither costs": (TURNS, SOFT_SAVES, "fails"),
    "damping alone costs": (RISES, SOFT_SAVES, "depends on"),
    "compliance alone costs": (TURNS, SOFT_COSTS, "depends on"),
    "a difference that is none": ([0.0, 0.2, 0.20001, 0.2], [0.10001, 0.1, 0.1], "depends on"),
}


@pytest.mark.parametrize("case", OUTCOMES)
def test_the_verdict_follows_from_what_gaits_cost(case: str) -> None:
    over_damping, over_stiffness, expected = OUTCOMES[case]
    found = damping_verdict(
        DampingStudy((made_up(DAMPING, over_damping),), (made_up(STIFFNESS, over_stiffness),))
    )
    assert found.verdict == expected
    assert ("grows neither" in found.finding) == (expected == "depends on")


def test_beyond_a_fold_costs_do_not_count() -> None:
    """The branch turns round at a damping of 2; back at 0.5 its gaits are others."""
    folded = made_up(DAMPING, [0.0, 0.1, 0.2, 0.05], [0.0, 1.0, 2.0, 0.5])
    found = damping_verdict(DampingStudy((folded,), ()))
    assert found.verdict == "holds"
    assert "where the branch folds" in found.finding
    around = made_up(STIFFNESS, [0.05, 0.2, 0.3], [300.0, 150.0, 260.0])
    found = damping_verdict(DampingStudy((), (around,)))
    assert found.verdict == "fails", "the cheaper gait is beyond the fold at the softest"


def test_without_damped_gaits_the_claim_is_undecided() -> None:
    nowhere: Any = made_up(DAMPING, [0.0])
    for study in (DampingStudy((), ()), DampingStudy((nowhere,), ())):
        found = damping_verdict(study)
        assert found.verdict == "undecided"
        assert found.finding
