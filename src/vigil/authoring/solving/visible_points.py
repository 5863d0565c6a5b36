"""Counts of a thing's points that are visible from a place, tested only as far as a question needs."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from vigil.base.geometry import Vec3

BATCHES = 4
"""Number of batches in which points are tested, each of them spread over the whole thing."""
SEEN_POINTS = 6
"""Least number of a thing's points that are visible from a place that sees enough of it."""


class PointCount:
    """The number of visible points of a thing, known between two bounds."""

    def __init__(self, points: np.ndarray, sees: Callable[[np.ndarray], np.ndarray]) -> None:
        """Count points (n, 3); `sees` returns which of some points are visible, and gets each at most once."""
        self._portions = [points[first::BATCHES] for first in range(min(BATCHES, len(points)))]
        self._sees = sees
        self._left = len(points)
        self.seen = 0
        """Number of visible points among those tested so far."""

    def is_at_least(self, least: float) -> bool:
        """Return whether at least `least` points are visible."""
        while self.seen < least <= self.seen + self._left:
            portion = self._portions.pop()
            self.seen += int(self._sees(portion).sum())
            self._left -= len(portion)
        return self.seen >= least


def places_seeing_enough(
    places: Sequence[Vec3], count_at: Callable[[Vec3], PointCount], share: float
) -> Iterator[Vec3]:
    """Yield the places that see at least `SEEN_POINTS` points and a share of the number that the best place sees."""
    counts = [count_at(place) for place in places]
    best = 0
    for count in counts:
        while count.is_at_least(best + 1):
            best = count.seen
    enough = max(SEEN_POINTS, share * best)
    yield from (place for place, count in zip(places, counts, strict=True) if count.is_at_least(enough))
