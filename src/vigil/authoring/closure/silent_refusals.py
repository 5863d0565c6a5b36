"""Tasks whose obvious action is refused for a reason that is visible but not stated.

A machine runs or is open, an obstacle stands in front of a door, or a shelf is full.
"""

from collections.abc import Iterable
from itertools import combinations, islice

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Surface
from vigil.authoring.closure.impossible import PUT_ON
from vigil.authoring.closure.receptacle_space import free_surfaces, refuses_clicks
from vigil.authoring.closure.tasks import LEVEL_DEG, NEAR_M, ClosureTask, Tasks, interleave
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import CLEAR_PX, is_seen, is_target
from vigil.authoring.families.cr.drafts import interlocked, swing_blocked
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.wording import Act, order_slots, pronoun_slots, say
from vigil.authoring.review.containers import BELONGS_IN
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Vec3
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectAtReceptacle, ObjectInState
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.geometry import Motion
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing
from vigil.sim.core.placing import EDGE_M

ANY_MOVE_M = 0.01
"""Distance (m) by which an obstacle must be moved: any movement counts if the door then opens."""
SHELVES = ("ShelvingUnit", "Fridge", "Cabinet", "TVStand", "SideTable", "Cart", "Desk", "CoffeeTable", "Dresser")
"""Categories of furniture that may have several level surfaces, one of which can be full."""
HAND_HEIGHT_M = 1.0
"""Height (m) of the hand; the surface nearest to it is the obvious one."""
TRIED_SHELVES, TRIED_TARGETS, TRIED_FILLERS, MAX_FILLERS, TRIED_ROWS = 3, 2, 6, 3, 4
"""Limits of the search: pieces of furniture, targets, fillers to choose from, fillers on a shelf, and rows of them."""
MIN_SIDE_M = 0.07
"""Least width (m) of a target; narrower ones almost always fit into a gap."""
FULL = "full_shelf"
PUT_IN = (
    "Put {target} into {receptacle}.",
    "Please put {target} into {receptacle}.",
    "Pick up {target} and put it into {receptacle}.",
    "Take {target} and find a place for it inside {receptacle}.",
)


def silent_refusal(context: HouseContext) -> Tasks:
    """Yield tasks whose obvious action is refused without a stated reason."""
    forms = (
        _implicit_tasks(context, swing_blocked(context), "swing"),
        _implicit_tasks(context, interlocked(context), "machine"),
    )
    yield from interleave(context, *forms, _full_shelf_tasks(context))


def _implicit_tasks(context: HouseContext, drafts: Iterable[Episode], form: str) -> Tasks:
    for episode in drafts:
        goal, constraint = episode.goal, episode.goal.constraint
        target = context.thing(goal.object_id)
        if constraint is None or not isinstance(goal, ObjectInState):
            continue
        act: Act = "open" if goal.state == "is_open" else "turn_on"
        phrase = str(context.phrase(target.id))
        words = order_slots(act, target.category, phrase, context.rng) | pronoun_slots(target.category)
        if constraint.kind == "object_moved":  # the door opens only if the obstacle was moved far enough
            constraint = constraint.model_copy(update={"distance_m": ANY_MOVE_M})
        bare = episode.model_copy(
            update={
                "instruction": context.say(ORDERS, target=phrase, **words),
                "bindings": {"target": target.id},
                "goal": goal.model_copy(update={"constraint": constraint}),
            }
        )
        yield ClosureTask("silent_refusal", (bare,), form=form)


def _full_shelf_tasks(context: HouseContext) -> Tasks:
    for shelves in context.things(lambda thing: thing.category in SHELVES and thing.is_receptacle)[:TRIED_SHELVES]:
        opened = Setup(objects={shelves.id: ObjectSetup(openness=1.0)} if shelves.is_openable else {})
        if not context.can_begin(opened):
            continue
        obvious = obvious_surface(context.thing(shelves.id))
        context.begin(Setup())
        if obvious is None:
            continue
        targets = context.things(lambda thing, shelves=shelves: _may_go_on(context, thing, shelves))
        for target in targets[:TRIED_TARGETS]:
            task = _filled_up(context, shelves, opened, target)
            if task is not None:
                yield task
                break


def obvious_surface(shelves: Thing) -> tuple[Surface, Motion] | None:
    """Return the surface nearest to `HAND_HEIGHT_M`, among those inside the furniture or else those on it.

    None unless there are at least two inside or two on it.
    """
    level = list(level_surfaces(shelves))
    for is_inside in (True, False):
        found = [each for each in level if each[0].is_inside == is_inside]
        if len(found) > 1:
            return min(found, key=lambda each: (abs(float(each[1].shift[1]) - HAND_HEIGHT_M), each[0].name))
    return None


def _may_go_on(context: HouseContext, thing: Thing, shelves: Thing) -> bool:
    is_free = thing.is_pickupable and is_target(thing) and thing.parent != shelves.id
    takes = CATALOG[shelves.category].can_hold(CATALOG[thing.category]) and _belongs(thing, shelves)
    return is_free and takes and _side(thing) >= MIN_SIDE_M and not children(context.view.scene, thing.id)


def _belongs(thing: Thing, shelves: Thing) -> bool:
    """Return whether people would keep a thing in the furniture; open shelves take anything."""
    return thing.category in BELONGS_IN.get(shelves.category, (thing.category,))


def _side(thing: Thing) -> float:
    """Return the shorter side (m) of a thing's footprint."""
    return min(thing.asset.size.x, thing.asset.size.z)


def _filled_up(context: HouseContext, shelves: Thing, opened: Setup, target: Thing) -> ClosureTask | None:
    """Return the task of putting a target on shelves of which the obvious one is full; None if none can be made."""
    if not context.can_begin(opened):
        return None
    stands = context.thing(shelves.id)
    found = obvious_surface(stands)
    if found is None:
        return None
    surface, frame = found
    fillers = sorted(
        (thing for thing in context.view.scene.things.values() if _may_fill(context, thing, stands, target, surface)),
        key=lambda thing: (-thing.asset.size.x * thing.asset.size.z, thing.id),
    )[:TRIED_FILLERS]
    sets = (chosen for count in range(MAX_FILLERS + 1) for chosen in combinations(fillers, count))
    rows = (_row(opened, stands, surface, frame, chosen, _side(target)) for chosen in sets)
    for setup in islice((row for row in rows if row is not None), TRIED_ROWS):
        if context.can_begin(setup) and is_full(context.view, target.id, stands.id):
            return _putting(context, setup, stands, target, surface)
    context.begin(Setup())
    return None


def is_full(view: PrivilegedView, target_id: str, shelves_id: str) -> bool:
    """Return whether every click on the obvious surface is refused for lack of room while another surface has room."""
    scene = view.scene
    found = obvious_surface(scene.things[shelves_id])
    if found is None:
        return False
    surface, _ = found
    others = {each.name for each, _ in level_surfaces(scene.things[shelves_id]) if each.is_inside == surface.is_inside}
    free = free_surfaces(scene, target_id, shelves_id) & others - {surface.name}
    return bool(free) and refuses_clicks(scene, view.agent, target_id, shelves_id, surface.name)


def _may_fill(context: HouseContext, thing: Thing, shelves: Thing, target: Thing, surface: Surface) -> bool:
    is_movable = thing.is_present and thing.is_pickupable and not children(context.view.scene, thing.id)
    is_other = thing.id != target.id and thing.category != target.category and thing.parent != shelves.id
    takes = CATALOG[shelves.category].can_hold(CATALOG[thing.category]) and _belongs(thing, shelves)
    fits = thing.asset.size.z <= surface.size_z and thing.asset.size.y <= surface.clearance
    leaves_none = (surface.size_z - thing.asset.size.z) / 2 + EDGE_M < _side(target)
    return is_movable and is_other and not thing.is_receptacle and takes and fits and leaves_none


def _row(
    opened: Setup, shelves: Thing, surface: Surface, frame: Motion, fillers: tuple[Thing, ...], side_m: float
) -> Setup | None:
    """Return the setup in which the fillers stand in an evenly spaced row on a surface.

    None if they do not fit, or leave a gap for a thing whose shorter side is `side_m`.
    """
    if not fillers:
        return opened
    gap = (surface.size_x - sum(thing.asset.size.x for thing in fillers)) / (len(fillers) + 1)
    if not 0 <= gap < side_m - EDGE_M:
        return None
    objects, left = dict(opened.objects), -surface.size_x / 2
    for thing in fillers:
        left += gap
        place = np.array([[left + thing.asset.size.x / 2, thing.asset.size.y / 2, 0.0]])
        left += thing.asset.size.x
        position = Vec3(*(round(float(value), 4) for value in frame(place)[0]))
        rotation = Vec3(0.0, shelves.rotation.y, 0.0)
        objects[thing.id] = ObjectSetup(placement=Placement(position=position, rotation=rotation, parent=shelves.id))
    return Setup(objects=objects)


def _putting(
    context: HouseContext, setup: Setup, shelves: Thing, target: Thing, surface: Surface
) -> ClosureTask | None:
    phrases = context.phrase(target.id), context.phrase(shelves.id)
    start = context.start_seeing(target, NEAR_M, LEVEL_DEG, is_seen(CLEAR_PX))
    context.begin(Setup())
    if start is None or None in phrases:
        return None
    sentences = PUT_IN if surface.is_inside else PUT_ON
    words = {"target": str(phrases[0]), "receptacle": str(phrases[1])}
    task = TaskSpec(
        start=start,
        setup=setup,
        instruction=say(sentences, context.rng, **words),
        goal=ObjectAtReceptacle(object_id=target.id, receptacle_id=shelves.id, inside=surface.is_inside),
        bindings={"target": target.id, "receptacle": shelves.id},
        template="put",
    )
    return ClosureTask("silent_refusal", (context.draft("SI", task),), form=FULL)
