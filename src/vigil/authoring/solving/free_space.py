"""The free floor of a scene, where a body can be, as polygons for `vigil.authoring.solving.paths`."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.authoring.solving.paths import Point2, WalkableMap
from vigil.base.geometry import Box, Pose, heading
from vigil.protocol.actions import REACH_M
from vigil.scene.outlines import BODY_RADIUS_M, floor_of_rooms, footprint, thing_shapes, wall_shapes
from vigil.scene.things import Scene, Thing

MARGIN_M = 0.03
"""Distance (m) that planned walks keep from obstacles in addition to the body's radius."""
TIGHT_M = 0.001
"""Distance (m) that exact walks keep from obstacles in addition to the body's radius."""
ARC_SEGMENTS = 16
"""Segments per quarter circle of outlines that are grown."""
ROOM_TO_MOVE_M = 0.4
"""Length (m) of free floor that a start needs ahead or to a side."""
SIDES_DEG = (0.0, -90.0, 90.0)
PLACES_M = 0.05
"""Distance (m) between the places of `places_within`."""
SAME_PLACE_M = 1e-6
"""Distance (m) from a region within which a place counts as inside."""


class Obstacles:
    """The outlines on the floor of a scene's walls and things, cached between plans."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._floor = floor_of_rooms(scene.rooms)
        self._walls = shapely.unary_union([shape for panel in scene.panels for shape in wall_shapes(panel)])
        self._grown_walls = {radius: self._grown(self._walls, radius) for radius in _RADII}
        self._things: dict[tuple, _FloorShapes] = {}

    def plan(self) -> WalkableMap:
        """Return the walkable map of the scene in its current state."""
        outlines = [self._outlines(thing) for thing in self._things_on_floor()]
        tight, roomy = (partial(self._free, radius, outlines) for radius in _RADII)
        return WalkableMap(roomy, tight())

    def bare(self) -> BaseGeometry:
        """Return the floor on which nothing stands in the current state."""
        taken = [shape for thing in self._things_on_floor() for shape in self._outlines(thing).shapes]
        return self._floor.difference(shapely.unary_union([self._walls, *taken]))

    def _things_on_floor(self) -> Iterator[Thing]:
        return (thing for thing in self.scene.things.values() if thing.is_present and not thing.is_held)

    def _free(self, radius: float, outlines: list["_FloorShapes"]) -> BaseGeometry:
        """Return the region for the axis of a body of a radius (m)."""
        return self._floor.difference(
            shapely.unary_union([self._grown_walls[radius], *(each.grown[radius] for each in outlines)])
        )

    def _outlines(self, thing: Thing) -> "_FloorShapes":
        key = thing.id, thing.position, thing.rotation, thing.openness
        if key not in self._things:
            shapes = thing_shapes(thing)
            whole = shapely.unary_union(shapes)
            self._things[key] = _FloorShapes(shapes, {radius: self._grown(whole, radius) for radius in _RADII})
        return self._things[key]

    @staticmethod
    def _grown(shape: BaseGeometry, radius: float) -> BaseGeometry:
        return shape.buffer(radius, quad_segs=ARC_SEGMENTS)


@dataclass(frozen=True, slots=True)
class _FloorShapes:
    """The outlines of a thing on the floor."""

    shapes: list[BaseGeometry]
    grown: dict[float, BaseGeometry]
    """Radius (m) of a body -> all outlines together, grown by it."""


def has_room_to_move(free: BaseGeometry, pose: Pose) -> bool:
    """Return whether a body in a free region can go `ROOM_TO_MOVE_M` ahead or to a side from a pose."""
    place = pose.position
    for side in SIDES_DEG:
        x, z = heading(pose.rotation + side)
        end = place.x + ROOM_TO_MOVE_M * x, place.z + ROOM_TO_MOVE_M * z
        if free.covers(shapely.LineString([(place.x, place.z), end])):
            return True
    return False


def is_cut_off(free: BaseGeometry, place: Point2, box: Box) -> bool:
    """Return whether a body at `place` cannot come within reach of a box in a free region; False if it is outside."""
    here = shapely.Point(place)
    parts = [part for part in shapely.get_parts(free) if part.distance(here) < SAME_PLACE_M]
    outline = footprint(box)
    return bool(parts) and all(part.distance(outline) > REACH_M for part in parts)


def places_within(floor: BaseGeometry, box: Box, within_m: float) -> np.ndarray:
    """Return places (n, 2) in x, z on a floor within a distance (m) of a box: a grid, and points along all edges."""
    near = floor.intersection(footprint(box).buffer(within_m, quad_segs=4 * ARC_SEGMENTS))
    if near.is_empty:
        return np.empty((0, 2))
    left, low, right, high = near.bounds
    columns = np.arange(math.floor(left / PLACES_M), math.ceil(right / PLACES_M) + 1) * PLACES_M
    rows = np.arange(math.floor(low / PLACES_M), math.ceil(high / PLACES_M) + 1) * PLACES_M
    grid = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1).reshape(-1, 2)
    edges = shapely.get_coordinates(shapely.segmentize(near, PLACES_M))
    return np.concatenate([edges, grid[shapely.contains_xy(near, grid[:, 0], grid[:, 1])]])


_RADII = (BODY_RADIUS_M + TIGHT_M, BODY_RADIUS_M + MARGIN_M)
