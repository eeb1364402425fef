"""The side view of a run in space, with the names that a run in the plane has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def is_spatial(dataset: xr.Dataset) -> bool:
    """Tell a run in space from one in the plane."""
    return dataset.sizes.get("axis") == 3


def sagittal(dataset: xr.Dataset) -> xr.Dataset:
    """Return a run in space as seen from the right: x forward, y up."""
    import xarray as xr

    flat = dataset.sel(axis=["x", "z"]).assign_coords(axis=["x", "y"])
    feet = dataset["foot_name"].values.astype(str)
    stands, slides = (dataset[name].values > 0 for name in ("stands", "slides"))
    sliding = np.char.add(feet, " slides")
    footing = np.array(
        [
            ", ".join(np.where(off, sliding, feet)[on]) or "no foot"
            for on, off in zip(stands, slides, strict=True)
        ]
    )
    return flat.assign(
        footing=("time", footing),
        event_time=("event", np.zeros(0)),
        event_kind=("event", np.zeros(0, dtype=str)),
        event_impulse=xr.DataArray(
            np.zeros((0, len(feet), 2)), dims=("event", "foot_name", "axis")
        ),
    )
