"""Functions that propose tasks whose obvious action is refused, and that check that a shelf is full."""

from collections.abc import Iterable, Iterator
from itertools import combinations, islice

import numpy as np

from vigil.assets.kernel.asset import Surface
from vigil.authoring.closure.asking import PUT_ON, start_near
from vigil.authoring.closure.kinds.silent_refusal import FULL
from vigil.authoring.closure.receptacle_space import free_surfaces, refuses_clicks
from vigil.authoring.closure.tasks import ClosureTask, Tasks, interleave
from vigil.authoring.drafting.filling import can_be_put, can_hold
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import act_of
from vigil.authoring.families.cr.drafts import interlocked, swing_blocked
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.wording import say
from vigil.authoring.review.containers import BELONGS_IN
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Vec3
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectAtReceptacle, ObjectInState
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.geometry import Motion
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing
from vigil.sim.core.placing import EDGE_M

ANY_MOVE_M = 0.01
"""Minimum distance (m) by which an obstacle must be moved. It is small: any move counts if the door can then open."""
SHELVES = ("ShelvingUnit", "Fridge", "Cabinet", "TVStand", "SideTable", "Cart", "Desk", "CoffeeTable", "Dresser")
"""Categories of furniture that may have several level surfaces. One of the surfaces can be full."""
HAND_HEIGHT_M = 1.0
"""Height (m) of the hand. The obvious surface of furniture is the surface nearest to this height."""
TRIED_SHELVES, TRIED_TARGETS, TRIED_FILLERS, MAX_FILLERS, TRIED_ROWS = 3, 2, 6, 3, 4
"""Limits of the search: pieces of furniture, targets, things tried as fillers, fillers on a shelf, rows of fillers."""
MIN_SIDE_M = 0.07
"""Minimum width (m) of a target. A narrower thing almost always fits into a gap."""
PUT_IN = (
    "Put {target} into {receptacle}.",
    "Please put {target} into {receptacle}.",
    "Pick up {target} and put it into {receptacle}.",
    "Take {target} and find a place for it inside {receptacle}.",
)


def silent_refusal(context: HouseContext) -> Tasks:
    """Yield tasks whose obvious action is refused, without informing the agent of the reason."""
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
        if constraint.kind == "object_moved":  # the door opens only if the obstacle was moved far enough
            constraint = constraint.model_copy(update={"distance_m": ANY_MOVE_M})
        bare = episode.model_copy(
            update={
                "instruction": context.order(ORDERS, act_of(goal), target, context.phrase(target.id)),
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
        found = (task for target in targets[:TRIED_TARGETS] for task in _filled_up(context, shelves, opened, target))
        yield from islice(found, 1)


def obvious_surface(shelves: Thing) -> tuple[Surface, Motion] | None:
    """Return the obvious surface of furniture, with its frame: the surface nearest to `HAND_HEIGHT_M`.

    Only the surfaces inside count or, if there are fewer than two inside, only the outer surfaces. None if there are
    fewer than two of these, too.
    """
    level = list(level_surfaces(shelves))
    for is_inside in (True, False):
        found = [each for each in level if each[0].is_inside == is_inside]
        if len(found) > 1:
            return min(found, key=lambda each: (abs(float(each[1].shift[1]) - HAND_HEIGHT_M), each[0].name))
    return None


def _may_go_on(context: HouseContext, thing: Thing, shelves: Thing) -> bool:
    suits = can_be_put(thing, shelves) and _belongs(thing, shelves)
    return suits and _side(thing) >= MIN_SIDE_M and not children(context.view.scene, thing.id)


def _belongs(thing: Thing, shelves: Thing) -> bool:
    """Return whether people would put a thing into this furniture. They put any thing on open shelves."""
    return thing.category in BELONGS_IN.get(shelves.category, (thing.category,))


def _side(thing: Thing) -> float:
    """Return the shorter side (m) of a thing's footprint."""
    return min(thing.asset.size.x, thing.asset.size.z)


def _filled_up(context: HouseContext, shelves: Thing, opened: Setup, target: Thing) -> Tasks:
    """Yield the task to put a target on shelves whose obvious surface is full; nothing if no such task can be made."""
    if not context.can_begin(opened):
        return
    stands = context.thing(shelves.id)
    found = obvious_surface(stands)
    if found is None:
        return
    surface, frame = found
    fillers = sorted(
        (thing for thing in context.view.scene.things.values() if _may_fill(context, thing, stands, target, surface)),
        key=lambda thing: (-thing.asset.size.x * thing.asset.size.z, thing.id),
    )[:TRIED_FILLERS]
    sets = (chosen for count in range(MAX_FILLERS + 1) for chosen in combinations(fillers, count))
    rows = (_row(opened, stands, surface, frame, chosen, _side(target)) for chosen in sets)
    for setup in islice((row for row in rows if row is not None), TRIED_ROWS):
        if context.can_begin(setup) and is_full(context.view, target.id, stands.id):
            yield from _putting(context, setup, stands, target, surface)
            return
    context.begin(Setup())


def is_full(view: PrivilegedView, target_id: str, shelves_id: str) -> bool:
    """Return whether every click on the obvious surface is refused for lack of room, and another surface has room."""
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
    takes = can_hold(shelves, thing) and _belongs(thing, shelves)
    fits = thing.asset.size.z <= surface.size_z and thing.asset.size.y <= surface.clearance
    leaves_none = (surface.size_z - thing.asset.size.z) / 2 + EDGE_M < _side(target)
    return is_movable and is_other and not thing.is_receptacle and takes and fits and leaves_none


def _row(
    opened: Setup, shelves: Thing, surface: Surface, frame: Motion, fillers: tuple[Thing, ...], side_m: float
) -> Setup | None:
    """Return the setup in which the fillers stand in an evenly spaced row on a surface.

    None if they do not fit, or if a thing whose shorter side is `side_m` would fit into a gap between them.
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


def _putting(context: HouseContext, setup: Setup, shelves: Thing, target: Thing, surface: Surface) -> Tasks:
    things = {"target": target, "receptacle": shelves}
    found = context.start_and_phrases(setup, things, lambda _: start_near(context, target))
    if found is not None:
        start, phrases = found
        words = {role: str(phrase) for role, phrase in phrases.items()}
        sentence = say(PUT_IN if surface.is_inside else PUT_ON, context.rng, **words)
        goal = ObjectAtReceptacle(object_id=target.id, receptacle_id=shelves.id, inside=surface.is_inside)
        bindings = {role: thing.id for role, thing in things.items()}
        draft = context.draft("SI", TaskSpec(start, sentence, goal, bindings, setup=setup, template="put"))
        yield ClosureTask("silent_refusal", (draft,), form=FULL)


def faults(
    view: PrivilegedView, task: ClosureTask, episode: Episode, _: tuple[Action, ...]
) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) if a shelf that must be full is not full."""
    goal = episode.goal
    if task.form != FULL or not isinstance(goal, ObjectAtReceptacle):
        return
    if not is_full(view, goal.object_id, goal.receptacle_id):
        yield "obvious_is_full", f"{goal.receptacle_id!r} has room at the obvious place, or nowhere"
