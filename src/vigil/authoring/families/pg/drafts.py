"""Drafts of Pixel Grounding (PG), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import (
    Ask,
    Drafts,
    drafts_about,
    finder_of_starts_in_view,
    is_target,
    shows_px,
    size_of_thing,
)
from vigil.authoring.language.sentences import Sentences
from vigil.authoring.review.rules import SMALL_START_PX
from vigil.protocol.family import TargetSize
from vigil.protocol.goals import TargetGrounded

CLEAR_PX_BY_SIZE: dict[TargetSize, int] = {"large": 4000, "medium": 800, "small": 180}
HARD_PX_BY_SIZE: dict[TargetSize, int] = {"large": 1000, "medium": 200, "small": SMALL_START_PX}
"""Minimum visible pixels of a target by size class: CLEAR_PX_BY_SIZE for starts that show it clearly to a person,
HARD_PX_BY_SIZE for hard starts (for small targets, the minimum of the rules)."""
POINT = Sentences(
    public=(
        "Point at {target}.",
        "Where is {target}? Point at {it}.",
        "Show me {target} by pointing at {it} in the picture.",
        "I am looking for {target}. Point {it} out to me.",
        "Please point to {target}.",
        "Which of the things that you see is {target}? Point at {it}.",
        "In the picture, mark {target}.",
        "I need to know where {target} is: point at {it}.",
        "Put your pointer on {target}, so that I can see what you take for {it}.",
        "Your task is to point at {target}.",
        "{Target} is in the picture. Point at {it}.",
        "Someone has asked for {target}. Point at {it}, please.",
        "Could you point at {target}?",
        "Show where {target} is by pointing at {it}.",
        "{Target} should be marked in the picture. Please do that.",
    ),
    held_out=(
        "Put your pointer on {target}.",
        "Can you see {target}? Point at {it}.",
        "Indicate where {target} is.",
        "Would you point {target} out to me?",
        "Look at the picture and point at {target}.",
        "I want you to point at {target}.",
        "In the picture, find {target} and put your pointer on {it}.",
        "{Target} is to be pointed at, and nothing else.",
        "So that I know where {target} is, point at {it}.",
        "There is something I need you to point at: {target}.",
        "Select {target} by pointing at {it}.",
        "If I asked you for {target}, where would you point? Show me.",
        "{Target} is what I am after. Please point at {it}.",
        "Single out {target} by pointing at {it}.",
        "Help me to find {target}: point at {it} in the picture.",
    ),
)


def pointing(context: HouseContext, size: TargetSize) -> Drafts:
    """Yield drafts whose target has this size class."""
    things = context.things(lambda thing: is_target(thing) and size_of_thing(thing) == size)
    yield from drafts_about(context, asking(context), things)


def asking(context: HouseContext) -> Ask:
    """Return how this family asks for a target: the sentences, the start and the goal."""
    least_px = HARD_PX_BY_SIZE if context.prefers_hard_starts else CLEAR_PX_BY_SIZE
    find_start = finder_of_starts_in_view(context, "PG", lambda thing: shows_px(least_px[size_of_thing(thing)]))
    return Ask("PG", POINT, find_start, lambda thing: TargetGrounded(object_id=thing.id))
