"""Background processes that make the houses of a stream before they are read.

A process that was killed is started again and makes the same house. All processes end when their reader ends.
"""

from concurrent.futures import Future
from functools import partial

from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.base.processes.group import WorkerGroup
from vigil.base.processes.worker import WorkerSettings
from vigil.errors import SimulatorError

MAX_DEATHS = 3
"""Maximum number of processes that may die while they make the same house. Then the stream gives up."""


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
