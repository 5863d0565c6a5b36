"""Proposals of searches (SI) for objects in closed containers that the instruction does not name."""

from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import Drafts, start_not_seeing
from vigil.authoring.drafting.sequences import filled
from vigil.authoring.language.referring import Phrase, referents
from vigil.authoring.language.sentences import SEARCH_ORDERS
from vigil.authoring.language.wording import order_slots, pronoun_slots
from vigil.authoring.review.containers import MAX_CLOSED, may_hold, visible_through_glass_from
from vigil.authoring.review.rules import INSIDE_TEMPLATE
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import ObjectHeld
from vigil.protocol.world import Setup
from vigil.scene.things import Thing


def picking_from_inside(context: HouseContext) -> Drafts:
    """Yield drafts whose target is found by opening the right one of a few closed containers."""
    for container, inside, setup in filled(context):
        if not context.can_begin(setup):
            continue
        target = context.thing(inside.id)
        phrase = _placeless(context, target) if visible_through_glass_from(context.view, target) is None else None
        start = (
            None
            if phrase is None
            else start_not_seeing(context, target, by_turning=None, horizon=DEFAULT_HORIZON_DEG / 2)
        )
        context.begin(Setup())
        if start is None or phrase is None:
            continue
        words = order_slots("pick", target.category, str(phrase), context.rng) | pronoun_slots(target.category)
        task = TaskSpec(
            start=start,
            setup=setup,
            instruction=context.say(SEARCH_ORDERS, target=str(phrase), **words),
            goal=ObjectHeld(object_id=target.id),
            bindings={"target": target.id, "container": container.id},
            template=INSIDE_TEMPLATE,
        )
        yield context.draft("SI", task)


def _placeless(context: HouseContext, target: Thing) -> Phrase | None:
    """Return a phrase for a thing that does not name its container.

    None if no such phrase means that thing only, or if more than `MAX_CLOSED` closed containers would have to be
    searched.
    """
    items = context.items
    item = items[target.id]
    if item.has_misleading_name:
        return None
    colours = item.colours[:1] if len(item.colours) == 1 else ()
    for colour in (None, *colours):
        for room in (None, item.room) if item.is_room_one else (None,):
            phrase = Phrase(item.name, colour=colour, room=room)
            is_fair = len(may_hold(context.view, items, target, room)) <= MAX_CLOSED
            if is_fair and [each.id for each in referents(phrase, items.values())] == [item.id]:
                return phrase
    return None
