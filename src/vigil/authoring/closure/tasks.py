"""Tasks of the closure-stress suite: what a proposal yields, and what all proposals share.

A task is made of a draft of Search and Interact, so that the side which can be done obeys every rule of that family,
but for those that its kind breaks by intent. `vigil.authoring.closure.certify` decides which tasks hold. Source:
decision 30.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext
from vigil.base.geometry import Pose
from vigil.protocol.episode import Episode
from vigil.scoring.closure import Evidence, Kind

LEVEL_DEG = 15.0
"""Camera pitch of a start that sees what is to be acted on."""
NEAR_M = (0.7, 4.0)
"""How far such a start is from it."""
EVIDENCE_PX = 300
"""Pixels in which a thing's state, or that it bars the way, is plain to see."""
FLAMES = frozenset({"Candle"})
"""Nobody says that it is on or off."""


@dataclass(frozen=True, slots=True)
class ClosureTask:
    """One episode, or two twins, the side first that the families' rules bind."""

    kind: Kind
    episodes: tuple[Episode, ...]
    removed: str = ""
    """Id of the object about which twins differ."""
    evidence: tuple[Evidence, ...] = ()
    form: str = ""
    """Which form of its kind it has; empty where there is but one."""


Tasks = Iterator[ClosureTask | Rejection]


def interleave(context: HouseContext, *proposals: Tasks) -> Tasks:
    """Yield one task of each in turn, with what was refused before it, until none has any left.

    Which is the first is drawn for each house, so that no form comes short where few tasks are kept.
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


def object_evidence(thing_id: str) -> Evidence:
    """Return the evidence that a thing gives by itself to who sees it plainly."""
    return Evidence(object_id=thing_id, least_px=EVIDENCE_PX)


def is_out_of_view_from(context: HouseContext, pose: Pose, thing_id: str) -> bool:
    """Whether nothing of a thing is in view from a pose."""
    return context.seen_from(pose, thing_id).visible_px == 0


def rejection(context: HouseContext, kind: Kind, rule: str, message: str) -> Rejection:
    """Return the line that says why something was not proposed."""
    return Rejection(family="SI", kind=kind, house=context.house.name, rule=rule, message=message)
