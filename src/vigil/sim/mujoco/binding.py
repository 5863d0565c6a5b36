"""The only module that imports MuJoCo, after the OpenGL library has been found."""

# ruff: noqa: E402
from vigil.sim.mujoco import gl

BACKEND = gl.prepare()

import mujoco

__all__ = ["BACKEND", "mujoco"]
