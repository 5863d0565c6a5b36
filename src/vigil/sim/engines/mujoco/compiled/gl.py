"""Finds an OpenGL library before MuJoCo is imported, because MuJoCo chooses its backend on import.

On Linux the library is EGL (of a GPU driver or of Mesa) or OSMesa. Without a library, scenes can be loaded and rays can
be cast, but a request for a frame raises an error that names the missing packages.
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
"""Values of MUJOCO_GL that make MuJoCo open a window."""
_READ_BY_OPENGL = (
    *("MUJOCO_", "PYOPENGL_", "LIBGL_", "MESA_", "GALLIUM_", "EGL_", "__EGL_", "__GL", "DRI_", "LD_"),
    "CUDA_VISIBLE_DEVICES",
)
"""Prefixes of the environment variables that influence OpenGL or the search for it."""


@dataclass(frozen=True, slots=True)
class GLBackend:
    """The OpenGL library that MuJoCo uses."""

    name: str
    """Name of the library: `egl`, `osmesa`, `glfw`, `native` (not on Linux), or `none`."""
    fault: str | None = None
    """Reason why this library cannot draw; None if it can."""
    is_chosen_by_user: bool = False
    """Whether the user chose the library with an environment variable."""
    settings: str = field(default="", compare=False)
    """Sentence that lists the environment variables read by OpenGL, followed by a space; empty if none is set."""

    @property
    def advice(self) -> str:
        """What the user can do if the library was found but cannot draw."""
        return _advice(self.settings)

    @property
    def module(self) -> str:
        """Name of MuJoCo's module that makes OpenGL contexts with the library."""
        return self.name if self.name in _LIBRARIES else "gl_context"


def choose_backend() -> GLBackend:
    """Set MUJOCO_GL to a backend whose libraries are installed, unless the user has set it; return the backend."""
    if not sys.platform.startswith("linux"):
        return GLBackend("native")
    asked = [name for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM") if os.environ.get(name, "").strip()]
    backend = _judge(asked[0]) if asked else _first_found()
    backend = replace(backend, settings=_settings())
    os.environ["MUJOCO_GL"] = "disable" if backend.fault else backend.name
    return backend


def demand(backend: GLBackend) -> None:
    """Raise SimulatorError if the backend cannot draw."""
    if backend.fault:
        raise SimulatorError(f"The MuJoCo simulator cannot draw a frame: {backend.fault}.")


def without_backend(backend: GLBackend, error: Exception) -> GLBackend:
    """Return the backend `none`, which replaces a backend that was found but failed to load."""
    return replace(backend, name="none", fault=f"OpenGL ({backend.name}) does not load: {error}. {backend.advice}")


def _advice(settings: str) -> str:
    return f"{settings}Unset what you did not intend, or {ADVICE}" if settings else f"To draw, {ADVICE}"


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
    """Return the backend that the environment variable `variable` selects."""
    given = os.environ[variable].strip()
    name, said = given.lower(), f"{variable} is set to {given!r}"
    fault: str | None = None
    if variable == "MUJOCO_GL" and name in _OFF:
        fault = f"{said}: unset it"
    elif name in _LIBRARIES:
        missing, wrong = _fault_of(name), _wrong_setting(name)
        fault = wrong or (f"{said}, but {missing}: {ADVICE}, or unset it" if missing else None)
    elif variable != "MUJOCO_GL" or name not in _WINDOWS:
        fault = f"{said}, which cannot draw: set it to egl or osmesa, or unset it"
    return GLBackend("none" if fault else name, fault, is_chosen_by_user=True)


def _wrong_setting(name: str) -> str | None:
    """Return the environment variable that stops MuJoCo from using an installed library; None if there is none."""
    platform, device = os.environ.get("PYOPENGL_PLATFORM"), os.environ.get("MUJOCO_EGL_DEVICE_ID")
    if platform and platform.lower() != name:
        return f"PYOPENGL_PLATFORM is set to {platform!r}, but MUJOCO_GL to {name!r}: unset one of them"
    if name == "egl" and device is not None and not _is_number(device):
        return f"MUJOCO_EGL_DEVICE_ID is set to {device!r}, which is not the number of a device (0, 1, ...): unset it"
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
        return "egl: the library does not offer a device (Mesa's driver, libegl-mesa0, is missing or too old)"
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
