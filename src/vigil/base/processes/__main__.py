"""`python -m vigil.base.processes FD`: a worker process; `vigil.base.processes.worker` starts it."""

import faulthandler
import importlib
import sys
from multiprocessing.connection import Connection
from typing import Any

from vigil.base.imports import import_modules_from_environment
from vigil.base.processes.child import serve

main_module: str | None = None
"""Name of the module if the main process was started by `python -m MODULE`; otherwise None."""


def __getattr__(name: str) -> Any:
    """Return `name` from the main process's `__main__`, because pickled requests may refer to it."""
    if main_module is None or name.startswith("__"):
        raise AttributeError(name)
    return getattr(importlib.import_module(main_module), name)


if __name__ == "__main__":
    faulthandler.enable()
    with Connection(int(sys.argv[1])) as connection:
        folders, main_module = connection.recv()
        sys.path += [folder for folder in folders if folder not in sys.path]
        import_modules_from_environment()
        serve(connection, connection.recv_bytes())
