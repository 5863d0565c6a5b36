"""The command that AI2-THOR's client starts the engine with."""

import os
import shlex
import sys
from pathlib import Path

from vigil.assets.sizes import AssetDatabase
from vigil.errors import SettingError
from vigil.sim import BACKENDS, Quality

NO_DISPLAY = ":0"
"""The client wants a text for DISPLAY, and does not look whether such a display is there."""


def thor_engine(
    *, backend: str = "mujoco", quality: Quality = "default", asset_database: str | Path | None = None
) -> str:
    """Returns the command of an engine that AI2-THOR's client takes in the place of Unity.

    `Controller(local_executable_path=vigil.thor_engine(), scene=house)`. It sets DISPLAY when it is unset: the client
    asks for it on Linux, the engine does not use it. Raises SettingError on an unknown backend or a broken database:
    the client would wait for ever for an engine that ends at once.
    """
    if backend not in BACKENDS:
        raise SettingError(f"Backend {backend!r} is unknown. Choose one of {', '.join(sorted(BACKENDS))}.")
    AssetDatabase.of(None if asset_database is None else Path(asset_database))
    os.environ.setdefault("DISPLAY", NO_DISPLAY)
    return shlex.join([sys.executable, "-m", "vigil.thor", *engine_options(backend, quality, asset_database)])


def engine_options(backend: str, quality: Quality, asset_database: str | Path | None) -> list[str]:
    """Returns the engine's own options, as words of a command line."""
    words = [f"--backend={backend}", f"--render-quality={quality}"]
    return words if asset_database is None else [*words, f"--assets={Path(asset_database).absolute()}"]
