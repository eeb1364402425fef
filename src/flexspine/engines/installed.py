"""MuJoCo, if it is there and of a version that will do, and what all its models have alike."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from flexspine.errors import MachineError

# Versions from the first up to the second: 4.0.0 gets accelerations wrong.
VERSIONS = (3, 17), (4, 0)

REMEDY = "pip install 'mujoco>=3.17,<4', or flexspine with the extra 'engine'"

# kg m^2; MuJoCo takes no body without inertia, and this much is less than rounding errors.
LEAST_INERTIA = 2e-15


def mujoco_version() -> str:
    """The version of MuJoCo that is used. Raises `MachineError` as `mujoco_module` does."""
    return str(mujoco_module().__version__)


def mujoco_module() -> Any:
    """MuJoCo. Raises `MachineError` if it is missing or has a version that is not supported."""
    try:
        mujoco = import_module("mujoco")
    except ImportError:
        raise MachineError("the package 'mujoco' is not installed", REMEDY) from None
    oldest, barred = VERSIONS
    if not oldest <= tuple(map(int, re.findall(r"\d+", mujoco.__version__)[:2])) < barred:
        ours, theirs = (".".join(map(str, version)) for version in VERSIONS)
        raise MachineError(
            f"mujoco {mujoco.__version__} is installed, and only {ours} up to but not including "
            f"{theirs} will do",
            REMEDY,
        )
    return mujoco


def empty_specification(mujoco: Any, gravity: tuple[float, float, float]) -> Any:
    """An `MjSpec` without bodies, in radians, whose bodies have the inertias that they are given.

    ``gravity`` is in m/s^2. Energies are computed, and a run that diverged is not begun anew.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.gravity = gravity
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    spec.option.enableflags = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    return spec


def constant_impedance(impedance: float) -> list[float]:
    """MuJoCo's ``solimp`` of a constraint that is as hard anywhere.

    Width, midpoint and power, the last three, shape the way between two impedances.
    """
    return [impedance, impedance, 1e-3, 0.5, 2.0]


@contextmanager
def unheard(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo's warnings out of the terminal, and its log out of the working directory."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
