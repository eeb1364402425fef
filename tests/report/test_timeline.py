"""Which stretch of a run a strip of postures shows."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from flexspine import Ground, Model, examine, load_model, simulate, stabilize, steer, to_dataset
from flexspine.report.timeline import apex_times, last_cycle


@pytest.fixture(scope="module")
def steered() -> xr.Dataset:
    gait = examine(load_model("kamimura2015-flexible"))
    inputs = ("touchdown.fore", "touchdown.hind", "legs.extension")
    feedback = stabilize(gait, inputs, twice=True)
    return to_dataset(steer(gait.model, feedback, strides=3, record=True))


def test_the_last_stride_of_a_steered_run_has_a_stance_of_either_leg(steered: xr.Dataset) -> None:
    assert len(apex_times(steered)) == 7, "two a stride"
    start, end = last_cycle(steered)
    # An undisturbed gait: three strides take three times as long as one.
    assert end - start == pytest.approx(float(steered.time[-1]) / 3, rel=1e-6)
    within = steered.sel(time=slice(start, end))
    assert {"FS", "HS"} <= set(within["phase"].values.tolist())


def test_a_run_that_is_not_steered_ends_with_its_last_stride(flexible: Model) -> None:
    run = simulate(flexible, strides=2)
    start, end = last_cycle(to_dataset(run))
    assert (start, end) == pytest.approx([point.time for point in run.section_points[-2:]])


def test_a_run_that_fell_is_shown_up_to_its_end(flexible: Model) -> None:
    run = simulate(flexible.on(Ground.step(-0.2, at=2.0)), strides=5)
    assert not run.outcome.completed
    data = to_dataset(run)
    start, end = last_cycle(data)
    assert end == data.time[-1]
    first, second = (point.time for point in run.section_points[:2])
    assert end - start == pytest.approx(second - first, rel=1e-6)


def test_a_run_that_fell_in_its_first_stride_is_shown_whole(flexible: Model) -> None:
    data = to_dataset(simulate(flexible.on(Ground.step(0.3)), strides=5))
    assert data.attrs["outcome"] == "stumbled"
    assert last_cycle(data) == pytest.approx(np.asarray(data.time[[0, -1]]))
