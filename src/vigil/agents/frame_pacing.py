"""Beat: when a program's next frame is handed over, so that the time until then does not tell what its reply did."""

import math
import time
from collections.abc import Callable


class FramePacer:
    """Lets frames go at whole numbers of a period after the reply, whatever was done in between."""

    def __init__(
        self,
        seconds: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        """`seconds` is the period; with 0 nothing waits."""
        self._seconds = seconds
        self._clock = clock
        self._sleep = sleep
        self._began = clock()

    def begin(self) -> None:
        """Count from now: the program has replied, or was told that an episode begins."""
        self._began = self._clock()

    def wait(self) -> None:
        """Wait for the end of the period at hand, of the first at least."""
        if not self._seconds:
            return
        beats = max(1, math.ceil((self._clock() - self._began) / self._seconds))
        end = self._began + beats * self._seconds
        while (left := end - self._clock()) > 0:
            self._sleep(left)
