"""The next episode, drawn and its house built while the present one is played.

A vector steps its environments together, so one that builds a house would have all others wait for it. Which episodes
are drawn depends on the seed alone, not on how far the thread is.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait

import numpy as np

from vigil.integrations.gymnasium.sources import EpisodeSource, SampledEpisode
from vigil.protocol.house import House


class Prefetcher:
    """Draws from a source, one episode ahead."""

    def __init__(self, source: EpisodeSource, prepare: Callable[[House], None]) -> None:
        """`prepare` makes a house quick to load; it is called in another thread."""
        self._source, self._prepare = source, prepare
        self._thread = ThreadPoolExecutor(1, "next-episode")
        self._next: Future[SampledEpisode] | None = None

    def next_episode(self, rng: np.random.Generator, *, is_seeded: bool) -> SampledEpisode:
        """Return the next episode, and begin with the one after it; `rng` has just been seeded, or goes on.

        Raises what drawing or preparing raised.
        """
        pending, self._next = self._next or self._start_next(rng, is_seeded=is_seeded), None
        found = pending.result()
        self._next = self._start_next(rng, is_seeded=False)
        return found

    def discard(self) -> None:
        """Forget the next episode; what is being done for it is waited for."""
        if self._next is not None and not self._next.cancel():
            wait([self._next])
        self._next = None

    def close(self) -> None:
        """End the thread."""
        self.discard()
        self._thread.shutdown()

    def _start_next(self, rng: np.random.Generator, *, is_seeded: bool) -> Future[SampledEpisode]:
        return self._thread.submit(self._prepared, self._source.draw(rng, is_seeded=is_seeded))

    def _prepared(self, wanted: Callable[[], SampledEpisode]) -> SampledEpisode:
        sampled = wanted()
        self._prepare(sampled.house)
        return sampled
