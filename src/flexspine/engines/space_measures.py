"""What a run in space comes to, in numbers: speed, forces, oscillation, contact, energy."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexspine._version import STAMP
from flexspine.engines.installed import mujoco_version
from flexspine.engines.space_dataset import space_dataset
from flexspine.engines.space_run import SpaceRun
from flexspine.gaits.record import finite
from flexspine.hybrid.compile import Array
from flexspine.parameters import values

# Of their duration; runs are measured over whole strides after this much of them.
SETTLED = 0.5

# s; how long the shock of a touchdown lasts.
SHOCK = 0.02

# Of a count of strides, and s; what rounding leaves.
ROUNDING = 1e-9


@dataclass(frozen=True)
class SpaceSummary:
    """A run in space in numbers, in SI units and radians.

    All but ``distance``, ``deepest``, ``torque`` and ``imbalance`` are of the whole strides in the
    second half of the run, None or nothing if it did not come so far. ``speed`` is along the mean
    direction of the trunk, ``heading``, from x, and ``turning`` how fast that turns (rad/s).
    ``peak_normal`` is the largest normal force on a foot at any time step, ``impact`` the mean of
    the largest one in each touchdown (its first 20 ms), ``normal`` the mean on feet that the ground
    bears. ``flight`` is the share of time without ground contact. ``bounce`` and ``sway`` are
    standard deviations of the CoM's height and of its distance from its straight way, ``roll`` and
    ``pitch`` of the trunk, ``spine`` of the joints within it. ``cost_of_transport`` is the work of
    all motors, negative work counted as positive, per weight and distance. ``deepest`` is how far a
    foot got into the ground, ``contact_loss`` the energy that a stride lost to it and
    ``damper_loss`` to the dampers of joints. ``error`` is what joints are off their references
    (root mean square). ``imbalance`` is the energy that is not accounted for: what time steps of
    this size get wrong.
    """

    strides: int
    distance: float
    speed: float | None
    heading: float | None
    turning: float | None
    peak_normal: float | None
    impact: float | None
    normal: float | None
    flight: float | None
    bounce: float | None
    sway: float | None
    roll: float | None
    pitch: float | None
    spine: dict[str, float]
    cost_of_transport: float | None
    contact_loss: float | None
    damper_loss: float | None
    error: float | None
    torque: float
    deepest: float
    imbalance: float


def summarize_space(run: SpaceRun) -> SpaceSummary:
    """Measure a run in space, over the whole strides in its second half."""
    samples = run.samples
    time, com = samples["time"], samples["com"]
    energy = samples["kinetic_energy"] + samples["potential_energy"]
    losses = samples["contact_loss"] + samples["damper_loss"]
    balance = energy + losses - samples["motor_work"]
    frequency = run.walk.gains.gait.frequency
    strides = int(run.duration * frequency + ROUNDING)
    whole: dict[str, Any] = {
        "strides": strides,
        "distance": float(np.hypot(*(com[-1] - com[0])[:2])),
        # What broke down in the end has no numbers there.
        "torque": float(np.nanmax(np.abs(samples["torque"]))),
        "deepest": float(np.nanmax(samples["depth"])),
        "imbalance": float(np.nanmax(np.abs(balance - balance[0]))),
    }
    count = int(run.duration * (1 - SETTLED) * frequency + ROUNDING)
    if count < 1 or not run.outcome.completed:
        names = set(SpaceSummary.__dataclass_fields__) - set(whole)
        nothing: dict[str, Any] = {**dict.fromkeys(names), "spine": {}}
        return SpaceSummary(**whole, **nothing)
    # A window whose edges are samples, as nearly whole strides as these allow.
    first = int(np.searchsorted(time, time[-1] - count / frequency - ROUNDING))
    return SpaceSummary(**whole, **_steady(run, slice(first, None), count))


def _steady(run: SpaceRun, part: slice, strides: int) -> dict[str, Any]:
    dataset = space_dataset(run).isel(time=part)
    found = {str(name): column.values for name, column in dataset.data_vars.items()}
    time, com = dataset["time"].values, found["com"]
    lasted, gone = time[-1] - time[0], com[-1] - com[0]
    distance = float(np.hypot(*gone[:2]))
    along = gone[:2] / distance if distance else np.array([1.0, 0.0])
    aside = (com[:, :2] - com[0, :2]) @ [-along[1], along[0]]
    stands, heading = found["stands"] > 0, float(found["trunk_yaw"].mean())
    motors = [dataset["joint"].values.tolist().index(name) for name in dataset["motor"].values]
    power = np.abs(found["torque"] * found["angle_rate"][:, motors]).sum(axis=1)
    work = float(np.trapezoid(power, time))
    weight = run.robot.linkage.mass * run.robot.linkage.gravity
    spine = [hinge.name for hinge in run.space.hinges if not hinge.motor]
    angles = {n: found["angle"][:, dataset["joint"].values.tolist().index(n)] for n in spine}
    off = found["reference"] - found["angle"][:, motors]
    return {
        "speed": float(gone[:2] @ [np.cos(heading), np.sin(heading)] / lasted),
        "heading": heading,
        "turning": float((found["trunk_yaw"][-1] - found["trunk_yaw"][0]) / lasted),
        "peak_normal": float(found["peak_normal"].max()),
        "impact": _impact(time, stands, found["peak_normal"]),
        "normal": float(found["grf"][..., 2][stands].mean()) if stands.any() else None,
        "flight": float((~stands.any(axis=1)).mean()),
        "bounce": float(com[:, 2].std()),
        "sway": float(aside.std()),
        "roll": float(found["trunk_roll"].std()),
        "pitch": float(found["trunk_pitch"].std()),
        "spine": {name: float(angle.std()) for name, angle in angles.items()},
        "cost_of_transport": work / (weight * distance) if distance and weight else None,
        "contact_loss": float(np.ptp(found["contact_loss"][[0, -1]])) / strides,
        "damper_loss": float(np.ptp(found["damper_loss"][[0, -1]])) / strides,
        "error": float(np.sqrt((off**2).mean())),
    }


def _impact(time: Array, stands: NDArray[np.bool_], peaks: Array) -> float | None:
    """The mean over all touchdowns of the largest normal force in their first moments."""
    found = []
    for foot in range(stands.shape[1]):
        landed = np.flatnonzero(stands[1:, foot] & ~stands[:-1, foot]) + 1
        for begin in landed:
            end = int(np.searchsorted(time, time[begin] + SHOCK))
            found.append(peaks[begin : end + 1, foot].max())
    return float(np.mean(found)) if found else None


def space_record(run: SpaceRun, summary: SpaceSummary) -> dict[str, Any]:
    """Return outcome, settings, law of contact and measures as JSON holds them, in SI units."""
    return {
        **STAMP,
        "robot": run.robot.name,
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "advice": run.outcome.advice,
        "duration": run.duration,
        "settings": run.settings,
        "gains": values(run.walk.gains),
        "parameters": dict(run.robot.numbers),
        "contact": {foot: asdict(law) for foot, law in run.laws.items()},
        "measures": finite(asdict(summary)),
        "mujoco_version": mujoco_version(),
    }
