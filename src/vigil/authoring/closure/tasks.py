"""Tasks of the closure-stress suite, and functions that all proposals of tasks share.

Most tasks are made from drafts of the family SI (Search and Interact). So the first side satisfies the rules of this
family, except those that the task's kind breaks on purpose. `vigil.authoring.closure.certify` decides which tasks are
valid. Source: decision 30.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext
from vigil.protocol.episode import Episode
from vigil.scoring.closure import CLOSURE_KINDS, Evidence, Kind

LEVEL_DEG = 15.0
"""Camera pitch (deg) of a start from which a thing is visible."""
NEAR_M = (0.7, 4.0)
"""Minimum and maximum distance (m) from a thing to a start from which it is visible."""
BY_NAME = "named"
"""Form of a task about several things with the same name. In the other forms, a state identifies the things."""
FLAMES = frozenset({"Candle"})
"""Categories whose state people do not call "on" or "off"."""


@dataclass(frozen=True, slots=True)
class ClosureTask:
    """A task of the suite: one episode, or two twins. The first of the twins satisfies the families' rules."""

    kind: Kind
    episodes: tuple[Episode, ...]
    removed: str = ""
    """Id of the object in which the twins differ; empty if the task has no twins."""
    evidence: tuple[Evidence, ...] = ()
    """Evidence that shows which of the twins an episode is."""
    form: str = ""
    """Form of the task within its kind; empty if the kind has only one form."""

    @property
    def meant(self) -> frozenset[str]:
        """Ids of the things that the instruction means. Reading the instruction back must give the same ids."""
        bindings, unnamed = self.episodes[0].bindings, CLOSURE_KINDS[self.kind].unnamed_roles
        return frozenset(object_id for role, object_id in bindings.items() if role not in unnamed)

    @property
    def instruction(self) -> str:
        """The instruction, which twins share."""
        return self.episodes[0].instruction


Tasks = Iterator[ClosureTask | Rejection]


def interleave(context: HouseContext, *proposals: Tasks) -> Tasks:
    """Yield one task of each source in turn until all are exhausted. A source's rejections come before its next task.

    The order of the sources is random, so that each source gets its share although only the first tasks are used.
    """
    left = [proposals[index] for index in context.rng.permutation(len(proposals))]
    while left:
        for each in list(left):
            is_over = True
            for found in each:
                yield found
                if isinstance(found, ClosureTask):
                    is_over = False
                    break
            if is_over:
                left.remove(each)
