"""Tasks of the closure-stress suite: what a proposal yields, and what all proposals share.

A task is made from a draft of Search and Interact, so that the possible side obeys every rule of that family, except
those that its kind breaks on purpose. `vigil.authoring.closure.certify` decides which tasks hold. Source: decision 30.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.house_context import HouseContext
from vigil.base.geometry import Pose
from vigil.protocol.episode import Episode
from vigil.scoring.closure import Evidence, Kind

LEVEL_DEG = 15.0
"""Camera pitch of a start that sees the thing to act on."""
NEAR_M = (0.7, 4.0)
"""Distance of such a start from the thing."""
EVIDENCE_PX = 300
"""Pixels that make a thing's state, or the fact that it bars the way, clearly visible."""
FLAMES = frozenset({"Candle"})
"""Things that are not described as on or off."""


@dataclass(frozen=True, slots=True)
class ClosureTask:
    """One episode, or two twins; the side to which the families' rules apply comes first."""

    kind: Kind
    episodes: tuple[Episode, ...]
    removed: str = ""
    """Id of the object in which the twins differ."""
    evidence: tuple[Evidence, ...] = ()
    form: str = ""
    """Form of the task within its kind; empty where there is only one."""


Tasks = Iterator[ClosureTask | Rejection]


def interleave(context: HouseContext, *proposals: Tasks) -> Tasks:
    """Yield one task of each source in turn, with the rejections before it, until all are exhausted.

    The first source is drawn for each house, so that each form gets its share where few tasks are kept.
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
    """Return the evidence that a thing gives when it is clearly seen."""
    return Evidence(object_id=thing_id, min_px=EVIDENCE_PX)


def is_out_of_view_from(context: HouseContext, pose: Pose, thing_id: str) -> bool:
    """Return whether a thing is fully out of view from a pose."""
    return context.seen_from(pose, thing_id).visible_px == 0


def rejection(context: HouseContext, kind: Kind, rule: str, message: str) -> Rejection:
    """Return the line that says why something was not proposed."""
    return Rejection(family="SI", kind=kind, house=context.house.name, rule=rule, message=message)
