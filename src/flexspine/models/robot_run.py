"""A run of a robot, and every quantity of it over time as an xarray Dataset."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flexspine._version import __version__
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.trajectory import Arc, Event, Trajectory
from flexspine.models.articulated import LOSS, BoundRobot, impulse
from flexspine.models.dataset import DEFAULT_INTERVAL, checked_times, sample_times
from flexspine.models.footing import Footing
from flexspine.models.robot import Robot

if TYPE_CHECKING:
    import xarray as xr

# Events at which feet may get an impulse, by the end of their names.
HITS = ("touchdown", "push")

# Happens too often to be news.
SAMPLE = "sample"

# By name: dimensions, unit, meaning.
ROBOT_VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "com": (("time", "axis"), "m", "place of the centre of mass"),
    "com_rate": (("time", "axis"), "m/s", "velocity of the centre of mass"),
    "trunk_pitch": (("time",), "rad", "mean pitch of the trunk's links, nose up positive"),
    "angle": (("time", "joint"), "rad", "relative angle of a joint"),
    "angle_rate": (("time", "joint"), "rad/s", "rate of a joint's relative angle"),
    "reference": (("time", "motor"), "rad", "angle that a motor's joint is to have"),
    "torque": (("time", "motor"), "N m", "torque of a motor"),
    "link_angle": (("time", "link"), "rad", "angle of a link from +x"),
    "link_start": (("time", "link", "axis"), "m", "where a link starts"),
    "link_end": (("time", "link", "axis"), "m", "where a link ends"),
    "foot": (("time", "foot_name", "axis"), "m", "place of a foot"),
    "grf": (("time", "foot_name", "axis"), "N", "ground reaction force on a foot"),
    "stands": (("time", "foot_name"), "1", "1 on the ground, 0 in the air"),
    "slides": (("time", "foot_name"), "1", "1 sliding forward, -1 back, 0 not"),
    "kinetic_energy": (("time",), "J", "kinetic energy"),
    "potential_energy": (("time",), "J", "of weight, zero at height zero, and of springs"),
    "motor_work": (("time",), "J", "work of the motors since the start"),
    "dissipated_energy": (("time",), "J", "energy lost in dampers and by sliding"),
    "impact_loss": (("time",), "J", "kinetic energy lost at impacts"),
    "total_energy": (("time",), "J", "kinetic and potential energy"),
}


@dataclass(frozen=True)
class RobotRun:
    """A simulated run of a robot. ``settings`` are what it was asked for."""

    bound: BoundRobot
    trajectory: Trajectory
    tolerance: float
    settings: dict[str, Any]

    @property
    def robot(self) -> Robot:
        """What ran."""
        return self.bound.robot

    @property
    def outcome(self) -> Outcome:
        """How the run ended."""
        return self.trajectory.outcome

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """What happened, but for the ticking of a controller's clock."""
        return tuple(event for event in self.trajectory.events if event.names != (SAMPLE,))

    def impulses(self, event: Event) -> Array:
        """The impulses on the feet at an event in N s, shape (feet, 2); zero if it was no hit."""
        feet = self.robot.feet
        if not event.names[0].endswith(HITS):
            return np.zeros((len(feet), 2))
        places = self.bound.system.places
        return np.array(
            [[event.after.held[places[part]] for part in impulse(foot)] for foot in feet]
        )


def robot_dataset(
    run: RobotRun, *, interval: float = DEFAULT_INTERVAL, times: Array | None = None
) -> xr.Dataset:
    """Return the run over ``time`` (s), every ``interval`` seconds or at ``times``.

    Dimensions are ``joint``, ``motor``, ``link``, ``foot_name`` and ``axis`` (x, y), all by name;
    `ROBOT_VARIABLES` tells what there is. ``footing`` names the feet on the ground. Events stand
    along ``event`` with ``event_time``, ``event_kind`` and ``event_impulse`` (N s by foot and
    axis). Attributes carry parameters, settings, versions, tolerance and outcome. Raises
    `ParameterError` for times that are not usable.
    """
    import xarray as xr

    trajectory = run.trajectory
    grid = sample_times(trajectory, interval) if times is None else checked_times(trajectory, times)
    parts = [_sample(run, arc, grid[part]) for arc, part in trajectory.pieces(grid)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    footings = columns.pop("footing")
    events, robot = run.events, run.robot
    hits = np.array([run.impulses(event) for event in events]).reshape(-1, len(robot.feet), 2)
    return xr.Dataset(
        data_vars={
            **{
                name: (ROBOT_VARIABLES[name][0], column, _about(name))
                for name, column in columns.items()
            },
            "footing": ("time", footings, {"long_name": "feet on the ground"}),
            "event_time": ("event", np.array([e.time for e in events]), {"units": "s"}),
            "event_kind": ("event", np.array([" + ".join(e.names) for e in events], dtype=str)),
            "event_impulse": (("event", "foot_name", "axis"), hits, {"units": "N s"}),
        },
        coords={
            "time": ("time", grid, {"units": "s", "long_name": "time"}),
            "joint": list(robot.joints),
            "motor": [name for name, (_, motor) in robot.joints.items() if motor],
            "link": list(robot.parents),
            "foot_name": list(robot.feet),
            "axis": ["x", "y"],
        },
        attrs=_attributes(run),
    )


def _about(name: str) -> dict[str, str]:
    _, unit, text = ROBOT_VARIABLES[name]
    return {"units": unit, "long_name": text}


def _sample(run: RobotRun, arc: Arc, times: Array) -> dict[str, Any]:
    """Every quantity at times within one arc."""
    bound, robot, linkage = run.bound, run.robot, run.robot.linkage
    n, count = linkage.size, len(times)
    states = arc(times)
    q, rates = states[:, :n] @ linkage.to_relative.T, states[:, n : 2 * n] @ linkage.to_relative.T
    seen = bound.observe(arc.mode, states, arc.held)
    held = dict(zip(bound.system.held, arc.held.tolist(), strict=True))
    footing = Footing.in_flags(held, robot.feet)
    flags = np.array(list(footing.flags(robot.feet).values())).reshape(-1, 2)
    places = [linkage.place[joint] for joint in robot.joints]
    motors = [name for name, (_, motor) in robot.joints.items() if motor]
    found: dict[str, Any] = {
        "com": linkage.com(q),
        "com_rate": (linkage.com_jacobian(q) @ rates[..., None])[..., 0],
        "angle": q[:, places],
        "angle_rate": rates[:, places],
        "torque": _table(seen, "torque", motors, count),
        "link_angle": linkage.angles(q),
        "link_start": np.stack([linkage.point(q, l.name, 0.0) for l in linkage.links], axis=1),
        "link_end": np.stack([linkage.point(q, l.name, l.length) for l in linkage.links], axis=1),
        "foot": np.stack([linkage.foot(q, foot) for foot in robot.feet], axis=1),
        "grf": np.stack([_table(seen, f"force_{axis}", robot.feet, count) for axis in "xy"], axis=2),
        "stands": np.tile(flags[:, 0], (count, 1)),
        "slides": np.tile(flags[:, 1], (count, 1)),
        "kinetic_energy": linkage.kinetic_energy(q, rates),
        "potential_energy": linkage.potential_energy(q),
        "motor_work": states[:, 2 * n + 1],
        "dissipated_energy": states[:, 2 * n + 2],
        "impact_loss": np.full(count, held[LOSS]),
        "footing": np.full(count, footing.name, dtype=object),
    }
    if any(name.startswith("reference_") for name in seen):
        found["reference"] = _table(seen, "reference", motors, count)
    trunk = sorted({linkage.place[leg.trunk] for leg in robot.legs.values()})
    if trunk:
        found["trunk_pitch"] = found["link_angle"][:, trunk].mean(axis=1)
    found["total_energy"] = found["kinetic_energy"] + found["potential_energy"]
    return found


def _table(seen: dict[str, Array], kind: str, names: Any, count: int) -> Array:
    """Observables of a kind, shape (times, names); those that are not observed are zero."""
    columns = [seen.get(f"{kind}_{name}", np.zeros(count)) for name in names]
    return np.array(columns).reshape(len(columns), count).T


def _attributes(run: RobotRun) -> dict[str, str | float]:
    import heyoka

    robot = run.robot
    return {
        "title": f"{robot.name}: {robot.source.title}",
        "model": "articulated robot",
        "robot": robot.name,
        "citation": robot.source.citation,
        "parameters": json.dumps(dict(robot.numbers)),
        "provenance": json.dumps(dict(robot.source.provenance)),
        "legs": json.dumps({name: leg.foot for name, leg in robot.legs.items()}),
        "parents": json.dumps(dict(robot.parents)),
        "joints": json.dumps({name: link for name, (link, _) in robot.joints.items()}),
        "settings": json.dumps(run.settings),
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "tolerance": run.tolerance,
        "flexspine_version": __version__,
        "heyoka_version": heyoka.__version__,
        "conventions": "SI and radians; x forward, y up, angles counter-clockwise",
    }
