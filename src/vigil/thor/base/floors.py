"""Floors as objects: each room's floor is a receptacle of category Floor, with the room's id."""

import numpy as np
import shapely

from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Vec3
from vigil.scene.geometry import bounding_box
from vigil.scene.outlines import room_floor
from vigil.scene.things import RoomShape, Thing

FLOOR = "Floor"
AT_FLOOR_M = 0.05
"""Height (m) up to which a point, or the bottom of a thing, counts as on the floor."""
_SHARES = np.stack(np.meshgrid(np.linspace(0.02, 0.98, 13), np.linspace(0.02, 0.98, 13)), axis=-1).reshape(-1, 2)


def floors_of(rooms: list[RoomShape]) -> dict[str, Thing]:
    """Return the floor of each room as a thing, by the room's id."""
    found: dict[str, Thing] = {}
    for room in rooms:
        (left, low), (right, high) = room.polygon.min(axis=0).tolist(), room.polygon.max(axis=0).tolist()
        asset = Asset(FLOOR, Vec3(right - left, 0.0, high - low), (), ())
        middle = Vec3((left + right) / 2, 0.0, (low + high) / 2)
        found[room.id] = Thing(room.id, FLOOR, asset, middle, Vec3(0.0, 0.0, 0.0), is_receptacle=True)
    return found


def points_of_floor(room: RoomShape) -> np.ndarray:
    """Return points (n, 3) on a room's floor that form a lattice."""
    low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
    flat = low + _SHARES * (high - low)
    return np.insert(flat[shapely.contains_xy(room_floor(room), flat)], 1, 0.0, axis=1)


def rooms_at(rooms: list[RoomShape], places: np.ndarray) -> np.ndarray:
    """Return the index (n,) of the room that contains each place (n, 2) of x and z; -1 outside every room."""
    found = np.full(len(places), -1)
    for number, room in enumerate(rooms):
        floor = room_floor(room)
        shapely.prepare(floor)
        found[(found < 0) & shapely.intersects_xy(floor, places)] = number
    return found


def floor_below(rooms: list[RoomShape], thing: Thing) -> str | None:
    """Return the id of the floor on which a thing rests; None when it rests on something else."""
    if thing.parent is not None or thing.is_held or thing.is_structure or thing.is_drawer:
        return None
    if bounding_box(thing).bottom > AT_FLOOR_M:
        return None
    number = int(rooms_at(rooms, np.array([[thing.position.x, thing.position.z]]))[0])
    return rooms[number].id if number >= 0 else None
