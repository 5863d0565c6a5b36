"""Finds an OpenGL library before MuJoCo is imported, because MuJoCo chooses its backend while it is imported.

On Linux that is EGL (with a GPU's driver or Mesa's) or OSMesa. Without either, MuJoCo is imported without
drawing: scenes load and rays are cast, and only asking for a frame is an error, which names the missing packages.
"""

import ctypes
import os
import sys
from dataclasses import dataclass, field, replace

from vigil.errors import SimulatorError

ADVICE = (
    "install libegl1 and libgl1 (`apt-get install --no-install-recommends libegl1 libgl1`), or libosmesa6, "
    "and start again; no display, root rights at run time or GPU is needed"
)
_LIBRARIES = {"egl": ("libEGL.so.1", "libGL.so.1"), "osmesa": ("libOSMesa.so.8",)}
_ALTERNATIVES = {"libOSMesa.so.8": ("libOSMesa.so.6", "libOSMesa.so")}
_OFF = ("disable", "disabled", "off", "false", "0")
_WINDOWS = ("glfw", "glx", "enable", "enabled", "on", "true", "1")
"""What MuJoCo opens a window for."""
_READ_BY_OPENGL = (
    *("MUJOCO_", "PYOPENGL_", "LIBGL_", "MESA_", "GALLIUM_", "EGL_", "__EGL_", "__GL", "DRI_", "LD_"),
    "CUDA_VISIBLE_DEVICES",
)
"""How the names of environment variables begin that change what OpenGL does, or where it is found."""


@dataclass(frozen=True, slots=True)
class GLBackend:
    """What MuJoCo draws with."""

    name: str
    """`egl`, `osmesa`, `glfw`, `native` (not Linux), or `none`."""
    fault: str | None = None
    """Why nothing can be drawn; None when it can."""
    is_chosen_by_user: bool = False
    settings: str = field(default="", compare=False)
    """What the user's environment says to OpenGL, as a sentence and a space; empty when it says nothing."""

    @property
    def advice(self) -> str:
        """What to do when it was found and cannot draw."""
        return _advice(self.settings)

    @property
    def module(self) -> str:
        """The module of MuJoCo that makes its contexts."""
        return self.name if self.name in _LIBRARIES else "gl_context"


def prepare() -> GLBackend:
    """Sets MUJOCO_GL to a backend whose libraries are here, and returns it; keeps a user's own setting."""
    if not sys.platform.startswith("linux"):
        return GLBackend("native")
    asked = [name for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM") if os.environ.get(name, "").strip()]
    backend = _judge(asked[0]) if asked else _first_found()
    backend = replace(backend, settings=_settings())
    os.environ["MUJOCO_GL"] = "disable" if backend.fault else backend.name
    return backend


def demand(backend: GLBackend) -> None:
    """Raises SimulatorError when the backend cannot draw."""
    if backend.fault:
        raise SimulatorError(f"The MuJoCo simulator cannot draw a frame: {backend.fault}.")


def broken(backend: GLBackend, error: Exception) -> GLBackend:
    """Return in place of a backend that was found, and that then failed to load, none."""
    return replace(backend, name="none", fault=f"OpenGL ({backend.name}) does not load: {error}. {backend.advice}")


def _advice(settings: str) -> str:
    return f"{settings}Unset what was not meant, or {ADVICE}" if settings else f"To draw, {ADVICE}"


def _settings() -> str:
    found = [f"{name}={value!r}" for name, value in sorted(os.environ.items()) if name.startswith(_READ_BY_OPENGL)]
    return f"The environment sets {', '.join(found)}. " if found else ""


def _first_found() -> GLBackend:
    name = next((name for name in _LIBRARIES if not _fault_of(name)), None)
    if name is None:
        missing = f"no OpenGL library was found ({_fault_of('egl')}; {_fault_of('osmesa')})"
        return GLBackend("none", f"{missing}. {_advice(_settings())}")
    fault = _wrong_setting(name)
    return GLBackend("none" if fault else name, fault)


def _judge(variable: str) -> GLBackend:
    """Return the backend that a variable of the environment asks for."""
    given = os.environ[variable].strip()
    name, said = given.lower(), f"{variable} is set to {given!r}"
    fault: str | None = None
    if variable == "MUJOCO_GL" and name in _OFF:
        fault = f"{said}: unset it"
    elif name in _LIBRARIES:
        missing, wrong = _fault_of(name), _wrong_setting(name)
        fault = wrong or (f"{said}, but {missing}: {ADVICE}, or unset it" if missing else None)
    elif variable != "MUJOCO_GL" or name not in _WINDOWS:
        fault = f"{said}, which is nothing to draw with: set it to egl or osmesa, or unset it"
    return GLBackend("none" if fault else name, fault, is_chosen_by_user=True)


def _wrong_setting(name: str) -> str | None:
    """Return which variable of the environment keeps MuJoCo from drawing with a library that is here."""
    platform, device = os.environ.get("PYOPENGL_PLATFORM"), os.environ.get("MUJOCO_EGL_DEVICE_ID")
    if platform and platform.lower() != name:
        return f"PYOPENGL_PLATFORM is set to {platform!r}, but MUJOCO_GL to {name!r}: unset one of them"
    if name == "egl" and device is not None and not _is_number(device):
        return f"MUJOCO_EGL_DEVICE_ID is set to {device!r}, which is no number of a device (from 0 on): unset it"
    return None


def _is_number(text: str) -> bool:
    try:
        return int(text) >= 0
    except ValueError:
        return False


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
