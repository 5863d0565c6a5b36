"""Worker processes that exit when the process that started them exits, even if it was killed."""

import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.context import BaseContext
from typing import Any

from vigil.base.imports import import_modules_from_environment


def spawn_context() -> BaseContext:
    """Return the start method for processes: `spawn`, which inherits no state from the parent."""
    return multiprocessing.get_context("spawn")


def worker_pool(workers: int, begin: Callable[..., None] | None = None, *arguments: Any) -> ProcessPoolExecutor:
    """Return a pool of spawned processes, each of which first calls `begin` with the arguments.

    Unlike the workers of a plain `ProcessPoolExecutor`, these stop when the parent process is killed.
    """
    return ProcessPoolExecutor(workers, spawn_context(), initializer=_initialize_worker, initargs=(begin, arguments))


def _initialize_worker(begin: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    threading.Thread(target=_exit_with_parent, name="end with parent", daemon=True).start()
    import_modules_from_environment()
    if begin is not None:
        begin(*arguments)


def _exit_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None, "This runs in a worker."
    parent.join()
    os._exit(1)
