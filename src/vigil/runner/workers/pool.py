"""Simulator workers: processes that hold Env and simulator, with a watchdog.

Each worker (`vigil.runner.workers.worker`) has one GL context and any number of live episodes. If a worker is lost, its
episodes are restored in another worker by carrying out their replies again: the simulator is deterministic, so the
result is the same.
"""

import asyncio
import itertools
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from tenacity import AsyncRetrying, Retrying, retry_if_exception_type, stop_after_delay

from vigil.agents.frame_encoding import EncodedFrame
from vigil.base.processes.group import end_workers
from vigil.base.processes.worker import (
    START_TIMEOUT_S,
    WORKER_TIMEOUT_S,
    LocalProcess,
    NoCapacity,
    StartProcess,
    Worker,
    WorkerLost,
    WorkerSettings,
)
from vigil.errors import SettingError, SimulatorError, VigilError
from vigil.protocol.actions import Reply
from vigil.records.record import Boundary, EpisodeRecord
from vigil.runner.retries import MAX_RESTORES
from vigil.runner.workers.messages import FIRST_FRAME, Assignment, EncodedObservation, SimulatorFacts, WorkerPlan
from vigil.runner.workers.resimulation import ComparisonSettings, FactDifference
from vigil.runner.workers.worker import EpisodeWorker
from vigil.sim.protocol import WORKER_NUMBER

_RETRY_ON_ANOTHER: dict[str, Any] = {
    "retry": retry_if_exception_type(NoCapacity),
    "stop": stop_after_delay(START_TIMEOUT_S),
    "reraise": True,
}
"""Retry settings: if the cluster has no capacity for a worker, the request is sent to another worker."""


def usable_cpus() -> int:
    """Return the number of CPUs that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def worker_count(asked: int | None) -> int:
    """Return the number of workers: `asked`, or one for each CPU if it is None."""
    return asked or usable_cpus()


class SimulatorPool:
    """The workers of a run, each with a simulator."""

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
        threads = max(1, usable_cpus() // workers)
        self.workers: list[Worker] = []
        for number in range(workers):
            settings = replace(simulator_settings(timeout_s, threads, number), start=start)
            if logs is not None:
                settings = replace(settings, log=logs / f"worker-{number + 1}.log")
            self.workers.append(Worker(partial(EpisodeWorker, plan), f"Simulator worker-{number + 1}", settings))
        self._load = dict.fromkeys(self.workers, 0)
        self._sessions = itertools.count(1)

    def __enter__(self) -> "SimulatorPool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        if kind is not None:
            end_workers(self.workers)
        self.close()

    def close(self) -> None:
        """End all workers of the pool."""
        for worker in self.workers:
            worker.close()
        for worker in self.workers:
            worker.join()

    def facts(self, drawn: Assignment | None = None) -> SimulatorFacts:
        """Return the backend's facts. This starts all workers for which there is capacity.

        If `drawn` is given, each worker draws the first frame of `drawn`. Raises SimulatorError when a worker cannot
        start or draw, or when there is no capacity.
        """
        return Retrying(**_RETRY_ON_ANOTHER)(self._facts, drawn)

    def _facts(self, drawn: Assignment | None) -> SimulatorFacts:
        futures = [worker.submit(EpisodeWorker.facts, drawn) for worker in self.workers]
        started = [future for future in futures if not isinstance(future.exception(), NoCapacity)]
        facts = [future.result() for future in started or futures]
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

        `worker` is preferred among equally busy workers. `on_first_frame` is called before the agent sees the first
        frame. If the worker is lost after that and `may_resume` is true, the agent continues in another worker. If
        `may_resume` is false, WorkerLost is raised at once.
        """
        replies: list[Reply] = []

        def on_event(event: Any) -> None:
            nonlocal assignment
            assignment = replace(assignment, started=assignment.started or datetime.now(UTC))
            if event == FIRST_FRAME:
                on_first_frame()
            else:
                replies.append(event)

        for left in range(MAX_RESTORES, -1, -1):
            earlier = None if assignment.started is None else tuple(replies)
            try:
                return await self._request(EpisodeWorker.play, assignment, earlier, on_event=on_event, wanted=worker)
            except WorkerLost:
                if not (may_resume and left and assignment.started):
                    raise
        raise AssertionError("the last round returns or raises")

    async def resimulate(
        self, assignment: Assignment, record: EpisodeRecord, settings: ComparisonSettings
    ) -> list[FactDifference]:
        """Return the differences between a record and a new simulation of its replies. Raises SimulatorError."""
        return await self._request(EpisodeWorker.resimulate, assignment, record, settings)

    async def frames(
        self, assignment: Assignment, record: EpisodeRecord, steps: tuple[int, ...]
    ) -> dict[int, EncodedFrame]:
        """Return {step: frame} for `steps` of a record: the frame before the step's reply, drawn again.

        Raises RecordError.
        """
        return await self._request(EpisodeWorker.frames, assignment, record, steps)

    def live(self, assignment: Assignment, replies: Sequence[Reply] = ()) -> "LiveEpisode":
        """Return an episode for an agent in the main process; it has not begun yet.

        `replies` are the agent's replies from a process that was lost; `begin` carries them out again.
        """
        return LiveEpisode(self, assignment, next(self._sessions), replies)

    async def _request(
        self, function: Callable[..., Any], *arguments: Any, wanted: Worker | None = None, **options: Any
    ) -> Any:
        async def ask() -> Any:
            worker = self.acquire(wanted)
            try:
                return await asyncio.wrap_future(worker.submit(function, *arguments, **options))
            finally:
                self.release(worker)

        return await AsyncRetrying(**_RETRY_ON_ANOTHER)(ask)

    def acquire(self, wanted: Worker | None = None) -> Worker:
        """Return the least busy worker with capacity, and add 1 to its load; `release` subtracts this again.

        Among equally busy workers, `wanted` is preferred.
        """

        def rank(worker: Worker) -> tuple[bool, int, bool]:
            return worker.is_waiting_for_capacity, self._load[worker], worker is not wanted

        worker = min(self.workers, key=rank)
        self._load[worker] += 1
        return worker

    def release(self, worker: Worker) -> None:
        """Subtract 1 from the load of `worker`."""
        self._load[worker] -= 1


class LiveEpisode:
    """One episode in a worker, played by an agent in the main process."""

    def __init__(self, pool: SimulatorPool, assignment: Assignment, session: int, replies: Sequence[Reply]) -> None:
        self.assignment = assignment
        self._pool = pool
        self._session = session
        self._worker: Worker | None = None
        self._replies = list(replies)
        self._restores = 0

    async def begin(self) -> EncodedObservation | EpisodeRecord:
        """Start the episode in a worker, and return the first observation.

        If an earlier worker was lost, carry out the replies so far again, and return the observation after them. Return
        the record when the reset failed or a reply ended the episode. Raises SimulatorError.
        """
        while True:
            try:
                answer: EncodedObservation | EpisodeRecord = await AsyncRetrying(**_RETRY_ON_ANOTHER)(self._begin)
                self.assignment = replace(self.assignment, started=self.assignment.started or datetime.now(UTC))
                for reply in self._replies if isinstance(answer, EncodedObservation) else ():
                    answer = await self._ask(EpisodeWorker.advance, reply)
                return answer
            except WorkerLost:
                self._count_restore()

    async def advance(self, reply: Reply) -> EncodedObservation | EpisodeRecord:
        """Return the next observation, or the record when `reply` ended the episode. Raises SimulatorError."""
        self._replies.append(reply)
        try:
            return await self._ask(EpisodeWorker.advance, reply)
        except WorkerLost:
            self._count_restore()
        return await self.begin()

    async def fail(self, boundary: Boundary, message: str) -> EpisodeRecord | None:
        """End the episode as an error and return its record; None when the episode was lost with its worker."""
        try:
            return await self._ask(EpisodeWorker.fail, boundary, message)
        except VigilError:
            return None

    def close(self) -> None:
        """Remove the episode from its worker."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.submit(EpisodeWorker.drop, self._session)
            self._pool.release(worker)

    async def _begin(self) -> EncodedObservation | EpisodeRecord:
        self.close()
        self._worker = self._pool.acquire()
        return await self._ask(EpisodeWorker.begin, self.assignment)

    async def _ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return the worker's answer. Raises WorkerLost when the episode is lost or has not begun."""
        worker = self._worker
        if worker is None:
            raise WorkerLost("The episode has not begun.")
        try:
            return await asyncio.wrap_future(worker.submit(function, self._session, *arguments))
        except WorkerLost:
            self._worker = None
            self._pool.release(worker)
            raise

    def _count_restore(self) -> None:
        """Count a restore; re-raise the current WorkerLost when there were too many restores."""
        self._restores += 1
        if self._restores > MAX_RESTORES:
            raise


def simulator_settings(timeout_s: float, threads: int, number: int = 0) -> WorkerSettings:
    """Return the settings of simulator worker `number`; `threads` is the number of its software renderer's threads."""
    environment = {"LP_NUM_THREADS": str(threads), WORKER_NUMBER: str(number)}
    return WorkerSettings(timeout_s, environment, fault=SimulatorError)
