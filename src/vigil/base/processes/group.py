"""Several workers that share one queue of requests. A worker that is free takes the next request."""

import queue
import weakref
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar

from vigil.base.processes.child import MakeState
from vigil.base.processes.worker import Requests, Worker, WorkerSettings

_State = TypeVar("_State")
_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_MAP_SETTINGS = WorkerSettings(log=None, attempts=2, advice="Is there enough memory?")


class WorkerGroup:
    """Workers with equal states.

    Their processes end when `close` is called, when the group is garbage-collected, or when the interpreter ends.
    """

    def __init__(self, make_state: MakeState, workers: int, name: str, settings: WorkerSettings) -> None:
        requests: Requests = queue.SimpleQueue()
        self._workers = [Worker(make_state, f"{name} {number + 1}", settings, requests) for number in range(workers)]
        self._end = weakref.finalize(self, end_workers, self._workers)

    def pids(self) -> list[int]:
        """Return the ids of the worker processes that are running."""
        return [pid for worker in self._workers if (pid := worker.pid) is not None]

    def submit(self, function: Callable[..., _Result], *arguments: Any) -> "Future[_Result]":
        """Let a process call `function(state, *arguments)`; return the future of the result, like `Worker.submit`."""
        return self._workers[0].submit(function, *arguments)

    def close(self) -> None:
        """End the processes immediately. Requests that are running or waiting fail."""
        self._end()


def end_workers(workers: Sequence[Worker]) -> None:
    """End the processes of workers immediately, and wait until they have ended."""
    for worker in workers:
        worker.kill()
    for worker in workers:
        worker.join()


def map_in_workers(
    make_state: Callable[[], _State], function: Callable[[_State, _Item], _Result], items: Sequence[_Item], workers: int
) -> Iterator[_Result]:
    """Yield `function(state, item)` for each item, in order. Each worker process makes its state once.

    With one worker or one item, everything happens in this process. The functions and items must be picklable.
    """
    if workers == 1 or len(items) < 2:
        state = make_state()
        for item in items:
            yield function(state, item)
        return
    group = WorkerGroup(make_state, min(workers, len(items)), "Worker process", _MAP_SETTINGS)
    try:
        futures = [group.submit(function, item) for item in items]
        for future in futures:
            yield future.result()
    finally:
        group.close()


def given_state(value: _State) -> _State:
    """Return the value. As a `make_state`, `partial(given_state, value)` gives each process a copy of the value."""
    return value
