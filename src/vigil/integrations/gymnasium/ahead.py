"""The next episode, drawn and its house built while the present one is played.

A vector steps its environments together, so one that builds a house would have all others wait for it. Which episodes
are drawn depends on the seed alone, not on how far the thread is.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait

import numpy as np

from vigil.integrations.gymnasium.sources import Drawn, Source
from vigil.protocol.house import House


class Ahead:
    """Draws from a source, one episode ahead."""

    def __init__(self, source: Source, prepare: Callable[[House], None]) -> None:
        """`prepare` makes a house quick to load; it is called in another thread."""
        self._source, self._prepare = source, prepare
        self._thread = ThreadPoolExecutor(1, "next-episode")
        self._next: Future[Drawn] | None = None

    def drawn(self, rng: np.random.Generator, *, is_seeded: bool) -> Drawn:
        """Returns the next episode, and begins with the one after it; `rng` has just been seeded, or goes on.

        Raises what drawing or preparing raised.
        """
        begun, self._next = self._next or self._begun(rng, is_seeded=is_seeded), None
        found = begun.result()
        self._next = self._begun(rng, is_seeded=False)
        return found

    def forget(self) -> None:
        """Forgets the next episode; what is being done for it is waited for."""
        if self._next is not None and not self._next.cancel():
            wait([self._next])
        self._next = None

    def close(self) -> None:
        """Ends the thread."""
        self.forget()
        self._thread.shutdown()

    def _begun(self, rng: np.random.Generator, *, is_seeded: bool) -> Future[Drawn]:
        return self._thread.submit(self._ready, self._source.draw(rng, is_seeded=is_seeded))

    def _ready(self, wanted: Callable[[], Drawn]) -> Drawn:
        drawn = wanted()
        self._prepare(drawn.house)
        return drawn
