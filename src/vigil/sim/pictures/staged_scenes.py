"""Exhibits: scenes that show one thing at its typical place in a plain room. They are built by code, without a house
document.

`vigil.sim.pictures.places` decides where the thing is placed and what is shown with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.protocol.house import Color, MaterialRef
from vigil.scene.things import Hole, RoomShape, Scene, Thing, WallPanel
from vigil.sim.pictures.places import HEIGHT_M, MIDDLE_M, OPENINGS, companions, place

State = Literal["open", "closed", "on", "off"]

SUBJECT = "subject"
WIDTH_M, DEPTH_M, BEHIND_M = 2 * MIDDLE_M, 7.5, 4.0
"""Width and depth (m) of the room; depth (m) of a second room behind the wall, which is visible through a door."""
_FLOORS = ("WoodFloorsCross", "WoodGrain_Tan", "WoodGrain_Brown", "GreyFloor 1", "planks/oak", "planks/walnut")
_WALLS = ((0.94, 0.93, 0.9), (0.91, 0.87, 0.79), (0.8, 0.86, 0.81), (0.76, 0.82, 0.88), (0.83, 0.8, 0.85))

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SceneSubject:
    """The thing that a picture shows, given as a category, a variant and a state."""

    category: str
    variant: int
    state: State | None = None
    """State in which the thing is shown; None for a thing that can be neither opened nor switched."""

    @property
    def asset(self) -> Asset:
        """Asset of the thing, at the category's usual size."""
        return make(self.category, CATALOG[self.category].typical_size, self.variant)


def states_of(asset: Asset) -> tuple[State | None, ...]:
    """Return the states in which an asset can be shown; (None,) if it has only one state."""
    row = CATALOG[asset.category]
    moves: tuple[State, ...] = ("closed", "open") if row.is_openable and asset.can_open else ()
    switches: tuple[State, ...] = ("off", "on") if row.is_toggleable else ()
    return (*moves, *(switches[1:] if moves else switches)) or (None,)


def staged_scene(subject: SceneSubject, rng: np.random.Generator) -> Scene:
    """Return a room with the subject in it; the subject's thing has the id `SUBJECT`."""
    thing = _subject(subject)
    things = [thing, *place(thing, rng), *companions(thing, rng)]
    boxes = [(each.position, each.asset.size) for each in things if each.is_structure]
    holes = [Hole(at.x - size.x / 2, at.x + size.x / 2, at.y - size.y / 2, at.y + size.y / 2) for at, size in boxes]
    return _room(subject.category, holes, {each.id: each for each in things}, rng)


def _subject(subject: SceneSubject) -> Thing:
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
    )


def _walls(room: RoomShape, paint: MaterialRef, holes: tuple[Hole, ...]) -> list[WallPanel]:
    """Return a room's four walls. All holes are in the wall at z = 0, and are measured from x = 0."""
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
