"""Drafts of Distance Approach (DA), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from pathlib import Path

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Ask, Drafts, PoseTest, drafts_about, finder_of_starts_in_view, is_target
from vigil.authoring.language.sentences import read_sentences
from vigil.authoring.review.rules import place_blind_to
from vigil.base.geometry import Pose
from vigil.protocol.goals import NEAR_M, AgentNearTarget
from vigil.scene.things import Thing

APPROACHED_M = (0.15, 1.9)
"""Minimum and maximum length (m) of a target's longest side. Smaller things are hard to see, larger things are always
near."""
APPROACH = read_sentences(Path(__file__).with_name("sentences.toml"))["approach"]


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
