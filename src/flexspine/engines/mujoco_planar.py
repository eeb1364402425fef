"""A planar robot pinned by a foot in MuJoCo, which knows none of our equations.

The tree is walked from that foot, so that hinges alone hold the robot there: MuJoCo's equality
constraints are springs, and would let it give way.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from flexspine.engines.installed import LEAST_INERTIA, empty_specification, mujoco_module, unheard
from flexspine.mechanics.linkage import Array, Linkage
from flexspine.mechanics.rerooting import rerooted


class PinnedMotion(NamedTuple):
    """What an engine has found: absolute angles in rad (k, links) and the total energy in J (k,).

    The energy is kinetic, of weight with zero at the foot, and of springs.
    """

    angles: Array
    energies: Array


class PinnedMujoco:
    """A linkage in MuJoCo that turns about one of its feet, which is the origin.

    ``model`` and ``data`` are MuJoCo's; its joints are named after the links that they move. Raises
    `MachineError` if MuJoCo is not there or has a version that is not supported.
    """

    def __init__(self, linkage: Linkage, foot: str) -> None:
        self._mujoco = mujoco_module()
        self._tree = rerooted(linkage, foot)
        self.model = pinned_specification(self._mujoco, linkage, foot).compile()
        self.data = self._mujoco.MjData(self.model)
        # Where each of the tree's links stands among those of the linkage.
        self._order = [linkage.place[link.name] for link in self._tree.links]

    def run(self, angles: Array, step: float, count: int, every: int) -> PinnedMotion:
        """Let go from rest at absolute ``angles`` (rad), by ``count`` Runge-Kutta steps (s).

        Returns the start and every ``every``-th step after it; NaN from where it diverged.
        """
        self._mujoco.mj_resetData(self.model, self.data)
        self.model.opt.timestep = step
        self.data.qpos[:] = self._relative(angles)
        found = [self._now()]
        with unheard(self._mujoco):
            for number in range(1, count + 1):
                self._mujoco.mj_step(self.model, self.data)
                if number % every == 0:
                    found.append(self._now())
        turns, energies = zip(*found, strict=True)
        return PinnedMotion(np.array(turns), np.array(energies))

    def _relative(self, angles: Array) -> Array:
        """MuJoCo's joint angles."""
        n = len(angles)
        relative: Array = self._tree.to_relative[:n, :n] @ angles[self._order]
        return relative

    def _now(self) -> tuple[Array, float]:
        """Absolute angles, in the order of the linkage, and the energy."""
        self._mujoco.mj_forward(self.model, self.data)
        angles = np.empty(len(self._order))
        n = len(angles)
        angles[self._order] = self._tree.to_absolute[:n, :n] @ self.data.qpos
        return angles, float(self.data.energy.sum())


def pinned_specification(mujoco: Any, linkage: Linkage, foot: str) -> Any:
    """A linkage pinned by a foot, as an `MjSpec`.

    Our plane is that of its x and y, gravity acts against y. Raises `UnknownNameError`.
    """
    tree = rerooted(linkage, foot)
    spec = empty_specification(mujoco, (0.0, -tree.gravity, 0.0))
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    joints = {joint.link: joint for joint in tree.joints}
    bodies: dict[str | None, Any] = {None: spec.worldbody}
    for link in tree.links:
        mass, com, inertia = tree.with_feet(link.name)
        body = bodies[link.name] = bodies[link.parent].add_body(
            name=link.name,
            pos=[link.at, 0.0, 0.0],
            mass=mass,
            ipos=[com, 0.0, 0.0],
            # Only turns about z matter; a body has to be possible in space all the same.
            inertia=[max(inertia, LEAST_INERTIA)] * 3,
            explicitinertial=True,
        )
        hinge = body.add_joint(
            name=link.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0]
        )
        joint = joints.get(link.name)
        if joint is not None:
            # Forces may have quadratic and cubic parts there; ours are linear.
            hinge.stiffness, hinge.damping = [joint.stiffness, 0, 0], [joint.damping, 0, 0]
            hinge.springref = joint.rest
    return spec
