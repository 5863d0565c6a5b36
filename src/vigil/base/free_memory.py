"""Returns memory that this process has freed to the operating system."""

import ctypes

try:
    _libc = ctypes.CDLL("libc.so.6")  # glibc; other C libraries return freed memory by themselves
except OSError:
    _libc = None


def return_free_memory() -> None:
    """Return freed memory to the operating system; glibc would keep most of what compiling a house has used."""
    if _libc is not None:
        _libc.malloc_trim(0)
