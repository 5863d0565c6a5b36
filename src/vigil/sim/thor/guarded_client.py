"""A connection to AI2-THOR's engine through AI2-THOR's unmodified client; it notices when the engine ends.

Without this connection, the client waits forever if an engine ends before it connects. If an engine ends in the middle
of an answer, the client uses a whole CPU core until its time-out. With this connection, both cases raise SimulatorError
within a second, and no process, pipe or folder is left behind.
"""

import os
import threading
import time
from contextlib import suppress
from typing import Any

from vigil.errors import SettingError, SimulatorError

ASK_EVERY_S = 0.05
"""Interval (s) at which it is checked whether the engine's process still runs."""
ZEROS = bytes(65536)
"""Bytes that are sent to a client whose engine has ended. The client gives up, because no message begins with zeros."""
END_TIMEOUT_S = 60.0
"""Longest time (s) that a killed engine may take to end; on a busy machine this takes seconds."""


class GuardedClient:
    """A connection to one engine. It starts the engine, watches the engine's process, and ends it."""

    def __init__(
        self,
        scene: dict[str, Any],
        command: str | None = None,
        *,
        start_s: float = 60.0,
        answer_s: float = 30.0,
        **settings: Any,
    ) -> None:
        """Start an engine with `command` (None for AI2-THOR's own engine) and open a house in it.

        `settings` are parameters of the client's Controller. Raises SettingError if the client is not installed. Raises
        SimulatorError if the engine ends, does not connect within `start_s`, does not answer within `answer_s`, or
        cannot build the house.
        """
        self._controller: Any = object.__new__(_controller_class())
        self._start_s = start_s
        self._has_started = False
        self._was_late = False
        self._status: int | None = None
        """Exit status of the engine if it ended by itself; else None."""
        self._over = threading.Event()
        """Event that is set when the connection is closed."""
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        os.environ.pop("AI2THOR_VISIBILITY_DISTANCE", None)  # the client would add it to every action
        timeouts = {"server_timeout": answer_s, "server_start_timeout": start_s}
        try:
            self._controller.__init__(local_executable_path=command, scene=scene, **timeouts, **settings)
        except Exception as error:  # the client may raise any exception when it reads nonsense
            raise self._broken("starting", error) from error
        self._has_started = True
        self._check()

    @property
    def is_over(self) -> bool:
        """Whether the connection was closed or the engine has failed."""
        return self._over.is_set()

    def open(self, house: dict[str, Any]) -> None:
        """Make the engine build a house, replacing any earlier one.

        Raises SimulatorError; after that, the connection is over.
        """
        try:
            self._controller.reset(scene=house)
        except Exception as error:
            raise self._broken("opening a house", error) from error
        self._check()

    def _check(self) -> None:
        metadata = self._controller.last_event.metadata
        if not metadata["lastActionSuccess"]:
            self.close()
            raise SimulatorError(f"AI2-THOR's engine did not open the house: {metadata['errorMessage']}")

    def step(self, action: str, **arguments: Any) -> Any:
        """Return the client's event after an action. Raises SimulatorError; after that, the connection is over."""
        if self.is_over:
            raise SimulatorError(f"AI2-THOR's engine has ended; {action} was not sent. Start another engine.")
        try:
            return self._controller.step(action=action, **arguments)
        except Exception as error:
            raise self._broken(action, error) from error

    def close(self) -> None:
        """End the engine, and wait until its process, its pipes and their folder are removed."""
        self._over.set()
        self._thread.join()
        server = getattr(self._controller, "server", None)
        if server is None:
            return
        with suppress(OSError):  # unsent bytes for an engine that has ended
            server.stop()
        if server.server_pipe is not None:
            server.server_pipe.close()
        if server.unity_proc is not None:
            if server.unity_proc.poll() is None:
                server.unity_proc.kill()
            server.unity_proc.wait(timeout=END_TIMEOUT_S)
        server.tmp_dir.cleanup()

    def _broken(self, what: str, error: Exception) -> SimulatorError:
        """Close the connection; return an error that says why it failed."""
        self.close()
        if self._was_late:
            why = "the engine did not connect in time"
        elif self._status is not None:
            why = f"the engine ended with status {self._status}"
        else:
            why = f"{type(error).__name__}: {error}"
        return SimulatorError(f"AI2-THOR, {what}: {why}. The engine's log is ~/.ai2thor/log/unity.log.")

    def _watch(self) -> None:
        """Watch the engine's process. If it has ended or never connects, make the client stop waiting."""
        deadline: float | None = None  # counted from the engine's start: the client may have to download it first
        while not self._over.wait(ASK_EVERY_S):
            server = getattr(self._controller, "server", None)
            process = getattr(server, "unity_proc", None)
            if server is None or process is None:
                continue
            if process.poll() is None:
                deadline = deadline or time.monotonic() + self._start_s
                if not self._has_started and time.monotonic() > deadline:
                    self._was_late = True
                    process.kill()
                continue
            self._status = process.returncode
            self._feed(server.server_pipe_path)
            return

    def _feed(self, path: str) -> None:
        """Write zeros to the pipe that the client reads, until the connection is closed."""
        number: int | None = None
        while not self._over.wait(ASK_EVERY_S):
            try:
                number = os.open(path, os.O_WRONLY | os.O_NONBLOCK) if number is None else number
                os.write(number, ZEROS)
            except OSError:  # nobody reads yet, nobody reads any more, or the pipe is full
                continue
        if number is not None:
            os.close(number)


def _controller_class() -> Any:
    try:
        from ai2thor.controller import Controller  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - an extra
    except ImportError:
        raise SettingError("AI2-THOR's client is not installed. Give: pip install vigil-bench[thor]") from None
    return Controller
