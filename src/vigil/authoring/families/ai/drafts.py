"""Drafts of Approach and Interact (AI)."""

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.look_alike_targets import drafts_among_look_alikes
from vigil.authoring.drafting.proposals import Ask, Drafts, allows, drafts_about, finder_of_starts_in_view, is_target
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.wording import Act


def acting(context: HouseContext, act: Act) -> Drafts:
    """Yield drafts of an act: the target is in view but out of reach."""
    ask = Ask("AI", ORDERS, finder_of_starts_in_view(context, "AI"), act=act)
    yield from drafts_about(context, ask, context.things(lambda thing: is_target(thing) and allows(thing, act)))


def acting_among_look_alikes(context: HouseContext) -> Drafts:
    """Yield drafts of a random act on one of several look-alikes."""
    yield from drafts_among_look_alikes(context, Ask("AI", ORDERS, finder_of_starts_in_view(context, "AI")))
