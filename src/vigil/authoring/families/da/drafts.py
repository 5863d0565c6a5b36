"""Drafts of Distance Approach (DA), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Ask, Drafts, PoseTest, drafts_about, finder_of_starts_in_view, is_target
from vigil.authoring.language.sentences import Sentences
from vigil.authoring.review.rules import place_blind_to
from vigil.base.geometry import Pose
from vigil.protocol.goals import NEAR_M, AgentNearTarget
from vigil.scene.things import Thing

APPROACHED_M = (0.15, 1.9)
"""Minimum and maximum length (m) of a target's longest side. Smaller things are hard to see, larger things are always
near."""
APPROACH = Sentences(
    public=(
        "Walk up to {target}: come to within about one and a half metres of {it}, near enough to touch {it}, and stop "
        "there.",
        "Go and stand within about one and a half metres of {target}, so that you could reach out and touch {it}.",
        "Approach {target} until you are within about one and a half metres of {it}, so near that you could touch "
        "{it}.",
        "Move to within about one and a half metres of {target}, which is near enough to touch {it}.",
        "Get closer to {target}. Stop once you are within about one and a half metres of {it} and could touch {it}.",
        "Please go over to {target} and halt where you could touch {it}, within about one and a half metres of {it}.",
        "I want you to be within about one and a half metres of {target}, close enough to touch {it}.",
        "Go to {target}. You are there when you are within about one and a half metres of {it} and could touch {it}.",
        "{Target} should be within your reach: walk to within about one and a half metres of {it}.",
        "Your task is to stand within about one and a half metres of {target}, where you could touch {it}.",
        "Could you walk over to {target}? Stop within about one and a half metres of {it}, where your hand could reach "
        "{it}.",
        "I need you to be within reach of {target}: anywhere within about one and a half metres of {it} will do.",
        "Go to {target}, but leave {it} alone: just stand within about one and a half metres of {it}, within reach.",
        "Leave your place and come within about one and a half metres of {target}, so near that you could touch {it}.",
        "From where you stand {target} is out of reach. Go nearer, to within about one and a half metres of {it}.",
    ),
    held_out=(
        "Come to within about one and a half metres of {target}, near enough to touch {it}, then stop.",
        "Stand so near {target} that you could touch {it}, no farther than about one and a half metres from {it}.",
        "Walk until you are no farther than about one and a half metres from {target} and could touch {it}.",
        "Bring yourself within reach of {target}, no farther than about one and a half metres from {it}.",
        "I would like you to go as near to {target} as it takes to touch {it}, within about one and a half metres of "
        "{it}.",
        "Please get within reach of {target}: no farther than about one and a half metres from {it}.",
        "Go up to {target} so that you could touch {it} if you wanted to; within about one and a half metres of {it} "
        "is near enough.",
        "Head for {target} and stop within about one and a half metres of {it}, where you could touch {it}.",
        "{Target} is where I want you to go. Stop no farther than about one and a half metres from {it}, within reach.",
        "Someone is waiting at {target}. Go there, to within about one and a half metres of {it}, so that you could "
        "touch {it}.",
        "Keep going until you are within about one and a half metres of {target}, near enough to touch {it}.",
        "Would you go to {target} and stay there, no farther than about one and a half metres from {it}, within reach?",
        "You are too far from {target} to touch {it}. Change that: come within about one and a half metres of {it}.",
        "Reduce the distance to {target} until you could touch {it}, to within about one and a half metres of {it}.",
        "A place within about one and a half metres of {target}, from which you could touch {it}, is where I want you.",
    ),
)


def approaching(context: HouseContext) -> Drafts:
    """Yield drafts about things of a suitable size."""
    yield from drafts_about(context, asking(context), context.things(_is_approachable))


def asking(context: HouseContext) -> Ask:
    """Return how this family asks for a target: the sentences, the start and the goal."""
    start_in_view = finder_of_starts_in_view(context, "DA")

    def find_start(thing: Thing, also: PoseTest) -> Pose | None:
        if not _is_approachable(thing) or place_blind_to(context.view, thing, NEAR_M) is not None:
            return None
        return start_in_view(thing, also)

    return Ask("DA", APPROACH, find_start, lambda thing: AgentNearTarget(object_id=thing.id, threshold_m=NEAR_M))


def _is_approachable(thing: Thing) -> bool:
    """Return whether a thing may be a target: it has a suitable size, and it is not a drawer."""
    low, high = APPROACHED_M
    return is_target(thing) and low < max(thing.asset.size) < high and not thing.is_drawer
