"""Twins in which a state holds at the start of only one side: functions that `already` and `if_so` share."""

from collections.abc import Iterator

from vigil.authoring.closure.tasks import FLAMES
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import SV_TOGGLES
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.language.wording import Act, opening_phrase
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.authoring.solving.evidence import can_be_partly_open, gap_evidence, object_evidence, random_partial_openness
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectInState
from vigil.protocol.world import Setup
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence


def drafts_of_state(context: HouseContext, act: Act) -> Iterator[tuple[Episode, ObjectInState, Thing]]:
    """Yield drafts of Search and Interact whose act changes a clearly visible state, each with its goal and target."""
    for episode in seeking(context, act):
        goal, target = episode.goal, context.thing(episode.goal.object_id)
        is_plain = act in ("open", "close") or target.category in SV_TOGGLES - FLAMES
        if isinstance(goal, ObjectInState) and is_plain:
            yield episode, goal, target


def phrase_for_state(context: HouseContext, target: Thing, act: Act) -> str:
    """Return the words for the thing whose state is asked about, or for the part that has the state."""
    phrase = str(context.phrase(target.id))
    return opening_phrase(target.category, phrase).whole if act in ("open", "close") else phrase


def setup_with_goal_met(episode: Episode, goal: ObjectInState) -> Setup:
    """Return an episode's setup, changed so that the goal holds from the start."""
    fact = {"openness": float(goal.value)} if goal.state == "is_open" else {"is_toggled": goal.value}
    return changed_setup(episode.setup, goal.object_id, **fact)


def unfinished_setup(
    context: HouseContext, setup: Setup, target: Thing, act: Act
) -> tuple[Setup, tuple[Evidence, ...]]:
    """Return a setup in which the act is still needed, and the evidence that shows this.

    A thing to be closed is only partly open if it can be partly open with a visible gap.
    """
    if act != "close" or not can_be_partly_open(target):
        return setup, (object_evidence(target.id),)
    return changed_setup(setup, target.id, openness=random_partial_openness(target, context.rng)), (
        gap_evidence(target, 0.0),
    )
