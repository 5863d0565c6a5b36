"""Finds an OpenGL library before MuJoCo is imported, because MuJoCo chooses its backend while it is imported.

On Linux that is EGL (with a GPU's driver or Mesa's) or OSMesa. Without either, MuJoCo is imported without
drawing: scenes load and rays are cast, and only asking for a frame is an error, which names the missing packages.
"""

import ctypes
import os
import sys
from dataclasses import dataclass

from vigil.errors import SimulatorError

ADVICE = (
    "install libegl1 and libgl1 (`apt-get install --no-install-recommends libegl1 libgl1`), or libosmesa6, "
    "and start again; no display, root rights at run time or GPU is needed"
)
_LIBRARIES = {"egl": ("libEGL.so.1", "libGL.so.1"), "osmesa": ("libOSMesa.so.8",)}
_ALTERNATIVES = {"libOSMesa.so.8": ("libOSMesa.so.6", "libOSMesa.so")}
_OFF = ("disable", "disabled", "off", "false", "0")


@dataclass(frozen=True, slots=True)
class GLBackend:
    """What MuJoCo draws with."""

    name: str
    """`egl`, `osmesa`, `glfw`, `native` (not Linux), or `none`."""
    fault: str | None = None
    """Why nothing can be drawn; None when it can."""
    is_chosen_by_user: bool = False

    @property
    def module(self) -> str:
        """The module of MuJoCo that makes its contexts."""
        return self.name if self.name in _LIBRARIES else "gl_context"


def prepare() -> GLBackend:
    """Sets MUJOCO_GL to a backend whose libraries are here, and returns it; keeps a user's own setting."""
    if not sys.platform.startswith("linux"):
        return GLBackend("native")
    requested = os.environ.get("MUJOCO_GL", "").strip().lower()
    if requested:
        backend = _judge(requested)
    else:
        backend = next((GLBackend(name) for name in _LIBRARIES if not _fault_of(name)), None) or GLBackend(
            "none", f"no OpenGL library was found ({_fault_of('egl')}; {_fault_of('osmesa')}): {ADVICE}"
        )
    os.environ["MUJOCO_GL"] = "disable" if backend.fault else (requested or backend.name)
    return backend


def demand(backend: GLBackend) -> None:
    """Raises SimulatorError when the backend cannot draw."""
    if backend.fault:
        raise SimulatorError(f"The MuJoCo simulator cannot draw a frame: {backend.fault}.")


def _judge(requested: str) -> GLBackend:
    if requested in _OFF:
        return GLBackend("none", f"MUJOCO_GL is set to {requested!r}: unset it", is_chosen_by_user=True)
    fault = _fault_of(requested) if requested in _LIBRARIES else None
    if fault:
        return GLBackend(
            "none", f"MUJOCO_GL is set to {requested!r}, but {fault}: {ADVICE}, or unset it", is_chosen_by_user=True
        )
    return GLBackend(requested, is_chosen_by_user=True)


def _fault_of(name: str) -> str | None:
    missing = [library for library in _LIBRARIES[name] if not _loads(library)]
    if missing:
        return f"{name}: {' and '.join(missing)} cannot be loaded"
    if name == "egl" and not _egl_devices():
        return "egl: the library offers no device (Mesa's driver, libegl-mesa0, is missing or too old)"
    return None


def _loads(library: str) -> bool:
    for name in (library, *_ALTERNATIVES.get(library, ())):
        try:
            ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
        except OSError:
            continue
        return True
    return False


def _egl_devices() -> int:
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    address = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not address:
        return 0
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int))(address)
    count = ctypes.c_int(0)
    return count.value if query(0, None, ctypes.byref(count)) else 0
