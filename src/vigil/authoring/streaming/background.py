"""Background processes that make the houses of a stream ahead of its reader.

A process that was killed is started again and makes the same house again. Processes do not outlive their reader:
`close` ends them, as do the garbage collection of the pool and the end of the interpreter. A SIGKILL of the reader's
process also ends them, because it ends their input.
"""

import os
import pickle
import queue
import subprocess
import sys
import threading
import weakref
from collections.abc import Iterable
from concurrent.futures import Future
from typing import Any

from vigil.authoring.streaming.houses import StreamHouse, StreamSettings
from vigil.errors import SimulatorError

MAX_DEATHS = 3
"""Number of processes that end while they make one house after which the stream gives up."""

_Job = tuple[int, "Future[StreamHouse]"]
_Jobs = queue.SimpleQueue[_Job | None]


class HousePool:
    """A pool of processes that make houses in the order of the requests."""

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        self._jobs: _Jobs = queue.SimpleQueue()
        self._processes = [_Process(settings) for _ in range(workers)]
        self._end = weakref.finalize(self, _end, self._processes, self._jobs)
        for process in self._processes:
            threading.Thread(target=_serve, args=(process, self._jobs), daemon=True).start()

    def pids(self) -> list[int]:
        """Return the ids of the running processes."""
        return [pid for process in self._processes if (pid := process.pid) is not None]

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house. It raises SimulatorError if `MAX_DEATHS` processes ended while they made it."""
        future: Future[StreamHouse] = Future()
        self._jobs.put((number, future))
        return future

    def close(self) -> None:
        """End the processes immediately; houses in the making are lost."""
        self._end()


class _Process:
    """One background process, started on demand."""

    def __init__(self, settings: StreamSettings) -> None:
        self._settings = settings
        self._lock = threading.Lock()
        """Lock of `_process` and `_is_closed`."""
        self._process: subprocess.Popen[bytes] | None = None
        self._is_closed = False

    @property
    def pid(self) -> int | None:
        """Id of the process; None if it does not run."""
        return None if self._process is None else self._process.pid

    def house(self, number: int) -> StreamHouse:
        """Return a house of the stream. Raises the error of making it, or SimulatorError if processes ended."""
        for _ in range(MAX_DEATHS):
            answer = self._asked(self._running(), number)
            if isinstance(answer, Exception):
                raise answer
            if answer is not None:
                return answer
            self._end()
        raise SimulatorError(
            f"House {number} of stream {self._settings.label}: {MAX_DEATHS} background processes ended while they "
            "made it. Check that there is enough memory; each process takes about 500 MB."
        )

    def close(self) -> None:
        """End the process, and refuse to start another one."""
        with self._lock:
            self._is_closed = True
        self._end()

    def _running(self) -> "subprocess.Popen[bytes]":
        with self._lock:
            if self._is_closed:
                raise SimulatorError("The stream has been closed.")
            if self._process is None:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "vigil.authoring.streaming.worker"],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ},
                    start_new_session=True,
                )
            return self._process

    def _asked(self, process: "subprocess.Popen[bytes]", number: int) -> Any:
        """Return a process's answer; None if it ended instead."""
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            pickle.dump((self._settings, number), process.stdin)
            process.stdin.flush()
            return pickle.load(process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            return None

    def _end(self) -> None:
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                _close(pipe)


def _close(pipe: Any) -> None:
    """Close a pipe; unwritten data for a process that has ended does not matter."""
    try:
        pipe.close()
    except OSError:
        return


def _serve(process: _Process, jobs: _Jobs) -> None:
    """Have a process do the jobs one after the other, until a job is None."""
    while (job := jobs.get()) is not None:
        number, future = job
        if future.set_running_or_notify_cancel():
            try:
                future.set_result(process.house(number))
            except Exception as error:  # noqa: BLE001 - passed on to the reader
                future.set_exception(error)


def _end(processes: Iterable[_Process], jobs: _Jobs) -> None:
    for process in processes:
        process.close()
        jobs.put(None)
