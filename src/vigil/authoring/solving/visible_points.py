"""How many points of a thing are seen from a place, looked for no further than an answer needs."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from vigil.base.geometry import Vec3

BATCHES = 4
"""Points are looked for in so many goes, each of them spread over the whole thing."""
SEEN_POINTS = 6
"""At least so many points of a thing are seen from a place that sees enough of it."""


class PointCount:
    """How many of some points are seen, known between two bounds."""

    def __init__(self, points: np.ndarray, sees: Callable[[np.ndarray], np.ndarray]) -> None:
        """`sees` tells which of some of the points (n, 3) are seen; it is asked about each of them once at most."""
        self._portions = [points[first::BATCHES] for first in range(min(BATCHES, len(points)))]
        self._sees = sees
        self._left = len(points)
        self.seen = 0
        """Of the points looked for so far."""

    def is_at_least(self, least: float) -> bool:
        """Whether so many points are seen."""
        while self.seen < least <= self.seen + self._left:
            portion = self._portions.pop()
            self.seen += int(self._sees(portion).sum())
            self._left -= len(portion)
        return self.seen >= least


def places_seeing_enough(
    places: Sequence[Vec3], count_at: Callable[[Vec3], PointCount], share: float
) -> Iterator[Vec3]:
    """Yield the places that see `SEEN_POINTS` of a thing, and a share of what the best of them sees."""
    counts = [count_at(place) for place in places]
    best = 0
    for count in counts:
        while count.is_at_least(best + 1):
            best = count.seen
    enough = max(SEEN_POINTS, share * best)
    yield from (place for place, count in zip(places, counts, strict=True) if count.is_at_least(enough))
