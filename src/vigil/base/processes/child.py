"""The inside of a worker process: it makes a state once, then answers one request at a time.

The process ends when the other end of its connection is closed, even in the middle of a request.
"""

import gc
import os
import pickle
import select
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any, Literal

from vigil.errors import SimulatorError

UNWIND_AFTER_S = 0.5
"""Time (s) that a worker may continue with a request after nobody waits for its answer any more."""
END_AFTER_S = 15.0
"""Time (s) that a worker may take to stop a request cleanly. Within this time, it also ends the agents' programs."""
POLL_END = getattr(select, "POLLRDHUP", 0)
"""Flag for a poll that reports only that the other end of a connection has closed.

On systems without this flag, a poll still reports the end of a socket pair, but not of a TCP connection.
"""

MakeState = Callable[[], Any]
"""Function that makes the state of a worker process. If the state has a method `close`, it is called at the end."""
Message = tuple[Literal["done", "failed", "event", "question"], Any]
"""Message to the main process: the result of a request, its error with the traceback, or an event during the request.

A `question` is an event that the main process answers when it has handled the event.
"""

_connections: list[Connection] = []
"""The connection to the main process; empty if this process is not a worker."""


def report(event: object = None, *, is_awaited: bool = False) -> None:
    """Report to the main process that the request is still running. The report includes `event` unless this is None.

    If `is_awaited` is True, wait until the main process has handled the event. Outside a worker, this does nothing.
    """
    for connection in _connections:
        connection.send(("question" if is_awaited else "event", event))
        if is_awaited:
            connection.recv()


def serve(connection: Connection, make_state: bytes | MakeState) -> None:
    """Answer requests until the other end closes the connection.

    `make_state` may be pickled. It is called at the first request; if it raises an error, the error is the answer.
    """
    gc.freeze()  # imported modules are never garbage, so the collector need not look through them
    _connections[:] = [connection]
    is_ending = threading.Event()
    signal.signal(signal.SIGTERM, lambda _signal, _frame: None if is_ending.is_set() else sys.exit())
    threading.Thread(target=_end_with_parent, args=(connection.fileno(), is_ending), daemon=True).start()
    states: list[Any] = []

    def answer(request: bytes) -> Any:
        if not states:
            states.append((pickle.loads(make_state) if isinstance(make_state, bytes) else make_state)())
            report()
        function, arguments = pickle.loads(request)
        return function(states[0], *arguments)

    try:
        while True:
            connection.send_bytes(_answer_or_error(answer, connection.recv_bytes()))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the main process has ended, or has no more requests
    finally:
        is_ending.set()
        for state in states:
            if hasattr(state, "close"):
                state.close()


def _answer_or_error(answer: Callable[[bytes], Any], request: bytes) -> Any:
    """Return a pickled message: a request's answer or, if the request raised an error, the error and traceback."""
    try:
        return ForkingPickler.dumps(("done", answer(request)))
    except Exception as error:  # noqa: BLE001 - raised again in the main process
        return ForkingPickler.dumps(("failed", (_picklable(error), traceback.format_exc(limit=-8))))


def _picklable(error: Exception) -> Exception:
    """Return the error itself, or a SimulatorError with the same text if the error cannot be pickled."""
    try:
        return pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - errors of any library may fail in any way
        return SimulatorError(f"{type(error).__name__}: {error}")


def _end_with_parent(fd: int, is_ending: threading.Event) -> None:
    """End a busy worker when the other end is closed: stop the request cleanly, or exit if this takes too long."""
    other_end = select.poll()
    other_end.register(fd, POLL_END)
    other_end.poll()
    if not is_ending.wait(UNWIND_AFTER_S):
        os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(END_AFTER_S)
    os._exit(1)
