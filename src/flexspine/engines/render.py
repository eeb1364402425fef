"""Pictures of a run in space by MuJoCo's renderer, where OpenGL is to be had without a screen."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from flexspine.engines.installed import mujoco_module
from flexspine.engines.mjcf import specification
from flexspine.engines.space_run import SpaceRun
from flexspine.errors import MachineError

Picture = NDArray[np.uint8]

# px; even, as video codecs demand.
WIDTH, HEIGHT = 640, 360

# Which OpenGL is tried, best first, if the environment does not say (MUJOCO_GL).
BACKENDS = ("egl", "osmesa")

EMPTY = "<mujoco/>"

# s; a time this little before a sample is at it.
ROUNDING = 1e-9


def opengl() -> str | None:
    """Which OpenGL can draw here without a screen, if any."""
    script = f"import mujoco, os; mujoco.Renderer(mujoco.MjModel.from_xml_string({EMPTY!r}), 8, 8)"
    for backend in _backends():
        done = subprocess.run(
            [sys.executable, "-c", f"{script}; os._exit(0)"],
            env={**os.environ, "MUJOCO_GL": backend},
            capture_output=True,
            check=False,
        )
        if done.returncode == 0:
            return backend
    return None


def _backends() -> tuple[str, ...]:
    """Which OpenGL to try, in turn."""
    own = _own()
    return (own,) if own else BACKENDS


def _own() -> str | None:
    """Which OpenGL the user asks for, if any."""
    return os.environ.get("MUJOCO_GL") or None


def rendered(
    run: SpaceRun, times: NDArray[np.float64], size: tuple[int, int] = (WIDTH, HEIGHT)
) -> Iterator[Picture]:
    """Draw a run at times (s): pictures of shape (height, width, 3), of the sample before each.

    ``size`` is width and height in pixels. Raises `MachineError` where there is neither EGL nor
    OSMesa, before the first picture.
    """
    mujoco = mujoco_module()
    places = np.searchsorted(run.samples["time"], times + ROUNDING, side="right") - 1
    with TemporaryDirectory(prefix="flexspine-") as folder:
        model, postures = Path(folder) / "model.mjb", Path(folder) / "postures.npy"
        compiled = specification(mujoco, run.space).compile()
        mujoco.mj_saveModel(compiled, str(model), None)
        np.save(postures, run.samples["qpos"][places.clip(min=0)])
        arguments = [str(model), str(postures), *map(str, size)]
        yield from _pictures(arguments, len(times), size)


def _pictures(arguments: list[str], count: int, size: tuple[int, int]) -> Iterator[Picture]:
    told = ""
    for backend in _backends():
        command = [sys.executable, "-m", "flexspine.engines.frames", *arguments]
        with subprocess.Popen(
            command,
            env={**os.environ, "MUJOCO_GL": backend},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        ) as child:
            assert child.stdout is not None
            assert child.stderr is not None
            whole, done = 3 * size[0] * size[1], 0
            try:
                while done < count and len(picture := child.stdout.read(whole)) == whole:
                    yield np.frombuffer(picture, dtype=np.uint8).reshape(size[1], size[0], 3)
                    done += 1
            finally:
                child.kill()
            told = child.stderr.read().decode(errors="replace").strip().rpartition("\n")[2]
        if done == count:
            return
        if done:
            raise MachineError(f"MuJoCo's renderer stopped ({told})", "run it again")
    why = f"({told or 'no reason told'})"
    if own := _own():
        raise MachineError(
            f"there is no OpenGL to draw with as MUJOCO_GL={own} asks {why}",
            "unset MUJOCO_GL, or leave --render",
        )
    raise MachineError(
        f"there is no OpenGL to draw with, neither EGL nor OSMesa {why}",
        "install one of them, such as Debian's libegl1 or libosmesa6, or leave --render",
    )
