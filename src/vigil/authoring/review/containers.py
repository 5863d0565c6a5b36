"""Containers: where people would look for an object, and whether it is fair to search for it by opening containers.

If the instruction does not say where an object is, the search is fair only if people would look for the object in its
container, and if there are only a few containers in which they would look.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from vigil.authoring.language.referring import DescribedThing, Phrase
from vigil.authoring.solving.goal_actions import closed_containers_around
from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.actions import REACH_M
from vigil.protocol.world import OPEN_ABOVE
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.things import Thing

BELONGS_IN = {
    "Fridge": ("Apple", "Tomato", "Lettuce", "Egg", "Bottle", "WineBottle", "Potato", "Bread", "Bowl", "Plate"),
    "Microwave": ("Mug", "Bowl", "Plate", "Potato", "Cup"),
    "Cabinet": ("Plate", "Bowl", "Cup", "Mug", "Pot", "SoapBottle", "SprayBottle", "Cloth", "Bottle"),
    "Safe": ("Watch", "KeyChain", "CreditCard", "CellPhone", "CD"),
    "Box": ("Book", "TeddyBear", "CD", "RemoteControl", "TissueBox", "KeyChain", "AlarmClock", "Statue", "Vase"),
    "LaundryHamper": ("Towel", "HandTowel", "Cloth"),
    "WashingMachine": ("Towel", "HandTowel", "Cloth"),
    "ClothesDryer": ("Towel", "HandTowel", "Cloth"),
    "Drawer": (
        "Pen",
        "Pencil",
        "KeyChain",
        "Watch",
        "CellPhone",
        "CD",
        "RemoteControl",
        "CreditCard",
        "Book",
        "AlarmClock",
        "Candle",
    ),
}
"""Category of a container -> categories of things that people would look for in it."""
IN_BATHROOM_CABINETS = ("SoapBottle", "SprayBottle", "Cloth", "ToiletPaper", "Towel", "HandTowel", "TissueBox")
"""Categories that people would look for in a cabinet in a bathroom. They replace the categories for other cabinets."""
MAX_CLOSED = 4
"""Maximum number of closed containers that may hold the target of a search, so that the step budget is enough."""
LOOKED_FOR_POINTS, EVERY_CELL = 16, 5
"""Number of an object's points whose visibility through glass is tested, and step through the places from which it is
tested. One place in five is enough, because what is behind glass is visible from many places."""


def belongs_in(container: Thing, room: str | None, thing: Thing) -> bool:
    """Return whether people would look for a thing in a container, which is in a room called `room`."""
    is_in_bathroom = container.category == "Cabinet" and room == "bathroom"
    return thing.category in (IN_BATHROOM_CABINETS if is_in_bathroom else BELONGS_IN.get(container.category, ()))


def may_hold(view: PrivilegedView, items: dict[str, DescribedThing], target: Thing, room: str | None) -> list[str]:
    """Return the ids of closed containers in a room (None: anywhere) in which people would look for the target.

    The closed containers in which the target lies are always included.
    """
    around = set(closed_containers_around(view, target.id))
    found: list[str] = []
    for thing in view.scene.things.values():
        item = items.get(thing.id)
        if item is None or thing.id == target.id or not thing.is_openable or thing.openness > OPEN_ABOVE:
            continue
        is_likely = belongs_in(thing, item.room, target) and (room is None or item.room == room)
        if thing.id in around or is_likely:
            found.append(thing.id)
    return found


def room_mentioned(phrases: Iterable[Phrase]) -> str | None:
    """Return the first room that is named in an instruction's phrases; None if no room is named."""
    return next((phrase.room for phrase in phrases if phrase.room is not None), None)


def not_found_by_opening(
    view: PrivilegedView,
    items: dict[str, DescribedThing],
    target: Thing,
    phrases: list[Phrase],
    max_closed: int,
) -> Iterator[str]:
    """Yield messages if the target can be found without opening containers, or if the search in containers is unfair.

    `phrases` are the phrases of the instruction; `max_closed` closed containers may hold the target.
    """
    around = closed_containers_around(view, target.id)
    if not around:
        yield f"{target.id!r} does not lie in a closed container"
        return
    for name in around:
        if not belongs_in(view.scene.things[name], items[name].room, target):
            yield f"people would not look for {target.id!r} in {name!r}"
    if any(phrase.support is not None or phrase.relation is not None for phrase in phrases):
        yield "the instruction says where the target lies"
    closed = may_hold(view, items, target, room_mentioned(phrases))
    if len(closed) > max_closed:
        yield f"{len(closed)} closed containers may hold it, at most {max_closed} may: {', '.join(closed)}"
    if (place := visible_through_glass_from(view, target)) is not None:
        yield f"the target is visible through glass from ({place.x:.2f}, {place.z:.2f}) without opening anything"


def visible_through_glass_from(view: PrivilegedView, target: Thing) -> Vec3 | None:
    """Return a free place within reach of a thing from which the thing is visible now; None if there is none.

    No place is tried if the thing lies in shut containers without glass.
    """
    around = [view.scene.things[name] for name in view.state_of(target.id).inside]
    is_shut = any(each.is_openable for each in around) and all(each.openness == 0.0 for each in around)
    if is_shut and not any(each.asset.has_glass for each in around):
        return None
    points = surface_points(target, LOOKED_FOR_POINTS)
    cells = view.plan().cells[::EVERY_CELL]
    for x, z in cells[box_distances(body_box(target), cells) <= REACH_M]:
        place = Vec3(float(x), view.agent.position.y, float(z))
        if np.any(view.sees(Pose(position=place, rotation=0.0).eye, points, target.id, through_glass=True)):
            return place
    return None
