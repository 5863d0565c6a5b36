"""Background processes that make the houses of a stream ahead of its reader.

A process that is killed is started again and asked for the same house, which it makes the same. None outlives its
reader: `close` ends them, and so do the collection of the pool as garbage, the end of the interpreter and, because
their input ends then, a SIGKILL of the reader's process.
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
"""Processes that may end over one house before the stream gives up."""

_Job = tuple[int, "Future[StreamHouse]"]
_Jobs = queue.SimpleQueue[_Job | None]


class HousePool:
    """So many processes, which make houses in the order in which they are asked for."""

    def __init__(self, settings: StreamSettings, workers: int) -> None:
        self._jobs: _Jobs = queue.SimpleQueue()
        self._processes = [_Process(settings) for _ in range(workers)]
        self._end = weakref.finalize(self, _end, self._processes, self._jobs)
        for process in self._processes:
            threading.Thread(target=_serve, args=(process, self._jobs), daemon=True).start()

    def pids(self) -> list[int]:
        """Return the ids of the processes that run."""
        return [pid for process in self._processes if (pid := process.pid) is not None]

    def ask(self, number: int) -> "Future[StreamHouse]":
        """Return the future of a house. It raises SimulatorError when several processes ended over it."""
        future: Future[StreamHouse] = Future()
        self._jobs.put((number, future))
        return future

    def close(self) -> None:
        """Ends the processes at once; what is under way is lost."""
        self._end()


class _Process:
    """One background process, started when it is needed."""

    def __init__(self, settings: StreamSettings) -> None:
        self._settings = settings
        self._lock = threading.Lock()
        """Of the two below."""
        self._process: subprocess.Popen[bytes] | None = None
        self._is_closed = False

    @property
    def pid(self) -> int | None:
        """Its id; None when it does not run."""
        return None if self._process is None else self._process.pid

    def house(self, number: int) -> StreamHouse:
        """Return a house of the stream. Raises SimulatorError, or what making it raised."""
        for _ in range(MAX_DEATHS):
            answer = self._asked(self._running(), number)
            if isinstance(answer, Exception):
                raise answer
            if answer is not None:
                return answer
            self._end()
        raise SimulatorError(
            f"House {number} of stream {self._settings.label}: {MAX_DEATHS} background processes ended while they "
            "made it. Is there enough memory? Each takes some 500 MB."
        )

    def close(self) -> None:
        """Ends the process for good."""
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
        """Return what a process answers; None when it ended instead."""
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
    """Closes a pipe; what could not be written to a process that is gone does not matter."""
    try:
        pipe.close()
    except OSError:
        return


def _serve(process: _Process, jobs: _Jobs) -> None:
    """Makes what is asked for, one after the other, until None is asked for."""
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
