"""Proposals of searches (SI) for things that lie in something closed, which the instruction does not name."""

from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import Drafts, start_without
from vigil.authoring.drafting.sequences import filled
from vigil.authoring.language.referring import DescribedThing, Phrase, referents
from vigil.authoring.language.wording import SEARCH_ORDERS, order, say
from vigil.authoring.review.containers import MOST_CLOSED, may_hold, sees_through
from vigil.authoring.review.rules import INSIDE_TEMPLATE
from vigil.episode import LOOKING_DOWN_DEG
from vigil.goals import ObjectHeld
from vigil.scene.things import Thing
from vigil.world import Setup


def picking_from_inside(context: HouseContext) -> Drafts:
    """Yields drafts whose target is found by opening the right one of a few things."""
    for container, inside, setup in filled(context):
        if not context.can_begin(setup):
            continue
        target = context.thing(inside.id)
        phrase = _placeless(context, target) if sees_through(context.oracle, target) is None else None
        start = (
            None if phrase is None else start_without(context, target, by_turning=None, horizon=LOOKING_DOWN_DEG / 2)
        )
        context.begin(Setup())
        if start is None or phrase is None:
            continue
        task = TaskSpec(
            start=start,
            setup=setup,
            instruction=say(
                SEARCH_ORDERS,
                context.rng,
                target=str(phrase),
                **order("pick", target.category, str(phrase), context.rng),
            ),
            goal=ObjectHeld(object_id=target.id),
            bindings={"target": target.id, "container": container.id},
            template=INSIDE_TEMPLATE,
        )
        yield context.draft("SI", task)


def _placeless(context: HouseContext, target: Thing) -> Phrase | None:
    """Returns what to call a thing without saying what it lies in; None when that does not single it out, or when
    there are more closed things to look into than can be searched."""
    items = context.items
    item = items[target.id]
    colours = item.colours[:1] if len(item.colours) == 1 else ()
    for colour in (None, *colours):
        for room in (None, item.room) if _is_only_room(item, items) else (None,):
            phrase = Phrase(item.name, colour=colour, room=room)
            is_fair = len(may_hold(context.oracle, items, target, room)) <= MOST_CLOSED
            if is_fair and [each.id for each in referents(phrase, items.values())] == [item.id]:
                return phrase
    return None


def _is_only_room(item: DescribedThing, items: dict[str, DescribedThing]) -> bool:
    """Whether a thing is in the only room of its name."""
    return item.room is not None and {each.room_id for each in items.values() if each.room == item.room} == {
        item.room_id
    }
