"""What a walk comes to, in numbers: speed, forces, torques, slip, energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexspine.errors import FlexspineError
from flexspine.hybrid.compile import Array
from flexspine.models.articulated import anchor
from flexspine.models.robot_run import RobotRun, robot_dataset

if TYPE_CHECKING:
    import xarray as xr

# s; between the samples from which largest and least values are taken.
INTERVAL = 1e-3


@dataclass(frozen=True)
class WalkSummary:
    """A walk of a planar robot in numbers, in SI units and radians.

    ``steps`` were done, ``distance`` is that of the CoM. ``speed`` and ``cost_of_transport`` are of
    the whole steps in the second half of the run (None if there are none), all else of the whole
    run, sampled every millisecond. ``normal`` is the range of the normal forces on feet that are to
    stand, ``friction_demand`` the largest ratio of tangential to normal force of feet that stand
    without sliding, ``sliding`` the share of time in which some foot slides. ``peak_force`` is the
    largest force on a foot, ``impulse`` the largest normal impulse, ``torque`` the largest of a
    motor, ``drift`` how far a foot that sticks gets from where it landed, ``error`` and
    ``mean_error`` (root mean square) what joints are off their references. ``cost_of_transport`` is
    the work of all motors, negative work counted as positive, per weight and distance. ``height``
    is the range of the CoM's, ``pitch`` that of the trunk's, ``spine`` that of every joint without
    motor; ``imbalance`` is the energy that is not accounted for.
    """

    steps: int
    distance: float
    speed: float | None
    cost_of_transport: float | None
    normal: tuple[float, float]
    peak_force: float
    friction_demand: float
    sliding: float
    torque: float
    impulse: float
    drift: float
    error: float
    mean_error: float
    height: tuple[float, float]
    pitch: tuple[float, float]
    spine: dict[str, tuple[float, float]]
    imbalance: float


def summarize_walk(run: RobotRun) -> WalkSummary:
    """Measure a run of a planar robot that walks.

    Raises `FlexspineError` if it did not even begin.
    """
    dataset = robot_dataset(run, interval=INTERVAL)
    if not dataset.sizes["time"]:
        # No InputError: its exit code is that of a run that ended without its goal.
        raise FlexspineError(
            f"the run ended where it began: {run.outcome.message}", run.outcome.advice
        )
    forces, stands = dataset["grf"].values, dataset["stands"].values > 0
    sliding = dataset["slides"].values != 0
    planned, anchors, step = _plan(run, dataset["time"].values)
    normal = forces[..., 1]
    sticks = stands & ~sliding & (normal > 0)
    angles = dataset["angle"].sel(joint=dataset["motor"].values).values
    off = np.abs(angles - dataset["reference"].values)
    com = dataset["com"].values
    balance = sum(dataset[name].values for name in ("total_energy", "dissipated_energy"))
    balance = balance + dataset["impact_loss"].values - dataset["motor_work"].values
    speed, cost = _steady(run, dataset, step)
    return WalkSummary(
        steps=int(step[-1]),
        distance=float(com[-1, 0] - com[0, 0]),
        speed=speed,
        cost_of_transport=cost,
        normal=_range(normal[planned]),
        peak_force=float(np.hypot(*np.moveaxis(forces, -1, 0)).max()),
        friction_demand=float((np.abs(forces[sticks, 0]) / normal[sticks]).max(initial=0.0)),
        sliding=float(sliding.any(axis=1).mean()),
        torque=float(np.abs(dataset["torque"].values).max()),
        impulse=float(dataset["event_impulse"].values[..., 1].max(initial=0.0)),
        drift=_drift(dataset, stands & ~sliding, anchors),
        error=float(off.max()),
        mean_error=float(np.sqrt((off**2).mean())),
        height=_range(com[:, 1]),
        pitch=_range(dataset["trunk_pitch"].values),
        spine={
            name: _range(dataset["angle"].sel(joint=name).values)
            for name, (_, motor) in run.robot.joints.items()
            if not motor
        },
        imbalance=float(np.abs(balance - balance[0]).max()),
    )


def _range(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _plan(run: RobotRun, times: Array) -> tuple[Array, Array, Array]:
    """Which feet are to stand, where feet are anchored (both (times, feet)), and the steps done."""
    drive, system = run.bound.drive, run.bound.system
    feet = list(run.robot.feet)
    planned = np.zeros((len(times), len(feet)), dtype=bool)
    anchors = np.zeros(planned.shape)
    step = np.zeros(len(times))
    where = [system.places[anchor(foot)[0]] for foot in feet]
    for arc, part in run.trajectory.pieces(times):
        held = dict(zip(system.held, arc.held.tolist(), strict=True))
        step[part] = drive.steps(held)
        planned[part] = [foot in drive.to_stand(held) for foot in feet]
        anchors[part] = arc.held[where]
    return planned, anchors, step


def _drift(dataset: xr.Dataset, sticks: Array, anchors: Array) -> float:
    """How far feet that stick get from their anchors, in m."""
    place = dataset["foot"].values
    off = np.hypot(place[..., 0] - anchors, place[..., 1])
    return float(off[sticks].max(initial=0.0))


def _steady(run: RobotRun, dataset: xr.Dataset, step: Array) -> tuple[float | None, float | None]:
    """Speed and cost of transport over the whole steps in the second half of the run."""
    changes = np.flatnonzero(np.diff(step)) + 1
    whole = changes[changes >= len(step) // 2]
    whole = whole[len(whole) % 2 == 0 :]  # an even number of steps: both pairs alike
    if len(whole) < 3:
        return None, None
    first, last = int(whole[0]), int(whole[-1])
    time, x = dataset["time"].values, dataset["com"].values[:, 0]
    distance = float(x[last] - x[first])
    rates = dataset["angle_rate"].sel(joint=dataset["motor"].values).values
    power = np.abs(dataset["torque"].values * rates).sum(axis=1)[first : last + 1]
    work = float(np.trapezoid(power, time[first : last + 1]))
    weight = run.robot.linkage.mass * run.robot.linkage.gravity
    cost = work / (weight * abs(distance)) if distance and weight else None
    return distance / float(time[last] - time[first]), cost
