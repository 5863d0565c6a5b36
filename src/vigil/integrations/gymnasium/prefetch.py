"""Prefetching: while an episode is played, the next episode is chosen and its house is built.

A vector steps its environments together. If an environment built a house during a step, all others would wait. The
choice of episodes depends only on the seed, not on the speed of the thread.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait

import numpy as np

from vigil.integrations.sources import EpisodeSource, SampledEpisode
from vigil.protocol.house import House


class Prefetcher:
    """A thread that takes the next episode from a source while the current episode is played."""

    def __init__(self, source: EpisodeSource, prepare: Callable[[House], None]) -> None:
        """Take episodes from `source`. Another thread calls `prepare` with each house, so that the house loads faster
        later."""
        self._source, self._prepare = source, prepare
        self._thread = ThreadPoolExecutor(1, "next-episode")
        self._next: Future[SampledEpisode] | None = None

    def next_episode(self, rng: np.random.Generator, *, is_seeded: bool) -> SampledEpisode:
        """Return the next episode, and start preparing the episode after it.

        `is_seeded` says whether `rng` was just seeded. If an error occurred while the episode that is now due was
        prepared, raises this error.
        """
        pending, self._next = self._next or self._start_next(rng, is_seeded=is_seeded), None
        found = pending.result()
        self._next = self._start_next(rng, is_seeded=False)
        return found

    def discard(self) -> None:
        """Wait until the next episode is prepared, and discard it."""
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
