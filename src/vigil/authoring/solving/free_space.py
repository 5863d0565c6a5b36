"""Where a body can be in a scene, as polygons for `vigil.authoring.solving.paths`."""

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
"""What a planned walk keeps from everything besides the body's radius."""
TIGHT_M = 0.001
ARC_SEGMENTS = 16
ROOM_TO_MOVE_M = 0.4
"""How far one can go at a start that has room, ahead or to a side."""
SIDES_DEG = (0.0, -90.0, 90.0)
PLACES_M = 0.05
"""Distance between the places of `places_within`."""


class Obstacles:
    """The floor shapes of a scene's walls and things, kept between plans."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._floor = floor_of_rooms(scene.rooms)
        self._walls = shapely.unary_union([shape for panel in scene.panels for shape in wall_shapes(panel)])
        self._grown_walls = {radius: self._grown(self._walls, radius) for radius in _RADII}
        self._things: dict[tuple, _FloorShapes] = {}

    def plan(self) -> WalkableMap:
        """Return the floor plan of the scene as it is now."""
        kept = [self._kept(thing) for thing in self._standing()]
        tight, roomy = (partial(self._free, radius, kept) for radius in _RADII)
        return WalkableMap(roomy, tight())

    def bare(self) -> BaseGeometry:
        """Return the floor on which nothing stands now."""
        taken = [shape for thing in self._standing() for shape in self._kept(thing).shapes]
        return self._floor.difference(shapely.unary_union([self._walls, *taken]))

    def _standing(self) -> Iterator[Thing]:
        return (thing for thing in self.scene.things.values() if thing.is_present and not thing.is_held)

    def _free(self, radius: float, kept: list["_FloorShapes"]) -> BaseGeometry:
        """Return where the axis of a body of a radius may be."""
        return self._floor.difference(
            shapely.unary_union([self._grown_walls[radius], *(each.grown[radius] for each in kept)])
        )

    def _kept(self, thing: Thing) -> "_FloorShapes":
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
    """A thing on the floor: its shapes, and all of them together grown by the radius of a body."""

    shapes: list[BaseGeometry]
    grown: dict[float, BaseGeometry]


def has_room_to_move(free: BaseGeometry, pose: Pose) -> bool:
    """Whether a body in a free region can go FREE_M ahead or to a side from a pose."""
    place = pose.position
    for side in SIDES_DEG:
        x, z = heading(pose.rotation + side)
        end = place.x + ROOM_TO_MOVE_M * x, place.z + ROOM_TO_MOVE_M * z
        if free.covers(shapely.LineString([(place.x, place.z), end])):
            return True
    return False


def is_cut_off(free: BaseGeometry, place: Point2, box: Box) -> bool:
    """Whether no place that a body at `place` can get to within a free region is within reach of a box."""
    here = shapely.Point(place)
    parts = [part for part in shapely.get_parts(free) if part.distance(here) < 1e-6]
    outline = footprint(box)
    return bool(parts) and all(part.distance(outline) > REACH_M for part in parts)


def places_within(floor: BaseGeometry, box: Box, within_m: float) -> np.ndarray:
    """Return places (n, 2) close together on a floor within a distance of a box: a grid, and along all edges."""
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
