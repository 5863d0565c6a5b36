"""One simulator worker: a process, the pipe to it, and the thread that sends requests and waits for answers.

The process handles one request at a time. It is killed when it does not answer in time, and restarted for the
next request; its live episodes are lost (`WorkerLost`).
"""

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
from typing import Any, Protocol

from vigil.base.imports import ENVIRONMENT_VARIABLE
from vigil.errors import SettingError, SimulatorError
from vigil.protocol.actions import Reply
from vigil.runner.workers.messages import AboutToShowFrame, Failed, Heartbeat, Plan, Proceed, Request
from vigil.sim.protocol import WORKER_NUMBER

WORKER_TIMEOUT_S = 120.0
"""Time limit for one request, or for one step of a whole episode, in seconds."""
START_TIMEOUT_S = 120.0
"""Minimum time limit for a process to start and load its pack, in seconds."""
SHUTDOWN_TIMEOUT_S = 20.0
"""Time limit for a process to exit before it is killed, in seconds; it first ends agents' programs."""
_LOG_TAIL = 2000


class WorkerLost(SimulatorError):
    """The worker hung or died, and its live episodes are lost."""

    replies: tuple[Reply, ...] | None = None
    """Replies of the agent inside the worker since the request; None when the agent had not seen a frame."""


class NoCapacity(WorkerLost):
    """The cluster does not have a CPU for the worker yet; until it starts, requests must go to other workers."""


class WorkerProcess(Protocol):
    """Process of a worker, and the connection to it."""

    @property
    def pid(self) -> int | None:
        """Process id on the machine on which it runs; None before it has started."""
        ...

    @property
    def has_started(self) -> bool:
        """Whether `connect` returns without waiting for capacity."""
        ...

    def connect(self) -> Connection:
        """Return the connection to the process. Raises NoCapacity, or OSError when the process has ended."""
        ...

    def wait(self, timeout: float | None = None) -> int | None:
        """Wait until the process has ended; return its exit code, None if unknown. Raises subprocess.TimeoutExpired."""
        ...

    def terminate(self) -> None:
        """Ask the process to exit."""

    def kill(self) -> None:
        """Kill the process."""


class LocalProcess:
    """A worker process on this machine."""

    has_started = True

    def __init__(self, log: Path | None, environment: dict[str, str]) -> None:
        """Start the process. Its standard error is appended to `log`."""
        ours, theirs = socket.socketpair()
        with ours, theirs:
            self._process = launch(theirs.fileno(), log, environment)
            self._connection = Connection(ours.detach())
        self.pid: int | None = self._process.pid
        self.wait = self._process.wait
        self.terminate = self._process.terminate
        self.kill = self._process.kill

    def connect(self) -> Connection:
        """Return our end of the socket pair."""
        return self._connection


StartProcess = Callable[[Path | None, dict[str, str]], WorkerProcess]
"""Function that starts a worker process, here or elsewhere, from the path of its log and its environment."""


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """Settings of workers."""

    timeout_s: float = WORKER_TIMEOUT_S
    threads: int = 1
    """Number of threads of a software renderer."""
    logs: Path | None = None
    """Folder for the workers' standard error; None discards it."""
    start: StartProcess = LocalProcess


class _Job:
    """A pending request with the future that receives the answer."""

    def __init__(self, request: Request, generation: int | None, on_first_frame: Callable[[], None]) -> None:
        self.request = request
        self.generation = generation
        self.on_first_frame = on_first_frame
        self.future: Future[tuple[int, Any]] = Future()


class Worker:
    """One worker process, restarted when needed, and the thread that talks to it."""

    def __init__(self, plan: Plan, name: str, settings: WorkerSettings, number: int = 0) -> None:
        self.name = name
        self._plan = plan
        self._timeout_s = settings.timeout_s
        self._environment = {"LP_NUM_THREADS": str(settings.threads), WORKER_NUMBER: str(number)}
        if ENVIRONMENT_VARIABLE in os.environ:  # the node of a cluster has a different environment
            self._environment[ENVIRONMENT_VARIABLE] = os.environ[ENVIRONMENT_VARIABLE]
        self._log = settings.logs / f"{name}.log" if settings.logs else None
        self._start = settings.start
        self._generation = 0
        self._has_answered = False
        self._is_closed = self._is_killed = False
        self._lock = threading.Lock()
        """Lock for the two flags and the start of a process."""
        self._process: WorkerProcess | None = None
        self._connection: Connection | None = None
        self._replies: list[Reply] | None = None
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int | None:
        """Process id of the running worker; None before the first request."""
        return None if self._process is None else self._process.pid

    @property
    def is_waiting_for_capacity(self) -> bool:
        """Whether the process could not be started yet."""
        process = self._process
        return process is not None and self._connection is None and not process.has_started

    def submit(
        self, request: Request, generation: int | None = None, on_first_frame: Callable[[], None] | None = None
    ) -> "Future[tuple[int, Any]]":
        """Send a request and return the future of (generation, value); the generation counts the worker's processes.

        The future raises WorkerLost when the process hangs or dies during the request, and after `close` or `kill`;
        with `generation`, also when that process has ended. `on_first_frame` is called, in the worker's thread, before
        an agent inside the worker is shown the first frame.
        """
        job = _Job(request, generation, on_first_frame or (lambda: None))
        with self._lock:
            if self._is_closed:
                job.future.set_exception(WorkerLost(f"Simulator {self.name} has been closed."))
            else:
                self._jobs.put(job)
        return job.future

    def close(self) -> None:
        """End the process after the requests that were submitted before."""
        with self._lock:
            if not self._is_closed:
                self._is_closed = True
                self._jobs.put(None)

    def kill(self) -> None:
        """Kill the process and the agents' programs that it started; running and waiting requests fail."""
        with self._lock:
            self._is_killed = True
            process = self._process
        self.close()
        if process is not None:
            process.terminate()
            late = threading.Timer(SHUTDOWN_TIMEOUT_S, process.kill)
            late.daemon = True
            late.start()

    def join(self) -> None:
        """Wait for the end of the process."""
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
        self._end(SHUTDOWN_TIMEOUT_S)

    def _handle(self, job: "_Job") -> tuple[int, Any]:
        request, generation = job.request, job.generation
        if generation is not None and (generation != self._generation or self._connection is None):
            raise WorkerLost(f"Simulator {self.name} has been restarted; its live episodes are lost.")
        try:
            connection = self._running()
            connection.send(request)
            return self._generation, self._answer(connection, job)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise SettingError(f"Cannot send {type(request).__name__} to a simulator worker: {error}.") from error
        except (EOFError, OSError):
            raise WorkerLost(f"Simulator {self.name} died ({self._exit_summary()}).") from None

    def _answer(self, connection: Connection, job: "_Job") -> Any:
        while True:
            timeout_s = self._timeout_s if self._has_answered else max(self._timeout_s, START_TIMEOUT_S)
            if not connection.poll(timeout_s):
                self._end(0.0)
                what = f"{type(job.request).__name__} within {timeout_s:g} s"
                raise WorkerLost(f"Simulator {self.name} did not answer {what}; it was ended and will be restarted.")
            message = connection.recv()
            self._has_answered = True
            if isinstance(message, Failed):
                raise message.error
            if isinstance(message, AboutToShowFrame):
                self._replies = []
                self._call_on_first_frame(job.on_first_frame)
                connection.send(Proceed())
            elif isinstance(message, Heartbeat):
                if message.reply is not None:
                    self._replies = self._replies or []
                    self._replies.append(message.reply)
            else:
                return message.value

    def _call_on_first_frame(self, on_first_frame: Callable[[], None]) -> None:
        """Call `on_first_frame`; if it fails, end the worker, which waits for `Proceed`."""
        try:
            on_first_frame()
        except BaseException:
            self._end(0.0)
            raise

    def _running(self) -> Connection:
        if self._connection is None:
            with self._lock:
                if self._is_killed:
                    raise WorkerLost(f"Simulator {self.name} has been closed.")
                process = self._process = self._process or self._start(self._log, self._environment)
            self._connection = process.connect()
            self._generation += 1
            self._has_answered = False
            self._connection.send(self._plan)
        return self._connection

    def _end(self, timeout_s: float) -> int | None:
        connection, self._connection = self._connection, None
        process, self._process = self._process, None
        if connection is not None:
            connection.close()
        if process is None:
            return None
        try:
            return process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def _exit_summary(self) -> str:
        code = self._end(SHUTDOWN_TIMEOUT_S)
        text = "no exit code" if code is None else f"exit code {code}"
        if self._log is not None and self._log.is_file():
            tail = self._log.read_bytes()[-_LOG_TAIL:].decode(errors="replace").strip()
            text += f"; its log {self._log} ends with: {tail}" if tail else ""
        return text


def launch(fd: int, log: Path | None, environment: dict[str, str]) -> "subprocess.Popen[bytes]":
    """Start a worker process with its end of a socket pair; this process's environment overrides `environment`."""
    command = [sys.executable, "-m", "vigil.runner.workers.worker", str(fd)]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with open(log or os.devnull, "ab") as output:
        return subprocess.Popen(
            command,
            pass_fds=(fd,),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env={**one_thread, **environment, **os.environ},
            start_new_session=True,
        )
