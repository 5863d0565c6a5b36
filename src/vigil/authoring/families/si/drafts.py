"""Drafts of Search and Interact (SI)."""

from vigil.authoring.drafting.filling import filled
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.look_alike_targets import start_out_of_view
from vigil.authoring.drafting.proposals import Ask, Drafts, allows, can_be_searched_for, drafts_about, start_not_seeing
from vigil.authoring.language.disambiguation import first_meaning
from vigil.authoring.language.referring import Phrase
from vigil.authoring.language.sentences import SEARCH_ORDERS
from vigil.authoring.language.wording import Act
from vigil.authoring.review.containers import MAX_CLOSED, may_hold, visible_through_glass_from
from vigil.authoring.review.rules import INSIDE_TEMPLATE
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import ObjectHeld
from vigil.protocol.world import Setup
from vigil.scene.things import Thing

HORIZON_DEG = DEFAULT_HORIZON_DEG / 2
"""Camera pitch (deg) at the start."""


def seeking(context: HouseContext, act: Act, *, by_turning: bool | None = None) -> Drafts:
    """Yield drafts that ask for an act on a target that is out of view.

    `by_turning` says whether the target must (True) or must not (False) become visible by turning; None: either.
    """
    things = context.things(lambda thing: allows(thing, act) and can_be_searched_for(context, thing))
    yield from drafts_about(context, asking(context, act, by_turning), things)


def asking(context: HouseContext, act: Act | None = None, by_turning: bool | None = None) -> Ask:
    """Return how this family asks for a target: the sentences and the start; the goal follows from the act."""
    return Ask(
        "SI",
        SEARCH_ORDERS,
        lambda thing, also: start_out_of_view(context, thing, also, by_turning=by_turning, horizon=HORIZON_DEG),
        act=act,
    )


def picking_from_inside(context: HouseContext) -> Drafts:
    """Yield drafts whose target is in one of a few closed containers, so that the agent must open the right container.

    The instruction does not name the container.
    """
    for container, inside, setup in filled(context):
        if not context.can_begin(setup):
            continue
        target = context.thing(inside.id)
        phrase = (
            placeless_phrase(context, target, MAX_CLOSED)
            if visible_through_glass_from(context.view, target) is None
            else None
        )
        start = None if phrase is None else start_not_seeing(context, target, by_turning=None, horizon=HORIZON_DEG)
        context.begin(Setup())
        if start is None:
            continue
        task = TaskSpec(
            start=start,
            setup=setup,
            instruction=context.order(SEARCH_ORDERS, "pick", target, phrase),
            goal=ObjectHeld(object_id=target.id),
            bindings={"target": target.id, "container": container.id},
            template=INSIDE_TEMPLATE,
        )
        yield context.draft("SI", task)


def placeless_phrase(context: HouseContext, target: Thing, max_closed: int) -> Phrase | None:
    """Return a phrase that means only this thing and does not name the thing's container.

    None if there is no such phrase, or if the agent might have to search more than `max_closed` closed containers.
    """
    items = context.items
    item = items[target.id]
    if item.has_misleading_name:
        return None
    rooms = (None, item.room) if item.is_room_one else (None,)
    fair = [room for room in rooms if len(may_hold(context.view, items, target, room)) <= max_closed]
    phrases = (Phrase(item.name, colour=colour, room=room) for colour in (None, item.colour) for room in fair)
    return first_meaning(phrases, item, items.values())
