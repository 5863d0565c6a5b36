"""Proposals of the longer sequences (SM), which need most of the family's step budget.

Where a sequence ends in several facts (two objects in one place, or an object put in and the door closed again), its
goal is `all_of` them. The chain lists the facts before the end, in the order in which they are brought about.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from vigil.authoring.drafting.constraints import acts_for
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import (
    CLEAR_PX,
    Drafts,
    can_be_searched_for,
    goal_for,
    is_seen,
    is_target,
    setup_for,
)
from vigil.authoring.drafting.sequences import (
    PUT_INTO,
    SEATS,
    START_AWAY_M,
    TABLES,
    filled,
    is_wordy,
    may_go_in,
    receptacles_for,
    suits,
)
from vigil.authoring.language.chain_sentences import CHAINS
from vigil.authoring.language.wording import Act, opening_phrase, order_slots, pronoun_slots
from vigil.authoring.review.containers import BELONGS_IN
from vigil.base.geometry import floor_distance
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import AllOf, ChainLink, Goal, GoalPart, ObjectAtReceptacle, ObjectHeld, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing

TOGETHER_M = 4.0
"""Greatest floor distance (m) of a sequence's objects from its first one, so that the step budget is enough."""
CARRIED_M = 6.0
"""Greatest floor distance (m) between two containers; larger than `TOGETHER_M` since only one object is carried."""
TRIED_CONTAINERS = 6
"""Number of other containers tried as the place for an object taken out of one."""
ROOM_FACTOR = 3.0
"""Free area that objects need, as a multiple of their own, since objects do not lie close together."""
NEVER_CHANGED = frozenset({"Doorway"})
"""Categories that are not opened or closed in passing, because that changes the ways through the house."""


@dataclass(frozen=True, slots=True)
class ChainPlan:
    """A sequence for which a start pose and words are still to be found."""

    template: str
    setup: Setup
    roles: dict[str, Thing]
    chain: tuple[ChainLink, ...]
    goal: Goal
    leaf: Thing | None = None
    """Container that is opened, and in some templates closed again; None if the words do not name it."""
    other: Thing | None = None
    """Second container that is opened; None if there is only one."""
    acts: tuple[tuple[Thing, Act], ...] = ()
    """Two objects with what is done to each, for `three_acts` only."""
    inside: bool = False
    """Whether objects are put into the receptacle, not onto it."""


def two_to_one(context: HouseContext) -> Drafts:
    """Yield drafts in which two objects are put on or into the same receptacle."""
    movable = _movable(context)
    for first in movable:
        for receptacle in receptacles_for(context, first, {first.id, first.parent}):
            inside = receptacle.category in PUT_INTO
            joining = [each for each in movable if _may_join(each, first, receptacle)]
            near = (each for each in context.shuffled(joining) if _is_near(context, first, each, receptacle))
            second = next(near, None)
            if second is not None and _has_room(context, receptacle, first, second):
                parts = tuple(_at(each, receptacle, inside=inside) for each in (first, second))
                roles = {"target": first, "second": second, "receptacle": receptacle}
                chain = (_held(first), parts[0], _held(second))
                yield from _draft(context, ChainPlan("two_to_one", Setup(), roles, chain, _all(parts), inside=inside))


def _may_join(second: Thing, first: Thing, receptacle: Thing) -> bool:
    """Return whether a second object may be put where the first one goes."""
    taken = (first.id, receptacle.id)
    is_free = second.id not in (*taken, first.parent) and second.parent not in taken
    is_odd = receptacle.category in PUT_INTO and second.category not in PUT_INTO[receptacle.category]
    return is_free and not is_odd and suits(receptacle, second)


def put_and_close(context: HouseContext) -> Drafts:
    """Yield drafts in which an object is put into a container that is opened before and closed after."""
    for container in context.things(lambda thing: thing.category in BELONGS_IN and thing.is_openable):
        closed = Setup(objects={container.id: ObjectSetup(openness=0.0)})
        for target in context.things(lambda thing, container=container: may_go_in(container, thing)):
            if can_be_searched_for(context, target) and _is_near(context, container, target):
                inside = _at(target, container, inside=True)
                yield from _draft(context, ChainPlan(
                    "put_and_close", closed, {"target": target, "receptacle": container},
                    (_opened(container), _held(target), inside), _all((inside, _closed(container))),
                    leaf=container, inside=True,
                ))  # fmt: skip


def take_and_close(context: HouseContext) -> Drafts:
    """Yield drafts in which an object is taken out of a container and put elsewhere, and the container closed again."""
    for container, target, setup in filled(context):
        taken = {container.id, container.parent, target.id, target.parent}
        for receptacle in receptacles_for(context, target, taken):
            if _is_near(context, container, receptacle) and _has_room(context, receptacle, target):
                inside = receptacle.category in PUT_INTO
                there = _at(target, receptacle, inside=inside)
                yield from _draft(context, ChainPlan(
                    "take_and_close", setup, {"target": target, "container": container, "receptacle": receptacle},
                    (_opened(container), _held(target), there), _all((there, _closed(container))),
                    leaf=container, inside=inside,
                ))  # fmt: skip


def swapping(context: HouseContext) -> Drafts:
    """Yield drafts in which two objects on two tables or seats change places."""
    movable = [thing for thing in _movable(context) if _rests_on(context, thing) is not None]
    for first in movable:
        source = _rests_on(context, first)
        for second in movable:
            receptacle = _rests_on(context, second)
            if source is None or receptacle is None or receptacle.id == source.id:
                continue
            can_change = suits(receptacle, first) and suits(source, second)
            can_change = can_change and _has_room(context, receptacle, first) and _has_room(context, source, second)
            if can_change and _is_near(context, source, receptacle):
                parts = (_at(first, receptacle), _at(second, source))
                roles = {"target": first, "second": second, "source": source, "receptacle": receptacle}
                chain = (_held(first), parts[0], _held(second))
                yield from _draft(context, ChainPlan("swap", Setup(), roles, chain, _all(parts)))
                break


def from_one_into_another(context: HouseContext) -> Drafts:
    """Yield drafts in which an object goes from one closed container into another."""
    for container, target, setup in filled(context):
        others = context.things(lambda thing: thing.category in BELONGS_IN and thing.is_openable)
        for other in others[:TRIED_CONTAINERS]:
            is_apart = other.id != container.id and target.id != other.id
            is_within = floor_distance(container.position, other.position) <= CARRIED_M
            if not (is_apart and is_within and may_go_in(other, target)):
                continue
            both = Setup(objects={**setup.objects, other.id: ObjectSetup(openness=0.0)})
            chain = (_opened(other), _opened(container), _held(target))
            yield from _draft(context, ChainPlan(
                "out_of_into", both, {"target": target, "container": container, "receptacle": other},
                chain, _at(target, other, inside=True), leaf=container, other=other, inside=True,
            ))  # fmt: skip
            break


def three_acts(context: HouseContext) -> Drafts:
    """Yield drafts in which two objects are opened, closed or switched, and a third one is put somewhere."""
    for target in _movable(context):
        for receptacle in receptacles_for(context, target, {target.id, target.parent})[:1]:
            found = [each for each in _errands(context) if each[0].id not in (receptacle.id, target.id, target.parent)]
            acts = [each for each in found if _is_near(context, target, each[0], receptacle)][:2]
            if len(acts) < 2 or not _has_room(context, receptacle, target):
                continue
            inside = receptacle.category in PUT_INTO
            there = _at(target, receptacle, inside=inside)
            states = tuple(goal for thing, act in acts if isinstance(goal := goal_for(thing, act), ObjectInState))
            setup = Setup(objects={key: change for each in acts for key, change in setup_for(*each).objects.items()})
            roles = {"target": target, "receptacle": receptacle, "first": acts[0][0], "next": acts[1][0]}
            yield from _draft(context, ChainPlan(
                "three_acts", setup, roles, (*states, _held(target)), _all((there, *states)),
                acts=tuple(acts), inside=inside,
            ))  # fmt: skip


def _errands(context: HouseContext) -> list[tuple[Thing, Act]]:
    """Return objects in a random order, each with an act that can be done to it; one object per category."""
    chosen: dict[str, tuple[Thing, Act]] = {}
    for thing in context.things(lambda thing: is_target(thing) and thing.category not in NEVER_CHANGED):
        acts: list[Act] = [act for act in acts_for(thing) if act != "pick"]
        if acts and not thing.is_pickupable:
            chosen.setdefault(thing.category, (thing, acts[int(context.rng.integers(len(acts)))]))
    return list(chosen.values())


def _draft(context: HouseContext, plan: ChainPlan) -> Drafts:
    """Yield one draft, or none if no start pose or no words are found."""
    if not context.can_begin(plan.setup):
        return
    phrases = {role: context.phrase(thing.id) for role, thing in plan.roles.items()}
    named = {role: phrase for role, phrase in phrases.items() if phrase is not None}
    first = context.thing(plan.chain[0].object_id)
    is_sayable = len(named) == len(phrases) and not is_wordy(named)
    start = context.start_seeing(first, START_AWAY_M, DEFAULT_HORIZON_DEG, is_seen(CLEAR_PX)) if is_sayable else None
    context.begin(Setup())
    if start is None:
        return
    words = {role: str(phrase) for role, phrase in named.items()}
    words |= pronoun_slots(plan.roles["target"].category, "target_")
    said = {plan.roles[role].id: text for role, text in words.items() if role in plan.roles}
    if plan.leaf is not None:
        words |= opening_phrase(plan.leaf.category, said[plan.leaf.id]).slots()
    if plan.other is not None:
        words["other"] = opening_phrase(plan.other.category, said[plan.other.id]).whole
    for name, (thing, act) in zip(("order_a", "order_b"), plan.acts, strict=False):
        words[name] = order_slots(act, thing.category, said[thing.id], context.rng)["order"]
    words["into"] = "into" if plan.inside else "onto"
    yield context.draft(
        "SM",
        TaskSpec(
            start=start,
            setup=plan.setup,
            instruction=context.say(CHAINS[plan.template], **words),
            goal=plan.goal.model_copy(update={"chain": plan.chain}),
            bindings={role: thing.id for role, thing in plan.roles.items()},
            template=plan.template,
        ),
    )


def _movable(context: HouseContext) -> list[Thing]:
    """Return the objects that rest on another and can be picked up, in a random order."""
    return context.things(
        lambda thing: thing.is_pickupable and thing.parent is not None and can_be_searched_for(context, thing)
    )


def _rests_on(context: HouseContext, thing: Thing) -> Thing | None:
    """Return the table or seat that an object rests on; None if it does not rest on one."""
    support = context.thing(thing.parent or "") if thing.parent is not None else None
    return support if support is not None and support.category in (*TABLES, *SEATS) else None


def _has_room(context: HouseContext, receptacle: Thing, *things: Thing) -> bool:
    """Return whether objects are likely to fit on a receptacle together with what lies there already."""
    level = [surface for surface, _ in level_surfaces(receptacle)]
    tops = [surface for surface in level if not surface.is_inside] or level
    there = children(context.view.scene, receptacle.id)
    free_m2 = sum(surface.size_x * surface.size_z for surface in tops) - sum(map(_area_m2, there))
    return free_m2 >= ROOM_FACTOR * sum(map(_area_m2, things))


def _area_m2(thing: Thing) -> float:
    return thing.asset.size.x * thing.asset.size.z


def _is_near(context: HouseContext, first: Thing, *others: Thing) -> bool:
    """Return whether other objects are in the room of the first and at most `TOGETHER_M` from it."""
    room_at, home = context.view.room_at, context.view.room_at(first.position)
    return all(
        room_at(other.position) == home and floor_distance(first.position, other.position) <= TOGETHER_M
        for other in others
    )


def _held(thing: Thing) -> ObjectHeld:
    return ObjectHeld(object_id=thing.id)


def _opened(thing: Thing) -> ObjectInState:
    return ObjectInState(object_id=thing.id, state="is_open")


def _closed(thing: Thing) -> ObjectInState:
    return ObjectInState(object_id=thing.id, state="is_open", value=False)


def _at(thing: Thing, receptacle: Thing, *, inside: bool = False) -> ObjectAtReceptacle:
    return ObjectAtReceptacle(object_id=thing.id, receptacle_id=receptacle.id, inside=inside)


def _all(parts: Sequence[GoalPart]) -> AllOf:
    return AllOf(object_id=parts[0].object_id, parts=tuple(parts))
