"""Background processes that make the houses of a stream ahead of its reader.

A process that was killed is started again and makes the same house again. Processes do not outlive their reader.
"""

from concurrent.futures import Future
from functools import partial

from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.base.processes.group import WorkerGroup
from vigil.base.processes.worker import WorkerSettings
from vigil.errors import SimulatorError

MAX_DEATHS = 3
"""Number of processes that end while they make one house after which the stream gives up."""


class HousePool(WorkerGroup):
    """A pool of processes that make houses in the order of the requests."""

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        advice = "Check that there is enough memory; each process takes about 500 MB."
        super().__init__(
            partial(StreamHouseMaker, settings),
            workers,
            f"Stream {settings.label}: house maker",
            WorkerSettings(attempts=MAX_DEATHS, advice=advice, fault=SimulatorError),
        )

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house. It raises SimulatorError if `MAX_DEATHS` processes ended while they made it."""
        return self.submit(StreamHouseMaker.made, number)
