"""Drafts of View Search (VS), and its sentence forms (see `vigil.authoring.language.sentences`)."""

from pathlib import Path

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.look_alike_targets import start_out_of_view
from vigil.authoring.drafting.proposals import LEVEL_DEG, Ask, Drafts, PoseTest, can_be_searched_for, drafts_about
from vigil.authoring.language.sentences import read_sentences
from vigil.base.geometry import Pose
from vigil.protocol.goals import ObjectInState
from vigil.scene.things import Thing

MIN_SEARCHED_SIZE_M = 0.1
"""Minimum length (m) of the longest side of an object that may be the target of a search."""
SEARCH = read_sentences(Path(__file__).with_name("sentences.toml"))["search"]


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
