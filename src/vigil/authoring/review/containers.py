"""Containers: where a person would look for a thing, and whether it is found by opening one of them.

An instruction that does not say where a thing is can only be fair when it lies where such things are kept, and when
there are few enough places of that kind to look into.
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
"""Container -> what a person would look for in it."""
IN_BATHROOM_CABINETS = ("SoapBottle", "SprayBottle", "Cloth", "ToiletPaper", "Towel", "HandTowel", "TissueBox")
MAX_CLOSED = 4
"""Closed things that a search may have to open before the last of them shows the target: the budget of Search and
Interact allows each some five steps, and a walk between them."""
LOOKED_FOR_POINTS, EVERY_CELL = 16, 5
"""Points of a thing that are looked for from outside what it lies in, and of how many places one is tried: a pane shows
what is behind it to many."""


def belongs_in(container: Thing, room: str | None, thing: Thing) -> bool:
    """Whether a person would look for a thing in a container that stands in a room of this name."""
    is_in_bathroom = container.category == "Cabinet" and room == "bathroom"
    return thing.category in (IN_BATHROOM_CABINETS if is_in_bathroom else BELONGS_IN.get(container.category, ()))


def may_hold(view: PrivilegedView, items: dict[str, DescribedThing], target: Thing, room: str | None) -> list[str]:
    """Return the ids of the closed things in which a person would look for the target: in a room, or everywhere.

    What the target lies in is one of them in any case.
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
    """Return the room that an instruction about one thing names; None when it names none."""
    return next((phrase.room for phrase in phrases if phrase.room is not None), None)


def not_found_by_opening(
    view: PrivilegedView, items: dict[str, DescribedThing], target: Thing, phrases: list[Phrase]
) -> Iterator[str]:
    """Yield why a target need not be found by opening something, or cannot fairly be; `phrases` are those said."""
    around = closed_containers_around(view, target.id)
    if not around:
        yield f"{target.id!r} lies in nothing closed"
        return
    for name in around:
        if not belongs_in(view.scene.things[name], items[name].room, target):
            yield f"nobody would look for {target.id!r} in {name!r}"
    if any(phrase.support is not None or phrase.relation is not None for phrase in phrases):
        yield "the instruction says where it lies"
    closed = may_hold(view, items, target, room_mentioned(phrases))
    if len(closed) > MAX_CLOSED:
        yield f"{len(closed)} closed things may hold it, at most {MAX_CLOSED} can be searched: {', '.join(closed)}"
    if (place := visible_through_glass_from(view, target)) is not None:
        yield f"it is seen through glass from ({place.x:.2f}, {place.z:.2f}) before anything is opened"


def visible_through_glass_from(view: PrivilegedView, target: Thing) -> Vec3 | None:
    """Return a free place within reach of a thing from which it is seen as things stand; None without one."""
    points = surface_points(target, LOOKED_FOR_POINTS)
    cells = view.plan().cells[::EVERY_CELL]
    for x, z in cells[box_distances(body_box(target), cells) <= REACH_M]:
        place = Vec3(float(x), view.agent.position.y, float(z))
        if np.any(view.sees(Pose(position=place, rotation=0.0).eye, points, target.id, through_glass=True)):
            return place
    return None
