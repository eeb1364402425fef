from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from flexspine import Model, load_model, simulate, to_dataset
from flexspine.errors import ParameterError
from flexspine.models.dataset import VARIABLES
from flexspine.models.files import write_csv, write_events_csv, write_netcdf
from flexspine.parameters import values


def test_a_dataset_has_every_quantity_with_a_unit(flexible: Model) -> None:
    moved = {"legs.extension": 0.01, "legs.hip_lever": 0.01, "spine.rest_shift.fore": 0.1}
    actuated = to_dataset(simulate(flexible.with_values(moved)))
    expected = set(VARIABLES) - {"pitch", "pitch_rate"} | {"phase", "event_time", "event_kind"}
    assert set(actuated.data_vars) == expected
    data = to_dataset(simulate(flexible))
    passive = {name for name in expected if not name.endswith(("_work", "_torque"))}
    assert set(data.data_vars) == passive | {"spine_torque"}
    for name, (unit, _) in VARIABLES.items():
        if name in data:
            assert data[name].attrs["units"] == unit
    assert not any(np.isnan(data[name]).any() for name in VARIABLES if name in data)


def test_a_dataset_says_what_it_is(flexible: Model) -> None:
    attributes = to_dataset(simulate(flexible, tolerance=1e-11)).attrs
    assert json.loads(attributes["parameters"]) == values(flexible.parameters)
    assert attributes["tolerance"] == 1e-11
    assert attributes["outcome"] == "completed"
    assert attributes["heyoka_version"]
    assert attributes["flexspine_version"]


def test_phases_and_events_agree(flexible: Model) -> None:
    data = to_dataset(simulate(flexible))
    kinds = [str(kind) for kind in data.event_kind.values]
    assert kinds == ["fore touchdown", "fore lift-off", "hind touchdown", "hind lift-off", "apex"]
    times = data.event_time.values
    stance = (data.time.values >= times[0]) & (data.time.values < times[1])
    assert set(data.phase.values[stance]) == {"FS"}
    assert np.all((data.fore_grf.values > 0) <= (data.phase.values == "FS"))


def test_speed_is_the_rate_of_position(flexible: Model) -> None:
    """Central differences of every coordinate, away from events."""
    run = simulate(flexible)
    h, t = 1e-5, np.linspace(0.02, 0.08, 13)
    late, now, early = (to_dataset(run, times=t + s) for s in (h, 0.0, -h))
    for name in ("com_x", "com_y", "fore_pitch", "hind_pitch"):
        slope = (late[name].values - early[name].values) / (2 * h)
        np.testing.assert_allclose(now[f"{name}_rate"].values, slope, atol=1e-5)


def test_the_hips_are_where_the_geometry_puts_them(flexible: Model) -> None:
    """Segments of 0.276 m from joint to hip; the whole CoM midway between the segments' CoMs."""
    data = to_dataset(simulate(flexible))
    joint = np.array([data.spine_joint_x, data.spine_joint_y])
    fore = joint + 0.276 * np.array([np.cos(data.fore_pitch), np.sin(data.fore_pitch)])
    np.testing.assert_allclose(fore, [data.fore_hip_x, data.fore_hip_y], atol=1e-14)
    middle_fore = joint + 0.138 * np.array([np.cos(data.fore_pitch), np.sin(data.fore_pitch)])
    middle_hind = joint - 0.138 * np.array([np.cos(data.hind_pitch), np.sin(data.hind_pitch)])
    com = (middle_fore + middle_hind) / 2
    np.testing.assert_allclose(com, [data.com_x, data.com_y], atol=1e-14)


def test_any_sampling_can_be_asked_for(flexible: Model) -> None:
    run = simulate(flexible)
    coarse, fine = to_dataset(run, interval=0.01), to_dataset(run, interval=1e-4)
    assert coarse.sizes["time"] == 27
    assert float(coarse.time[-1]) == run.trajectory.duration
    np.testing.assert_array_equal(coarse.com_y.values[:-1], fine.com_y.values[:-1:100])
    for interval in (0.0, -1.0, float("nan"), 1e-12):
        with pytest.raises(ParameterError, match="interval"):
            to_dataset(run, interval=interval)


def test_a_run_that_fell_keeps_what_it_had() -> None:
    model = load_model("kamimura2015-flexible", touchdown={"fore": -0.3, "hind": -0.3})
    run = simulate(model, strides=5)
    assert run.outcome.name == "fell"
    data = to_dataset(run)
    assert data.attrs["outcome"] == "fell"
    assert float(data.time[-1]) == pytest.approx(run.trajectory.end.time)


def test_netcdf_and_csv_hold_the_same_numbers(flexible: Model, tmp_path: Path) -> None:
    data = to_dataset(simulate(flexible))
    write_netcdf(data, tmp_path / "run.nc")
    write_csv(data, tmp_path / "run.csv")
    write_events_csv(data, tmp_path / "events.csv")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as back:
        xr.testing.assert_identical(back.load(), data)
    with (tmp_path / "run.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["com_y [m]"]) for row in rows] == data.com_y.values.tolist()
    assert [row["phase"] for row in rows] == data.phase.values.tolist()
    with (tmp_path / "events.csv").open() as file:
        events = list(csv.DictReader(file))
    assert [float(row["event_time [s]"]) for row in events] == data.event_time.values.tolist()
