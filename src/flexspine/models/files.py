"""Datasets as files: NetCDF, and CSV for spreadsheets."""

from __future__ import annotations

import csv
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write everything, attributes included, as NetCDF-4."""
    # In memory first: where a disk is full, HDF5 keeps the file open and crashes at the very end.
    whole = BytesIO()
    dataset.to_netcdf(whole, engine="h5netcdf")
    path.write_bytes(whole.getbuffer())


def write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write one row per time; the header has the units, as in ``com_y [m]``."""
    names = [name for name, array in dataset.data_vars.items() if array.dims == ("time",)]
    _write_table(dataset, ["time", *map(str, names)], path)


def write_events_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write one row per event: when and what."""
    _write_table(dataset, ["event_time", "event_kind"], path)


def _write_table(dataset: xr.Dataset, names: list[str], path: Path) -> None:
    units = [dataset[name].attrs.get("units") for name in names]
    header = [
        name + (f" [{unit}]" if unit else "") for name, unit in zip(names, units, strict=True)
    ]
    # Python's own numbers, because their shortest text gives the same double back.
    columns = [np.asarray(dataset[name].values).tolist() for name in names]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))
