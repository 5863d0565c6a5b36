"""The only module that imports MuJoCo, after the OpenGL library has been found.

MuJoCo's extension modules carry no types, so its objects go by the names below.
"""

# ruff: noqa: E402
import importlib
import os
from types import SimpleNamespace
from typing import Any, TypeAlias

from vigil.sim.engines.mujoco.compiled import gl

_given = os.environ.get("MUJOCO_GL")
BACKEND = gl.prepare()

import mujoco as package

# MuJoCo has read it. Processes that this one starts judge what the user said, not what was made of it.
if _given is None:
    os.environ.pop("MUJOCO_GL", None)
else:
    os.environ["MUJOCO_GL"] = _given

mujoco: Any = package
"""The package."""
GLContext: Any = None
"""The class of OpenGL contexts; None when nothing can be drawn."""
GL: Any = None
"""PyOpenGL's functions of OpenGL 1.0 to 1.4, without the 140 modules of `OpenGL.GL`; None when nothing can be drawn."""

if BACKEND.fault is None:
    # By name, for somebody may have imported MuJoCo before, with another backend; and before PyOpenGL, which
    # chooses its platform when it is imported.
    try:
        GLContext = importlib.import_module(f"mujoco.{BACKEND.module}").GLContext
        versions = [vars(importlib.import_module(f"OpenGL.raw.GL.VERSION.GL_1_{minor}")) for minor in (0, 1, 3, 4)]
        GL = SimpleNamespace(**{name: value for version in versions for name, value in version.items()})
    except (ImportError, AttributeError, RuntimeError, OSError) as error:
        BACKEND = gl.broken(BACKEND, error)

NativeSpec: TypeAlias = Any
NativeBody: TypeAlias = Any
NativeModel: TypeAlias = Any
NativeData: TypeAlias = Any
RenderContext: TypeAlias = Any
