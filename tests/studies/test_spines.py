"""The published comparison in small: two stiffnesses, one speed for the sweeps."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet
import pytest

from flexspine.errors import OutputError, ParameterError
from flexspine.parameters import values
from flexspine.studies import spines, tables
from flexspine.studies.claims import verdicts
from flexspine.studies.spines import (
    FLEXIBLE,
    LOCKED,
    RIGID,
    Setting,
    SpineStudy,
    study_spines,
)
from flexspine.studies.verdict import Verdict
from tests import second_implementation as reference

SMALL = Setting(speeds=(4.2, 4.7), stiffnesses=(200.0, 260.0), compared=(4.5,))

# Every branch of a study, all of them short.
TINY = Setting(
    speeds=(4.48, 4.52), stiffnesses=(250.0, 260.0), compared=(4.5,), softest=250.0, stiffest=300.0
)


@pytest.fixture(scope="module")
def study() -> SpineStudy:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spines, "STIFF_POINTS", 12)
        return study_spines(SMALL)


@pytest.fixture(scope="module")
def judged(study: SpineStudy) -> dict[int, Verdict]:
    return {verdict.number: verdict for verdict in verdicts(study)}


def test_every_gait_has_the_energy_and_height_of_the_setting(study: SpineStudy) -> None:
    rows = [*tables.gaits_table(study), *tables.stiffness_table(study)]
    assert len(rows) > 200
    for row in rows:
        assert row["energy"] == pytest.approx(290, rel=1e-11)
        assert row["apex_height"] == pytest.approx(0.32, abs=1e-12)
        assert row["residual"] <= 1e-11
        assert row["energy_identity"] <= 1e-9


def test_gaits_are_symmetric_and_land_on_the_fore_leg_first(study: SpineStudy) -> None:
    for row in tables.gaits_table(study):
        assert row["family"].startswith("fore-first")
        assert row["peak_grf_fore"] == pytest.approx(row["peak_grf_hind"], rel=1e-9)
        assert row["touchdown_fore"] == pytest.approx(-row["liftoff_hind"], abs=1e-9)


def test_peaks_are_those_of_an_independent_implementation(study: SpineStudy) -> None:
    gait = study.specimen(FLEXIBLE, 200.0).at(4.25)
    assert gait is not None
    given = values(gait.gait.model.parameters)
    half = reference.Half(
        mass=given["fore.mass"],
        inertia=given["fore.inertia"],
        spine_offset=given["fore.spine_offset"],
        hip_offset=given["fore.hip_offset"],
        leg_stiffness=given["fore.leg.stiffness"],
        leg_damping=0.0,
        leg_rest_length=given["fore.leg.rest_length"],
    )
    body = reference.Flexible(half, half, 200.0, 0.0, 0.0, 9.81)
    apex, touchdown = dict(gait.gait.model.apex), dict(gait.gait.model.touchdown)
    theirs = reference.stride(body, apex, touchdown)
    assert theirs.peak_grf["fore"] == pytest.approx(gait.gait.peak_grf["fore"], rel=1e-7)
    assert theirs.end["distance"] / theirs.time == pytest.approx(4.25, abs=1e-8)


def test_the_branches_pass_through_the_published_readings(study: SpineStudy) -> None:
    """Within 8 N and 0.02 m/s, at the speeds that this small study covers."""
    readings = [r for r in tables.published_readings() if r["mean_speed"] >= 4.2]
    assert len(readings) == 6
    for reading in readings:
        body = FLEXIBLE if reading["spine_stiffness"] else RIGID
        specimen = study.specimen(body, reading["spine_stiffness"])
        speed, peak = reading["mean_speed"], reading["peak_grf"]
        near = [specimen.at(speed + shift) for shift in (-0.019, -0.01, 0.0, 0.01, 0.019)]
        peaks = [p.gait.peak_grf["fore"] for p in near if p is not None]
        assert min(peaks) - 8 <= peak <= max(peaks) + 8


def test_a_very_stiff_spine_comes_to_the_locked_one_as_one_over_stiffness(
    study: SpineStudy,
) -> None:
    (sweep,) = study.sweeps
    locked = study.specimen(LOCKED).at(4.5)
    assert locked is not None
    gaps = {
        stiffness: abs(gait.peak_grf["fore"] - locked.gait.peak_grf["fore"])
        for stiffness, gait, _ in sweep.stiff
    }
    stiffest = max(gaps)
    assert stiffest == pytest.approx(1e6)
    assert gaps[stiffest] < 0.01
    tenth = min(gaps, key=lambda stiffness: abs(stiffness - 1e5))
    assert gaps[tenth] / gaps[stiffest] == pytest.approx(stiffest / tenth, rel=0.5)


def test_verdicts_name_both_baselines_and_the_runs_behind_them(
    judged: dict[int, Verdict],
) -> None:
    assert sorted(judged) == [1, 2, 3, 4, 5, 6, 7, 9]
    for verdict in judged.values():
        assert verdict.verdict in ("holds", "fails", "depends on")
        assert verdict.runs
        assert all(gait.confirmed for gait in verdict.runs.values())
    for number in (1, 5, 6, 9):
        assert RIGID in judged[number].finding
        assert "locked spine" in judged[number].finding


def test_claims_without_evidence_stay_undecided() -> None:
    """No speed for the sweeps, and a body alone has nothing to be compared with over k_t."""
    alone = replace(SMALL, speeds=(4.45, 4.5), stiffnesses=(260.0,), compared=())
    found = {verdict.number: verdict.verdict for verdict in verdicts(study_spines(alone))}
    assert [found[number] for number in (2, 3, 4, 5)] == ["undecided"] * 4
    assert found[1] != "undecided"


def test_the_gravitational_share_at_the_apex_is_set_by_height_and_energy(
    judged: dict[int, Verdict],
) -> None:
    """m g h / E, whatever the spine."""
    for label, shares in judged[7].numbers.items():
        mass = 20.9 if label == RIGID else 20.8
        assert shares["gravity"] == pytest.approx(mass * 9.81 * 0.32 / 290, rel=1e-9)
    assert judged[7].verdict == "depends on"


def test_flexible_bodies_take_shorter_strides_and_bob_less(judged: dict[int, Verdict]) -> None:
    """Published gait: period 0.252732 s; rigid and locked ones are longer in the same table."""
    assert judged[9].verdict == "fails"
    assert judged[6].verdict == "holds"


def test_tables_are_the_same_in_parquet_and_csv(study: SpineStudy, tmp_path: Path) -> None:
    rows = tables.gaits_table(study)
    for suffix in ("csv", "parquet"):
        tables.write_table(rows, tmp_path / f"t.{suffix}")
    parquet = pyarrow.parquet.read_table(tmp_path / "t.parquet").to_pylist()
    assert parquet == rows
    with (tmp_path / "t.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [float(line["mean_speed"]) for line in lines] == [row["mean_speed"] for row in rows]
    assert lines[0]["spine_stiffness"] == ""


def test_an_interrupted_study_goes_on_to_the_same_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spines, "STIFF_POINTS", 2)
    study = study_spines(TINY)

    def stop(what: str, _share: float) -> None:
        if what == "flexible 260":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study_spines(TINY, tmp_path, stop)
    kept = sorted(path.name for path in tmp_path.iterdir())
    assert len(kept) == 4
    resumed = study_spines(TINY, tmp_path)
    assert tables.gaits_table(resumed) == tables.gaits_table(study)
    assert tables.stiffness_table(resumed) == tables.stiffness_table(study)
    assert tables.landmarks_table(resumed) == tables.landmarks_table(study)


def test_branches_of_another_setting_are_not_taken_over(tmp_path: Path) -> None:
    tiny = replace(SMALL, speeds=(4.45, 4.55), stiffnesses=(260.0,), compared=())
    study_spines(tiny, tmp_path)
    with pytest.raises(OutputError, match="other settings"):
        study_spines(replace(tiny, speeds=(4.4, 4.55)), tmp_path)


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        (replace(SMALL, speeds=(4.7, 4.1)), "4.7"),
        (replace(SMALL, stiffnesses=()), "stiffness"),
        (replace(SMALL, softest=1e7), "1e"),
        (replace(SMALL, energy=240.0), "energy"),
        (replace(SMALL, compared=(99.0,)), "99"),
        (replace(SMALL, stiffnesses=(float("nan"),)), "nan"),
    ],
)
def test_settings_without_gaits_are_refused_by_name(setting: Setting, named: str) -> None:
    with pytest.raises(ParameterError, match=named):
        study_spines(setting)
