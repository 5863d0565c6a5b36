"""Proposals of sequences (SM): open a container, take an object out of it, put an object on or into a receptacle.

Longer sequences are in `vigil.authoring.drafting.chains`.
"""

from collections.abc import Iterator
from functools import partial

from vigil.assets.catalog import CATALOG
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.drafting.proposals import CLEAR_PX, Drafts, can_be_searched_for, is_seen, is_target
from vigil.authoring.language.referring import Phrase
from vigil.authoring.language.wording import opening_phrase, pronoun_slots, say, sequence_forms
from vigil.authoring.review.containers import BELONGS_IN, belongs_in
from vigil.protocol.episode import Episode
from vigil.protocol.family import DEFAULT_HORIZON_DEG
from vigil.protocol.goals import Goal, ObjectAtReceptacle, ObjectHeld, ObjectInState
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.supports import is_level, surface_frame, surface_named
from vigil.scene.things import Thing

START_AWAY_M = (0.7, 4.0)
"""Distances (m) from the first object to act on between which an episode starts."""
TRIED_CONTENTS = 3
"""Number of objects tried as the content of each container."""
TRIED_RECEPTACLES = 3
MOVED = ("target", "second")
"""Roles of objects that are moved; naming their present room could be read as naming their destination."""
TABLES = ("CounterTop", "DiningTable", "CoffeeTable", "Desk", "SideTable", "Dresser", "TVStand", "Cart")
SEATS = ("Sofa", "Bed", "ArmChair", "Ottoman", "Chair", "Stool")
SOFT = frozenset(
    (
        "Pillow",
        "TeddyBear",
        "Towel",
        "HandTowel",
        "Cloth",
        "Book",
        "Newspaper",
        "Laptop",
        "RemoteControl",
        "TennisRacket",
    )
)
"""Categories that people put on a seat as well as on a table."""
FOOD = ("Apple", "Tomato", "Potato", "Egg", "Bread", "Lettuce")
WARE = ("Plate", "Bowl", "Cup", "Mug", "Fork", "Spoon", "Knife", "ButterKnife", "Spatula", "Ladle", "Pot", "Pan")
PUT_INTO = {
    "Sink": (*WARE, "DishSponge", "Apple", "Tomato", "Potato", "Lettuce"),
    "GarbageCan": (*FOOD, "Newspaper", "AluminumFoil", "PaperTowelRoll", "ToiletPaper", "TissueBox", "Bottle"),
    "Bowl": ("Apple", "Egg", "Potato", "Tomato", "Spoon"),
    "Bathtub": ("Towel", "SoapBottle", "SoapBar", "Cloth", "SprayBottle"),
}
"""Receptacle without a door or lid -> categories that people put into it."""


def revealing(context: HouseContext) -> Drafts:
    """Yield `reveal_pick` drafts: open a container and take out an object."""
    for container, inside, setup in filled(context):
        yield from _draft(context, "reveal_pick", setup, container, {"container": container, "target": inside})


def emptying(context: HouseContext) -> Drafts:
    """Yield `open_pick_place` drafts: open a container, take out an object, put it on or into a receptacle."""
    for container, inside, setup in filled(context):
        furniture = container.parent if container.is_drawer else None
        for receptacle in receptacles_for(context, inside, {container.id, furniture, inside.id, inside.parent}):
            roles = {"container": container, "target": inside, "receptacle": receptacle}
            yield from _draft(context, "open_pick_place", setup, container, roles)


def putting_in(context: HouseContext) -> Drafts:
    """Yield `put_into` drafts: take an object and put it into a container, which is opened first if it can be."""
    for container in context.things(_may_hold):
        setup = Setup(objects={container.id: ObjectSetup(openness=0.0)}) if container.is_openable else Setup()
        for target in context.things(partial(may_go_in, container)):
            if not can_be_searched_for(context, target):
                continue
            first = container if container.is_openable else target
            yield from _draft(context, "put_into", setup, first, {"target": target, "receptacle": container})


def rearranging(context: HouseContext) -> Drafts:
    """Yield `rearrange` drafts: take an object from one receptacle and put it on or into another."""
    for target in context.things(lambda thing: thing.is_pickupable and is_target(thing) and thing.parent is not None):
        source = context.thing(target.parent or "")
        if source.category not in (*TABLES, *SEATS):
            continue
        for receptacle in receptacles_for(context, target, {source.id, target.id}):
            roles = {"target": target, "source": source, "receptacle": receptacle}
            yield from _draft(context, "rearrange", Setup(), target, roles)


def _draft(
    context: HouseContext, template: str, setup: Setup, first: Thing, roles: dict[str, Thing]
) -> Iterator[Episode]:
    """Yield one draft, or none if no start pose or no words are found."""
    if not context.can_begin(setup):
        return
    phrases = {role: context.phrase(thing.id) for role, thing in roles.items()}
    named = {role: phrase for role, phrase in phrases.items() if phrase is not None}
    is_sayable = len(named) == len(phrases) and not is_wordy(named)
    start = context.start_seeing(first, START_AWAY_M, DEFAULT_HORIZON_DEG, is_seen(CLEAR_PX)) if is_sayable else None
    context.begin(Setup())
    if start is None:
        return
    receptacle = roles.get("receptacle")
    leaf = receptacle if template == "put_into" and receptacle and receptacle.is_openable else roles.get("container")
    inside = receptacle is not None and (template == "put_into" or receptacle.category in PUT_INTO)
    key = "put_into_closed" if leaf is not None and leaf is receptacle else template
    sentences = sequence_forms(key, context.forms, inside=inside)
    words = {role: str(phrase) for role, phrase in named.items()}
    words |= pronoun_slots(roles["target"].category, "target_")
    if leaf is not None:
        role = next(role for role, thing in roles.items() if thing is leaf)
        words |= opening_phrase(leaf.category, words[role]).slots()
    words |= {"into": "into", "in_": _place_word(named.get("receptacle"))} if inside else {"into": "on", "in_": "on"}
    yield context.draft(
        "SM",
        TaskSpec(
            start=start,
            setup=setup,
            instruction=say(sentences, context.rng, **words),
            goal=_goal(roles["target"], receptacle, leaf, inside=inside),
            bindings={role: thing.id for role, thing in roles.items()},
            template=template,
        ),
    )


def is_wordy(phrases: dict[str, Phrase]) -> bool:
    """Return whether phrases (by role) are too much for one sentence.

    They are if one names a support, one of a moved object names its room, or two name the same room.
    """
    rooms = [phrase.room for phrase in phrases.values() if phrase.room is not None]
    is_placed = any(phrase.support is not None for phrase in phrases.values())
    is_moved = any(phrases[role].room is not None for role in MOVED if role in phrases)
    return is_placed or is_moved or len(set(rooms)) < len(rooms)


def _place_word(receptacle: Phrase | None) -> str:
    """Return the word for placing an object in a receptacle, which avoids "in the sink in the kitchen"."""
    return "into" if receptacle is not None and receptacle.room else "in"


def _goal(target: Thing, receptacle: Thing | None, leaf: Thing | None, *, inside: bool) -> Goal:
    first = (ObjectInState(object_id=leaf.id, state="is_open"),) if leaf is not None else ()
    if receptacle is None:
        return ObjectHeld(object_id=target.id, chain=first)
    held = ObjectHeld(object_id=target.id)
    return ObjectAtReceptacle(object_id=target.id, receptacle_id=receptacle.id, inside=inside, chain=(*first, held))


def filled(context: HouseContext) -> Iterator[tuple[Thing, Thing, Setup]]:
    """Yield containers, each with an object and a setup in which the container is closed and holds the object.

    The setup places the object inside unless it lies there already.
    """
    for container in context.things(lambda thing: thing.is_openable and thing.category in BELONGS_IN):
        shut = {container.id: ObjectSetup(openness=0.0)}
        belongs = partial(belongs_in, container, context.items[container.id].room)
        for thing in context.things(belongs)[:TRIED_CONTENTS]:
            if _lies_in(container, thing):
                yield container, thing, Setup(objects=shut)
            elif (placement := _place_inside(thing, container)) is not None:
                yield container, thing, Setup(objects={**shut, thing.id: ObjectSetup(placement=placement)})


def _lies_in(container: Thing, thing: Thing) -> bool:
    surface = surface_named(container, thing.surface) if thing.parent == container.id else None
    return surface is not None and surface.needs_opening and thing.is_pickupable


def _place_inside(thing: Thing, container: Thing) -> Placement | None:
    """Return a placement of a thing in the middle of a level surface inside a container; None if it fits on none."""
    size = thing.asset.size
    for surface in container.asset.surfaces:
        frame = surface_frame(container, surface, 0.0)
        fits = size.x <= surface.size_x and size.z <= surface.size_z and size.y <= surface.clearance
        if surface.needs_opening and fits and is_level(frame):
            point = frame.shift
            position = thing.position._replace(x=float(point[0]), y=float(point[1]) + size.y / 2, z=float(point[2]))
            rotation = container.rotation._replace(x=0.0, z=0.0)
            return Placement(position=position, rotation=rotation, parent=container.id)
    return None


def _may_hold(thing: Thing) -> bool:
    """Return whether people put objects into a thing, and it has a surface inside that is not in one of its drawers."""
    is_container = thing.category in BELONGS_IN or thing.category in PUT_INTO
    return is_container and any(surface.is_inside for surface in thing.asset.surfaces)


def may_go_in(container: Thing, thing: Thing) -> bool:
    """Return whether a person would put a thing into a container, where it is not yet, and the thing can be moved."""
    suits = thing.category in (*BELONGS_IN.get(container.category, ()), *PUT_INTO.get(container.category, ()))
    takes = CATALOG[container.category].can_hold(CATALOG[thing.category])
    return suits and takes and thing.is_pickupable and is_target(thing) and thing.parent != container.id


def receptacles_for(context: HouseContext, target: Thing, without: set[str | None]) -> list[Thing]:
    """Return at most `TRIED_RECEPTACLES` things on or into which a target can be put, in a random order.

    `without` are ids of things that are not wanted.
    """
    return context.things(lambda thing: thing.id not in without and suits(thing, target))[:TRIED_RECEPTACLES]


def suits(receptacle: Thing, target: Thing) -> bool:
    """Return whether a person would put a target on or into a receptacle, and the receptacle can hold it."""
    kind = CATALOG[target.category]
    is_usual = receptacle.category in TABLES or (target.category in SOFT and receptacle.category in SEATS)
    is_usual = is_usual or target.category in PUT_INTO.get(receptacle.category, ())
    return receptacle.is_receptacle and is_usual and CATALOG[receptacle.category].can_hold(kind)
