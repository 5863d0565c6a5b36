"""Where a thing is placed in the room of an exhibit (a scene that shows this thing), and which other things are shown
with it. The catalogue says which place is the likeliest for a category.

Some things stand on the floor, mostly against a wall. Some rest on another thing (the host), which is shown with them
and may have a host itself: a faucet on the rim of a basin on a counter, a towel over its rail, a burner on a stove.
Other things hang on the wall or from the ceiling. Curtains and blinds hang in front of a window.
"""

import numpy as np

from vigil.assets.catalog import CATALOG, CEILING, FLOOR, WALL
from vigil.assets.kernel.asset import Asset, Surface
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.scene.things import Thing

MIDDLE_M, HEIGHT_M = 3.5, 2.6
"""x (m) at which things are placed along the wall z = 0, and height (m) of the room."""
OPENINGS = frozenset({"Doorway", "Doorframe", "Window"})
CARRIERS = frozenset(
    {"CounterTop", "DiningTable", "CoffeeTable", "SideTable", "Desk", "Dresser", "TVStand", "Bed", "Toilet"}
)
"""Categories of hosts whose tops carry the shown thing."""
RAILS = {"TowelHolder": 0.5, "HandTowelHolder": 0.05}
"""Category of a host over which towels hang -> height of its bar as a share of its whole height."""
HOSTS = CARRIERS | RAILS.keys() | {"Sink", "Stove"}
COMPANIONS = {"Sink": "Faucet", "ShowerHead": "Bathtub", "Blinds": "Window", "Curtains": "Window"}
"""Category -> category of another thing that is shown with it, although neither carries the other."""
FREE_STANDING = frozenset({"Rug", "CoffeeTable", "DiningTable", "Chair", "Stool", "Ottoman", "Footstool", "DogBed"})
LENGTHWISE = 1.2
"""A thing that can be carried is turned sideways to the viewer if it is at least this many times as deep as wide. Seen
from its end, it could not be recognised."""
FREE_STANDING_Z_M, CEILING_Z_M, WALL_GAP_M, EDGE_M = 1.2, 1.3, 0.015, 0.05
FREE_YAW_DEG, LYING_YAW_DEG = 25.0, 30.0
USUAL_MIDDLE_M = 1.4
"""Height (m) of the middle of a thing on a wall, unless its category has another height."""
_MIDDLES = {"LightSwitch": 1.1, "ToiletPaperHanger": 0.75, "Shelf": 1.2, "HandTowelHolder": 1.2, "TowelHolder": 1.2}
_MIDDLES |= {"Window": 1.45}
_TOPS = {"Curtains": 2.35, "ShowerHead": 2.1, "Blinds": 2.05}
KNOB_SHARE, KNOB_ASIDE = 0.91, 0.1
"""Place of an extra knob between a stove's own knobs: height as a share of the stove's height, and distance from the
stove's middle as a share of the stove's width."""
BURNER_AT = (-0.255, 0.268)
"""Middle (x, z) of a stove's large front plate, measured from the hob's middle in shares of the hob's sides."""
ROD_M, CLOTH_M = 0.013, 0.004
"""Radius (m) of a rail's rod, and thickness (m) of a towel on it."""
_WINDOW_WIDE, _WINDOW_HIGH, _WINDOW_HIGHEST_M, _WINDOW_DEEP_M = 0.8, 0.85, 1.1, 0.09
_LINTEL_M, _BEFORE_WINDOW_M = 0.08, 0.05


def place(thing: Thing, rng: np.random.Generator) -> list[Thing]:
    """Put a thing at its typical place in the middle of the wall z = 0.

    Return the chain of its hosts: the thing's host, the host's own host, and so on; empty if the thing has no host.
    """
    where = host_of(thing.category)
    if where in (FLOOR, WALL, CEILING):
        _into_room(thing, where, rng)
        return []
    host = _usual(where, rng)
    if host_of(where) == FLOOR:
        _against_wall(host)
        below = []
    else:
        below = place(host, rng)
    _onto(thing, host, rng)
    return [host, *below]


def companions(thing: Thing, rng: np.random.Generator) -> list[Thing]:
    """Return the things that are shown together with a placed thing but do not carry it."""
    category = COMPANIONS.get(thing.category)
    if category is None:
        return []
    if category == "Window":
        return [_window_behind(thing, rng)]
    other = _usual(category, rng)
    if host_of(category) == thing.category:
        _onto(other, thing, rng)
    else:
        _against_wall(other)
    return [other]


def host_of(category: str) -> str:
    """Return the likeliest place of a category: the category of its host, or "Floor", "Wall" or "Ceiling"."""
    known = HOSTS | {FLOOR, WALL, CEILING}
    return next((place for place in CATALOG[category].rests_on if place in known), FLOOR)


def _usual(category: str, rng: np.random.Generator) -> Thing:
    """Return a thing of a category in a random variant and the category's usual size; its id is the category's name."""
    asset = make(category, CATALOG[category].typical_size, int(rng.integers(1000)))
    return Thing(category, category, asset, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))


def _into_room(thing: Thing, where: str, rng: np.random.Generator) -> None:
    size = thing.asset.size
    if where == CEILING:
        thing.position = Vec3(MIDDLE_M, HEIGHT_M - size.y / 2, CEILING_Z_M)
    elif thing.category in OPENINGS:
        thing.position = Vec3(MIDDLE_M, _MIDDLES.get(thing.category, size.y / 2), 0.0)
    elif where == WALL:
        thing.position = Vec3(MIDDLE_M, _middle(thing), size.z / 2)
    elif thing.category in FREE_STANDING:
        thing.position = Vec3(MIDDLE_M, size.y / 2, FREE_STANDING_Z_M + size.z / 2)
        thing.rotation = Vec3(0.0, _yaw(thing, FREE_YAW_DEG, rng), 0.0)
    else:
        _against_wall(thing)
        thing.rotation = Vec3(0.0, _yaw(thing, 0.0, rng), 0.0)


def _against_wall(thing: Thing) -> None:
    size = thing.asset.size
    thing.position = Vec3(MIDDLE_M, size.y / 2, WALL_GAP_M + size.z / 2)


def _middle(thing: Thing) -> float:
    top = _TOPS.get(thing.category)
    return _MIDDLES.get(thing.category, USUAL_MIDDLE_M) if top is None else top - thing.asset.size.y / 2


def _onto(thing: Thing, host: Thing, rng: np.random.Generator) -> None:
    """Put a thing on or over its host (the thing that carries it), which is already placed."""
    if host.category in RAILS:
        thing.position = _over_bar(thing.asset, host)
    elif host.category == "Stove" and thing.category == "StoveKnob":
        thing.position = _at_front(thing.asset, host)
    elif host.category == "Stove":
        hob = _top(host.asset, thing.asset.size.y)
        thing.position = _on_surface(thing.asset, host, hob, BURNER_AT[0] * hob.size_x, BURNER_AT[1] * hob.size_z)
    elif host.category == "Sink":
        rim = next(surface for surface in host.asset.surfaces if surface.name == "rim")
        back = -host.asset.size.z / 2 + thing.asset.size.z / 2
        thing.position = _on_surface(thing.asset, host, rim, 0.0, back - rim.center.z)
    else:
        top = _top(host.asset, thing.asset.size.y)
        forward = max(0.0, top.size_z / 2 - thing.asset.size.z / 2 - EDGE_M) if host.category != "Bed" else 0.0
        thing.position = _on_surface(thing.asset, host, top, 0.0, forward)
        thing.rotation = Vec3(0.0, _yaw(thing, 0.0 if thing.category == "Sink" else LYING_YAW_DEG, rng), 0.0)


def _on_surface(asset: Asset, host: Thing, surface: Surface, aside: float, forward: float) -> Vec3:
    """Return the position of an asset on a host's surface, `aside` and `forward` metres from the surface's middle."""
    x, y, z = np.array(host.position) + np.array(surface.center)
    return Vec3(float(x) + aside, float(y) + asset.size.y / 2, float(z) + forward)


def _top(asset: Asset, height: float) -> Surface:
    """Return the highest surface that is not behind a door and has more free height than `height`. Of several surfaces
    at this height, return the largest."""
    free = [surface for surface in asset.surfaces if not surface.needs_opening and surface.clearance > height]
    return max(free, key=lambda surface: (round(surface.center.y, 1), surface.size_x * surface.size_z))


def _over_bar(towel: Asset, rail: Thing) -> Vec3:
    """Return the position of a towel that hangs over a rail's bar.

    The bar is at the rail's front, between the two halves of the towel.
    """
    size = rail.asset.size
    bar = rail.position.y + (RAILS[rail.category] - 0.5) * size.y
    return Vec3(rail.position.x, bar + ROD_M + CLOTH_M - towel.size.y / 2, rail.position.z + size.z / 2)


def _at_front(knob: Asset, stove: Thing) -> Vec3:
    size = stove.asset.size
    z = stove.position.z + _front_of(stove.asset, KNOB_SHARE) + knob.size.z / 2
    return Vec3(stove.position.x + KNOB_ASIDE * size.x, KNOB_SHARE * size.y, z)


def _front_of(asset: Asset, share: float) -> float:
    """Return how far forward (z, asset's frame) an asset reaches at `share` times the asset's height."""
    height = (share - 0.5) * asset.size.y
    reach = [solid.polygon for solid in asset.solids if solid.bottom <= height <= solid.top]
    return max((z for polygon in reach for _, z in polygon), default=asset.size.z / 2)


def _yaw(thing: Thing, up_to_deg: float, rng: np.random.Generator) -> float:
    """Return a random yaw of at most `up_to_deg`, so that a thing faces the viewer; a long thing gets a larger yaw."""
    size, sign = thing.asset.size, float(rng.choice([-1.0, 1.0]))
    if CATALOG[thing.category].is_pickupable and size.z > LENGTHWISE * size.x:
        return sign * float(rng.uniform(40.0, 75.0))
    return sign * float(rng.uniform(0.0, up_to_deg))


def _window_behind(thing: Thing, rng: np.random.Generator) -> Thing:
    """Return a window for a thing that hangs in front of a window, and move the thing away from the wall."""
    size = thing.asset.size
    width, height = _WINDOW_WIDE * size.x, min(_WINDOW_HIGHEST_M, _WINDOW_HIGH * size.y)
    asset = make("Window", Vec3(width, height, _WINDOW_DEEP_M), int(rng.integers(1000)))
    middle = Vec3(MIDDLE_M, thing.position.y + size.y / 2 - _LINTEL_M - height / 2, 0.0)
    thing.position = Vec3(middle.x, thing.position.y, _BEFORE_WINDOW_M + size.z / 2)
    return Thing("Window", "Window", asset, middle, Vec3(0.0, 0.0, 0.0), is_structure=True)
