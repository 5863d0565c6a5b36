"""Drafts of Approach and Interact (AI)."""

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import Ask, Drafts, allows, drafts_about, finder_of_starts_in_view, is_target
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.wording import Act


def acting(context: HouseContext, act: Act) -> Drafts:
    """Yield drafts that ask for an act on a target that is in view but out of reach."""
    things = context.things(lambda thing: is_target(thing) and allows(thing, act))
    yield from drafts_about(context, asking(context, act), things)


def asking(context: HouseContext, act: Act | None = None) -> Ask:
    """Return how this family asks for a target: the sentences and the start; the goal follows from the act."""
    return Ask("AI", ORDERS, finder_of_starts_in_view(context, "AI"), act=act)
