"""Draws postures of a MuJoCo model without a screen, for `flexspine.engines.render`.

A process of its own, as which OpenGL is used is settled once and for all when MuJoCo is imported,
and as drivers may take a process with them. Called with a model file, a file of postures and the
size; writes pictures to its output one after the other, as bytes of red, green and blue.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module

import numpy as np


def main(model_file: str, postures_file: str, width: int, height: int) -> None:
    """Draw every posture."""
    mujoco = import_module("mujoco")
    model = mujoco.MjModel.from_binary_path(model_file)
    data = mujoco.MjData(model)
    try:
        renderer = mujoco.Renderer(model, height, width)
    except Exception as failure:  # whatever drivers and their bindings raise
        print(f"{type(failure).__name__}: {failure}", file=sys.stderr)
        sys.stderr.flush()
        # Not an orderly exit: half-made contexts raise while they are taken down.
        os._exit(1)
    for posture in np.load(postures_file):
        data.qpos[:] = posture
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera="side")
        sys.stdout.buffer.write(renderer.render().tobytes())
    sys.stdout.buffer.flush()
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
