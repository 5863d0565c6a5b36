"""Phrases that distinguish things with the same name by their state, their size, or what lies on them.

Phrases with colour or place are in `vigil.authoring.language.referring`. For the phrases here, this module has the
wording and the function that reads them back.
"""

import re
from collections.abc import Iterable

from vigil.authoring.language.referring import DescribedThing, Phrase, referents
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.world import CLOSED_BELOW, OPEN_ABOVE
from vigil.scene.supports import children, surface_named
from vigil.scene.things import Thing

SIZE_RATIO, VOLUME_RATIO = 1.2, 1.6
"""Minimum ratios of the longest sides and of the volumes of two things at which the first is clearly larger."""
STATES = ("open", "closed", "burning", "not burning")


def by_size(name: str, *, is_larger: bool) -> str:
    """Return the phrase for the larger or the smaller of two things called `name`."""
    return f"the {'larger' if is_larger else 'smaller'} {name}"


def by_state(name: str, label: str) -> str:
    """Return the phrase for the thing called `name` that is in the state `label` (one of `STATES`)."""
    return f"the {name} that is {label}"


def by_bearing(name: str, other: str, *, is_inside: bool) -> str:
    """Return the phrase for the thing called `name` that has the thing called `other` inside it or on it."""
    return f"the {name} with the {other} {'in' if is_inside else 'on'} it"


def referents_in(instruction: str, items: Iterable[DescribedThing], view: PrivilegedView) -> set[str]:
    """Return the ids of the things that an instruction means by a phrase of this module; empty if it has none."""
    everything, things = list(items), view.scene.things
    names = "|".join(re.escape(name) for name in sorted({item.name for item in everything}, key=lambda n: (-len(n), n)))
    if found := re.search(rf"\bthe (?P<which>larger|smaller) (?P<name>{names})\b", instruction):
        named = _named(found["name"], everything, things)
        sized = sorted(named, key=_volume)
        if len(sized) != 2 or not is_clearly_larger(sized[1], sized[0]):
            return {thing.id for thing in named}
        return {sized[-1 if found["which"] == "larger" else 0].id}
    if found := re.search(rf"\bthe (?P<name>{names}) that is (?P<label>{'|'.join(STATES)})\b", instruction):
        named = _named(found["name"], everything, things)
        return {thing.id for thing in named if is_in_state(thing, found["label"])}
    if found := re.search(rf"\bthe (?P<name>{names}) with the (?P<other>{names}) (?:in|on) it\b", instruction):
        named = _named(found["name"], everything, things)
        borne = {each.id for each in referents(Phrase(found["other"]), everything)}
        return {thing.id for thing in named if borne & {child.id for child in children(view.scene, thing.id)}}
    return set()


def _named(name: str, items: list[DescribedThing], things: dict[str, Thing]) -> list[Thing]:
    return [things[item.id] for item in referents(Phrase(name), items)]


def is_clearly_larger(thing: Thing, other: Thing) -> bool:
    """Return whether a thing is larger than another by at least `SIZE_RATIO` and `VOLUME_RATIO`."""
    longer = max(thing.asset.size) >= SIZE_RATIO * max(other.asset.size)
    return longer and _volume(thing) >= VOLUME_RATIO * _volume(other)


def _volume(thing: Thing) -> float:
    x, y, z = thing.asset.size
    return x * y * z


def is_in_state(thing: Thing, label: str) -> bool:
    """Return whether `label` (one of `STATES`) describes a thing in its current state."""
    if label in ("burning", "not burning"):
        return thing.is_toggleable and thing.is_toggled == (label == "burning")
    if not thing.is_openable:
        return False
    return thing.openness >= CLOSED_BELOW if label == "open" else thing.openness <= OPEN_ABOVE


def is_inside_of(child: Thing, parent: Thing) -> bool:
    """Return whether a thing lies inside another thing, not on top of it."""
    surface = surface_named(parent, child.surface)
    return surface is not None and surface.is_inside
