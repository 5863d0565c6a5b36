"""Background processes that make the houses of a stream before they are read.

A process that was killed is started again and makes the same house. All processes end when their reader ends.
The readers of a stream in one process, such as a group of environments, share the processes and the houses.
"""

import os
import threading
from concurrent.futures import Future
from functools import partial

from cachetools import LRUCache

from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.base.processes.group import WorkerGroup
from vigil.base.processes.worker import WorkerSettings
from vigil.errors import SimulatorError

MAX_DEATHS = 3
"""Maximum number of processes that may die while they make the same house. Then the stream gives up."""
SHARED_HOUSES = 16
"""Number of houses last asked for that readers of the same stream share."""


class HousePool(WorkerGroup):
    """A pool of processes that make houses in the order in which they were requested."""

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        advice = "Check that there is enough memory; each process takes about 500 MB."
        super().__init__(
            partial(StreamHouseMaker, settings),
            workers,
            f"Stream {settings.label}: house maker",
            WorkerSettings(attempts=MAX_DEATHS, advice=advice, fault=SimulatorError),
        )

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house. It raises SimulatorError if `MAX_DEATHS` processes died making the house."""
        return self.submit(StreamHouseMaker.made, number)


class SharedHouses:
    """A reader's access to a `HousePool` that all readers of the same stream in this process share.

    The pool ends when its last reader is closed.
    """

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        self._key = os.getpid(), settings, workers
        with _lock:
            pool, houses, readers = _shared.get(self._key) or (HousePool(settings, workers), LRUCache(SHARED_HOUSES), 0)
            _shared[self._key] = pool, houses, readers + 1
        self.pids = pool.pids
        self._pool, self._houses = pool, houses
        self._is_closed = False

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house, see `HousePool.ask`. Raises SimulatorError if this reader is closed."""
        if self._is_closed:
            raise SimulatorError("The stream has been closed.")
        with _lock:
            found = self._houses.get(number)
            if found is None or (found.done() and found.exception() is not None):
                found = self._houses[number] = self._pool.ask(number)
        return found

    def close(self) -> None:
        """End the pool if this was its last reader."""
        if self._is_closed:
            return
        self._is_closed = True
        with _lock:
            pool, houses, readers = _shared.pop(self._key)
            if readers > 1:
                _shared[self._key] = pool, houses, readers - 1
        if readers == 1:
            pool.close()


_lock = threading.Lock()
_shared: dict[tuple[int, StreamSettings, int], tuple[HousePool, LRUCache[int, "Future[StreamHouse]"], int]] = {}
"""(id of this process, settings, workers) -> pool, its houses and the number of its readers."""
