"""The only module that imports MuJoCo, after the OpenGL library has been found.

MuJoCo's extension modules carry no types, so its objects go by the names below.
"""

# ruff: noqa: E402
import importlib
from types import SimpleNamespace
from typing import Any, TypeAlias

from vigil.sim.engines.mujoco.compiled import gl

BACKEND = gl.prepare()

import mujoco as package

mujoco: Any = package
"""The package."""
GLContext: Any = None
"""The class of OpenGL contexts; None when nothing can be drawn."""
GL: Any = None
"""PyOpenGL's functions of OpenGL 1.0 to 1.4, without the 140 modules of `OpenGL.GL`; None when nothing can be drawn."""

if BACKEND.fault is None:
    # By name, for somebody may have imported MuJoCo before, with another backend; and before PyOpenGL, which
    # chooses its platform when it is imported.
    GLContext = importlib.import_module(f"mujoco.{BACKEND.module}").GLContext
    versions = [vars(importlib.import_module(f"OpenGL.raw.GL.VERSION.GL_1_{minor}")) for minor in (0, 1, 3, 4)]
    GL = SimpleNamespace(**{name: value for version in versions for name, value in version.items()})

NativeSpec: TypeAlias = Any
NativeBody: TypeAlias = Any
NativeModel: TypeAlias = Any
NativeData: TypeAlias = Any
RenderContext: TypeAlias = Any
