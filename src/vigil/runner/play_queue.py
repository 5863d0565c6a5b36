"""Play queue: the assignments that are still to be played, so that no worker plays a twin right after the other."""

from collections import deque
from collections.abc import Iterable, Mapping

from vigil.runner.workers.messages import Assignment


class PlayQueue:
    """Assignments in their order, but for what a worker must not play next."""

    def __init__(self, assignments: Iterable[Assignment], pairs: Mapping[str, str]) -> None:
        """`pairs` names the pair of each episode that has a twin."""
        self._waiting = deque(assignments)
        self._pairs = pairs

    def take(self, last: Assignment | None) -> Assignment | None:
        """Return what comes next for a worker that has played `last`; None when nothing is left.

        Its twin, and the same episode in another epoch, come later, unless nothing else is left.
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
