"""MuJoCo, imported after an OpenGL library has been found; no other module imports MuJoCo.

MuJoCo's extension modules have no types, so aliases for the types of its objects are defined below.
"""

# ruff: noqa: E402
import importlib
import os
from types import SimpleNamespace
from typing import Any, TypeAlias

from vigil.sim.engines.mujoco.compiled import gl

_given = os.environ.get("MUJOCO_GL")
BACKEND = gl.choose_backend()

import mujoco as package

# MuJoCo has read the variable. Child processes must judge the user's setting, not the one made of it.
if _given is None:
    os.environ.pop("MUJOCO_GL", None)
else:
    os.environ["MUJOCO_GL"] = _given

mujoco: Any = package
"""The package `mujoco`."""
GLContext: Any = None
"""The class of OpenGL contexts; None without OpenGL."""
GL: Any = None
"""PyOpenGL's functions of OpenGL 1.0 to 1.4, loaded without the 140 modules of `OpenGL.GL`; None without OpenGL."""

if BACKEND.fault is None:
    # Imported by name, because MuJoCo may have been imported before with another backend; and before PyOpenGL,
    # which chooses its platform on import.
    try:
        GLContext = importlib.import_module(f"mujoco.{BACKEND.module}").GLContext
        versions = [vars(importlib.import_module(f"OpenGL.raw.GL.VERSION.GL_1_{minor}")) for minor in (0, 1, 3, 4)]
        GL = SimpleNamespace(**{name: value for version in versions for name, value in version.items()})
    except (ImportError, AttributeError, RuntimeError, OSError) as error:
        BACKEND = gl.without_backend(BACKEND, error)

NativeBody: TypeAlias = Any
NativeModel: TypeAlias = Any
NativeData: TypeAlias = Any
