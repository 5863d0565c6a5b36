"""Exhibits: one thing standing where such things stand, in a plain room; a scene built by hand, no house.

Floor things stand on the floor against a wall, small things on the furniture that usually carries them, others hang on
the wall or from the ceiling; doors and windows fill a hole, curtains and blinds hang before a window.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from vigil.assets import make
from vigil.assets.catalog import CATALOG, CEILING, FLOOR, WALL
from vigil.assets.kernel.asset import Asset
from vigil.house import Color, MaterialRef
from vigil.pose import Vec3
from vigil.scene.things import Hole, RoomShape, Scene, Thing, WallPanel

State = Literal["open", "closed", "on", "off"]

SUBJECT = "subject"
WIDTH_M, DEPTH_M, HEIGHT_M, BEHIND_M = 7.0, 7.5, 2.6, 4.0
"""The room, and how deep the one behind its wall is, which is seen through a door."""
OPENINGS = frozenset({"Doorway", "Doorframe", "Window"})
BEFORE_WINDOWS = frozenset({"Blinds", "Curtains"})
FREE_STANDING = frozenset({"Rug", "CoffeeTable", "DiningTable", "Chair", "Stool", "Ottoman", "Footstool", "DogBed"})
CARRIERS = frozenset({"CounterTop", "DiningTable", "CoffeeTable", "SideTable", "Desk", "Dresser", "TVStand", "Bed"})
LENGTHWISE = 1.2
"""What is this much deeper than wide, and can be carried, lies turned: nobody would know it by its end."""
FREE_STANDING_Z_M, WALL_GAP_M, EDGE_M = 1.2, 0.015, 0.05
USUAL_MIDDLE_M = 1.4
"""Height of the middle of what hangs on a wall, and where that is another."""
_MIDDLES = {"LightSwitch": 1.1, "ToiletPaperHanger": 0.75, "Shelf": 1.2, "HandTowelHolder": 1.2, "TowelHolder": 1.2}
_TOPS = {"Curtains": 2.35, "ShowerHead": 2.1, "Blinds": 2.05}
KNOB_SHARE, KNOB_ASIDE = 0.91, 0.1
"""Height of a stove's knobs, as a share of the stove's, and how far from its middle one fits between them."""
_FLOORS = ("WoodFloorsCross", "WoodGrain_Tan", "WoodGrain_Brown", "GreyFloor 1", "planks/oak", "planks/walnut")
_WALLS = ((0.94, 0.93, 0.9), (0.91, 0.87, 0.79), (0.8, 0.86, 0.81), (0.76, 0.82, 0.88), (0.83, 0.8, 0.85))

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Subject:
    """What a picture shows."""

    category: str
    variant: int
    state: State | None = None
    """None for what can be neither opened nor switched."""

    @property
    def asset(self) -> Asset:
        """Its shape, at the category's usual size."""
        return make(self.category, CATALOG[self.category].typical_size, self.variant)


def states_of(asset: Asset) -> tuple[State | None, ...]:
    """Returns the states in which an asset can be seen; (None,) when it has but one."""
    row = CATALOG[asset.category]
    moves: tuple[State, ...] = ("closed", "open") if row.is_openable and asset.can_open else ()
    switches: tuple[State, ...] = ("off", "on") if row.is_toggleable else ()
    return (*moves, *(switches[1:] if moves else switches)) or (None,)


def exhibit(subject: Subject, rng: np.random.Generator) -> Scene:
    """Returns a room in which the subject stands; its thing has the id `SUBJECT`."""
    things = [_subject(subject)]
    where = _where(subject.category)
    if subject.category in OPENINGS:
        _hang(things[0], things[0].asset.size.y / 2 if subject.category != "Window" else 1.45, depth=0.0)
    elif where == WALL:
        _hang(things[0], _middle(things[0]), depth=things[0].asset.size.z)
        if subject.category in BEFORE_WINDOWS:
            things.append(_window_behind(things[0], rng))
    elif where == CEILING:
        things[0].position = Vec3(WIDTH_M / 2, HEIGHT_M - things[0].asset.size.y / 2, 1.3)
    elif where == FLOOR:
        _stand(things[0], rng)
    else:
        things.append(_carrier(where, things[0], rng))
        if subject.category == "Sink":
            things.append(_faucet_of(things[0], things[1], rng))
    holes = [_hole_of(thing) for thing in things if thing.is_structure]
    return _room(subject.category, holes, {thing.id: thing for thing in things}, rng)


def _subject(subject: Subject) -> Thing:
    asset = subject.asset
    shows_inside = any(part.bears_toggle and part.joint for part in asset.parts)
    return Thing(
        SUBJECT,
        subject.category,
        asset,
        Vec3(0.0, 0.0, 0.0),
        Vec3(0.0, 0.0, 0.0),
        openness=float(subject.state == "open" or (subject.state == "on" and shows_inside)),
        is_toggled=subject.state == "on",
        is_structure=subject.category in OPENINGS,
    )


def _where(category: str) -> str:
    """Returns the likeliest place of a category that an exhibit knows."""
    places = CATALOG[category].rests_on
    if places == ("Stove",):
        return "Stove"
    return next((place for place in places if place in CARRIERS or place in (FLOOR, WALL, CEILING)), FLOOR)


def _middle(thing: Thing) -> float:
    top = _TOPS.get(thing.category)
    return _MIDDLES.get(thing.category, USUAL_MIDDLE_M) if top is None else top - thing.asset.size.y / 2


def _hang(thing: Thing, middle: float, depth: float) -> None:
    thing.position = Vec3(WIDTH_M / 2, middle, depth / 2)


def _stand(thing: Thing, rng: np.random.Generator) -> None:
    size = thing.asset.size
    is_free = thing.category in FREE_STANDING
    z = FREE_STANDING_Z_M + size.z / 2 if is_free else WALL_GAP_M + size.z / 2
    thing.position = Vec3(WIDTH_M / 2, size.y / 2, z)
    thing.rotation = Vec3(0.0, _yaw(thing, 25.0 if is_free else 0.0, rng), 0.0)


def _window_behind(thing: Thing, rng: np.random.Generator) -> Thing:
    width, height = 0.8 * thing.asset.size.x, min(1.1, 0.85 * thing.asset.size.y)
    asset = make("Window", Vec3(width, height, 0.09), int(rng.integers(1000)))
    top = thing.position.y + thing.asset.size.y / 2
    middle = Vec3(WIDTH_M / 2, top - 0.08 - height / 2, 0.0)
    window = Thing("window", "Window", asset, middle, Vec3(0.0, 0.0, 0.0), is_structure=True)
    thing.position = Vec3(middle.x, thing.position.y, 0.05 + thing.asset.size.z / 2)
    return window


def _carrier(category: str, thing: Thing, rng: np.random.Generator) -> Thing:
    """Returns the furniture that carries `thing`, and places that on it, near the front."""
    asset = make(category, CATALOG[category].typical_size, int(rng.integers(1000)))
    size, own = asset.size, thing.asset.size
    carrier = Thing(
        "carrier", category, asset, Vec3(WIDTH_M / 2, size.y / 2, WALL_GAP_M + size.z / 2), Vec3(0.0, 0.0, 0.0)
    )
    if category == "Stove":
        knob_y, knob_z = KNOB_SHARE * size.y, WALL_GAP_M + _front_of(asset, KNOB_SHARE) + own.z / 2
        thing.position = Vec3(WIDTH_M / 2 + KNOB_ASIDE * size.x, knob_y, knob_z + size.z / 2)
        return carrier
    free = [surface for surface in asset.surfaces if not surface.needs_opening and surface.clearance > own.y]
    top = max(free, key=lambda surface: (round(surface.center.y, 1), surface.size_x * surface.size_z))
    forward = 0.0 if category == "Bed" else max(0.0, top.size_z / 2 - own.z / 2 - EDGE_M)
    x, y, z = np.array(carrier.position) + np.array(top.center)
    thing.position = Vec3(float(x), float(y) + own.y / 2, float(z) + forward)
    thing.rotation = Vec3(0.0, _yaw(thing, 0.0 if thing.category == "Sink" else 30.0, rng), 0.0)
    return carrier


def _yaw(thing: Thing, up_to_deg: float, rng: np.random.Generator) -> float:
    """Returns how far a thing that faces the viewer is turned: a little, or across when it is long."""
    size, sign = thing.asset.size, float(rng.choice([-1.0, 1.0]))
    if CATALOG[thing.category].is_pickupable and size.z > LENGTHWISE * size.x:
        return sign * float(rng.uniform(40.0, 75.0))
    return sign * float(rng.uniform(0.0, up_to_deg))


def _faucet_of(sink: Thing, carrier: Thing, rng: np.random.Generator) -> Thing:
    """Returns a faucet that stands on the counter behind a basin."""
    asset = make("Faucet", CATALOG["Faucet"].typical_size, int(rng.integers(1000)))
    level = sink.position.y - sink.asset.size.y / 2
    z = WALL_GAP_M + 0.02 + asset.size.z / 2
    return Thing("faucet", "Faucet", asset, Vec3(carrier.position.x, level + asset.size.y / 2, z), Vec3(0.0, 0.0, 0.0))


def _front_of(asset: Asset, share: float) -> float:
    """Returns how far to the front (z, asset frame) the body reaches at a share of its height."""
    height = (share - 0.5) * asset.size.y
    reach = [solid.polygon for solid in asset.solids if solid.bottom <= height <= solid.top]
    return max((z for polygon in reach for _, z in polygon), default=asset.size.z / 2)


def _hole_of(thing: Thing) -> Hole:
    half, middle = thing.asset.size.x / 2, thing.position
    return Hole(middle.x - half, middle.x + half, middle.y - thing.asset.size.y / 2, middle.y + thing.asset.size.y / 2)


def _room(category: str, holes: Sequence[Hole], things: dict[str, Thing], rng: np.random.Generator) -> Scene:
    kind = CATALOG[category].rooms[0]
    floor = MaterialRef(name="small_tiles/white" if kind == "Bathroom" else _one(_FLOORS, rng))
    red, green, blue = _one(_WALLS, rng)
    paint = MaterialRef(name="Walldrywall4Tiled", color=Color(r=red, g=green, b=blue))
    extents = {"room": (0.0, DEPTH_M)} | ({"behind": (-BEHIND_M, 0.0)} if category.startswith("Door") else {})
    rooms = [_shape(name, kind, low, high, floor) for name, (low, high) in extents.items()]
    panels = [panel for room in rooms for panel in _walls(room, paint, tuple(holes))]
    return Scene(rooms=rooms, panels=panels, things=things)


def _shape(name: str, kind: str, low: float, high: float, floor: MaterialRef) -> RoomShape:
    return RoomShape(
        id=name,
        room_type=kind,
        polygon=np.array([(0.0, low), (WIDTH_M, low), (WIDTH_M, high), (0.0, high)]),
        height=HEIGHT_M,
        floor_material=floor,
        ceiling_material=None,
        light=Vec3(WIDTH_M / 2, HEIGHT_M - 0.2, low + 0.45 * (high - low)),
        light_rgb=(1.0, 0.97, 0.94),
        light_intensity=1.0,
    )


def _walls(room: RoomShape, paint: MaterialRef, holes: tuple[Hole, ...]) -> list[WallPanel]:
    """Returns a room's four walls; the holes are in the one at z = 0, which runs from x = 0."""
    low, high = float(room.polygon[0, 1]), float(room.polygon[2, 1])
    sides = [
        ((0.0, low), (WIDTH_M, low), (0.0, 1.0)),
        ((0.0, high), (WIDTH_M, high), (0.0, -1.0)),
        ((0.0, low), (0.0, high), (1.0, 0.0)),
        ((WIDTH_M, low), (WIDTH_M, high), (-1.0, 0.0)),
    ]
    return [
        WallPanel(
            f"{room.id}|{number}", room.id, start, end, 0.0, HEIGHT_M, normal, paint,
            holes if start[1] == end[1] == 0.0 else (),
        )
        for number, (start, end, normal) in enumerate(sides)
    ]  # fmt: skip


def _one(choices: Sequence[T], rng: np.random.Generator) -> T:
    return choices[int(rng.integers(len(choices)))]
