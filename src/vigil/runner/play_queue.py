"""Queue of the remaining assignments that avoids giving a worker both twins of a pair in succession."""

from collections import deque
from collections.abc import Iterable, Mapping

from vigil.runner.workers.messages import Assignment


class PlayQueue:
    """Queue of assignments. They are taken in order, but assignments that a worker should not play next are skipped."""

    def __init__(self, assignments: Iterable[Assignment], pairs: Mapping[str, str]) -> None:
        """`pairs` maps the id of each episode that has a twin to the name of the pair."""
        self._waiting = deque(assignments)
        self._pairs = pairs

    def take(self, last: Assignment | None) -> Assignment | None:
        """Return the next assignment for a worker that has just played `last`; None when nothing is left.

        The twin of `last`, and the same episode in another epoch, are only taken if nothing else is left.
        """
        if not self._waiting:
            return None
        pair = None if last is None else self._pair_of(last)
        at = next((at for at, each in enumerate(self._waiting) if self._pair_of(each) != pair), 0)
        found = self._waiting[at]
        del self._waiting[at]
        return found

    def _pair_of(self, assignment: Assignment) -> str:
        return self._pairs.get(assignment.episode.id, assignment.episode.id)
