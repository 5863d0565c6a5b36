"""Pacing of the frames for an agent's program: the time until the next frame must not reveal what the reply did."""

import math
import time
from collections.abc import Callable


class FramePacer:
    """Releases each frame a whole number of periods after the reply, however long the action took."""

    def __init__(
        self,
        seconds: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        """`seconds` is the period; with 0, frames are released at once."""
        self._seconds = seconds
        self._clock = clock
        self._sleep = sleep
        self._began = clock()

    def begin(self) -> None:
        """Count periods from now. Call this when the program has replied or an episode has begun."""
        self._began = self._clock()

    @property
    def left(self) -> float:
        """Time (s) until a whole number of periods, at least one, has passed since `begin`."""
        return max(0.0, self._end() - self._clock())

    def wait(self) -> None:
        """Wait until a whole number of periods, at least one, has passed since `begin`."""
        end = self._end()
        while (left := end - self._clock()) > 0:
            self._sleep(left)

    def _end(self) -> float:
        if not self._seconds:
            return self._began
        return self._began + max(1, math.ceil((self._clock() - self._began) / self._seconds)) * self._seconds
