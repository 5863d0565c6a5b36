"""Referring expressions: phrases by which a person finds one particular thing, and their recognition in a text.

A phrase is the thing's name. A colour, a support, a room or a relation to another thing is added only if several things
have this name. A phrase fits each thing that a careful listener could take it for: "the bottle" also fits a wine
bottle, and "the mug" also fits a cup.
"""

import re
import threading
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter
from typing import Any

from cachetools import LRUCache, cached
from shapely import Point, Polygon

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.palette import COLOURS
from vigil.authoring.language import drawer_names
from vigil.authoring.language.appearance import (
    colour_shares,
    has_misleading_name,
    is_open_shelf,
    min_colour_share,
    names_by_appearance,
)
from vigil.authoring.language.relations import RELATIONS, LocatedThing
from vigil.base.geometry import Box, rotate_floor
from vigil.scene.geometry import body_box
from vigil.scene.outlines import room_floor
from vigil.scene.supports import drawers_of, surface_named
from vigil.scene.things import Scene, Thing

ROOM_NAMES = {"Kitchen": "kitchen", "LivingRoom": "living room", "Bedroom": "bedroom", "Bathroom": "bathroom"}

LOOK_ALIKES = (
    ("cup", "mug"),
    ("vase", "vase with branches", "house plant"),
    ("statue", "table ornament"),
    ("ottoman", "footstool", "stool"),
    ("desk", "dining table", "coffee table", "side table"),
    ("dresser", "TV stand", "cabinet"),
    ("towel", "hand towel"),
    ("salt shaker", "pepper shaker"),
    ("pen", "pencil"),
    ("knife", "butter knife"),
    ("toilet brush", "plunger"),
    ("box", "tissue box", "safe"),
    ("wall shelf", "shelving unit"),
    ("clothes dryer", "washing machine"),
    ("open doorway", "door"),
    ("pot", "kettle"),
    ("faucet", "shower head"),
    ("rug", "dog bed"),
    ("lettuce", "house plant"),
    ("remote control", "cell phone"),
)
"""Groups of names of things that people may mistake for each other."""

COLOUR_GROUPS = (
    ("white", "cream", "beige"),
    ("grey", "dark grey"),
    ("dark grey", "black", "navy"),
    ("brown", "beige", "orange"),
    ("red", "orange", "pink"),
    ("yellow", "orange", "cream"),
    ("green", "light green", "teal"),
    ("blue", "light blue", "teal", "navy"),
    ("purple", "pink", "navy"),
)

LAMPS = frozenset({"DeskLamp", "FloorLamp", "Candle"})
"""Categories whose light changes their colour, so that their colour is not used while they are on."""
UNCERTAIN_COLOURS = frozenset({"WineBottle", "Safe"})
"""Categories that are so dark that their colour is not used."""
SIDE_M = 0.3
"""Distance (m) from the middle of a door to the two points that show which rooms the door joins."""

_ON = r"(?: (?:that is|that stands|that lies|standing|lying|sitting))? (?:on|on a shelf of|in|inside) the "

DESCRIPTION_CACHE_SIZE = 32
"""Number of scene states whose descriptions are cached, because the same few states are used again and again."""

BETWEEN = " between "
"""Text in the name of a door, between "door" and the rooms that it joins."""
RoomOutlines = list[tuple[str, str | None, Polygon]]
"""Id, name and floor polygon of each room."""


@dataclass(frozen=True, slots=True)
class DescribedThing:
    """A thing in words: its name, its colours, what it rests on, and in which room it is."""

    id: str
    category: str
    name: str
    colours: tuple[str, ...] = ()
    room_id: str | None = None
    room: str | None = None
    support_id: str | None = None
    support: str | None = None
    is_inside: bool = False
    """Whether the thing lies inside its support, not on top of it."""
    is_on_shelf: bool = False
    """Whether the thing lies on an open shelf of its support."""
    alternative_names: tuple[str, ...] = ()
    """Other names that people who see the thing may use."""
    has_misleading_name: bool = False
    """Whether people would not use the thing's name where it is, e.g. "countertop" in a bathroom."""
    is_room_one: bool = True
    """Whether the name of the thing's room is unique in the home."""
    box: Box | None = None

    @property
    def colour(self) -> str | None:
        """The only colour of the thing; None if it has no colour or several."""
        return self.colours[0] if len(self.colours) == 1 else None

    @property
    def on_support(self) -> "Phrase":
        """The phrase that consists of the thing's name and its support, e.g. "the cup on the desk"."""
        return Phrase(self.name, support=self.support, is_inside=self.is_inside, is_on_shelf=self.is_on_shelf)


@dataclass(frozen=True, slots=True)
class Phrase:
    """The parts of a phrase such as "the red mug on the desk": name, colour, support, room, relation and anchor."""

    name: str
    colour: str | None = None
    support: str | None = None
    room: str | None = None
    is_inside: bool = False
    is_on_shelf: bool = False
    relation: str | None = None
    """Relation to the thing named `anchor`: a key of `RELATIONS`. None without a relation."""
    anchor: str | None = None

    @property
    def without_place(self) -> "Phrase":
        """The phrase that consists of only name and colour."""
        return Phrase(self.name, colour=self.colour)

    def __str__(self) -> str:
        text = f"the {self.colour} {self.name}" if self.colour else f"the {self.name}"
        if self.support:
            where = "on a shelf of" if self.is_on_shelf else "in" if self.is_inside else "on"
            text += f" {where} the {self.support}"
        if self.relation:
            text += f" {self.relation} the {self.anchor}"
        return f"{text} in the {self.room}" if self.room else text


def resolve_mentions(
    phrases: Sequence[Phrase], items: Iterable[DescribedThing], held: DescribedThing | None = None
) -> list[list[DescribedThing]]:
    """Return for each phrase of a text the things that it could mean, given the phrases before it.

    A phrase without a place may mean a thing that an earlier phrase identified, or the thing in the hand (`held`).
    """
    everything = list(items)
    found: list[list[DescribedThing]] = []
    named: dict[str, dict[str, DescribedThing]] = {}
    for phrase in phrases:
        meant = referents(phrase, everything)
        known = {name: item for name, item in named.get(phrase.name, {}).items() if fits(phrase, item)}
        if not known and held is not None and held in meant:
            known = {held.id: held}
        is_repeat = phrase == phrase.without_place and len(meant) > 1 and len(known) == 1
        found.append(list(known.values()) if is_repeat else meant)
        if len(found[-1]) == 1:
            named.setdefault(phrase.name, {})[found[-1][0].id] = found[-1][0]
    return found


def items_of(scene: Scene) -> dict[str, DescribedThing]:
    """Return id -> description of every present thing, in the scene's order, with the names of the catalogue."""
    return dict(_items_now(scene))


def items_as_seen(scene: Scene) -> dict[str, DescribedThing]:
    """Return id -> description of every present thing, in the scene's order, as people see the thing."""
    return dict(_items_as_seen_now(scene))


_description_facts = attrgetter("position", "rotation", "parent", "surface", "is_toggled", "is_present")
"""Function that returns the changeable facts about a thing that its description depends on."""


def description_key(scene: Scene) -> Hashable:
    """Return a cache key for a state of a scene. Two states with the same key have the same descriptions."""
    return scene, tuple(map(_description_facts, scene.things.values()))


@cached(LRUCache(DESCRIPTION_CACHE_SIZE), key=description_key, lock=threading.Lock())
def _items_now(scene: Scene) -> dict[str, DescribedThing]:
    rooms = [(room.id, ROOM_NAMES.get(room.room_type), room_floor(room)) for room in scene.rooms]
    return {thing.id: _item(scene, thing, rooms) for thing in scene.things.values() if thing.is_present}


@cached(LRUCache(DESCRIPTION_CACHE_SIZE), key=description_key, lock=threading.Lock())
def _items_as_seen_now(scene: Scene) -> dict[str, DescribedThing]:
    named = [ROOM_NAMES.get(room.room_type) for room in scene.rooms]
    twice = {name for name in named if name is not None and named.count(name) > 1}
    return {key: _seen(scene.things[key], item, twice, scene) for key, item in _items_now(scene).items()}


def _seen(thing: Thing, item: DescribedThing, twice: set[str], scene: Scene) -> DescribedThing:
    parent = scene.things.get(item.support_id or "")
    is_on_shelf = item.is_inside and parent is not None and is_open_shelf(parent, thing.surface)
    joined = item.name.partition(BETWEEN)[2]
    return replace(
        item,
        colours=tuple(colour for colour in item.colours if _is_seen_as(scene, thing, colour)),
        is_inside=item.is_inside and not is_on_shelf,
        is_on_shelf=is_on_shelf,
        alternative_names=names_by_appearance(thing),
        has_misleading_name=has_misleading_name(thing.category, item.room)
        or any(f"the {name}" in joined for name in twice),
        is_room_one=item.room not in twice,
    )


def _is_seen_as(scene: Scene, thing: Thing, colour: str) -> bool:
    """Return whether enough of a thing's visible area has a colour. A thing that is all glass may have any colour."""
    shares = colour_shares(thing.asset, *(part.asset for part in drawers_of(scene, thing)))
    alike = sum(share for word, share in shares.items() if _look_alike(colour, word))
    return not shares or alike >= min_colour_share(thing.category)


def _item(scene: Scene, thing: Thing, rooms: RoomOutlines) -> DescribedThing:
    room_id, room = _room_at(thing.position.x, thing.position.z, rooms)
    parent = scene.things.get(thing.parent or "")
    surface = surface_named(parent, thing.surface) if parent else None
    return DescribedThing(
        id=thing.id,
        category=thing.category,
        name=_name(scene, thing, rooms),
        colours=_colours(thing),
        room_id=room_id,
        room=room,
        support_id=parent.id if parent else None,
        support=_name(scene, parent, []) if parent else None,
        is_inside=surface is not None and surface.is_inside,
        box=body_box(thing),
    )


def _room_at(x: float, z: float, rooms: RoomOutlines) -> tuple[str | None, str | None]:
    place = Point(x, z)
    return next(((id_, name) for id_, name, floor in rooms if floor.covers(place)), (None, None))


def _name(scene: Scene, thing: Thing, rooms: RoomOutlines) -> str:
    """Return a thing's name. A door's name includes the rooms that it joins; a drawer's name includes its furniture."""
    if thing.is_drawer:
        return drawer_names.drawer_name(scene, thing)
    name = CATALOG[thing.category].display_name
    if not thing.is_structure or thing.category == "Window":
        return name
    shift_x, shift_z = rotate_floor(0.0, SIDE_M, thing.rotation.y)
    sides = [
        _room_at(thing.position.x + sign * shift_x, thing.position.z + sign * shift_z, rooms) for sign in (1.0, -1.0)
    ]
    (one_id, one), (other_id, other) = sides
    if one is None or other is None or one_id == other_id:
        return name
    first, second = sorted((one, other))
    return f"{name}{BETWEEN}the {first} and the {second}" if first != second else f"{name}{BETWEEN}two {first}s"


def _colours(thing: Thing) -> tuple[str, ...]:
    if thing.category in UNCERTAIN_COLOURS or (thing.category in LAMPS and thing.is_toggled):
        return ()
    return tuple(sorted(tag for tag in thing.asset.tags if tag in COLOURS))


def fits(phrase: Phrase, item: DescribedThing) -> bool:
    """Return whether a listener could understand `phrase` as `item`. The relation in the phrase is ignored."""
    return (
        _is_called(item, phrase.name)
        and (phrase.colour is None or not item.colours or any(_look_alike(phrase.colour, c) for c in item.colours))
        and (phrase.support is None or (item.support is not None and _support_fits(phrase.support, item.support)))
        and (phrase.room is None or phrase.room == item.room)
    )


def referents(phrase: Phrase, items: Iterable[DescribedThing]) -> list[DescribedThing]:
    """Return the items that a phrase could mean. If the phrase has a relation that does not clearly hold for exactly
    one item, all items that may be meant are returned."""
    everything = list(items)
    found = [item for item in everything if fits(phrase, item)]
    if phrase.relation is None or phrase.anchor is None:
        return found
    anchors = [_placed(item) for item in everything if _is_called(item, phrase.anchor)]
    if len(anchors) != 1 or len(found) < 2 or anchors[0] is None:
        return found
    others = [place for item in found if item.id != anchors[0].id and (place := _placed(item)) is not None]
    meant = RELATIONS[phrase.relation](others, anchors[0])
    return [item for item in found if item.id in meant]


def _is_called(item: DescribedThing, name: str) -> bool:
    return _names_fit(name, item.name) or name in item.alternative_names


def _placed(item: DescribedThing) -> LocatedThing | None:
    return None if item.box is None else LocatedThing(item.id, item.room_id, item.box)


def phrase_for(item: DescribedThing, items: Iterable[DescribedThing]) -> Phrase | None:
    """Return the shortest phrase that means only `item`; None if there is none, or if its name is misleading."""
    if item.has_misleading_name:
        return None
    others = [other for other in items if other.id != item.id]
    room = item.room if item.is_room_one else None
    candidates = [
        Phrase(item.name),
        Phrase(item.name, colour=item.colour),
        item.on_support,
        Phrase(item.name, room=room),
        replace(item.on_support, colour=item.colour),
        Phrase(item.name, colour=item.colour, room=room),
    ]
    return next(
        (
            phrase
            for phrase in candidates
            if not referents(phrase, others) and is_support_unambiguous(phrase, item, others)
        ),
        None,
    )


def mentions(text: str, names: Iterable[str]) -> list[Phrase]:
    """Return the phrases "the <colour> <name> (on|in the <support>) (next to the <anchor>) (in the <room>)" in a text.

    A name that only says where another thing is, or to what another thing belongs ("the door of the fridge"), is not
    counted as a phrase.
    """
    return [_phrase(found) for found in _pattern(names).finditer(text)]


def without_repeats(text: str, names: Iterable[str]) -> str:
    """Return a text in which, of several equal phrases, only the first says where the thing is.

    A later "the safe in the bedroom" becomes "the safe", unless another phrase in the text has the same name.
    """
    pattern = _pattern(names)
    said = {_phrase(found) for found in pattern.finditer(text)}
    seen: set[Phrase] = set()

    def short(found: re.Match[str]) -> str:
        phrase = _phrase(found)
        is_clear = all(other == phrase or other.name != phrase.name for other in said)
        if phrase not in seen or not is_clear:
            seen.add(phrase)
            return found[0]
        return found[0][0] + str(phrase.without_place)[1:]

    return pattern.sub(short, text)


def _phrase(found: re.Match[str]) -> Phrase:
    parts: dict[str, Any] = found.groupdict()
    return Phrase(**parts)


def _pattern(names: Iterable[str]) -> re.Pattern[str]:
    every = {name for full in names for name in (full, full.partition(BETWEEN)[0], drawer_names.without_position(full))}
    known = "|".join(re.escape(name) for name in sorted(every, key=lambda name: (-len(name), name)))
    colours = "|".join(sorted(COLOURS, key=lambda name: (-len(name), name)))
    rooms = "|".join(sorted(ROOM_NAMES.values()))
    return re.compile(
        rf"\b[Tt]he (?:(?P<colour>{colours}) )?(?P<name>{known})\b(?! of the )"
        rf"(?:{_ON}(?P<support>{known})\b)?(?: (?P<relation>{'|'.join(RELATIONS)}) the (?P<anchor>{known})\b)?"
        rf"(?:{_ON}(?P<room>{rooms})\b)?"
    )


def is_support_unambiguous(phrase: Phrase, item: DescribedThing, others: list[DescribedThing]) -> bool:
    """Return whether the support that a phrase names can only be the support of `item`."""
    if phrase.support is None or item.support_id is None:
        return phrase.support is None
    supports = [other for other in others if _names_fit(phrase.support, other.name)]
    return {other.id for other in supports} == {item.support_id}


def _support_fits(said: str, support: str) -> bool:
    """Return whether `said` names the support; if the support is a drawer, `said` may also name its furniture."""
    whole = drawer_names.furniture_name(support)
    return _names_fit(said, support) or (whole is not None and _names_fit(said, whole))


@lru_cache(maxsize=65536)
def _names_fit(said: str, name: str) -> bool:
    if drawer_names.is_drawer(said) or drawer_names.is_drawer(name):
        return drawer_names.could_mean_drawer(said, name, _names_fit)
    said_kind, _, said_where = said.partition(BETWEEN)
    kind, _, where = name.partition(BETWEEN)
    if said_where and said_where != where:
        return False
    if said_kind == kind or kind.endswith(f" {said_kind}"):
        return True
    return any(said_kind in group and kind in group for group in LOOK_ALIKES)


def _look_alike(said: str, colour: str) -> bool:
    return said == colour or any(said in group and colour in group for group in COLOUR_GROUPS)
