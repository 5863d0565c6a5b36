"""Simulator workers: processes that hold Env and simulator, with a watchdog.

Each worker is one process with one GL context and any number of live episodes. It handles one request at a time; a
thread of the main process talks to it, and kills and restarts it when it does not answer in time or dies. An episode
that was alive in a lost worker is restored in another one by carrying out its replies again: the simulator is
deterministic, so the result is the same.
"""

import asyncio
import itertools
import os
import pickle
import queue
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any

from vigil.actions import Reply
from vigil.errors import SettingError, SimulatorError, VigilError
from vigil.record import Boundary, EpisodeRecord
from vigil.runner.workers.messages import (
    AboutToShowFrame,
    Advance,
    Assignment,
    Begin,
    Drop,
    EncodedObservation,
    Fail,
    Failed,
    GetSimulatorFacts,
    Heartbeat,
    Play,
    Proceed,
    Request,
    Resimulate,
    SimulatorFacts,
    WorkerPlan,
)
from vigil.runner.workers.resimulation import FactDifference

PATIENCE_S = 120.0
"""How long a worker may be silent over one request, or over one step of a whole episode."""
START_S = 120.0
"""How long a process may take to start and to load its pack, however short the patience."""
CLOSING_S = 5.0
MAX_RESTORES = 2
"""How often one episode is carried over to another worker before it counts as lost."""
_LOG_TAIL = 2000


class WorkerLost(SimulatorError):
    """The worker hung or died; what was alive in it is gone."""

    replies: tuple[Reply, ...] | None = None
    """What the agent inside had replied since the request; None when it was shown no frame."""


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """How workers are run."""

    patience_s: float = PATIENCE_S
    threads: int = 1
    """For a software renderer."""
    logs: Path | None = None
    """Folder for what they write to standard error; None drops it."""


class _Job:
    """A pending request with the future that receives the answer."""

    def __init__(self, request: Request, generation: int | None, shows: Callable[[], None]) -> None:
        self.request = request
        self.generation = generation
        self.shows = shows
        self.future: Future[tuple[int, Any]] = Future()


class Worker:
    """One worker process, restarted when needed, and the thread that talks to it."""

    def __init__(self, plan: WorkerPlan, name: str, settings: WorkerSettings) -> None:
        self.name = name
        self._plan = plan
        self._patience_s = settings.patience_s
        self._threads = settings.threads
        self._log = settings.logs / f"{name}.log" if settings.logs else None
        self._generation = 0
        self._is_up = False
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._replies: list[Reply] | None = None
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int | None:
        """Process id of the running worker; None before the first request."""
        return None if self._process is None else self._process.pid

    def submit(
        self, request: Request, generation: int | None = None, shows: Callable[[], None] | None = None
    ) -> "Future[tuple[int, Any]]":
        """Returns the future of (generation, value). With `generation`, raises WorkerLost if that process is gone.

        `shows` is called, in the worker's thread, before an agent inside is shown the first frame.
        """
        job = _Job(request, generation, shows or (lambda: None))
        self._jobs.put(job)
        return job.future

    def close(self) -> None:
        """Ends the process when the requests before are done."""
        self._jobs.put(None)

    def kill(self) -> None:
        """Ends the process, with the agents' programs that it started; the request at work fails."""
        process = self._process
        if process is not None:
            process.terminate()

    def join(self) -> None:
        """Waits for the end of the process."""
        self._thread.join()

    def _serve(self) -> None:
        while (job := self._jobs.get()) is not None:
            if not job.future.set_running_or_notify_cancel():
                continue
            self._replies = None
            try:
                job.future.set_result(self._handle(job))
            except WorkerLost as error:
                error.replies = None if self._replies is None else tuple(self._replies)
                job.future.set_exception(error)
            except Exception as error:  # noqa: BLE001 - passed on to the caller
                job.future.set_exception(error)
        self._end(CLOSING_S)

    def _handle(self, job: "_Job") -> tuple[int, Any]:
        request, generation = job.request, job.generation
        if generation is not None and (generation != self._generation or self._connection is None):
            raise WorkerLost(f"Simulator {self.name} has been restarted; its live episodes are lost.")
        try:
            connection = self._running()
            connection.send(request)
            return self._generation, self._answer(connection, job)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise SettingError(f"Cannot hand {type(request).__name__} to a simulator worker: {error}.") from error
        except (EOFError, OSError):
            raise WorkerLost(f"Simulator {self.name} died ({self._autopsy()}).") from None

    def _answer(self, connection: Connection, job: "_Job") -> Any:
        while True:
            patience_s = self._patience_s if self._is_up else max(self._patience_s, START_S)
            if not connection.poll(patience_s):
                self._end(0.0)
                what = f"{type(job.request).__name__} within {patience_s:g} s"
                raise WorkerLost(f"Simulator {self.name} did not answer {what}; it was ended and will be restarted.")
            message = connection.recv()
            self._is_up = True
            if isinstance(message, Failed):
                raise message.error
            if isinstance(message, AboutToShowFrame):
                self._replies = []
                self._tell(job.shows)
                connection.send(Proceed())
            elif isinstance(message, Heartbeat):
                if message.reply is not None:
                    self._replies = self._replies or []
                    self._replies.append(message.reply)
            else:
                return message.value

    def _tell(self, shows: Callable[[], None]) -> None:
        """Calls `shows`; the worker, which waits for leave, is ended when that fails."""
        try:
            shows()
        except BaseException:
            self._end(0.0)
            raise

    def _running(self) -> Connection:
        if self._connection is None:
            ours, theirs = socket.socketpair()
            with theirs:
                self._process = self._launch(theirs.fileno())
            self._connection = Connection(ours.detach())
            self._generation += 1
            self._is_up = False
            self._connection.send(self._plan)
        return self._connection

    def _launch(self, fd: int) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", "vigil.runner.workers.worker", str(fd)]
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "LP_NUM_THREADS": str(self._threads)}
        with open(self._log or os.devnull, "ab") as log:
            return subprocess.Popen(
                command,
                pass_fds=(fd,),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**threads, **os.environ},
                start_new_session=True,
            )

    def _end(self, patience_s: float) -> int | None:
        connection, self._connection = self._connection, None
        process, self._process = self._process, None
        if connection is not None:
            connection.close()
        if process is None:
            return None
        try:
            return process.wait(patience_s)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def _autopsy(self) -> str:
        code = self._end(CLOSING_S)
        text = f"exit code {code}"
        if self._log is not None and self._log.is_file():
            tail = self._log.read_bytes()[-_LOG_TAIL:].decode(errors="replace").strip()
            text += f"; its log {self._log} ends with: {tail}" if tail else ""
        return text


def usable_cpus() -> int:
    """Returns how many CPUs this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class SimulatorPool:
    """The workers of a run."""

    def __init__(
        self, plan: WorkerPlan, workers: int, *, patience_s: float = PATIENCE_S, logs: Path | None = None
    ) -> None:
        """`logs` is the folder for what the workers write to standard error; None drops it."""
        if workers < 1:
            raise SettingError(f"A run needs at least one simulator worker, not {workers}.")
        if logs is not None:
            logs.mkdir(parents=True, exist_ok=True)
        settings = WorkerSettings(patience_s, max(1, usable_cpus() // workers), logs)
        self.workers = [Worker(plan, f"worker-{number}", settings) for number in range(1, workers + 1)]
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
        """Ends all workers."""
        for worker in self.workers:
            worker.close()
        for worker in self.workers:
            worker.join()

    def facts(self) -> SimulatorFacts:
        """Returns what the backend says about itself; starts all workers. Raises SimulatorError when one cannot."""
        futures = [worker.submit(GetSimulatorFacts()) for worker in self.workers]
        facts = [future.result()[1] for future in futures]
        return facts[0]

    async def play(self, assignment: Assignment, shows: Callable[[], None], *, goes_on: bool) -> EpisodeRecord:
        """Returns the record of an episode played by the agent inside a worker. Raises WorkerLost.

        `shows` is called before the agent is shown the first frame. With `goes_on`, an agent whose worker is lost after
        that plays on in another one from where it was; without, the loss is raised at once.
        """
        earlier: tuple[Reply, ...] | None = None
        for left in range(MAX_RESTORES, -1, -1):
            try:
                return await self._once(Play(assignment, earlier), shows)
            except WorkerLost as lost:
                if not goes_on or not left or (earlier is None and lost.replies is None):
                    raise
                earlier = (*(earlier or ()), *(lost.replies or ()))
        raise AssertionError("the last round returns or raises")

    async def resimulate(
        self, assignment: Assignment, record: EpisodeRecord, *, frames: bool, exact: bool
    ) -> list[FactDifference]:
        """Returns the differences between a record and its replies carried out again. Raises SimulatorError."""
        return await self._once(Resimulate(assignment, record, frames, exact))

    def live(self, assignment: Assignment) -> "LiveEpisode":
        """Returns an episode to be played from outside, not begun yet."""
        return LiveEpisode(self, assignment, next(self._sessions))

    async def _once(self, request: Request, shows: Callable[[], None] | None = None) -> Any:
        worker = self.take()
        try:
            return (await asyncio.wrap_future(worker.submit(request, shows=shows)))[1]
        finally:
            self.give_back(worker)

    def take(self) -> Worker:
        """Returns the least busy worker, counted as busier by one until it is given back."""
        worker = min(self.workers, key=self._load.__getitem__)
        self._load[worker] += 1
        return worker

    def give_back(self, worker: Worker) -> None:
        """Counts `worker` as less busy by one."""
        self._load[worker] -= 1


class LiveEpisode:
    """One episode alive in a worker, driven by an agent in the main process."""

    def __init__(self, pool: SimulatorPool, assignment: Assignment, session: int) -> None:
        self.assignment = assignment
        self._pool = pool
        self._session = session
        self._worker: Worker | None = None
        self._generation = 0
        self._replies: list[Reply] = []
        self._restores = 0

    async def begin(self) -> EncodedObservation | EpisodeRecord:
        """Returns the first view, or the record when the reset failed. Raises SimulatorError."""
        while True:
            try:
                return await self._begin()
            except WorkerLost:
                self._count_restore()

    async def advance(self, reply: Reply) -> EncodedObservation | EpisodeRecord:
        """Returns the next view, or the record when `reply` ended the episode. Raises SimulatorError."""
        self._replies.append(reply)
        try:
            return await self._ask(Advance(self._session, reply))
        except WorkerLost:
            self._count_restore()
        return await self._restore()

    async def fail(self, boundary: Boundary, message: str) -> EpisodeRecord | None:
        """Returns the record so far, ended as an error; None when it is lost with its worker."""
        try:
            return await self._ask(Fail(self._session, boundary, message))
        except VigilError:
            return None

    def close(self) -> None:
        """Lets the worker forget the episode."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.submit(Drop(self._session), self._generation)
            self._pool.give_back(worker)

    async def _begin(self) -> EncodedObservation | EpisodeRecord:
        self.close()
        self._worker = self._pool.take()
        future = self._worker.submit(Begin(self._session, self.assignment))
        self._generation, view = await asyncio.wrap_future(future)
        return view

    async def _ask(self, request: Request) -> Any:
        if self._worker is None:
            raise WorkerLost("The episode has not begun.")
        return (await asyncio.wrap_future(self._worker.submit(request, self._generation)))[1]

    async def _restore(self) -> EncodedObservation | EpisodeRecord:
        """Returns what follows the last reply, after carrying out all replies in another process."""
        while True:
            try:
                answer = await self._begin()
                for reply in self._replies if isinstance(answer, EncodedObservation) else ():
                    answer = await self._ask(Advance(self._session, reply))
                return answer
            except WorkerLost:
                self._count_restore()

    def _count_restore(self) -> None:
        """Raises the WorkerLost at hand when the episode was carried over too often."""
        self._restores += 1
        if self._restores > MAX_RESTORES:
            raise
