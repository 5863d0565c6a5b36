"""Pacing of a program's frames, so that the time until the next frame does not show what the reply did."""

import math
import time
from collections.abc import Callable


class FramePacer:
    """Pacer that releases each frame a whole number of periods after the reply, whatever was done in between."""

    def __init__(
        self,
        seconds: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        """`seconds` is the period; with 0 frames do not wait."""
        self._seconds = seconds
        self._clock = clock
        self._sleep = sleep
        self._began = clock()

    def begin(self) -> None:
        """Count periods from now: the program has replied, or an episode has begun."""
        self._began = self._clock()

    def wait(self) -> None:
        """Wait for the end of the current period, but at least of the first."""
        if not self._seconds:
            return
        beats = max(1, math.ceil((self._clock() - self._began) / self._seconds))
        end = self._began + beats * self._seconds
        while (left := end - self._clock()) > 0:
            self._sleep(left)
