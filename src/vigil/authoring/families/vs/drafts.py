"""Drafts of View Search (VS), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.look_alike_targets import start_out_of_view
from vigil.authoring.drafting.proposals import LEVEL_DEG, Ask, Drafts, PoseTest, can_be_searched_for, drafts_about
from vigil.authoring.language.sentences import Sentences
from vigil.base.geometry import Pose
from vigil.protocol.goals import ObjectInState
from vigil.scene.things import Thing

MIN_SEARCHED_SIZE_M = 0.1
"""Minimum length (m) of the longest side of an object that may be the target of a search."""
SEARCH = Sentences(
    public=(
        "Find {target}. You are done once {it_is} in the picture.",
        "Look around for {target} until you can see {it} in the picture.",
        "Search for {target} and bring {it} into the picture.",
        "Where is {target}? Look for {it} until {it_is} in view.",
        "I cannot find {target}. Have a look around until you see {it}.",
        "Please locate {target}; you are done when {it_is} in the picture.",
        "Turn and walk until {target} is in the picture.",
        "{Target} is out of sight from here. Look for {it} until you see {it}.",
        "Your task is to get {target} into view.",
        "I would like to see {target}: keep looking until {it_is} in the picture.",
        "Could you look for {target}? Stop as soon as {it_is} in view.",
        "Explore until you come upon {target} and have {it} in the picture.",
        "I need to see {target}. Find {it}.",
        "Look for {target}, so that {it_is} in your view at the end.",
        "Go wherever you must, and stop when you see {target}.",
    ),
    held_out=(
        "Go looking for {target}; stop when you see {it}.",
        "Search the home until {target} is in the picture.",
        "Let me see {target}: find {it} and get {it} into the picture.",
        "Have you seen {target}? Look for {it}, and stop once you have {it} in view.",
        "{Target} has to be found. That is done when {it_is} in the picture.",
        "Somebody has lost sight of {target}. Find {it}, so that {it_is} in the picture again.",
        "Look around, in other places if need be, until you see {target}.",
        "Bring {target} into view; nothing needs to be touched.",
        "I wonder where {target} is. Walk about until {it_is} in your picture.",
        "Would you find {target} for me? To see {it} is enough.",
        "Make your way around until {target} comes into view.",
        "All that you have to do is find {target} and have {it} in the picture.",
        "What I want to see in the picture is {target}. Look for {it}.",
        "Go wherever you have to for a look at {target}; stop once {it_is} in the picture.",
        "Check where {target} is: look around until you see {it}.",
    ),
)


def searching(context: HouseContext, *, by_turning: bool) -> Drafts:
    """Yield drafts. `by_turning` says whether turning at the start must (True) or must not (False) show the target."""
    things = context.things(lambda thing: _is_searchable(thing) and can_be_searched_for(context, thing))
    yield from drafts_about(context, asking(context, by_turning=by_turning), things)


def asking(context: HouseContext, *, by_turning: bool = False) -> Ask:
    """Return how this family asks for a target: the sentences, the start and the goal."""

    def find_start(thing: Thing, also: PoseTest) -> Pose | None:
        if not _is_searchable(thing):
            return None
        return start_out_of_view(context, thing, also, by_turning=by_turning, horizon=LEVEL_DEG)

    return Ask(
        "VS",
        SEARCH,
        find_start,
        lambda thing: ObjectInState(object_id=thing.id, state="is_visible"),
        template="turn" if by_turning else "walk",
    )


def _is_searchable(thing: Thing) -> bool:
    """Return whether a thing may be searched for: it is neither too small nor a drawer, which is part of furniture."""
    return max(thing.asset.size) > MIN_SEARCHED_SIZE_M and not thing.is_drawer
