"""The only module that imports MuJoCo, after the OpenGL library has been found.

MuJoCo's extension modules carry no types, so its objects go by the names below.
"""

# ruff: noqa: E402
from typing import Any, TypeAlias

from vigil.sim.mujoco import gl

BACKEND = gl.prepare()

import mujoco as package

mujoco: Any = package

NativeSpec: TypeAlias = Any
NativeBody: TypeAlias = Any
NativeModel: TypeAlias = Any
NativeData: TypeAlias = Any
RenderContext: TypeAlias = Any
