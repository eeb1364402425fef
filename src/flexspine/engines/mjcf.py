"""A robot in space in MuJoCo's terms: an `MjSpec`, from which a model is compiled or written.

The bodies hang as `flexspine.models.space` says, in the posture in which the robot stands, so
that viewers show it on its feet; angles keep their zero, which is all links in line. Only feet
meet the ground. Motors turn hinges by the torque that they are told.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from flexspine.control.leg_function import standing
from flexspine.engines.contact import IMPEDANCE, TANGENTIAL, ContactLaw
from flexspine.engines.installed import LEAST_INERTIA, constant_impedance, empty_specification
from flexspine.hybrid.compile import Array
from flexspine.models.space import OUT, PITCH, Part, SpaceRobot

# Of the reach of the shortest leg; how high hips are in the posture of the description.
STANDING = 0.8

# s; ten steps are one sample of a computer at 400 Hz.
STEP = 2.5e-4

# Coordinates of a robot that is kept to the plane.
ROOT_X, ROOT_Z, ROOT_PITCH = "root_x", "root_z", "root_pitch"

COLORS = {
    "trunk": (0.35, 0.44, 0.55, 1.0),
    "left": (0.93, 0.68, 0.47, 1.0),
    "right": (0.82, 0.42, 0.16, 1.0),
}
# N m/rad, N m s/rad; of springs that keep the robot standing.
HOLD = 300.0, 4.0

# m; between the trunk and the legs, as pictures show them.
GAP = 0.004

DARK = (0.15, 0.15, 0.17, 1.0)
GROUND = (0.93, 0.93, 0.91), (0.83, 0.84, 0.83)

FLOOR = "floor"


class Start(NamedTuple):
    """Where a robot is that stands: x and z of its first part, its pitch, angles by hinge."""

    place: tuple[float, float]
    pitch: float
    angles: dict[str, float]

    @classmethod
    def of(cls, space: SpaceRobot, q: Array) -> Start:
        """Where a robot in the plane is at ``q``, shape (N,)."""
        (x, z), pitch = space.root(q)
        angles = {name: float(angle) for name, angle in space.angles(q).items()}
        return cls((float(x), float(z)), float(pitch), angles)


def standing_start(space: SpaceRobot, height: float | None = None) -> Start:
    """The robot on its feet, hips at a ``height`` (m) above the lowest points of its feet."""
    if height is None:
        height = STANDING * min(leg.reach for leg in space.legs.values())
    return Start.of(space, standing(space.robot, height))


def specification(
    mujoco: Any, space: SpaceRobot, *, ground: bool = True, hold: bool = False
) -> Any:
    """The robot as an `MjSpec`, on flat ground unless there is to be none.

    With ``hold`` springs and dampers at the hinges with motors keep it standing by itself.
    """
    spec = _drawn(mujoco, space, ground)
    if hold:
        for joint in spec.joints:
            if joint.name in space.motors:
                joint.stiffness, joint.damping = [HOLD[0], 0, 0], [HOLD[1], 0, 0]
                joint.springref = joint.ref
    if ground:
        # How much a foot gives is known of a compiled model only.
        model = spec.compile()
        for pair in spec.pairs:
            body = model.geom_bodyid[model.geom(pair.geomname2).id]
            law = ContactLaw.of(space.numbers, float(model.body_invweight0[body][0]))
            pair.solref = law.solref
            pair.solreffriction = law.solreffriction
            pair.solimp = constant_impedance(IMPEDANCE)
    return spec


def _drawn(mujoco: Any, space: SpaceRobot, ground: bool) -> Any:
    spec = empty_specification(mujoco, (0.0, 0.0, -space.robot.linkage.gravity))
    spec.modelname = space.robot.name
    spec.comment = (
        f"{space.robot.source.title}. Made by flexspine. SI units, radians; x forward, y left, z "
        "up. Hinges about -y are counter-clockwise seen from the right; all links are in line at 0."
    )
    spec.option.timestep = STEP
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = TANGENTIAL
    _draw_scene(mujoco, spec, ground)
    start = standing_start(space)
    bodies: dict[str | None, Any] = {None: spec.worldbody}
    for part in space.parts:
        bodies[part.name] = _add_body(mujoco, bodies[part.parent], space, part, start)
    friction = space.robot.friction
    for ball in space.balls:
        bodies[ball.part].add_geom(
            name=ball.foot,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[ball.radius, 0, 0],
            pos=[ball.end - ball.radius, 0, 0],
            rgba=DARK,
            contype=0,
            conaffinity=0,
        )
        if ground:
            spec.add_pair(
                name=ball.foot,
                geomname1=FLOOR,
                geomname2=ball.foot,
                condim=3,
                friction=[friction, friction, 0, 0, 0],
            )
    for motor in space.motors:
        spec.add_actuator(
            name=motor, target=motor, trntype=mujoco.mjtTrn.mjTRN_JOINT, gear=[1, 0, 0, 0, 0, 0]
        )
    return spec


def _draw_scene(mujoco: Any, spec: Any, ground: bool) -> None:
    world = spec.worldbody
    world.add_light(
        pos=[0, 0, 4], dir=[0.2, 0.3, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        castshadow=False, diffuse=[0.6, 0.6, 0.6],
    )  # fmt: skip
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.visual.headlight.diffuse = [0.25, 0.25, 0.25]
    spec.visual.headlight.specular = [0, 0, 0]
    getattr(spec.visual, "global").offwidth = 1280
    getattr(spec.visual, "global").offheight = 720
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, rgb1=[1, 1, 1], rgb2=[0.8, 0.86, 0.92],
        width=64, height=384,
    )  # fmt: skip
    if not ground:
        return
    spec.add_texture(
        name="tiles", type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER, rgb1=GROUND[0], rgb2=GROUND[1],
        width=256, height=256,
    )  # fmt: skip
    tiles = spec.add_material(name="tiles", texrepeat=[4, 4], texuniform=True)
    tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    world.add_geom(
        name=FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], material="tiles",
        contype=0, conaffinity=0,
    )  # fmt: skip


def _add_body(mujoco: Any, parent: Any, space: SpaceRobot, part: Part, start: Start) -> Any:
    """A part, and the hinges or the freedom that it has."""
    free = part.parent is None
    angle = start.pitch if free else sum(
        start.angles[hinge.name] for hinge in part.hinges if hinge.axis == PITCH
    )  # fmt: skip
    body = parent.add_body(
        name=part.name,
        pos=[start.place[0], 0, start.place[1]] if free else part.place,
        quat=[cos(angle / 2), 0, -sin(angle / 2), 0],
        mass=part.mass,
        ipos=[part.com, 0, 0],
        inertia=np.maximum(part.inertia, LEAST_INERTIA),
        explicitinertial=True,
    )
    if free and space.plane:
        _free_in_plane(mujoco, body, start)
    elif free:
        body.add_freejoint(name="root")
    for hinge in part.hinges:
        # The trunk's axis, seen from the thigh that hangs down.
        axis = (cos(angle), 0.0, -sin(angle)) if hinge.axis == OUT else hinge.axis
        joint = body.add_joint(
            name=hinge.name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=axis,
            ref=start.angles[hinge.name],
        )
        # Forces may have quadratic and cubic parts there; ours are linear.
        joint.stiffness, joint.damping = [hinge.stiffness, 0, 0], [hinge.damping, 0, 0]
        joint.springref = hinge.rest
    # Shanks end in the middle of their feet, and the trunk is drawn between the legs.
    shown = part.length - sum(ball.radius for ball in space.balls if ball.part == part.name)
    body.add_geom(
        name=part.name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[shown / 2, _drawn_width(space, part) / 2, part.height / 2],
        pos=[shown / 2, 0, 0],
        rgba=COLORS[_kind(space, part)],
        contype=0,
        conaffinity=0,
    )
    if free:
        body.add_camera(
            name="side", mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM, pos=[0.3, -1.5, 0.3],
            xyaxes=[1, 0, 0, 0, 0.2, 1],
        )  # fmt: skip
    return body


def _kind(space: SpaceRobot, part: Part) -> str:
    """The trunk, or the side that a leg is on."""
    sides = {
        link: space.robot.legs[leg.name].side
        for leg in space.legs.values()
        for link in (leg.thigh, leg.shank)
    }
    return sides.get(part.name, "trunk")


def _drawn_width(space: SpaceRobot, part: Part) -> float:
    if part.name not in space.trunk:
        return part.width
    between = space.numbers.hip_width - space.numbers.leg_width
    return min(part.width, max(between, part.width / 2) - GAP)


def _free_in_plane(mujoco: Any, body: Any, start: Start) -> None:
    """Slides and a hinge whose values are the place and the pitch of the part."""
    # Slides act in the frame of the world, but are told in that of the body.
    turn = np.array([[cos(start.pitch), 0, sin(start.pitch)], [0, 1, 0],
                     [-sin(start.pitch), 0, cos(start.pitch)]])  # fmt: skip
    for name, axis, value in (
        (ROOT_X, (1, 0, 0), start.place[0]), (ROOT_Z, (0, 0, 1), start.place[1])
    ):  # fmt: skip
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=turn @ axis, ref=value)
    body.add_joint(name=ROOT_PITCH, type=mujoco.mjtJoint.mjJNT_HINGE, axis=PITCH, ref=start.pitch)
