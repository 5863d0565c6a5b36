"""Several workers that share their requests: each takes the next one when it is free."""

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

    `close` ends the processes, as do the garbage collection of the group and the end of the interpreter.
    """

    def __init__(self, make_state: MakeState, workers: int, name: str, settings: WorkerSettings) -> None:
        requests: Requests = queue.SimpleQueue()
        self._workers = [Worker(make_state, f"{name} {number + 1}", settings, requests) for number in range(workers)]
        self._end = weakref.finalize(self, end_workers, self._workers)

    def pids(self) -> list[int]:
        """Return the ids of the running processes."""
        return [pid for worker in self._workers if (pid := worker.pid) is not None]

    def submit(self, function: Callable[..., _Result], *arguments: Any) -> "Future[_Result]":
        """Have a process call `function(state, *arguments)`, and return the future of the result, as `Worker` does."""
        return self._workers[0].submit(function, *arguments)

    def close(self) -> None:
        """End the processes immediately; running and waiting requests fail."""
        self._end()


def end_workers(workers: Sequence[Worker]) -> None:
    """End the processes of workers immediately, and wait for their end."""
    for worker in workers:
        worker.kill()
    for worker in workers:
        worker.join()


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
    group = WorkerGroup(make_state, min(workers, len(items)), "Worker process", _MAP_SETTINGS)
    try:
        futures = [group.submit(function, item) for item in items]
        for future in futures:
            yield future.result()
    finally:
        group.close()


def given_state(value: _State) -> _State:
    """Return the value: `partial(given_state, value)` gives each process a copy as its state."""
    return value
