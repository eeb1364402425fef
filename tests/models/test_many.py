from __future__ import annotations

import numpy as np
import pytest

from flexspine import Model, load_model, simulate, simulate_many, stream_many, summarize
from flexspine.errors import InputError, StateError
from flexspine.models.legs import SIDES

RUNS, STRIDES, SPREAD = 45, 3, 0.03


def scattered(model: Model, runs: int = RUNS) -> dict[str, np.ndarray]:
    random = np.random.default_rng(1)
    return {
        name: value + SPREAD * max(abs(value), 0.1) * random.standard_normal(runs)
        for name, value in model.apex.items()
    }


def test_many_runs_end_as_each_does_alone(preset: Model) -> None:
    many = simulate_many(preset, scattered(preset), strides=STRIDES)
    compared = 0
    for i in range(RUNS):
        try:
            run = many.run(i)
        except StateError:
            assert many["outcome"][i] == "fell"
            assert many["strides"][i] == 0
            continue
        assert many["outcome"][i] == run.outcome.name
        assert many["strides"][i] == len(run.trajectory.crossings)
        # What is left of rounding has grown from stride to stride, most in those that fall.
        loose = 1e-7 if run.outcome.completed else 1e-5
        assert many["duration"][i] == pytest.approx(run.trajectory.duration, abs=loose)
        for name, value in run.apexes[-1].items():
            assert many[f"apex_{name}"][i] == pytest.approx(value, abs=100 * loose)
        for side, peak in summarize(run).peak_grf.items():
            assert many[f"peak_grf_{side}"][i] == pytest.approx(peak, rel=100 * loose, abs=1e-6)
        compared += run.outcome.completed
    assert compared > 5


def test_a_published_gait_comes_back_in_every_lane(flexible: Model) -> None:
    many = simulate_many(flexible, {"height": np.full(40, flexible.apex["height"])})
    for name, value in flexible.apex.items():
        assert np.abs(many[f"apex_{name}"] - value).max() < 1e-11
    assert many["duration"] == pytest.approx(0.252732108498, abs=1e-11)
    for side in SIDES:
        assert many[f"peak_grf_{side}"] == pytest.approx(530.4604944, abs=1e-7)


def test_energy_is_kept_or_accounted_for() -> None:
    damped = {"spine.damping": 0.5, "fore.leg.damping": 20.0, "hind.leg.damping": 10.0}
    for parameters in ({}, damped):
        model = load_model("kamimura2015-flexible")
        many = simulate_many(model, scattered(model), parameters, strides=1)
        done = many["outcome"] == "completed"
        assert done.sum() > 20
        lost = many["energy_start"] - many["energy_end"] - many["dissipated"]
        assert np.abs(lost[done]).max() < 1e-9 * many["energy_start"].max()


def test_a_run_does_not_depend_on_its_neighbours_or_on_processes(flexible: Model) -> None:
    given = scattered(flexible)
    whole = simulate_many(flexible, given, strides=STRIDES)
    order = np.random.default_rng(2).permutation(RUNS)[:37]
    some = {name: column[order] for name, column in given.items()}
    varied = np.where(np.arange(37) == 5, 250.0, 260.0)
    batches = [some, {**some, "spine.stiffness": varied}, some]
    part, mixed, _ = stream_many(flexible, batches, strides=STRIDES, processes=2)
    same = np.arange(37) != 5
    for name, column in whole.columns.items():
        np.testing.assert_array_equal(part[name], column[order])
        np.testing.assert_array_equal(mixed[name][same], column[order][same])


@pytest.mark.parametrize(
    "given",
    [
        {"heigth": 0.3},
        {"height": np.nan},
        {"height": "high"},
        {"height": []},
        {"height": [[0.3]]},
        {"spine.stiffness": [-1.0]},
        {"touchdown.fore": [0.4, 1.6]},
        {"height": [0.3, 0.31], "speed": [4.0, 4.1, 4.2]},
    ],
)
def test_values_that_make_no_runs_are_refused(flexible: Model, given: dict[str, object]) -> None:
    with pytest.raises(InputError) as caught:
        simulate_many(flexible, given)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_what_is_no_model_and_no_mapping_is_refused(flexible: Model) -> None:
    with pytest.raises(InputError, match="is no model"):
        simulate_many("scout2")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="does not tell what varies"):
        simulate_many(flexible, [0.3, 0.31])  # type: ignore[arg-type]
    runs = simulate_many(flexible, {"height": [0.32, 0.33]})
    assert repr(runs).startswith("<Ensemble of 2 runs of kamimura2015-flexible")
    with pytest.raises(InputError, match="did you mean 'outcome'"):
        runs["outcomes"]
    with pytest.raises(InputError, match="no run 2"):
        runs.run(2)


def test_the_tally_counts_every_run() -> None:
    model = load_model("scout2")
    many = simulate_many(model, scattered(model), strides=2)
    assert sum(many.tally.values()) == len(many) == RUNS
    assert simulate(many.cases.one(3), strides=2).outcome.name == many["outcome"][3]


def test_actuators_that_some_runs_have_act_in_these_alone(flexible: Model) -> None:
    """Below zero in one run and absent in the other, whose equations are then those of both."""
    given = {"legs.extension": [-0.003, 0.0], "spine.stiffness_shift.fore": [-0.1, 0.0]}
    runs = simulate_many(flexible, parameters=given)
    for number in range(2):
        alone = runs.run(number)
        assert runs["outcome"][number] == alone.outcome.name
        for name, value in alone.apexes[-1].items():
            assert runs[f"apex_{name}"][number] == pytest.approx(value, abs=1e-9)
    assert runs["energy_end"][0] != pytest.approx(runs["energy_end"][1], abs=0.1)
