"""Disambiguation of look-alikes: phrases that mean only one of several things with the same name.

They use an attribute (the colour), the place (what the thing lies on), or a relation to a thing with a unique name.
"""

from collections.abc import Iterable, Iterator

from vigil.assets.catalog import CATALOG
from vigil.authoring.language.drawer_names import is_drawer
from vigil.authoring.language.referring import DescribedThing, Phrase, is_support_unambiguous, mentions, referents
from vigil.authoring.language.relations import gap_m

NEVER_ANCHORS = (
    *("Rug", "CeilingLamp", "LightSwitch", "StoveKnob", "Doorframe", "Doorway", "Blinds", "Curtains", "TowelHolder"),
    *("HandTowelHolder", "ToiletPaperHanger", "WallDecor", "RoomDecor", "Chair", "Stool", "Drawer"),
)
"""Categories that are too flat, too high, too numerous or too easily moved to say where another thing is."""
ANCHOR_M = 0.2
"""Minimum length (m) of the longest side of an anchor, e.g. of the desk in "the box next to the desk"."""
MIN_ANCHOR_SHARE = 0.7
"""Minimum length of an anchor, as a share of the length of the located thing: a lamp does not locate a desk."""
LARGE_M = 0.6
"""Minimum length (m) of the longest side of a landmark, which is an anchor for a whole room."""
LANDMARK_M = 3.0
"""Maximum gap (m) between a thing and its anchor."""
COVERING_FURNITURE = frozenset({"Desk", "DiningTable", "CoffeeTable", "SideTable", "Bed", "Sink"})
"""Categories of furniture under which other things may stand."""


def look_alikes(item: DescribedThing, items: Iterable[DescribedThing]) -> list[DescribedThing]:
    """Return the other things with exactly the same name as a thing.

    Things with a similar name are not included: people may mistake a cell phone for a remote control, but "the cell
    phone" is clear enough.
    """
    return [other for other in items if other.id != item.id and other.name == item.name]


def confusable(item: DescribedThing, items: Iterable[DescribedThing]) -> list[DescribedThing]:
    """Return the other things that a listener may think are meant if only the name of `item` is said."""
    return [other for other in referents(Phrase(item.name), items) if other.id != item.id]


def first_meaning(phrases: Iterable[Phrase], item: DescribedThing, items: Iterable[DescribedThing]) -> Phrase | None:
    """Return the first phrase in `phrases` that means only `item`; None if there is none."""
    everything = list(items)
    return next((phrase for phrase in phrases if referents(phrase, everything) == [item]), None)


def disambiguating_phrases(item: DescribedThing, items: Iterable[DescribedThing]) -> list[Phrase]:
    """Return the phrases that mean only this one of several look-alikes, by colour, by place or by a relation.

    The list is empty for a thing without look-alikes or with a misleading name. It is also empty for a drawer, because
    its name says to which furniture it belongs.
    """
    everything = list(items)
    if item.has_misleading_name or is_drawer(item.name) or not look_alikes(item, everything):
        return []
    names = [other.name for other in everything]
    return [phrase for phrase in _tried(item, everything) if _is_unambiguous(phrase, item, everything, names)]


def _is_unambiguous(phrase: Phrase, item: DescribedThing, items: list[DescribedThing], names: list[str]) -> bool:
    """Return whether a phrase means only `item`, and is recognized as the same phrase when read from a text."""
    if referents(phrase, items) != [item]:
        return False
    read = mentions(str(phrase), names)
    return (
        len(read) == 1
        and str(read[0].without_place) == str(phrase.without_place)
        and referents(read[0], items) == [item]
    )


def anchor_of(phrase: Phrase, items: Iterable[DescribedThing]) -> DescribedThing | None:
    """Return the anchor of a phrase: in "the box next to the desk", the desk. None if there is none or several."""
    found = [] if phrase.anchor is None else referents(Phrase(phrase.anchor), items)
    return found[0] if len(found) == 1 else None


def _tried(item: DescribedThing, items: list[DescribedThing]) -> Iterator[Phrase]:
    if item.colour is not None:
        yield Phrase(item.name, colour=item.colour)
    if item.support is not None and is_support_unambiguous(item.on_support, item, items):
        yield item.on_support
    for anchor in _anchors(item, items):
        is_landmark = _longest_m(anchor) >= LARGE_M
        if anchor.support_id == item.support_id:
            yield Phrase(item.name, relation="next to", anchor=anchor.name)
        if is_landmark:
            yield Phrase(item.name, relation="closest to", anchor=anchor.name)
        if anchor.category in COVERING_FURNITURE:
            yield Phrase(item.name, relation="under", anchor=anchor.name)


def _anchors(item: DescribedThing, items: list[DescribedThing]) -> Iterator[DescribedThing]:
    """Yield the possible anchors within `LANDMARK_M` whose name alone is unique, the nearest first."""
    box = item.box
    near = [
        (gap_m(box, other.box), other.id, other)
        for other in items
        if box is not None and other.box is not None and _may_be_anchor(item, other)
    ]
    for away_m, _, other in sorted(near, key=lambda found: found[:2]):
        if away_m <= LANDMARK_M and [each.id for each in referents(Phrase(other.name), items)] == [other.id]:
            yield other


def _may_be_anchor(item: DescribedThing, other: DescribedThing) -> bool:
    is_other = other.id not in (item.id, item.support_id) and other.support_id != item.id
    is_placed = other.room_id is not None and other.room_id == item.room_id
    is_known = other.category in CATALOG and other.category not in NEVER_ANCHORS and not other.has_misleading_name
    is_known = is_known and other.name != item.name
    return (
        is_other and is_placed and is_known and _longest_m(other) >= max(ANCHOR_M, MIN_ANCHOR_SHARE * _longest_m(item))
    )


def _longest_m(item: DescribedThing) -> float:
    return max(item.box.size) if item.box is not None else 0.0
