"""Plans of Sequential Manipulation (SM): containers are opened, objects taken out and put elsewhere, containers closed.

A sequence may end in several facts (two objects in one place, or an object inside and the door closed). Its goal is
then `all_of` these facts.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from vigil.authoring.drafting.filling import can_be_put, can_hold, filled
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import acts_for, can_be_searched_for, goal_for, is_target, setup_for
from vigil.authoring.language.wording import Act
from vigil.authoring.review.containers import BELONGS_IN
from vigil.base.geometry import floor_distance
from vigil.protocol.goals import AllOf, Goal, GoalPart, ObjectAtReceptacle, ObjectHeld, ObjectInState
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.supports import children, level_surfaces
from vigil.scene.things import Thing

TOGETHER_M = 4.0
"""Maximum floor distance (m) from a sequence's first object to the other objects, so that the step budget is enough."""
CARRIED_M = 6.0
"""Maximum floor distance (m) between two containers. It exceeds `TOGETHER_M` because only one object is carried."""
TRIED_RECEPTACLES, TRIED_CONTAINERS = 3, 6
"""Number of receptacles, and number of other containers, that are tried as the place for an object."""
ROOM_FACTOR = 3.0
"""Free area that objects need, as a multiple of their own area: objects do not lie close together."""
NEVER_CHANGED = frozenset({"Doorway"})
"""Categories that `three_acts` does not open or close, because this would change the ways through the house."""
TABLES = ("CounterTop", "DiningTable", "CoffeeTable", "Desk", "SideTable", "Dresser", "TVStand", "Cart")
SEATS = ("Sofa", "Bed", "ArmChair", "Ottoman", "Chair", "Stool")
SOFT = (
    *("Pillow", "TeddyBear", "Towel", "HandTowel", "Cloth", "Book", "Newspaper", "Laptop", "RemoteControl"),
    "TennisRacket",
)
"""Categories that people put on seats as well as on tables."""
FOOD = ("Apple", "Tomato", "Potato", "Egg", "Bread", "Lettuce")
WARE = ("Plate", "Bowl", "Cup", "Mug", "Fork", "Spoon", "Knife", "ButterKnife", "Spatula", "Ladle", "Pot", "Pan")
PUT_INTO = {
    "Sink": (*WARE, "DishSponge", "Apple", "Tomato", "Potato", "Lettuce"),
    "GarbageCan": (*FOOD, "Newspaper", "AluminumFoil", "PaperTowelRoll", "ToiletPaper", "TissueBox", "Bottle"),
    "Bowl": ("Apple", "Egg", "Potato", "Tomato", "Spoon"),
    "Bathtub": ("Towel", "SoapBottle", "SoapBar", "Cloth", "SprayBottle"),
}
"""Receptacle without a door or lid -> categories that people put into it."""
Fact = ObjectInState | ObjectHeld | ObjectAtReceptacle


@dataclass(frozen=True, slots=True)
class SequencePlan:
    """A sequence of acts that does not have a start pose and an instruction yet."""

    template: str
    setup: Setup
    roles: dict[str, Thing]
    facts: tuple[Fact, ...]
    """Facts that the acts bring about, in order."""
    ends: tuple[GoalPart, ...] = ()
    """Facts that must hold at the end, if there are several; empty if only the last fact must hold."""

    @property
    def goal(self) -> Goal:
        """The goal: the facts that must hold at the end. Its `chain` has all facts before the last one, in order."""
        goal = AllOf(object_id=self.ends[0].object_id, parts=self.ends) if self.ends else self.facts[-1]
        return goal.model_copy(update={"chain": self.facts[:-1]})


Plans = Iterator[SequencePlan]


def revealing(context: HouseContext) -> Plans:
    """Yield `reveal_pick` plans: open a container and take out an object."""
    for container, target, setup in filled(context):
        roles = {"container": container, "target": target}
        yield SequencePlan("reveal_pick", setup, roles, (_opened(container), _held(target)))


def emptying(context: HouseContext) -> Plans:
    """Yield `open_pick_place` plans: open a container, take out an object, put it on or into a receptacle."""
    for container, target, setup in filled(context):
        furniture = container.parent if container.is_drawer else None
        for receptacle in receptacles_for(context, target, {container.id, furniture, target.id, target.parent}):
            roles = {"container": container, "target": target, "receptacle": receptacle}
            facts = _opened(container), _held(target), _at(target, receptacle)
            yield SequencePlan("open_pick_place", setup, roles, facts)


def putting_in(context: HouseContext) -> Plans:
    """Yield `put_into` plans: take an object and put it into a container, which is first opened if it can be."""
    for container in context.things(_may_hold):
        setup = _closed_setup(container) if container.is_openable else Setup()
        opened = (_opened(container),) if container.is_openable else ()
        for target in context.things(lambda thing, container=container: _may_go_in(container, thing)):
            if can_be_searched_for(context, target):
                roles = {"target": target, "receptacle": container}
                facts = (*opened, _held(target), _at(target, container, inside=True))
                yield SequencePlan("put_into", setup, roles, facts)


def rearranging(context: HouseContext) -> Plans:
    """Yield `rearrange` plans: take an object from one receptacle and put it on or into another."""
    for target in context.things(lambda thing: thing.is_pickupable and is_target(thing) and thing.parent is not None):
        source = context.thing(target.parent or "")
        if source.category not in (*TABLES, *SEATS):
            continue
        for receptacle in receptacles_for(context, target, {source.id, target.id}):
            roles = {"target": target, "source": source, "receptacle": receptacle}
            yield SequencePlan("rearrange", Setup(), roles, (_held(target), _at(target, receptacle)))


def two_to_one(context: HouseContext) -> Plans:
    """Yield plans in which two objects are put on or into the same receptacle."""
    movable = _movable(context)
    for first in movable:
        for receptacle in receptacles_for(context, first, {first.id, first.parent}):
            joining = [each for each in movable if _may_join(each, first, receptacle)]
            near = (each for each in context.shuffled(joining) if _is_near(context, first, each, receptacle))
            second = next(near, None)
            if second is not None and _has_room(context, receptacle, first, second):
                roles = {"target": first, "second": second, "receptacle": receptacle}
                ends = _at(first, receptacle), _at(second, receptacle)
                facts = _held(first), ends[0], _held(second), ends[1]
                yield SequencePlan("two_to_one", Setup(), roles, facts, ends)


def _may_join(second: Thing, first: Thing, receptacle: Thing) -> bool:
    """Return whether a second object may be put at the receptacle to which the first object is moved."""
    taken = (first.id, receptacle.id)
    is_free = second.id not in (*taken, first.parent) and second.parent not in taken
    is_odd = receptacle.category in PUT_INTO and second.category not in PUT_INTO[receptacle.category]
    return is_free and not is_odd and _suits(receptacle, second)


def put_and_close(context: HouseContext) -> Plans:
    """Yield plans in which a container is opened, an object is put into it, and the container is closed."""
    for container in context.things(lambda thing: thing.category in BELONGS_IN and thing.is_openable):
        for target in context.things(lambda thing, container=container: _may_go_in(container, thing)):
            if can_be_searched_for(context, target) and _is_near(context, container, target):
                roles = {"target": target, "receptacle": container}
                ends = _at(target, container, inside=True), _closed(container)
                facts = _opened(container), _held(target), *ends
                yield SequencePlan("put_and_close", _closed_setup(container), roles, facts, ends)


def take_and_close(context: HouseContext) -> Plans:
    """Yield plans in which an object is taken out of a container and put elsewhere, and the container is closed."""
    for container, target, setup in filled(context):
        taken = {container.id, container.parent, target.id, target.parent}
        for receptacle in receptacles_for(context, target, taken):
            if _is_near(context, container, receptacle) and _has_room(context, receptacle, target):
                roles = {"target": target, "container": container, "receptacle": receptacle}
                ends = _at(target, receptacle), _closed(container)
                facts = _opened(container), _held(target), *ends
                yield SequencePlan("take_and_close", setup, roles, facts, ends)


def swapping(context: HouseContext) -> Plans:
    """Yield plans in which two objects, each on a table or seat, change places."""
    movable = [each for each in _movable(context) if context.thing(each.parent or "").category in (*TABLES, *SEATS)]
    for first in movable:
        source = context.thing(first.parent or "")
        for second in movable:
            receptacle = context.thing(second.parent or "")
            if receptacle.id == source.id:
                continue
            can_change = _suits(receptacle, first) and _suits(source, second)
            can_change = can_change and _has_room(context, receptacle, first) and _has_room(context, source, second)
            if can_change and _is_near(context, source, receptacle):
                roles = {"target": first, "second": second, "source": source, "receptacle": receptacle}
                ends = _at(first, receptacle, inside=False), _at(second, source, inside=False)
                facts = _held(first), ends[0], _held(second), ends[1]
                yield SequencePlan("swap", Setup(), roles, facts, ends)
                break


def from_one_into_another(context: HouseContext) -> Plans:
    """Yield plans in which an object is moved from one closed container into another."""
    for container, target, setup in filled(context):
        others = context.things(lambda thing: thing.category in BELONGS_IN and thing.is_openable)
        for other in others[:TRIED_CONTAINERS]:
            is_apart = other.id != container.id and target.id != other.id
            is_within = floor_distance(container.position, other.position) <= CARRIED_M
            if is_apart and is_within and _may_go_in(other, target):
                both = Setup(objects={**setup.objects, **_closed_setup(other).objects})
                roles = {"target": target, "container": container, "receptacle": other}
                facts = _opened(other), _opened(container), _held(target), _at(target, other, inside=True)
                yield SequencePlan("out_of_into", both, roles, facts)
                break


def three_acts(context: HouseContext) -> Plans:
    """Yield plans in which two things are opened, closed or switched, and an object is put somewhere."""
    for target in _movable(context):
        for receptacle in receptacles_for(context, target, {target.id, target.parent})[:1]:
            found = [each for each in _errands(context) if each[0].id not in (receptacle.id, target.id, target.parent)]
            acts = [each for each in found if _is_near(context, target, each[0], receptacle)][:2]
            if len(acts) < 2 or not _has_room(context, receptacle, target):
                continue
            states = tuple(goal for thing, act in acts if isinstance(goal := goal_for(thing, act), ObjectInState))
            setup = Setup(objects={key: change for each in acts for key, change in setup_for(*each).objects.items()})
            roles = {"target": target, "receptacle": receptacle, "first": acts[0][0], "next": acts[1][0]}
            there = _at(target, receptacle)
            yield SequencePlan("three_acts", setup, roles, (*states, _held(target), there), (there, *states))


def _errands(context: HouseContext) -> list[tuple[Thing, Act]]:
    """Return things in a random order, at most one per category, each with an act that can be done to it."""
    chosen: dict[str, tuple[Thing, Act]] = {}
    for thing in context.things(lambda thing: is_target(thing) and thing.category not in NEVER_CHANGED):
        acts: list[Act] = [act for act in acts_for(thing) if act != "pick"]
        if acts and not thing.is_pickupable:
            chosen.setdefault(thing.category, (thing, acts[int(context.rng.integers(len(acts)))]))
    return list(chosen.values())


def _movable(context: HouseContext) -> list[Thing]:
    """Return, in a random order, the objects that rest on another thing and can be picked up."""
    return context.things(
        lambda thing: thing.is_pickupable and thing.parent is not None and can_be_searched_for(context, thing)
    )


def _may_hold(thing: Thing) -> bool:
    """Return whether people put objects into a thing, and the thing itself (not its drawers) has a surface inside."""
    is_container = thing.category in BELONGS_IN or thing.category in PUT_INTO
    return is_container and any(surface.is_inside for surface in thing.asset.surfaces)


def _may_go_in(container: Thing, thing: Thing) -> bool:
    """Return whether people would put a thing into a container, and the thing can be moved and is not in it yet."""
    suits = thing.category in (*BELONGS_IN.get(container.category, ()), *PUT_INTO.get(container.category, ()))
    return suits and can_be_put(thing, container)


def receptacles_for(context: HouseContext, target: Thing, without: set[str | None]) -> list[Thing]:
    """Return at most `TRIED_RECEPTACLES` things on or into which a target can be put, in a random order.

    `without` has the ids of things that must not be returned.
    """
    return context.things(lambda thing: thing.id not in without and _suits(thing, target))[:TRIED_RECEPTACLES]


def _suits(receptacle: Thing, target: Thing) -> bool:
    """Return whether people would put a target on or into a receptacle, and the receptacle can hold the target."""
    is_usual = receptacle.category in TABLES or (target.category in SOFT and receptacle.category in SEATS)
    is_usual = is_usual or target.category in PUT_INTO.get(receptacle.category, ())
    return receptacle.is_receptacle and is_usual and can_hold(receptacle, target)


def _has_room(context: HouseContext, receptacle: Thing, *things: Thing) -> bool:
    """Return whether objects are likely to fit on a receptacle in addition to the objects that lie there already."""
    level = [surface for surface, _ in level_surfaces(receptacle)]
    tops = [surface for surface in level if not surface.is_inside] or level
    there = children(context.view.scene, receptacle.id)
    free_m2 = sum(surface.size_x * surface.size_z for surface in tops) - sum(map(_area_m2, there))
    return free_m2 >= ROOM_FACTOR * sum(map(_area_m2, things))


def _area_m2(thing: Thing) -> float:
    return thing.asset.size.x * thing.asset.size.z


def _is_near(context: HouseContext, first: Thing, *others: Thing) -> bool:
    """Return whether the other things are in the same room as the first thing and at most `TOGETHER_M` from it."""
    room_at, home = context.view.room_at, context.view.room_at(first.position)
    return all(
        room_at(other.position) == home and floor_distance(first.position, other.position) <= TOGETHER_M
        for other in others
    )


def _closed_setup(container: Thing) -> Setup:
    return Setup(objects={container.id: ObjectSetup(openness=0.0)})


def _held(thing: Thing) -> ObjectHeld:
    return ObjectHeld(object_id=thing.id)


def _opened(thing: Thing) -> ObjectInState:
    return ObjectInState(object_id=thing.id, state="is_open")


def _closed(thing: Thing) -> ObjectInState:
    return ObjectInState(object_id=thing.id, state="is_open", value=False)


def _at(thing: Thing, receptacle: Thing, *, inside: bool | None = None) -> ObjectAtReceptacle:
    """Return the fact that a thing is inside or on a receptacle. If `inside` is None, it is inside the receptacles in
    `PUT_INTO`, and on all others."""
    is_inside = receptacle.category in PUT_INTO if inside is None else inside
    return ObjectAtReceptacle(object_id=thing.id, receptacle_id=receptacle.id, inside=is_inside)
