"""The flexible bounder in MuJoCo's terms: the same trunk, on legs that weigh nearly nothing.

Each leg is a hinge at the hip, a slide and a toe, which is a point mass that can be pinned. Our
plane is that of MuJoCo's x and y, gravity acts against y.

The pin is MuJoCo's `connect`, which is as stiff as its contacts can be and obeys the same law. A
contact holds a toe by friction, and only while they press on each other: a light toe that lands
comes off again for a moment and slips meanwhile, so that differences shrink unevenly. A pinned toe
comes back to where it landed.
"""

from __future__ import annotations

from typing import Any

from flexspine.engines.installed import LEAST_INERTIA, constant_impedance, empty_specification
from flexspine.errors import ParameterError
from flexspine.models.actuation import Features
from flexspine.models.flexible_bounder import FLEXIBLE_BOUNDER
from flexspine.models.legs import SIDES
from flexspine.models.model import Model
from flexspine.parameters import values

# Time constant of the pins, in time steps: the least that MuJoCo takes.
PIN = 2.0

# Of a pin; MuJoCo takes no larger impedance.
IMPEDANCE = 0.9999

# Which way each segment's parts lie, seen from the spine joint, and what turns it: the hind one
# hangs on the fore one.
AHEAD = {"fore": 1.0, "hind": -1.0}
PITCHES = {"fore": "pitch", "hind": "spine"}


def check_bounder(bounder: Model) -> None:
    """Raise `ParameterError` for a model that this engine is not fed with."""
    if bounder.kind is not FLEXIBLE_BOUNDER:
        raise ParameterError(
            f"'{bounder.name}' is a {bounder.kind.name}, MuJoCo is given flexible ones only",
            "choose a preset with a flexible spine, such as kamimura2015-flexible",
        )
    bounder.on_flat_ground("legs in MuJoCo")
    has = Features.of(values(bounder.parameters))
    if has.thrust or has.hips or has.switched:
        raise ParameterError(
            f"'{bounder.name}' has actuators, MuJoCo is given springs and dampers only",
            "set stiffening, extension, hip_lever and the shifts of the spine to zero",
        )


def specification(mujoco: Any, bounder: Model, toe: float, step: float) -> Any:
    """The bounder as an `MjSpec`, hung up at its spine joint; mass of a toe in kg, step in s."""
    given = values(bounder.parameters)
    spec = empty_specification(mujoco, (0.0, -given["gravity"], 0.0))
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    hinge, slide = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
    parent = spec.worldbody
    for side in SIDES:
        hip = AHEAD[side] * (given[f"{side}.spine_offset"] + given[f"{side}.hip_offset"])
        com, length = AHEAD[side] * given[f"{side}.spine_offset"], given[f"{side}.leg.rest_length"]
        mass, inertia = given[f"{side}.mass"], given[f"{side}.inertia"]
        parent = _add_body(parent, side, (0, 0, 0), mass, inertia, com)
        if side == "fore":
            parent.add_joint(name="x", type=slide, axis=[1, 0, 0])
            parent.add_joint(name="y", type=slide, axis=[0, 1, 0])
        spine = parent.add_joint(name=PITCHES[side], type=hinge, axis=[0, 0, 1])
        # Of leg and toe only the toe's mass counts; a body has to have some of everything.
        leg = _add_body(parent, f"{side}_leg", (hip, 0, 0), LEAST_INERTIA)
        leg.add_joint(name=f"{side}_hinge", type=hinge, axis=[0, 0, 1])
        point = _add_body(leg, f"{side}_toe", (0, -length, 0), toe)
        reach = point.add_joint(name=f"{side}_slide", type=slide, axis=[0, -1, 0], ref=length)
        reach.springref = length
        pin = spec.add_equality(name=side, type=mujoco.mjtEq.mjEQ_CONNECT, active=False)
        pin.objtype, pin.name1, pin.name2 = mujoco.mjtObj.mjOBJ_BODY, point.name, "world"
        pin.solref, pin.solimp = [PIN * step, 1], constant_impedance(IMPEDANCE)
    # Forces may have quadratic and cubic parts there; ours are linear.
    spine.stiffness = [given["spine.stiffness"], 0, 0]
    spine.damping = [given["spine.damping"], 0, 0]
    # It turns by hind minus fore.
    spine.springref = -given["spine.rest_angle"]
    return spec


def _add_body(
    parent: Any,
    name: str,
    at: tuple[float, float, float],
    mass: float,
    inertia: float = LEAST_INERTIA,
    com: float = 0.0,
) -> Any:
    """Only turns about z matter; a body has to be possible in space all the same."""
    return parent.add_body(
        name=name,
        pos=at,
        mass=mass,
        inertia=[inertia] * 3,
        # MuJoCo would take the place of the body for that of its CoM in it.
        ipos=[com, 0, 0],
        explicitinertial=True,
    )
