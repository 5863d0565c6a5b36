"""The command by which AI2-THOR's client starts the engine."""

from pathlib import Path

from vigil.assets.database import AssetDatabase
from vigil.errors import SettingError
from vigil.protocol.observation import Quality
from vigil.sim import EDITABLE_BACKENDS
from vigil.sim.thor.start import engine_options, own_command


def thor_engine(
    *, backend: str = "mujoco", quality: Quality = "default", asset_database: str | Path | None = None
) -> str:
    """Return the command of an engine that AI2-THOR's client can start instead of Unity.

    Use it as `Controller(local_executable_path=vigil.thor_engine(), scene=house)`. This function sets DISPLAY if it is
    unset, because the client requires it on Linux, although the engine does not use it. Raises SettingError on an
    unknown backend or an invalid database, because the client would wait without limit for an engine that ends at once.
    """
    check_backend(backend, asset_database)
    return own_command(engine_options(backend, quality, asset_database))


def check_backend(backend: str, asset_database: str | Path | None) -> None:
    """Raise SettingError on a backend that the engine does not have, or an invalid database."""
    if backend not in EDITABLE_BACKENDS:
        raise SettingError(
            f"The AI2-THOR engine does not have backend {backend!r}. "
            f"Choose one of {', '.join(sorted(EDITABLE_BACKENDS))}."
        )
    AssetDatabase.from_file(None if asset_database is None else Path(asset_database))
