"""One worker: a process, the connection to it, and the thread that sends requests and waits for answers.

The process handles one request at a time. If it does not answer in time, it is killed and its state is lost
(`WorkerLost`); a new process is started for the next request.
"""

import os
import pickle
import queue
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any, Protocol, TypeVar

from vigil.base.processes.child import MakeState, Message
from vigil.errors import SettingError, SimulatorError, VigilError

WORKER_TIMEOUT_S = 120.0
"""Time limit (s) for one request. If the request plays a whole episode, it is the limit for each step."""
START_TIMEOUT_S = 120.0
"""Minimum time limit for a process to start and make its state, in seconds."""
SHUTDOWN_TIMEOUT_S = 20.0
"""Time limit (s) for a process to end the agents' programs and exit. After this time, the process is killed."""
_LOG_TAIL = 2000
_Result = TypeVar("_Result")


class WorkerLost(SimulatorError):
    """The worker hung or died, and its state is lost."""


class NoCapacity(WorkerLost):
    """The cluster has no free CPU for the worker yet. Until it has one, other workers must take the requests."""


class WorkerProcess(Protocol):
    """The process of a worker, and the connection to this process."""

    @property
    def pid(self) -> int | None:
        """Process id on the machine where the process runs; None before the process has started."""
        ...

    @property
    def has_started(self) -> bool:
        """Whether `connect` can return without waiting for a free CPU."""
        ...

    def connect(self) -> Connection:
        """Return the connection to the process. The maker of the state has already been sent over it.

        Raises NoCapacity, or OSError if the process has ended.
        """
        ...

    def wait(self, timeout: float | None = None) -> int | None:
        """Wait until the process has ended. Return its exit code; None if unknown. Raises subprocess.TimeoutExpired."""
        ...

    def terminate(self) -> None:
        """Ask the process to exit."""

    def kill(self) -> None:
        """Kill the process."""


class LocalProcess(subprocess.Popen[bytes]):
    """A worker process on this machine. It imports modules from the same folders as this process."""

    has_started = True

    def __init__(self, make_state: MakeState, log: Path | None, environment: Mapping[str, str]) -> None:
        """Start the process. Variables that are set in this process override those in `environment`.

        The output of the process is appended to the file `log`. If `log` is None, the output goes where this process
        prints.
        """
        self._make_state = ForkingPickler.dumps(make_state)
        ours, theirs = socket.socketpair()
        with ours, theirs, nullcontext() if log is None else log.open("ab") as output:
            super().__init__(
                [sys.executable, "-m", "vigil.base.processes", str(theirs.fileno())],
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **environment, **os.environ},
                start_new_session=True,
            )
            self._connection = Connection(ours.detach())

    def connect(self) -> Connection:
        """Return this process's end of the socket pair."""
        spec = getattr(sys.modules["__main__"], "__spec__", None)
        self._connection.send((sys.path, spec and spec.name))
        self._connection.send_bytes(self._make_state)
        return self._connection


StartProcess = Callable[[MakeState, Path | None, Mapping[str, str]], WorkerProcess]
"""Function that starts a worker process on this or another machine. Its arguments: the maker of the state, the path of
the log, and the environment."""


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """Settings of a worker: time limit, environment, log, and what happens if its process ends."""

    timeout_s: float | None = None
    """Time limit (s) for one request, or between two events of a request; None for no limit."""
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    """Environment variables of the process. A variable that is set in this process keeps its value."""
    log: Path | None = Path(os.devnull)
    """File for the output of the process; None if the output goes where this process prints."""
    start: StartProcess = LocalProcess
    attempts: int = 1
    """Maximum number of processes that try a request, one after the other. If all of them die, the request fails."""
    advice: str = ""
    """Advice to the user, added to the message about a process that has ended."""
    fault: Callable[[str], Exception] | None = None
    """Function that turns the traceback of an unexpected exception in the process into the error to raise; None to
    raise the exception itself."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request, and the future that gets the answer."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    on_event: Callable[[Any], None]
    future: "Future[Any]" = field(default_factory=Future[Any])

    @property
    def name(self) -> str:
        """Name of the requested function, for messages."""
        return getattr(self.function, "__name__", repr(self.function))


Requests = queue.SimpleQueue[Request | None]


class Worker:
    """One worker process, which is restarted when needed, and the thread that communicates with the process."""

    def __init__(
        self,
        make_state: MakeState,
        name: str,
        settings: WorkerSettings = WorkerSettings(),
        requests: Requests | None = None,
    ) -> None:
        """Start the thread. The process starts at the first request. Several workers may share `requests`."""
        self.name = name
        self._make_state = make_state
        self._settings = settings
        self._timeout_s = settings.timeout_s
        self._has_answered = False
        self._is_closed = self._is_killed = False
        self._lock = threading.Lock()
        """Lock for `_is_closed` and `_is_killed`, and for starting the process."""
        self._process: WorkerProcess | None = None
        self._connection: Connection | None = None
        self._requests: Requests = requests or queue.SimpleQueue()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int | None:
        """Process id of the running worker; None before the first request."""
        return None if self._process is None else self._process.pid

    @property
    def is_waiting_for_capacity(self) -> bool:
        """Whether the process could not start yet, because the cluster has no free CPU."""
        process = self._process
        return process is not None and self._connection is None and not process.has_started

    def submit(
        self, function: Callable[..., _Result], *arguments: Any, on_event: Callable[[Any], None] = lambda _event: None
    ) -> "Future[_Result]":
        """Let the process call `function(state, *arguments)`, and return the future of the result.

        The future raises WorkerLost if the process hangs or dies during the request, and after `close` or `kill`.
        `on_event` is called in the worker's thread with each event that the function reports.
        """
        request = Request(function, arguments, on_event)
        with self._lock:
            if self._is_closed:
                request.future.set_exception(self._closed_error())
            else:
                self._requests.put(request)
        return request.future

    def close(self) -> None:
        """End the process after it has handled the requests that were already submitted."""
        with self._lock:
            if not self._is_closed:
                self._is_closed = True
                self._requests.put(None)

    def kill(self) -> None:
        """Kill the process and the agents' programs that it started. Requests that are running or waiting fail."""
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
        """Wait until the process has ended."""
        self._thread.join()

    def _running(self) -> WorkerProcess:
        """Return the process; start it if it is not running. Raises WorkerLost after `kill`."""
        with self._lock:
            if self._is_killed:
                raise self._closed_error()
            if self._process is None:
                self._process = self._settings.start(self._make_state, self._settings.log, self._settings.environment)
                self._has_answered = False
            return self._process

    def _closed_error(self) -> WorkerLost:
        return WorkerLost(f"{self.name} has been closed.")

    def _serve(self) -> None:
        while (request := self._requests.get()) is not None:
            if request.future.set_running_or_notify_cancel():
                try:
                    request.future.set_result(self._answer(request))
                except Exception as error:  # noqa: BLE001 - passed on to the caller
                    request.future.set_exception(error)
            del request  # an idle worker keeps no answer
        self._end(SHUTDOWN_TIMEOUT_S)

    def _answer(self, request: Request) -> Any:
        """Return a request's answer. If the process dies, start a new one. Raises WorkerLost or the request's error."""
        for left in range(self._settings.attempts - 1, -1, -1):
            try:
                return self._ask(request)
            except WorkerLost:
                if self._is_killed or not left:
                    raise
        raise AssertionError("the last attempt returns or raises")

    def _ask(self, request: Request) -> Any:
        try:
            data = ForkingPickler.dumps((request.function, request.arguments))
            process = self._running()
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise SettingError(f"Cannot send {request.name} to {self.name}: {error}.") from error
        try:
            if self._connection is None:
                self._connection = process.connect()
            self._connection.send_bytes(data)
            kind, value = self._receive(self._connection, request)
        except (EOFError, OSError):
            raise self._lost() from None
        if kind == "done":
            return value
        error, trace = value
        if self._settings.fault is not None and not isinstance(error, VigilError):
            raise self._settings.fault(trace)
        error.add_note(f"In a worker process:\n{trace}")
        raise error

    def _receive(self, connection: Connection, request: Request) -> Message:
        """Return the message that ends a request, after handling events. Raises WorkerLost, EOFError or OSError."""
        while True:
            timeout_s = self._timeout_s
            if timeout_s is not None and not self._has_answered:
                timeout_s = max(timeout_s, START_TIMEOUT_S)
            if not connection.poll(timeout_s):
                self._end(0.0)
                what = f"{request.name} within {timeout_s:g} s"
                raise WorkerLost(f"{self.name} did not answer {what}; it was ended and will be restarted.")
            kind, value = connection.recv()
            self._has_answered = True
            if kind in ("done", "failed"):
                return kind, value
            self._handle_event(request, value)
            if kind == "question":
                connection.send(None)

    def _handle_event(self, request: Request, event: object) -> None:
        """Call `on_event`. If this fails, end the process, because it may be waiting for an answer."""
        try:
            if event is not None:
                request.on_event(event)
        except BaseException:
            self._end(0.0)
            raise

    def _end(self, timeout_s: float) -> int | None:
        connection, self._connection = self._connection, None
        process, self._process = self._process, None
        if connection is not None:
            shut_down(connection)
            connection.close()
        if process is None:
            return None
        try:
            return process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()

    def _lost(self) -> WorkerLost:
        """Return the error for a process that has ended. The message has its exit code and the end of its log."""
        code, log = self._end(SHUTDOWN_TIMEOUT_S), self._settings.log
        text = "no exit code" if code is None else f"exit code {code}"
        if log is not None and log.is_file():
            tail = log.read_bytes()[-_LOG_TAIL:].decode(errors="replace").strip()
            text += f"; its log {log} ends with: {tail}" if tail else ""
        attempts = self._settings.attempts
        return WorkerLost(
            f"{self.name} died{f' {attempts} times' if attempts > 1 else ''} ({text}). {self._settings.advice}".rstrip()
        )


def shut_down(connection: Connection) -> None:
    """Tell the other end that the connection has ended, even if forked processes hold copies of this end."""
    with suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as line:
        line.shutdown(socket.SHUT_RDWR)
