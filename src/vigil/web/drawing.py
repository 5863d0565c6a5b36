"""Drawing on demand: a simulator worker draws pictures for the pages; recent pictures are cached.

The cache key of a picture is the moment that it shows: house, start, setup and actions so far.
"""

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from cachetools import LRUCache

from vigil.base.processes.worker import Worker
from vigil.errors import SimulatorError
from vigil.protocol.actions import PhysicalAction
from vigil.runner.workers.drawing import MomentRenderer
from vigil.runner.workers.messages import EpisodeMoment, WalkResult
from vigil.runner.workers.pool import simulator_settings, usable_cpus

DRAW_TIMEOUT_S = 90.0
"""Time limit (s) for drawing one picture, and for the wait of a request until earlier pictures are drawn."""
PICTURE_CACHE_SIZE = 400
_Result = TypeVar("_Result")


class RenderService:
    """Service that draws pictures for the pages, one at a time; safe to call from any thread.

    A call blocks until the picture is drawn, so call it from a thread, not from the event loop.
    """

    def __init__(self, timeout_s: float = DRAW_TIMEOUT_S) -> None:
        self._timeout_s = timeout_s
        self._worker = Worker(MomentRenderer, "Simulator drawing-worker", simulator_settings(timeout_s, usable_cpus()))
        self._lock = threading.Lock()
        self._kept: LRUCache[str, bytes] = LRUCache(PICTURE_CACHE_SIZE)

    def picture(self, moment: EpisodeMoment) -> bytes:
        """Return the frame (PNG) of a moment. Raises SimulatorError or InputError."""
        name = moment.name
        with self._lock:
            if name in self._kept:
                return self._kept[name]
        data = self._ask(MomentRenderer.draw, moment)
        with self._lock:
            self._kept[name] = data
        return data

    def walk(self, moment: EpisodeMoment, action: PhysicalAction | None) -> WalkResult:
        """Return the result of `action` at a moment (pose, effect, frame). Raises SimulatorError or InputError."""
        return self._ask(MomentRenderer.walk, moment, action)

    def name_at(self, moment: EpisodeMoment, x: int, y: int) -> str | None:
        """Return the id of the object at a pixel; None for structure and sky. Raises SimulatorError or InputError."""
        return self._ask(MomentRenderer.name_at, moment, x, y)

    def close(self) -> None:
        """Kill the worker process, even while it draws a picture."""
        self._worker.kill()
        self._worker.join()

    def _ask(self, function: Callable[..., _Result], *arguments: Any) -> _Result:
        future = self._worker.submit(function, *arguments)
        try:
            return future.result(self._timeout_s)
        except TimeoutError:
            if future.cancel():
                raise SimulatorError("The drawing process is busy with other pictures; try again.") from None
            return future.result()  # the picture is being drawn; the watchdog limits how long that takes
