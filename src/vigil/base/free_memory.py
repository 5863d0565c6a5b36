"""Returns memory that this process has freed to the operating system."""

import ctypes
from typing import Any


def _c_library() -> Any:
    try:
        return ctypes.CDLL("libc.so.6")  # glibc; other C libraries return freed memory by themselves
    except OSError:
        return None


_LIBC = _c_library()


def return_free_memory() -> None:
    """Return freed memory to the operating system; glibc would keep most of what compiling a house has used."""
    if _LIBC is not None:
        _LIBC.malloc_trim(0)
