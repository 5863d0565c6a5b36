"""Queue of the assignments that remain; no worker plays both twins of a pair in a row."""

from collections import deque
from collections.abc import Iterable, Mapping

from vigil.runner.workers.messages import Assignment


class PlayQueue:
    """Queue of assignments in order, except that it skips what a worker must not play next."""

    def __init__(self, assignments: Iterable[Assignment], pairs: Mapping[str, str]) -> None:
        """`pairs` maps each episode that has a twin to its pair."""
        self._waiting = deque(assignments)
        self._pairs = pairs

    def take(self, last: Assignment | None) -> Assignment | None:
        """Return the next assignment for a worker that has played `last`; None when nothing is left.

        The twin of `last`, and the same episode in another epoch, come later unless nothing else is left.
        """
        if not self._waiting:
            return None
        at = next((at for at, each in enumerate(self._waiting) if not self._is_same_pair(each, last)), 0)
        found = self._waiting[at]
        del self._waiting[at]
        return found

    def _is_same_pair(self, one: Assignment, last: Assignment | None) -> bool:
        return last is not None and self._pair_of(one) == self._pair_of(last)

    def _pair_of(self, assignment: Assignment) -> str:
        return self._pairs.get(assignment.episode.id, assignment.episode.id)
