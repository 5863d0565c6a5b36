"""VIGIL: measures world completion and terminal commitment of embodied agents separately.

The names of `vigil.api` are available here and are loaded on first use: `import vigil` alone loads nothing else.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vigil.api import *  # noqa: F403 - exactly the names in its `__all__`

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    api = import_module("vigil.api") if not name.startswith("_") else None
    if api is None or name not in api.__all__:
        raise AttributeError(f"module 'vigil' has no attribute {name!r}")
    value = globals()[name] = getattr(api, name)
    return value


def __dir__() -> list[str]:
    return sorted({"__version__", *import_module("vigil.api").__all__})
