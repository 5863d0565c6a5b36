"""The floor on which an agent can walk: those nodes of a 0.25 m grid where its body fits, connected through doors."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPoint, Polygon

from vigil.base.geometry import Box, Vec3
from vigil.protocol.house import House
from vigil.scene.floor import largest_part
from vigil.scene.geometry import Prism, bounding_box, moving_prisms_of, prisms_of
from vigil.scene.outlines import (
    BODY_HIGH_M,
    BODY_LOW_M,
    BODY_RADIUS_M,
    FLOOR_GROWTH_M,
    GRID_M,
    floor_of_rooms,
    footprint,
    meets_body,
    polygon_of,
    room_floor,
)
from vigil.scene.portals import Portals
from vigil.scene.things import Scene, Thing

LEAST_SHARE = 0.9
"""Least share of the free nodes that must be connected with each other."""
JAMB_M = 0.08
"""Width (m) that a door's frame takes away from each side of the door's hole."""
BEHIND_M = 0.01
"""How far (m) the strip of floor that leads through a door overlaps the walkable floor of the rooms on both sides."""


@dataclass(slots=True, eq=False)
class WalkableGrid:
    """The grid of nodes, and the largest part of it that is connected."""

    xs: np.ndarray
    """x (m) of the nodes (rows, columns)."""
    zs: np.ndarray
    """z (m) of the nodes (rows, columns)."""
    space: shapely.Geometry
    """Floor where the vertical axis of the agent's body could be if there were no things."""
    obstacles: shapely.Geometry
    """Floor where the vertical axis of the agent's body cannot be because things are in the way."""
    free: np.ndarray
    """Whether the body fits at each node."""
    main: np.ndarray
    """Whether each node belongs to the largest connected part."""

    @property
    def share(self) -> float:
        """Share of the free nodes that belong to the largest part."""
        count = int(self.free.sum())
        return float(self.main.sum()) / count if count else 0.0

    def reaches(self, floor: Polygon) -> bool:
        """Return whether a node of the largest connected part lies on `floor`."""
        return bool((self.main & shapely.contains_xy(floor, self.xs, self.zs)).any())

    def is_free_start(self, x: float, z: float) -> bool:
        """Return whether the body fits at a place, and the nodes around it belong to the largest connected part."""
        if not shapely.contains_xy(self.space, x, z) or shapely.contains_xy(self.obstacles, x, z):
            return False
        near = np.hypot(self.xs - x, self.zs - z) <= GRID_M
        return bool((self.main & near).any())

    def can_be_reached(self, thing: Thing, reach_m: float) -> bool:
        """Return whether an agent can stand within reach of a thing without being hit by the thing's leaves.

        The leaves are tested half open and fully open.
        """
        outline = footprint(bounding_box(thing))
        x0, z0, x1, z1 = outline.bounds
        near = self.main & (self.xs >= x0 - reach_m) & (self.xs <= x1 + reach_m)
        near &= (self.zs >= z0 - reach_m) & (self.zs <= z1 + reach_m)
        points = shapely.points(self.xs[near], self.zs[near])
        ok = shapely.distance(points, outline) <= reach_m
        for openness in (0.5, 1.0):
            for prism in moving_prisms_of(thing, openness):
                if meets_body(prism):
                    ok &= shapely.distance(points, polygon_of(prism)) > BODY_RADIUS_M
        return bool(ok.any())


def build_walkable_grid(house: House, scene: Scene) -> WalkableGrid:
    """Return the walkable floor of a house; doors that can be opened count as open."""
    floors = [room_floor(room) for room in scene.rooms]
    space = shapely.union_all([*_room_spaces(scene), *_passages(house, scene)])
    x0, z0, x1, z1 = MultiPoint([corner for floor in floors for corner in floor.exterior.coords]).bounds
    columns = np.arange(np.floor(x0 / GRID_M), np.ceil(x1 / GRID_M) + 1) * GRID_M
    rows = np.arange(np.floor(z0 / GRID_M), np.ceil(z1 / GRID_M) + 1) * GRID_M
    xs, zs = np.meshgrid(columns, rows)
    free = shapely.contains_xy(space, xs, zs)
    obstacles = shapely.union_all(shapely.buffer([polygon_of(prism) for prism in _obstacles(scene)], BODY_RADIUS_M))
    free &= ~shapely.contains_xy(obstacles, xs, zs)
    return WalkableGrid(xs, zs, space, obstacles, free, largest_part(free))


def _room_spaces(scene: Scene) -> Iterator[shapely.Geometry]:
    """Yield, for each room, the floor where the body's axis can be, ignoring things and doors.

    Rooms without a wall between them count as one room.
    """
    for rooms in Portals(scene).connected_rooms():
        if len(rooms) == 1:
            yield room_floor(scene.rooms[rooms[0]]).buffer(-BODY_RADIUS_M)
            continue
        floor = floor_of_rooms([scene.rooms[room] for room in rooms])
        high = (each for each in scene.panels if each.bottom < BODY_HIGH_M and each.bottom + each.height > BODY_LOW_M)
        walls = shapely.MultiLineString([(panel.start, panel.end) for panel in high])  # doors are passages
        yield floor.buffer(-BODY_RADIUS_M - FLOOR_GROWTH_M, join_style="mitre") - walls.buffer(BODY_RADIUS_M)


def _obstacles(scene: Scene) -> Iterator[Prism]:
    """Yield the obstacles to walking: things in their present state, but all doors that can be opened are open."""
    for thing in scene.things.values():
        if not thing.is_structure or thing.category == "Window":
            yield from filter(meets_body, prisms_of(thing))
        elif thing.is_openable:
            yield from filter(meets_body, moving_prisms_of(thing, 1.0))


def _passages(house: House, scene: Scene) -> Iterator[Polygon]:
    """Yield the strips of floor through inner doors in which the body's axis can be."""
    for door in house.document.doors:
        thing = scene.things[door.id]
        width = thing.asset.size.x - 2 * (BODY_RADIUS_M + JAMB_M)
        if door.joins_rooms and door.openable is not False and width > 0.0:
            size = Vec3(width, thing.asset.size.y, 2 * (BODY_RADIUS_M + BEHIND_M))
            yield footprint(Box(center=thing.position, size=size, yaw=thing.rotation.y))
