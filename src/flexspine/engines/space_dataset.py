"""Every quantity of a run in space over time, as an xarray Dataset."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexspine._version import __version__
from flexspine.engines.installed import mujoco_version
from flexspine.engines.space_run import SpaceRun
from flexspine.hybrid.compile import Array
from flexspine.models.space import PITCH, LegJoints
from flexspine.parameters import values

if TYPE_CHECKING:
    import xarray as xr

# Of the largest force that friction can; solvers of cones come no closer. Feet that bear less than
# this share of the weight do not count.
EDGE, BORNE = 0.999, 1e-2

# By name: dimensions, unit, meaning.
SPACE_VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "com": (("time", "axis"), "m", "place of the centre of mass"),
    "com_rate": (("time", "axis"), "m/s", "velocity of the centre of mass"),
    "trunk_roll": (("time",), "rad", "mean roll of the trunk's links, left side up positive"),
    "trunk_pitch": (("time",), "rad", "mean pitch of the trunk's links, nose up positive"),
    "trunk_yaw": (("time",), "rad", "mean yaw of the trunk's links, to the left positive"),
    "angle": (("time", "joint"), "rad", "angle of a hinge"),
    "angle_rate": (("time", "joint"), "rad/s", "rate of a hinge"),
    "reference": (("time", "motor"), "rad", "angle that a motor's hinge is to have"),
    "reference_rate": (("time", "motor"), "rad/s", "rate that a motor's hinge is to have"),
    "torque": (("time", "motor"), "N m", "torque of a motor"),
    "link_start": (("time", "link", "axis"), "m", "upper end of a link"),
    "link_end": (("time", "link", "axis"), "m", "lower end of a link; of the trunk, its front"),
    "foot": (("time", "foot_name", "axis"), "m", "lowest point of a foot"),
    "grf": (("time", "foot_name", "axis"), "N", "ground reaction force on a foot"),
    "stands": (("time", "foot_name"), "1", "1 if the ground bears the foot, else 0"),
    "slides": (("time", "foot_name"), "1", "1 if its tangential force is all that friction can"),
    "peak_normal": (("time", "foot_name"), "N", "largest normal force since the last sample"),
    "depth": (("time", "foot_name"), "m", "how deep a foot was in the ground since the last one"),
    "kinetic_energy": (("time",), "J", "kinetic energy"),
    "potential_energy": (("time",), "J", "of weight, zero at height zero, and of springs"),
    "motor_work": (("time",), "J", "work of the motors since the start"),
    "contact_loss": (("time",), "J", "energy that went into the ground, by giving and sliding"),
    "damper_loss": (("time",), "J", "energy lost in the dampers of joints"),
    "total_energy": (("time",), "J", "kinetic and potential energy"),
}


def space_dataset(run: SpaceRun) -> xr.Dataset:
    """Return a run in space over ``time`` (s), at every sample of its controller.

    Dimensions are ``joint``, ``motor``, ``link``, ``foot_name`` and ``axis`` (x forward, y left,
    z up), all by name; variables tell their meaning and their unit. Attributes carry parameters,
    settings, the law of contact, versions and outcome.
    """
    import xarray as xr

    found = _columns(run)
    return xr.Dataset(
        data_vars={
            name: (dimensions, found[name], {"units": unit, "long_name": text})
            for name, (dimensions, unit, text) in SPACE_VARIABLES.items()
        },
        coords={
            "time": ("time", run.samples["time"], {"units": "s", "long_name": "time"}),
            "joint": [hinge.name for hinge in run.space.hinges],
            "motor": list(run.space.motors),
            "link": [part.name for part in run.space.parts],
            "foot_name": [ball.foot for ball in run.space.balls],
            "axis": ["x", "y", "z"],
        },
        attrs=_attributes(run),
    )


def _columns(run: SpaceRun) -> dict[str, Array]:
    samples = run.samples
    turn = samples["turn"]
    angles = {
        "trunk_roll": np.arctan2(turn[..., 2, 1], turn[..., 2, 2]),
        "trunk_pitch": np.arcsin(np.clip(turn[..., 2, 0], -1, 1)),
        "trunk_yaw": np.unwrap(np.arctan2(turn[..., 1, 0], turn[..., 0, 0]), axis=0),
    }
    return {
        **samples,
        **{name: angle.mean(axis=1) for name, angle in angles.items()},
        "stands": (samples["grf"][..., 2] > 0).astype(float),
        "slides": _slides(run).astype(float),
        "total_energy": samples["kinetic_energy"] + samples["potential_energy"],
    }


def _slides(run: SpaceRun) -> NDArray[np.bool_]:
    """Which feet are at the edge of their cones, shape (times, feet)."""
    forces, linkage = run.samples["grf"], run.robot.linkage
    across = np.hypot(forces[..., 0], forces[..., 1])
    found: NDArray[np.bool_] = (forces[..., 2] > BORNE * linkage.mass * linkage.gravity) & (
        across > EDGE * run.robot.friction * forces[..., 2]
    )
    return found


def _attributes(run: SpaceRun) -> dict[str, Any]:
    robot, space = run.robot, run.space
    limbs = {
        name: {
            "links": [leg.shank, leg.thigh],
            "joints": [LegJoints.of(name).hip, LegJoints.of(name).knee],
            "side": robot.legs[name].side,
        }
        for name, leg in space.legs.items()
    }
    return {
        "title": f"{robot.name}, in {'its plane' if space.plane else 'space'}: {run.walk.name}",
        "model": "articulated robot in space",
        "robot": robot.name,
        **robot.source.attributes(),
        "parameters": json.dumps(dict(robot.numbers)),
        "gains": json.dumps(values(run.walk.gains)),
        "gains_provenance": run.walk.source.attributes()["provenance"],
        "gains_source": run.walk.source.source,
        "legs": json.dumps({name: leg.foot for name, leg in space.legs.items()}),
        "limbs": json.dumps(limbs),
        "parents": json.dumps({part.name: part.parent for part in space.parts}),
        "joints": json.dumps(
            {h.name: part.name for part in space.parts for h in part.hinges if h.axis == PITCH}
        ),
        "settings": json.dumps(run.settings),
        "contact": json.dumps({foot: asdict(law) for foot, law in run.laws.items()}),
        "outcome": run.outcome.name,
        "message": run.outcome.message,
        "flexspine_version": __version__,
        "mujoco_version": mujoco_version(),
        "conventions": "SI and radians; x forward, y left, z up; hinges in the plane are "
        "counter-clockwise seen from the right",
    }
