"""Worker processes that exit when the process that started them exits, even if it was killed."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.context import BaseContext
from typing import Any, TypeVar

from vigil.base.imports import import_modules_from_environment

_State = TypeVar("_State")
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def spawn_context() -> BaseContext:
    """Return the start method for processes: `spawn`, which inherits no state from the parent."""
    return multiprocessing.get_context("spawn")


def worker_pool(workers: int, begin: Callable[..., None] | None = None, *arguments: Any) -> ProcessPoolExecutor:
    """Return a pool of spawned processes, each of which first calls `begin` with the arguments.

    Unlike the workers of a plain `ProcessPoolExecutor`, these stop when the parent process is killed.
    """
    return ProcessPoolExecutor(workers, spawn_context(), initializer=_initialize_worker, initargs=(begin, arguments))


def map_in_workers(
    make_state: Callable[[], _State],
    function: Callable[[_State, _Item], _Result],
    items: Sequence[_Item],
    workers: int,
) -> Iterator[_Result]:
    """Yield `function(state, item)` of each item, in order; each worker process makes its own state once.

    With one worker, or one item, everything happens in this process. What is passed in must be picklable.
    """
    if workers == 1 or len(items) < 2:
        state = make_state()
        for item in items:
            yield function(state, item)
        return
    with worker_pool(workers, _keep_state, make_state) as pool:
        futures: list[Future[_Result]] = [pool.submit(_apply, function, item) for item in items]
        try:
            for future in futures:
                yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)


_states: list[Any] = []
"""The state of this worker process."""


def _keep_state(make_state: Callable[[], Any]) -> None:
    _states.append(make_state())


def _apply(function: Callable[[Any, _Item], _Result], item: _Item) -> _Result:
    return function(_states[0], item)


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
