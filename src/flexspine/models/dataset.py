"""A run as an xarray Dataset: every quantity over time, with units and provenance."""

from __future__ import annotations

import json
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from flexspine._version import __version__
from flexspine.errors import ParameterError
from flexspine.hybrid.compile import Array
from flexspine.hybrid.trajectory import Trajectory
from flexspine.models.legs import PHASES, SIDES
from flexspine.models.model import check_between
from flexspine.models.simulation import Run
from flexspine.parameters import values

if TYPE_CHECKING:
    import xarray as xr

# s; between samples, where none is given.
DEFAULT_INTERVAL = 1e-3

# m; how much of the ground before and behind the run is kept.
VICINITY = 3.0

# More samples than this are a slip of the pen (a GiB and more), not a wish.
MAX_SAMPLES = 2_000_000

_SIDE_VARIABLES = {
    "toe_x": ("m", "horizontal position of the {} toe; in flight where touchdown would put it"),
    "toe_y": ("m", "height of the {} toe; in flight of the leg held out for touchdown"),
    "hip_x": ("m", "horizontal position of the {} hip"),
    "hip_y": ("m", "height of the {} hip"),
    "leg_length": ("m", "length of the {} leg"),
    "leg_angle": ("rad", "angle of the {} leg from the vertical, foot ahead of the hip positive"),
    "grf_x": ("N", "horizontal ground reaction force on the {} toe, per pair of legs"),
    "grf_y": ("N", "vertical ground reaction force on the {} toe, per pair of legs"),
    "hip_torque": ("N m", "torque that turns the {} leg backward"),
    "grf": ("N", "magnitude of the ground reaction force on the {} toe, per pair of legs"),
}

VARIABLES: dict[str, tuple[str, str]] = {
    "com_x": ("m", "horizontal position of the centre of mass"),
    "com_y": ("m", "height of the centre of mass"),
    "pitch": ("rad", "pitch of the body, nose up positive"),
    "fore_pitch": ("rad", "pitch of the fore segment, nose up positive"),
    "hind_pitch": ("rad", "pitch of the hind segment, nose up positive"),
    "com_x_rate": ("m/s", "forward speed of the centre of mass"),
    "com_y_rate": ("m/s", "vertical speed of the centre of mass"),
    "pitch_rate": ("rad/s", "pitch rate of the body"),
    "fore_pitch_rate": ("rad/s", "pitch rate of the fore segment"),
    "hind_pitch_rate": ("rad/s", "pitch rate of the hind segment"),
    **{
        f"{side}_{name}": (unit, text.format(side))
        for side in SIDES
        for name, (unit, text) in _SIDE_VARIABLES.items()
    },
    "spine_joint_x": ("m", "horizontal position of the spine joint"),
    "spine_joint_y": ("m", "height of the spine joint"),
    "spine_angle": ("rad", "fore pitch minus hind pitch"),
    "spine_torque": ("N m", "torque of the spine on the hind segment, minus that on the fore one"),
    "kinetic_energy": ("J", "kinetic energy"),
    "gravity_energy": ("J", "potential energy of gravity, zero on the ground"),
    "leg_energy": ("J", "elastic energy of both legs"),
    "spine_energy": ("J", "elastic energy of the spine"),
    "total_energy": ("J", "kinetic, gravity, leg and spine energy"),
    "dissipated_energy": ("J", "energy lost in dampers since the start"),
    **{f"{side}_leg_work": ("J", f"work of the {side} leg's thrust") for side in SIDES},
    **{f"{side}_hip_work": ("J", f"work of the {side} hip's torque") for side in SIDES},
    "spine_work": ("J", "work of changing the spine from phase to phase"),
}


def unit_and_meaning(name: str) -> tuple[str, str]:
    """Unit and meaning of a variable; of one that a model of its own adds, by its name."""
    words = name.replace("_", " ")
    if name.endswith(("pitch", "angle")):
        return VARIABLES.get(name, ("rad", words))
    if name.endswith("_rate"):
        return VARIABLES.get(name, ("rad/s", words))
    return VARIABLES.get(name, ("", words))


PHASE_CODES = {phase: code for code, phase in enumerate(PHASES)}


# What adds up to the total energy.
ENERGIES = ("kinetic_energy", "gravity_energy", "leg_energy", "spine_energy")


def sample_times(trajectory: Trajectory, interval: float) -> Array:
    """Return a regular grid of times over a run, the end included, in s.

    Raises `ParameterError` for an interval that is not usable.
    """
    check_interval(interval)
    duration = trajectory.duration
    if duration / interval >= MAX_SAMPLES:
        raise ParameterError(
            f"interval = {interval} s is too short for a run of {duration:.6g} s",
            f"give one that makes fewer than {MAX_SAMPLES} samples",
        )
    start, end = trajectory.start.time, trajectory.end.time
    steps = np.arange(int(duration / interval) + 1, dtype=float)
    grid: Array = np.minimum(start + interval * steps, end)  # rounding may overshoot
    return grid if grid[-1] >= end else np.append(grid, end)


def check_interval(interval: float) -> None:
    """Raise `ParameterError` for a sampling interval (s) that no run can have."""
    check_between("interval", interval, 0, inf)


def checked_times(trajectory: Trajectory, wanted: Array) -> Array:
    """Sorted times, if all of them lie within a run. Raises `ParameterError` otherwise."""
    times = np.asarray(wanted, dtype=float).ravel()
    start, end = trajectory.start.time, trajectory.end.time
    if not np.all((times >= start) & (times <= end)):
        raise ParameterError(
            f"times reach beyond the run, which lasts from {start:.6g} to {end:.6g} s",
            "give times within it",
        )
    return np.sort(times)


def sample(run: Run, times: Array) -> dict[str, Array]:
    """Evaluate every quantity at sorted times (s) within the run, by name, each shape (times,).

    The instant of an event belongs to the phase that follows. ``phase`` holds `PHASE_CODES`.
    """
    names = run.model.state_names
    columns: dict[str, Array] = {}

    def column(name: str) -> Array:
        if name not in columns:
            columns[name] = np.zeros(len(times))
        return columns[name]

    for arc, part in run.trajectory.pieces(times):
        states = arc(times[part])
        column("phase")[part] = PHASE_CODES[arc.mode]
        for name, values_ in zip(names, states.T, strict=True):
            column(name)[part] = values_
        for name, values_ in run.trajectory.observe(arc, states).items():
            column(name)[part] = values_
    columns["total_energy"] = sum((columns[kind] for kind in ENERGIES), np.zeros(len(times)))
    return columns


def to_dataset(
    run: Run, *, interval: float = DEFAULT_INTERVAL, times: Array | None = None
) -> xr.Dataset:
    """Return the run as a Dataset over ``time`` (s), every ``interval`` seconds or at ``times``.

    Variables tell their meaning and their unit; x forward, y up, pitch nose up positive.
    ``phase`` is one of DF, FS, HS, DS. Events stand along ``event`` with ``event_time`` and
    ``event_kind``; ground that is not flat along ``ground``. Attributes carry parameters, versions,
    tolerance and outcome. A run that ended at its first instant has one sample at most. Raises
    `ParameterError` for times that are not usable.

    >>> from flexspine import load_model, simulate, to_dataset
    >>> data = to_dataset(simulate(load_model("kamimura2015-flexible")))
    >>> force = data["fore_grf"]
    >>> f"{force.max().item():.1f} {force.units}"
    '530.5 N'
    """
    import xarray as xr

    trajectory = run.trajectory
    grid = sample_times(trajectory, interval) if times is None else checked_times(trajectory, times)
    columns = sample(run, grid) if run.trajectory.arcs and grid.size else {}
    if not columns:
        grid, columns = grid[:0], {"phase": np.zeros(0)}
    labels = np.array(list(PHASE_CODES))[columns.pop("phase").astype(int)]
    data: dict[str, tuple[str, Array, dict[str, str]]] = {
        name: (
            "time",
            column,
            dict(zip(("units", "long_name"), unit_and_meaning(name), strict=True)),
        )
        for name, column in columns.items()
    }
    events = run.trajectory.events
    return xr.Dataset(
        data_vars={
            **data,
            **_ground(run, columns),
            "phase": ("time", labels, {"long_name": "contact phase", "values": "DF FS HS DS"}),
            "event_time": ("event", np.array([e.time for e in events]), {"units": "s"}),
            "event_kind": ("event", np.array([" + ".join(e.names) for e in events], dtype=str)),
        },
        coords={"time": ("time", grid, {"units": "s", "long_name": "time"})},
        attrs=_attributes(run),
    )


def _ground(run: Run, columns: dict[str, Array]) -> dict[str, tuple[str, Array, dict[str, str]]]:
    """The ground that the run passed over, as a polyline, where it is not flat."""
    ground = run.model.ground
    if ground is None or "com_x" not in columns:
        return {}
    x = columns["com_x"]
    outline = ground.outline(float(x.min()) - VICINITY, float(x.max()) + VICINITY)
    return {
        f"ground_{axis}": ("ground", outline[:, i], {"units": "m", "long_name": text})
        for i, (axis, text) in enumerate((("x", "points of the ground"), ("y", "their height")))
    }


def _attributes(run: Run) -> dict[str, str | float]:
    import heyoka

    model = run.model
    return {
        "title": f"{model.name}: {model.source.title}",
        "model": model.kind.name,
        "preset": model.name,
        **model.source.attributes(),
        "parameters": json.dumps(values(model.parameters)),
        "touchdown_angles": json.dumps(dict(model.touchdown)),
        "apex": json.dumps(dict(model.apex)),
        **({"ground": model.ground.name} if model.ground else {}),
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        **run.remarks,
        "tolerance": run.tolerance,
        "flexspine_version": __version__,
        "heyoka_version": heyoka.__version__,
        "conventions": "SI and radians; x forward, y up, angles counter-clockwise",
    }
