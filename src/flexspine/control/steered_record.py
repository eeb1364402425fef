"""A run under feedback as one JSON object, and its apexes as a table."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from flexspine._version import STAMP
from flexspine.control.stabilize import Stabilizer
from flexspine.control.steering import Fixed, SteeredRun
from flexspine.gaits.gait import Gait
from flexspine.gaits.record import finite
from flexspine.gaits.stability import floquet_multipliers
from flexspine.models.bounder import DISSIPATED, FELL, works
from flexspine.models.dataset import ENERGIES
from flexspine.parameters import values


def stabilizer_record(stabilizer: Stabilizer) -> dict[str, Any]:
    """The gait, what is steered, gains in natural units, multipliers without and with feedback.

    The spectral radius ``on_level`` is that with feedback, but for the multiplier 1 of an energy
    that nothing changes.
    """
    record = _gait_record(stabilizer.gait)
    return {
        **record,
        "inputs": list(stabilizer.inputs),
        "usual": stabilizer.usual.tolist(),
        "method": stabilizer.method,
        "acts_per_stride": len(stabilizer.parts),
        "gains": [gain.tolist() for gain in stabilizer.gains],
        "floquet_multipliers": {
            **record["floquet_multipliers"],
            "with": [[value.real, value.imag] for value in stabilizer.multipliers.tolist()],
        },
        "spectral_radius": {
            **record["spectral_radius"],
            "with": float(np.abs(stabilizer.multipliers[0])),
            "on_level": stabilizer.level_spectral_radius,
        },
    }


def _gait_record(gait: Gait) -> dict[str, Any]:
    model, free = gait.model, floquet_multipliers(gait)
    return {
        "preset": model.name,
        "model": model.kind.name,
        "parameters": values(model.parameters),
        "apex": dict(model.apex),
        "touchdown_angles": dict(model.touchdown),
        "mean_speed": gait.mean_speed,
        "energy": gait.energy,
        "floquet_multipliers": {
            "without": [[value.real, value.imag] for value in free.multipliers]
        },
        "spectral_radius": {"without": free.spectral_radius},
    }


def steered_record(
    run: SteeredRun, gait: Gait, stabilizer: Stabilizer | None = None
) -> dict[str, Any]:
    """How a run of a gait under feedback, or without, went; deviations in natural units."""
    start, end = run.trajectory.start, run.trajectory.end
    distance = float(end.states[0] - start.states[0])
    rows = apex_table(run, gait)
    record = {
        **STAMP,
        **(_gait_record(gait) if stabilizer is None else stabilizer_record(stabilizer)),
        "noise": asdict(run.noise),
        "seed": run.seed,
        "ground": run.model.ground.name if run.model.ground else None,
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "advice": _advice(run),
        "strides": len(run.trajectory.crossings),
        "duration": end.time - start.time,
        "distance": distance,
        "achieved_speed": distance / (end.time - start.time) if end.time > start.time else None,
        **_energy(run),
        "largest_deviation": max((row["deviation"] for row in rows), default=0.0),
        "last_deviation": rows[-1]["deviation"] if rows else 0.0,
    }
    return {key: finite(value) for key, value in record.items()}


def _energy(run: SteeredRun) -> dict[str, Any]:
    """Energy at the start and the end, what became of it between, and what is unaccounted for."""
    trajectory, bound = run.trajectory, run.trajectory.bound
    points = (trajectory.start, trajectory.end)
    places = bound.system.places
    seen = [bound.observe(p.mode, p.states[None], p.held[None]) for p in points]
    total = [sum(float(each[kind][0]) for kind in ENERGIES) for each in seen]
    lost = [float(point.states[places[DISSIPATED]]) for point in points]
    work = {
        name: float(points[1].states[places[symbol]] - points[0].states[places[symbol]])
        for name, symbol in works(run.model.keeping(run.steering.inputs).features).items()
    }
    off = total[1] - total[0] + lost[1] - lost[0] - sum(work.values())
    return {
        "energy_at_start": total[0],
        "energy_at_end": total[1],
        "dissipated": lost[1] - lost[0],
        "net_work": work,
        "energy_unaccounted": abs(off) / abs(total[0]) if total[0] else None,
    }


def _advice(run: SteeredRun) -> str:
    if run.outcome.name == FELL.name and not isinstance(run.steering, Fixed):
        return "disturb it less, or steer otherwise: other inputs, twice a stride, another effort"
    return run.outcome.advice


def apex_table(run: SteeredRun, gait: Gait) -> list[dict[str, float]]:
    """One row per apex: when and where, its coordinates, how far off they are, what was steered.

    The height is that above the ground. ``deviation`` is the length of the vector of deviations
    from the gait, in natural units.
    """
    model, undisturbed = run.model, gait.model
    rows = []
    for number, (point, apex, inputs) in enumerate(
        zip(run.section_points, run.apexes, run.inputs, strict=True)
    ):
        x = float(point.states[0])
        if model.ground is not None:
            apex = {**apex, "height": apex["height"] - model.ground.height(x)}
        off = [(apex[n] - undisturbed.apex[n]) / undisturbed.scales[n] for n in apex]
        rows.append(
            {
                "stride": number,
                "time": point.time,
                "com_x": x,
                **apex,
                "deviation": float(np.linalg.norm(off)),
                **inputs,
            }
        )
    return rows
