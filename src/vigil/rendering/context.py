"""Access to moderngl, which draws in the OpenGL context of this process."""

import ctypes
from functools import cache
from importlib import resources
from typing import Any

import moderngl as package

moderngl: Any = package
GraphicsError: type[Exception] = package.Error
"""Error that is raised when OpenGL lacks a feature."""


class _Loader:
    """Looks up the addresses of OpenGL's functions in the current context."""

    def __init__(self, library: str, function: str) -> None:
        address = getattr(ctypes.CDLL(library), function)
        self._address_of = ctypes.cast(address, ctypes.CFUNCTYPE(ctypes.c_size_t, ctypes.c_char_p))

    def load_opengl_function(self, name: str) -> int:
        """Return the address of a function; 0 if the name is unknown."""
        return self._address_of(name.encode()) or 0

    def release(self) -> None:
        """Do nothing: the code that made the OpenGL context also frees it."""


_LOADERS = {"egl": ("libEGL.so.1", "eglGetProcAddress"), "osmesa": ("libOSMesa.so.8", "OSMesaGetProcAddress")}


@cache
def context_in(backend: str) -> Any:
    """Return moderngl's view of the current context, made by `backend` (egl, osmesa, native). Raises GraphicsError."""
    try:
        package.init_context(_Loader(*_LOADERS[backend]) if backend in _LOADERS else None)
    except (RuntimeError, ImportError, OSError) as error:  # moderngl's, when it finds no window
        raise GraphicsError(str(error)) from error
    return package.get_context()


@cache
def program(backend: str, vertex: str, fragment: str, *definitions: str) -> Any:
    """Return the program of a vertex and a fragment shader file, with preprocessor definitions."""
    return context_in(backend).program(
        vertex_shader=_source(vertex, definitions), fragment_shader=_source(fragment, definitions)
    )


def _source(name: str, definitions: tuple[str, ...]) -> str:
    text = resources.files("vigil.rendering").joinpath("shaders", name).read_text(encoding="utf-8")
    first, _, rest = text.partition("\n")
    return "\n".join([first, *(f"#define {each}" for each in definitions), rest])
