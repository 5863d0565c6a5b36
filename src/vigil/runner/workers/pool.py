"""Simulator workers: processes that hold Env and simulator, with a watchdog.

Each worker (`vigil.runner.workers.process`) has one GL context and any number of live episodes. An episode of a
lost worker is restored in another one by carrying out its replies again: the simulator is deterministic, so the result
is the same.
"""

import asyncio
import itertools
import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

from tenacity import AsyncRetrying, Retrying, retry_if_exception_type, stop_after_delay

from vigil.errors import SettingError, VigilError
from vigil.protocol.actions import Reply
from vigil.records.record import Boundary, EpisodeRecord
from vigil.runner.retries import MAX_RESTORES
from vigil.runner.workers.messages import (
    AdvanceEpisode,
    Assignment,
    BeginEpisode,
    DropEpisode,
    EncodedObservation,
    FailEpisode,
    GetSimulatorFacts,
    PlayEpisode,
    Request,
    Resimulate,
    SimulatorFacts,
    WorkerPlan,
)
from vigil.runner.workers.process import (
    START_TIMEOUT_S,
    WORKER_TIMEOUT_S,
    LocalProcess,
    NoCapacity,
    StartProcess,
    Worker,
    WorkerLost,
    WorkerSettings,
)
from vigil.runner.workers.resimulation import FactDifference

_RETRY_ON_ANOTHER: dict[str, Any] = {
    "retry": retry_if_exception_type(NoCapacity),
    "stop": stop_after_delay(START_TIMEOUT_S),
    "reraise": True,
}
"""Retries that send a request to another worker while the cluster has no capacity for one."""


def usable_cpus() -> int:
    """Return the number of CPUs that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def worker_count(asked: int | None) -> int:
    """Return the number of workers: `asked`, or one for each CPU."""
    return asked or usable_cpus()


class SimulatorPool:
    """The workers of a run."""

    def __init__(
        self,
        plan: WorkerPlan,
        workers: int,
        *,
        timeout_s: float = WORKER_TIMEOUT_S,
        logs: Path | None = None,
        start: StartProcess = LocalProcess,
    ) -> None:
        """`logs` is the folder for the workers' standard error; None discards it. `start` starts each worker."""
        if workers < 1:
            raise SettingError(f"A run needs at least one simulator worker, not {workers}.")
        if logs is not None:
            logs.mkdir(parents=True, exist_ok=True)
        settings = WorkerSettings(timeout_s, max(1, usable_cpus() // workers), logs, start)
        self.workers = [Worker(plan, f"worker-{number + 1}", settings, number) for number in range(workers)]
        self._load = dict.fromkeys(self.workers, 0)
        self._sessions = itertools.count(1)

    def __enter__(self) -> "SimulatorPool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        if kind is not None:
            for worker in self.workers:
                worker.kill()
        self.close()

    def close(self) -> None:
        """End all workers."""
        for worker in self.workers:
            worker.close()
        for worker in self.workers:
            worker.join()

    def facts(self, drawn: Assignment | None = None) -> SimulatorFacts:
        """Return the backend's facts; this starts all workers for which there is capacity.

        Each worker draws the first frame of `drawn`, if given. Raises SimulatorError when a worker cannot start or
        draw, or when there is no capacity.
        """
        return Retrying(**_RETRY_ON_ANOTHER)(self._facts, drawn)

    def _facts(self, drawn: Assignment | None) -> SimulatorFacts:
        futures = [worker.submit(GetSimulatorFacts(drawn)) for worker in self.workers]
        started = [future for future in futures if not isinstance(future.exception(), NoCapacity)]
        facts = [future.result()[1] for future in started or futures]
        return facts[0]

    async def play(
        self,
        assignment: Assignment,
        on_first_frame: Callable[[], None],
        *,
        may_resume: bool,
        worker: Worker | None = None,
    ) -> EpisodeRecord:
        """Play an episode with the agent inside a worker and return the record. Raises WorkerLost.

        `worker` is preferred among equally busy ones. `on_first_frame` is called before the agent is shown the first
        frame. With `may_resume`, an agent whose worker is lost after that continues in another worker; without it, the
        loss is raised at once.
        """
        earlier: tuple[Reply, ...] | None = None
        for left in range(MAX_RESTORES, -1, -1):
            try:
                return await self._request(PlayEpisode(assignment, earlier), on_first_frame, worker)
            except WorkerLost as lost:
                if not may_resume or not left or (earlier is None and lost.replies is None):
                    raise
                earlier = (*(earlier or ()), *(lost.replies or ()))
        raise AssertionError("the last round returns or raises")

    async def resimulate(
        self, assignment: Assignment, record: EpisodeRecord, *, frames: bool, exact: bool
    ) -> list[FactDifference]:
        """Return the differences between a record and a new simulation of its replies. Raises SimulatorError."""
        return await self._request(Resimulate(assignment, record, frames, exact))

    def live(self, assignment: Assignment) -> "LiveEpisode":
        """Return a live episode, not yet begun, for an agent in the main process."""
        return LiveEpisode(self, assignment, next(self._sessions))

    async def _request(
        self, request: Request, on_first_frame: Callable[[], None] | None = None, wanted: Worker | None = None
    ) -> Any:
        return await AsyncRetrying(**_RETRY_ON_ANOTHER)(self._ask, request, on_first_frame, wanted)

    async def _ask(self, request: Request, on_first_frame: Callable[[], None] | None, wanted: Worker | None) -> Any:
        worker = self.acquire(wanted)
        try:
            return (await asyncio.wrap_future(worker.submit(request, on_first_frame=on_first_frame)))[1]
        finally:
            self.release(worker)

    def acquire(self, wanted: Worker | None = None) -> Worker:
        """Return the least busy worker with capacity, and raise its load by one until `release`.

        Among equally busy workers, `wanted` is preferred.
        """

        def rank(worker: Worker) -> tuple[bool, int, bool]:
            return worker.is_waiting_for_capacity, self._load[worker], worker is not wanted

        worker = min(self.workers, key=rank)
        self._load[worker] += 1
        return worker

    def release(self, worker: Worker) -> None:
        """Reduce the load of `worker` by one."""
        self._load[worker] -= 1


class LiveEpisode:
    """One episode in a worker, played by an agent in the main process."""

    def __init__(self, pool: SimulatorPool, assignment: Assignment, session: int) -> None:
        self.assignment = assignment
        self._pool = pool
        self._session = session
        self._worker: Worker | None = None
        self._generation = 0
        self._replies: list[Reply] = []
        self._restores = 0

    async def begin(self) -> EncodedObservation | EpisodeRecord:
        """Return the first observation, or the record when the reset failed. Raises SimulatorError."""
        while True:
            try:
                return await self._begin()
            except WorkerLost:
                self._count_restore()

    async def advance(self, reply: Reply) -> EncodedObservation | EpisodeRecord:
        """Return the next observation, or the record when `reply` ended the episode. Raises SimulatorError."""
        self._replies.append(reply)
        try:
            return await self._ask(AdvanceEpisode(self._session, reply))
        except WorkerLost:
            self._count_restore()
        return await self._restore()

    async def fail(self, boundary: Boundary, message: str) -> EpisodeRecord | None:
        """Return the record so far, ended as an error; None when it was lost with its worker."""
        try:
            return await self._ask(FailEpisode(self._session, boundary, message))
        except VigilError:
            return None

    def close(self) -> None:
        """Let the worker forget the episode."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.submit(DropEpisode(self._session), self._generation)
            self._pool.release(worker)

    async def _begin(self) -> EncodedObservation | EpisodeRecord:
        return await AsyncRetrying(**_RETRY_ON_ANOTHER)(self._begin_once)

    async def _begin_once(self) -> EncodedObservation | EpisodeRecord:
        self.close()
        self._worker = self._pool.acquire()
        future = self._worker.submit(BeginEpisode(self._session, self.assignment))
        self._generation, view = await asyncio.wrap_future(future)
        return view

    async def _ask(self, request: Request) -> Any:
        if self._worker is None:
            raise WorkerLost("The episode has not begun.")
        return (await asyncio.wrap_future(self._worker.submit(request, self._generation)))[1]

    async def _restore(self) -> EncodedObservation | EpisodeRecord:
        """Return the observation or record after the last reply, by carrying out all replies in another process."""
        while True:
            try:
                answer = await self._begin()
                for reply in self._replies if isinstance(answer, EncodedObservation) else ():
                    answer = await self._ask(AdvanceEpisode(self._session, reply))
                return answer
            except WorkerLost:
                self._count_restore()

    def _count_restore(self) -> None:
        """Count a restore; re-raise the current WorkerLost when there were too many."""
        self._restores += 1
        if self._restores > MAX_RESTORES:
            raise
