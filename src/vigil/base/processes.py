"""Worker processes that end with the process that started them, however that ends."""

import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.context import BaseContext
from typing import Any

from vigil.base.imports import import_modules_from_environment


def spawn_context() -> BaseContext:
    """Return how processes are started: fresh, with nothing of the state of the one that starts them."""
    return multiprocessing.get_context("spawn")


def worker_pool(workers: int, begin: Callable[..., None] | None = None, *arguments: Any) -> ProcessPoolExecutor:
    """Return a pool of fresh processes, each of which first calls `begin` with the arguments.

    The standard library's own goes on with all that was submitted when its process is killed.
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
