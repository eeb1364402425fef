"""A run of a robot, and every quantity of it over time as an xarray Dataset."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from flexspine._version import __version__
from flexspine.hybrid.compile import Array
from flexspine.hybrid.outcome import Outcome
from flexspine.hybrid.trajectory import Event, Trajectory
from flexspine.models.articulated import DISSIPATED, LOSS, WORK, impulse
from flexspine.models.bound_robot import BoundRobot
from flexspine.models.dataset import DEFAULT_INTERVAL, checked_times, sample_times
from flexspine.models.footing import Footing, flags_of
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
    "reference_rate": (("time", "motor"), "rad/s", "rate that a motor's joint is to have"),
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
    "impact_loss": (("time",), "J", "kinetic energy lost at impacts, less what a push added"),
    "total_energy": (("time",), "J", "kinetic and potential energy"),
}


@dataclass(frozen=True)
class RobotRun:
    """A simulated run of a planar robot; `robot_dataset` gives every quantity of it over time.

    ``bound`` is the robot with its controller, ``settings`` are what was asked for, ``tolerance``
    is the integrator's.
    """

    bound: BoundRobot
    trajectory: Trajectory
    tolerance: float
    settings: dict[str, Any]

    def __repr__(self) -> str:
        told = f"{self.trajectory.duration:.4g} s, {self.outcome.name}"
        return f"<RobotRun of {self.robot.name}: {told}>"

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
        """Return the impulses on the feet at an event in N s, shape (feet, 2), x and y.

        Zero if it was neither a touchdown nor a push.
        """
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
    variables tell their meaning and their unit. ``footing`` names the feet on the ground. Events
    stand along ``event`` with ``event_time``, ``event_kind`` and ``event_impulse`` (N s by foot and
    axis). Attributes carry parameters, settings, versions, tolerance and outcome. A run that ended
    at its first instant has no samples. Raises `ParameterError` for times that are not usable.
    """
    import xarray as xr

    trajectory = run.trajectory
    grid = sample_times(trajectory, interval) if times is None else checked_times(trajectory, times)
    if not trajectory.arcs:
        grid = grid[:0]
    columns = _sample(run, grid)
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
            "motor": list(robot.motors),
            "link": list(robot.parents),
            "foot_name": list(robot.feet),
            "axis": ["x", "y"],
        },
        attrs=_attributes(run),
    )


def _about(name: str) -> dict[str, str]:
    _, unit, text = ROBOT_VARIABLES[name]
    return {"units": unit, "long_name": text}


def _sample(run: RobotRun, times: Array) -> dict[str, Any]:
    """Every quantity at sorted times."""
    bound, robot, linkage = run.bound, run.robot, run.robot.linkage
    n, count, system = linkage.size, len(times), run.bound.system
    states = np.zeros((count, len(system.states)))
    held = np.zeros((count, len(system.held)))
    modes = np.zeros(count, dtype=object)
    for arc, part in run.trajectory.pieces(times):
        states[part], held[part], modes[part] = arc(times[part]), arc.held, arc.mode
    seen = _observed(bound, modes, states, held)
    flags = {foot: [held[:, system.places[f]] for f in flags_of(foot)] for foot in robot.feet}
    q, rates = states[:, :n] @ linkage.to_relative.T, states[:, n : 2 * n] @ linkage.to_relative.T
    places = [linkage.place[joint] for joint in robot.joints]
    starts = [linkage.point(q, link.name, 0.0) for link in linkage.links]
    ends = [linkage.point(q, link.name, link.length) for link in linkage.links]
    forces = [_table(seen, f"force_{axis}", robot.feet, count) for axis in "xy"]
    found: dict[str, Any] = {
        "com": linkage.com(q),
        "com_rate": (linkage.com_jacobian(q) @ rates[..., None])[..., 0],
        "angle": q[:, places],
        "angle_rate": rates[:, places],
        "torque": _table(seen, "torque", robot.motors, count),
        "link_angle": linkage.angles(q),
        "link_start": np.stack(starts, axis=1),
        "link_end": np.stack(ends, axis=1),
        "foot": np.stack([linkage.foot(q, foot) for foot in robot.feet], axis=1),
        "grf": np.stack(forces, axis=2),
        "stands": np.stack([stands for stands, _ in flags.values()], axis=1),
        "slides": np.stack([slides for _, slides in flags.values()], axis=1),
        "kinetic_energy": linkage.kinetic_energy(q, rates),
        "potential_energy": linkage.potential_energy(q),
        "motor_work": states[:, system.places[WORK]],
        "dissipated_energy": states[:, system.places[DISSIPATED]],
        "impact_loss": held[:, system.places[LOSS]],
        "footing": np.array([_footing_name(row) for row in _rows(flags)], dtype=object),
    }
    for kind in ("reference", "reference_rate"):
        if all(f"{kind}_{joint}" in seen for joint in robot.motors):
            found[kind] = _table(seen, kind, robot.motors, count)
    trunk = sorted({linkage.place[leg.trunk] for leg in robot.legs.values()})
    if trunk:
        found["trunk_pitch"] = found["link_angle"][:, trunk].mean(axis=1)
    found["total_energy"] = found["kinetic_energy"] + found["potential_energy"]
    return found


def _observed(
    bound: BoundRobot, modes: NDArray[np.object_], states: Array, held: Array
) -> dict[str, Array]:
    """What the modes observe, each over all times."""
    seen: dict[str, Array] = {}
    for mode in sorted(set(modes)):
        here = modes == mode
        for name, values in bound.observe(mode, states[here], held[here]).items():
            seen.setdefault(name, np.zeros(len(modes)))[here] = values
    return seen


def _rows(flags: dict[str, list[Array]]) -> Iterator[tuple[tuple[str, float, float], ...]]:
    """Foot, whether it stands and how it slides, of all feet at each time."""
    columns = [
        [(foot, *pair) for pair in zip(stands.tolist(), slides.tolist(), strict=True)]
        for foot, (stands, slides) in flags.items()
    ]
    return zip(*columns, strict=True)


@lru_cache(maxsize=1024)
def _footing_name(row: tuple[tuple[str, float, float], ...]) -> str:
    held: dict[sp.Symbol, float] = {}
    for foot, *pair in row:
        held |= dict(zip(flags_of(foot), pair, strict=True))
    return Footing.in_flags(held, [foot for foot, *_ in row]).name


def _table(seen: dict[str, Array], kind: str, names: Iterable[str], count: int) -> Array:
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
        **robot.source.attributes(),
        "parameters": json.dumps(dict(robot.numbers)),
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
