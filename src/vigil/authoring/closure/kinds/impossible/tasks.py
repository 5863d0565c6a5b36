"""Functions that propose twins with one impossible side."""

from itertools import islice

from vigil.authoring.closure.asking import PLACED_ORDERS, PUT_ON, phrase_by_support, start_near
from vigil.authoring.closure.receptacle_space import fits_on
from vigil.authoring.closure.tasks import ClosureTask, Tasks, interleave
from vigil.authoring.drafting.filling import can_be_put
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.families.cr.drafts import is_furniture, placements_in_the_way
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.language.wording import say
from vigil.authoring.review.placements import placements_on
from vigil.authoring.review.synthetic_records import changed_setup
from vigil.authoring.solving.evidence import notice_evidence, object_evidence, surface_evidence
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectAtReceptacle
from vigil.protocol.world import Placement, Setup
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing

TRIED_FURNITURE = 4
STANDS = ("SideTable", "Stool", "Chair", "Ottoman", "CoffeeTable", "Shelf", "Cart", "TVStand", "Dresser", "Desk")
"""Categories of receptacles that may be full."""
OCCUPANTS = ("Television", "Desktop", "CoffeeMachine", "Safe", "Microwave")
"""Categories that may fill a receptacle. People can see that these things cannot be carried."""
MIN_OCCUPIED_SHARE = 0.5
"""Minimum share of a surface that an occupant takes up, so that people can see that the receptacle is full."""
BLOCKERS = ("Ottoman", "ArmChair", "SideTable", "CoffeeTable", "Cart")
"""Categories that may block a door or drawer. Unlike a chair or a lamp, they visibly cannot be carried."""
TRIED_TARGETS, MAX_OCCUPANTS_TRIED = 6, 3


def impossible(context: HouseContext) -> Tasks:
    """Yield twins with one impossible side."""
    yield from interleave(
        context, _absent_tasks(context), _blocked_tasks(context), _broken_tasks(context), _no_room_tasks(context)
    )


def _absent_tasks(context: HouseContext) -> Tasks:
    for episode in seeking(context, "pick"):
        target = context.thing(episode.goal.object_id)
        item = context.items[target.id]
        phrase, support = phrase_by_support(context, item), context.view.scene.things.get(target.parent or "")
        if phrase is None or support is None:
            yield context.rejection(
                "SI", "impossible", "distinguished", f"{target.id!r} cannot be identified by its support"
            )
            continue
        evidence = surface_evidence(support, target.surface)
        if not evidence or children(context.view.scene, target.id):
            yield context.rejection(
                "SI", "impossible", "place_can_be_seen", f"{support.id!r} cannot be looked at from above"
            )
            continue
        first = episode.model_copy(
            update={
                "instruction": context.order(PLACED_ORDERS, "pick", target, phrase),
                "bindings": {"target": target.id, "place": support.id},
            }
        )
        gone = changed_setup(first.setup, target.id, is_absent=True)
        yield ClosureTask("impossible", (first, first.model_copy(update={"setup": gone})), target.id, evidence)


def _blocked_tasks(context: HouseContext) -> Tasks:
    for episode in seeking(context, "open"):
        target = context.thing(episode.goal.object_id)
        if target.is_structure or target.is_pickupable or not is_furniture(target):
            continue
        furniture = context.things(lambda thing, target=target: may_block(context, thing, target))
        for blocker in furniture[:TRIED_FURNITURE]:
            for spot in placements_in_the_way(context, target, blocker, episode.setup):
                if _is_never_in_view(context, episode, blocker, spot):
                    first = episode.model_copy(update={"bindings": {"target": target.id, "blocker": blocker.id}})
                    barred = first.model_copy(update={"setup": changed_setup(first.setup, blocker.id, placement=spot)})
                    evidence = object_evidence(target.id), object_evidence(blocker.id)
                    yield ClosureTask("impossible", (first, barred), blocker.id, evidence)
                    break


def _is_never_in_view(context: HouseContext, episode: Episode, thing: Thing, moved: Placement) -> bool:
    """Return whether a thing is fully out of view at an episode's start, both at its own place and at `moved`."""
    setups = episode.setup, changed_setup(episode.setup, thing.id, placement=moved)
    found = all(context.can_begin(setup) and context.is_out_of_view_from(episode.start, thing.id) for setup in setups)
    context.begin(Setup())
    return found


def may_block(context: HouseContext, thing: Thing, target: Thing) -> bool:
    """Return whether furniture may keep a target from opening: nothing is on it, and it is in the target's room."""
    is_kind = thing.category in BLOCKERS and not thing.is_pickupable and thing.parent is None
    is_bare, room_at = not children(context.view.scene, thing.id), context.view.room_at
    return is_kind and is_bare and thing.id != target.id and room_at(thing.position) == room_at(target.position)


def _broken_tasks(context: HouseContext) -> Tasks:
    for episode in seeking(context, "turn_on"):
        target = context.thing(episode.goal.object_id)
        notice = notice_evidence(target)
        if notice is None:
            continue
        broken = changed_setup(episode.setup, target.id, is_broken=True)
        yield ClosureTask("impossible", (episode, episode.model_copy(update={"setup": broken})), target.id, (notice,))


def _no_room_tasks(context: HouseContext) -> Tasks:
    stands = context.things(lambda thing: thing.category in STANDS and thing.is_receptacle and thing.parent is None)
    for stand in stands:
        occupants = context.things(lambda thing, stand=stand: may_occupy(context, thing, stand))
        for occupant in occupants[:MAX_OCCUPANTS_TRIED]:
            taken = next(placements_on(stand, occupant, inside=False), None)
            if taken is None or not takes_enough_room(stand, occupant):
                continue
            targets = context.things(
                lambda thing, stand=stand: can_be_put(thing, stand) and not children(context.view.scene, thing.id)
            )[:TRIED_TARGETS]
            found = (task for target in targets for task in _no_room_task(context, stand, occupant, taken, target))
            yield from islice(found, 1)


def takes_enough_room(stand: Thing, occupant: Thing) -> bool:
    """Return whether a thing takes up at least `MIN_OCCUPIED_SHARE` of a stand's largest upper surface."""
    tops = [surface for surface, _ in level_surfaces(stand) if not surface.is_inside]
    area = max((top.size_x * top.size_z for top in tops), default=0.0)
    return occupant.asset.size.x * occupant.asset.size.z >= MIN_OCCUPIED_SHARE * area


def may_occupy(context: HouseContext, thing: Thing, stand: Thing) -> bool:
    """Return whether a thing is a machine that may fill a stand: it has nothing on it, and is not on the stand yet."""
    is_bare = not children(context.view.scene, thing.id) and not thing.is_structure
    return thing.category in OCCUPANTS and not thing.is_pickupable and is_bare and thing.parent != stand.id


def _no_room_task(context: HouseContext, stand: Thing, occupant: Thing, taken: Placement, target: Thing) -> Tasks:
    """Yield twins: on the first side, a target fits on a stand; on the second, an occupant takes up the stand.

    Nothing is yielded if the target still fits there, the setup is impossible, or no start or words are found.
    """
    setup = Setup()
    full = changed_setup(setup, occupant.id, placement=taken)
    if not context.can_begin(full):
        return
    is_full = not fits_on(context.view.scene, target.id, stand.id)
    context.begin(setup)
    if not is_full or not fits_on(context.view.scene, target.id, stand.id, may_clear=False):
        return
    phrase, on = context.phrase(target.id), context.phrase(stand.id)
    context.begin(full)
    start = start_near(context, target, occupant.id)
    context.begin(setup)
    if start is None or phrase is None or on is None or not context.is_out_of_view_from(start, occupant.id):
        return
    # not two places in succession: "the pen on the bed on the chair"
    orders = tuple(each for each in PUT_ON if phrase.support is None or " it " in each)
    sentence = say(orders, context.rng, target=str(phrase), receptacle=str(on))
    goal = ObjectAtReceptacle(object_id=target.id, receptacle_id=stand.id)
    bindings = {"target": target.id, "receptacle": stand.id, "occupant": occupant.id}
    first = context.draft("SI", TaskSpec(start, sentence, goal, bindings, template="put"))
    second = first.model_copy(update={"setup": changed_setup(first.setup, occupant.id, placement=taken)})
    evidence = object_evidence(stand.id), object_evidence(occupant.id)
    yield ClosureTask("impossible", (first, second), occupant.id, evidence)
