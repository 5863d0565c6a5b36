"""Twins of which one is impossible: the target is absent, blocked or broken, or the receptacle is full."""

from itertools import islice

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.notice import notice_centre, notice_parts
from vigil.authoring.closure.receptacle_space import fits_on
from vigil.authoring.closure.tasks import (
    LEVEL_DEG,
    NEAR_M,
    ClosureTask,
    Tasks,
    interleave,
    is_out_of_view_from,
    object_evidence,
    rejection,
)
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import CLEAR_PX, is_seen, is_target
from vigil.authoring.families.cr.drafts import fits_on_floor, is_furniture, placements_in_front_of
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.language.referring import DescribedThing, Phrase, referents
from vigil.authoring.language.sentences import SEARCH_ORDERS, Sentences
from vigil.authoring.language.wording import order_slots, pronoun_slots, say
from vigil.authoring.review.placements import placements_on
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.base.geometry import EYE_HEIGHT_M, Vec3
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectAtReceptacle
from vigil.protocol.world import Placement, Setup
from vigil.scene.geometry import place_of
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence

TRIED_FURNITURE = 4
NOTICE_READABLE_M = 2.0
"""Greatest distance (m) from the camera at which a notice can be read."""
BELOW_EYES_M = 0.2
"""Least height (m) of the eyes above a surface that can be seen from above."""
SPOT_SHARES, SPOT_ABOVE_M = (-0.3, 0.3), 0.002
"""Offsets from a surface's middle (shares of its size) and height (m) of the points that are evidence."""
STANDS = ("SideTable", "Stool", "Chair", "Ottoman", "CoffeeTable", "Shelf", "Cart", "TVStand", "Dresser", "Desk")
"""Categories of receptacles that may be full."""
OCCUPANTS = ("Television", "Desktop", "CoffeeMachine", "Safe", "Microwave")
"""Categories that may fill a receptacle and clearly cannot be carried."""
MIN_OCCUPIED_SHARE = 0.5
"""Least share of a surface that an occupant takes up, so that a viewer sees that the receptacle is full."""
BLOCKERS = ("Ottoman", "ArmChair", "SideTable", "CoffeeTable", "Cart")
"""Categories that may block a door or drawer and clearly cannot be carried, unlike a chair or a lamp."""
TRIED_TARGETS, MAX_OCCUPANTS_TRIED = 6, 3
_CLAIMS = ("I do not know where {target} is", "Where is {target}?")
PLACED_ORDERS = Sentences(
    *(
        tuple(each for each in half if not each.startswith(_CLAIMS))
        for half in (SEARCH_ORDERS.public, SEARCH_ORDERS.held_out)
    )
)
"""Orders of searches that do not ask where the target is, since the phrase says it."""
PUT_ON = (
    "Put {target} on {receptacle}.",
    "Please put {target} on {receptacle}.",
    "Pick up {target} and put it on {receptacle}.",
    "Take {target} and set it down on {receptacle}.",
    "I would like you to put {target} on {receptacle}.",
)


def impossible(context: HouseContext) -> Tasks:
    """Yield twins of which one is impossible."""
    yield from interleave(
        context, _absent_tasks(context), _blocked_tasks(context), _broken_tasks(context), _no_room_tasks(context)
    )


def _absent_tasks(context: HouseContext) -> Tasks:
    for episode in seeking(context, "pick"):
        target = context.thing(episode.goal.object_id)
        item = context.items[target.id]
        phrase, support = phrase_by_support(context, item), context.view.scene.things.get(target.parent or "")
        if phrase is None or support is None:
            yield rejection(
                context, "impossible", "distinguished", f"{target.id!r} cannot be identified by its support"
            )
            continue
        spots = _evidence_spots(support, target)
        if not spots or children(context.view.scene, target.id):
            yield rejection(
                context, "impossible", "place_can_be_seen", f"{support.id!r} cannot be looked at from above"
            )
            continue
        words = order_slots("pick", target.category, str(phrase), context.rng) | pronoun_slots(target.category)
        first = episode.model_copy(
            update={
                "instruction": context.say(PLACED_ORDERS, target=str(phrase), **words),
                "bindings": {"target": target.id, "place": support.id},
            }
        )
        gone = changed_setup(first.setup, target.id, is_absent=True)
        evidence = tuple(Evidence(object_id=support.id, spot=spot) for spot in spots)
        yield ClosureTask("impossible", (first, first.model_copy(update={"setup": gone})), target.id, evidence)


def phrase_by_support(context: HouseContext, item: DescribedThing, *, may_colour: bool = True) -> Phrase | None:
    """Return a phrase for a thing that names its support; None if there is no unambiguous one."""
    items = list(context.items.values())
    if item.support is None or {each.id for each in referents(Phrase(item.support), items)} != {item.support_id}:
        return None
    colours = item.colours[:1] if len(item.colours) == 1 and may_colour else ()
    for colour in (None, *colours):
        phrase = Phrase(
            item.name,
            colour=colour,
            support=item.support,
            is_inside=item.is_inside,
            is_on_shelf=item.is_on_shelf,
        )
        if [each.id for each in referents(phrase, items)] == [item.id]:
            return phrase
    return None


def _evidence_spots(support: Thing, target: Thing) -> list[Vec3]:
    """Return points spread over the surface on which a thing lies; empty if it cannot be seen from above."""
    for surface, frame in level_surfaces(support):
        if surface.name == target.surface:
            shares = [(x * surface.size_x, SPOT_ABOVE_M, z * surface.size_z) for x in SPOT_SHARES for z in SPOT_SHARES]
            found = [Vec3(*(round(float(value), 3) for value in point)) for point in frame(np.array(shares))]
            is_low = all(spot.y <= EYE_HEIGHT_M - BELOW_EYES_M for spot in found)
            return found if is_low and not surface.needs_opening else []
    return []


def _blocked_tasks(context: HouseContext) -> Tasks:
    for episode in seeking(context, "open"):
        target = context.thing(episode.goal.object_id)
        if target.is_structure or target.is_pickupable or not is_furniture(target):
            continue
        room = context.view.room_at(target.position)
        furniture = context.things(lambda thing, room=room, target=target: _may_block(context, thing, target, room))
        for blocker in islice(furniture, TRIED_FURNITURE):
            spot = next(
                (
                    spot
                    for spot in placements_in_front_of(target, blocker)
                    if fits_on_floor(context, blocker, spot, episode.setup)
                    and _is_never_in_view(context, episode, blocker, spot)
                ),
                None,
            )
            if spot is None:
                continue
            first = episode.model_copy(update={"bindings": {"target": target.id, "blocker": blocker.id}})
            barred = changed_setup(first.setup, blocker.id, placement=spot)
            evidence = object_evidence(target.id), object_evidence(blocker.id)
            yield ClosureTask("impossible", (first, first.model_copy(update={"setup": barred})), blocker.id, evidence)


def _is_never_in_view(context: HouseContext, episode: Episode, thing: Thing, moved: Placement) -> bool:
    """Return whether a thing is fully out of view at an episode's start, both unmoved and moved to a placement."""
    setups = episode.setup, changed_setup(episode.setup, thing.id, placement=moved)
    found = all(context.can_begin(setup) and is_out_of_view_from(context, episode.start, thing.id) for setup in setups)
    context.begin(Setup())
    return found


def _may_block(context: HouseContext, thing: Thing, target: Thing, room: str | None) -> bool:
    is_kind = thing.category in BLOCKERS and not thing.is_pickupable and thing.parent is None
    is_bare = not children(context.view.scene, thing.id)
    return is_kind and is_bare and thing.id != target.id and context.view.room_at(thing.position) == room


def _broken_tasks(context: HouseContext) -> Tasks:
    for episode in seeking(context, "turn_on"):
        target = context.thing(episode.goal.object_id)
        spot = notice_centre(target.asset) if notice_parts(target.asset) else None
        if spot is None:
            continue
        middle = place_of(target)(np.array(spot)[None])[0]
        place = Vec3(*(round(float(value), 3) for value in middle))
        evidence = (Evidence(object_id=target.id, spot=place, within_m=NOTICE_READABLE_M),)
        broken = changed_setup(episode.setup, target.id, is_broken=True)
        yield ClosureTask("impossible", (episode, episode.model_copy(update={"setup": broken})), target.id, evidence)


def _no_room_tasks(context: HouseContext) -> Tasks:
    for stand in context.things(
        lambda thing: thing.category in STANDS and thing.is_receptacle and thing.parent is None
    ):
        for occupant in islice(
            context.things(lambda thing, stand=stand: _may_occupy(context, thing, stand)), MAX_OCCUPANTS_TRIED
        ):
            taken = next(islice(placements_on(stand, occupant, inside=False), 1), None)
            if taken is None or not _takes_enough_room(stand, occupant):
                continue
            targets = context.things(lambda thing, stand=stand: _may_go_on(context, thing, stand))
            for target in targets[:TRIED_TARGETS]:
                task = _no_room_task(context, stand, occupant, taken, target)
                if task is not None:
                    yield task
                    break


def _orders_for(target: Phrase | None) -> tuple[str, ...]:
    """Return the orders for a target that do not name two places in succession ("the pen on the bed on the chair")."""
    names_place = target is not None and target.support is not None
    return tuple(each for each in PUT_ON if not names_place or " it " in each)


def _takes_enough_room(stand: Thing, occupant: Thing) -> bool:
    """Return whether a thing takes up at least `MIN_OCCUPIED_SHARE` of a stand's largest upper surface."""
    tops = [surface for surface, _ in level_surfaces(stand) if not surface.is_inside]
    area = max((top.size_x * top.size_z for top in tops), default=0.0)
    return occupant.asset.size.x * occupant.asset.size.z >= MIN_OCCUPIED_SHARE * area


def _may_occupy(context: HouseContext, thing: Thing, stand: Thing) -> bool:
    is_bare = not children(context.view.scene, thing.id) and not thing.is_structure
    return thing.category in OCCUPANTS and not thing.is_pickupable and is_bare and thing.parent != stand.id


def _may_go_on(context: HouseContext, thing: Thing, stand: Thing) -> bool:
    is_free = thing.is_pickupable and is_target(thing) and thing.parent != stand.id
    takes = CATALOG[stand.category].can_hold(CATALOG[thing.category])
    return is_free and takes and not children(context.view.scene, thing.id)


def _no_room_task(
    context: HouseContext, stand: Thing, occupant: Thing, taken: Placement, target: Thing
) -> ClosureTask | None:
    """Return twins in which a target fits on a stand, or does not fit because an occupant stands there.

    None if that is not so, the setup is impossible, or no start or words are found.
    """
    setup = Setup()
    full = changed_setup(setup, occupant.id, placement=taken)
    if not context.can_begin(full):
        return None
    is_full = not fits_on(context.view.scene, target.id, stand.id)
    context.begin(setup)
    if not is_full or not fits_on(context.view.scene, target.id, stand.id, may_clear=False):
        return None
    phrases = context.phrase(target.id), context.phrase(stand.id)
    context.begin(full)
    start = context.start_seeing(
        target, NEAR_M, LEVEL_DEG, is_seen(CLEAR_PX), lambda pose: is_out_of_view_from(context, pose, occupant.id)
    )
    context.begin(setup)
    if start is None or None in phrases or not is_out_of_view_from(context, start, occupant.id):
        return None
    first = context.draft(
        "SI",
        TaskSpec(
            start=start,
            setup=setup,
            instruction=say(_orders_for(phrases[0]), context.rng, target=str(phrases[0]), receptacle=str(phrases[1])),
            goal=ObjectAtReceptacle(object_id=target.id, receptacle_id=stand.id),
            bindings={"target": target.id, "receptacle": stand.id, "occupant": occupant.id},
            template="put",
        ),
    )
    second = first.model_copy(update={"setup": changed_setup(first.setup, occupant.id, placement=taken)})
    evidence = object_evidence(stand.id), object_evidence(occupant.id)
    return ClosureTask("impossible", (first, second), occupant.id, evidence)
