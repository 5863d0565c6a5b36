"""Counts of a thing's points that are visible from a place. No more points are tested than a question needs."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from vigil.base.geometry import Vec3

BATCHES = 4
"""Number of batches in which points are tested. Each batch is spread over the whole thing."""
SEEN_POINTS = 6
"""A place sees enough of a thing if at least this number of the thing's points is visible from the place."""


class PointCount:
    """The number of visible points of a thing. Until all points are tested, only a range is known."""

    def __init__(self, points: np.ndarray, sees: Callable[[np.ndarray], np.ndarray]) -> None:
        """Count points (n, 3). `sees` returns which of some points are visible; it gets each point at most once."""
        self._portions = [points[first::BATCHES] for first in range(min(BATCHES, len(points)))]
        self._sees = sees
        self._left = len(points)
        self.seen = 0
        """Number of visible points among the points tested so far."""

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
    """Yield the places from which at least `SEEN_POINTS` points are visible, and at least `share` of the number that is
    visible from the best place.
    """
    counts = [count_at(place) for place in places]
    best = 0
    for count in counts:
        while count.is_at_least(best + 1):
            best = count.seen
    enough = max(SEEN_POINTS, share * best)
    yield from (place for place, count in zip(places, counts, strict=True) if count.is_at_least(enough))
