"""Drafts of Pixel Grounding (PG), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from pathlib import Path

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
from vigil.authoring.language.sentences import read_sentences
from vigil.authoring.review.rules import SMALL_START_PX
from vigil.protocol.family import TargetSize
from vigil.protocol.goals import TargetGrounded

CLEAR_PX_BY_SIZE: dict[TargetSize, int] = {"large": 4000, "medium": 800, "small": 180}
HARD_PX_BY_SIZE: dict[TargetSize, int] = {"large": 1000, "medium": 200, "small": SMALL_START_PX}
"""Minimum visible pixels of a target by size class: CLEAR_PX_BY_SIZE for starts that show it clearly to a person,
HARD_PX_BY_SIZE for hard starts (for small targets, the minimum of the rules)."""
POINT = read_sentences(Path(__file__).with_name("sentences.toml"))["point"]


def pointing(context: HouseContext, size: TargetSize) -> Drafts:
    """Yield drafts whose target has this size class."""
    things = context.things(lambda thing: is_target(thing) and size_of_thing(thing) == size)
    yield from drafts_about(context, asking(context), things)


def asking(context: HouseContext) -> Ask:
    """Return how this family asks for a target: the sentences, the start and the goal."""
    least_px = HARD_PX_BY_SIZE if context.prefers_hard_starts else CLEAR_PX_BY_SIZE
    find_start = finder_of_starts_in_view(context, "PG", lambda thing: shows_px(least_px[size_of_thing(thing)]))
    return Ask("PG", POINT, find_start, lambda thing: TargetGrounded(object_id=thing.id))
