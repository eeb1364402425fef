"""A robot in space in MuJoCo, set down, driven and looked at."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexspine.engines.contact import ContactLaw
from flexspine.engines.installed import mujoco_module, unheard
from flexspine.engines.mjcf import ROOT_PITCH, ROOT_X, ROOT_Z, Start, specification
from flexspine.hybrid.compile import Array
from flexspine.models.space import SpaceRobot


class SpaceEngine:
    """A robot in MuJoCo; ``model`` and ``data`` are MuJoCo's.

    Raises `MachineError` if MuJoCo is not there or has a version that is not supported, and
    `ParameterError` for a robot that is not described in space.
    """

    def __init__(
        self, space: SpaceRobot, *, ground: bool = True, step: float | None = None
    ) -> None:
        self._mujoco = mujoco_module()
        self.space = space
        self.model = specification(self._mujoco, space, ground=ground).compile()
        if step is not None:
            self.model.opt.timestep = step
        self.data = self._mujoco.MjData(self.model)
        self.hinges = tuple(hinge.name for hinge in space.hinges)
        joints = [self.model.joint(name) for name in self.hinges]
        self._angles = np.array([int(joint.qposadr[0]) for joint in joints])
        self._rates = np.array([int(joint.dofadr[0]) for joint in joints])
        self.driven = np.array([self.hinges.index(name) for name in space.motors])
        self._links = [self.model.body(part.name).id for part in space.parts]
        self._feet = [self.model.geom(ball.foot).id for ball in space.balls]
        self._radius = np.array([ball.radius for ball in space.balls])
        self._lengths = np.array([part.length for part in space.parts])
        self._foot_of = np.zeros(self.model.ngeom, dtype=np.int64)
        self._foot_of[self._feet] = np.arange(len(self._feet))

    @property
    def step(self) -> float:
        """MuJoCo's time step in s."""
        return float(self.model.opt.timestep)

    @property
    def laws(self) -> dict[str, ContactLaw]:
        """How each foot meets the ground."""
        numbers, model = self.space.numbers, self.model
        bodies = model.geom_bodyid[self._feet]
        return {
            ball.foot: ContactLaw.of(numbers, float(model.body_invweight0[body][0]))
            for ball, body in zip(self.space.balls, bodies, strict=True)
        }

    def set_down(self, start: Start) -> None:
        """Let the robot rest as ``start`` tells, raised so that its lowest foot touches ground."""
        self._mujoco.mj_resetData(self.model, self.data)
        self.place(start)
        self.forward()
        low = float((self.data.geom_xpos[self._feet, 2] - self._radius).min())
        self.place(start._replace(place=(start.place[0], start.place[1] - low)))
        self.forward()

    def place(self, start: Start) -> None:
        """Set place, pitch and angles."""
        qpos, (x, z), half = self.data.qpos, start.place, start.pitch / 2
        if self.space.plane:
            values = {ROOT_X: x, ROOT_Z: z, ROOT_PITCH: start.pitch}
            for name, value in values.items():
                qpos[self.model.joint(name).qposadr[0]] = value
        else:
            qpos[:7] = x, 0.0, z, np.cos(half), 0.0, -np.sin(half), 0.0
        qpos[self._angles] = [start.angles[name] for name in self.hinges]

    def forward(self) -> None:
        """Work out what follows from places and velocities."""
        self._mujoco.mj_forward(self.model, self.data)

    def advance(self) -> None:
        """One time step."""
        self._mujoco.mj_step(self.model, self.data)

    @property
    def angles(self) -> Array:
        """Of the hinges, in rad."""
        found: Array = self.data.qpos[self._angles]
        return found

    @property
    def rates(self) -> Array:
        """Of the hinges, in rad/s."""
        found: Array = self.data.qvel[self._rates]
        return found

    @property
    def depths(self) -> Array:
        """How far feet are in the ground, in m, shape (feet,); negative in the air."""
        found: Array = self._radius - self.data.geom_xpos[self._feet, 2]
        return found

    def forces(self) -> Array:
        """Ground reaction forces on the feet in N, shape (feet, 3), along x, y and z."""
        found = np.zeros((len(self._feet), 3))
        touching, rows = self._contacts()
        # Along the normal, which is z, and two ways across it; the frame is the same for all feet.
        if len(touching):
            found[touching] = rows @ self.data.contact.frame[0].reshape(3, 3)
        return found

    @property
    def normals(self) -> Array:
        """Normal forces on the feet in N, shape (feet,)."""
        found = np.zeros(len(self._feet))
        touching, rows = self._contacts()
        found[touching] = rows[:, 0]
        return found

    def _contacts(self) -> tuple[NDArray[np.int64], Array]:
        """Which feet touch the ground, and the forces on them, shape (k, 3)."""
        contact = self.data.contact
        # Contacts are all that constrains the robot: three rows each, in order.
        borne = contact.geom[contact.efc_address >= 0, 1]
        return self._foot_of[borne], self.data.efc_force.reshape(-1, 3)

    def look(self) -> dict[str, Any]:
        """Where everything is, in the frame of the world."""
        data = self.data
        starts = data.xpos[self._links]
        ways = data.xmat[self._links].reshape(-1, 3, 3)[:, :, 0]
        self._mujoco.mj_subtreeVel(self.model, data)
        root = self._links[0]
        return {
            "qpos": data.qpos.copy(),
            "com": data.subtree_com[root].copy(),
            "com_rate": data.subtree_linvel[root].copy(),
            "turn": data.xmat[self._links[: len(self.space.trunk)]].reshape(-1, 3, 3).copy(),
            "link_start": starts.copy(),
            "link_end": starts + self._lengths[:, None] * ways,
            "foot": data.geom_xpos[self._feet] - [0.0, 0.0, 1.0] * self._radius[:, None],
            "grf": self.forces(),
            "angle": self.angles,
            "angle_rate": self.rates,
            "kinetic_energy": float(data.energy[1]),
            "potential_energy": float(data.energy[0]),
        }

    @property
    def lowest(self) -> float:
        """How high the lowest corner of the trunk or the lowest joint of a leg is, in m."""
        data = self.data
        places = data.xpos[self._links, 2]
        down = data.xmat[self._links[: len(self._corners)], 6:]
        corners = places[: len(self._corners), None] + (self._corners @ down[:, :, None])[..., 0]
        return float(min(places.min(), corners.min()))

    @cached_property
    def _corners(self) -> Array:
        """The corners of the trunk's boxes in their frames, shape (boxes, 8, 3)."""
        shares = np.array(list(product((0, 1), (-0.5, 0.5), (-0.5, 0.5))))
        boxes = [part for part in self.space.parts if part.name in self.space.trunk]
        return np.array([shares * (box.length, box.width, box.height) for box in boxes])

    def unheard(self) -> AbstractContextManager[None]:
        """Keep MuJoCo's warnings out of the terminal, and its log out of the working directory."""
        return unheard(self._mujoco)
