"""What can be seen from a place, by the rooms: that to which a straight line leads through doorways and windows.

Directions are compared, not lines, and leaves stop none, so something is named too much now and then, and nothing too
little. Places are (x, z) of the plan, or (x, z, height).
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from cachetools import LRUCache

from vigil.scene.outlines import room_floor
from vigil.scene.sectors import ALL, Sector
from vigil.scene.things import Hole, Scene, WallPanel

OUTSIDE = -1
BESIDE_M = 0.3
"""A hole leads into the rooms that are this near to its middle."""
IN_DOORWAY_M = 0.4
"""So near to a hole everything may be seen through it."""
SAME_M = 0.02
"""An eye is in all rooms that are not this much farther from it than the nearest."""
WALL_M = 0.1
"""A wall is this near to the edge of its room, ..."""
SHORT_M = 0.02
"""and shorter by no more than this."""
STRETCH_M = 0.5
"""Where walls are missing it is asked so often which rooms are beside."""
KEPT_EYES = 256
"""From how many places what is seen is kept."""


Place = tuple[float, float, float]
"""(x, z, height) in metres."""
_Bare = tuple[tuple[float, float], tuple[float, float], float, float]
"""The ends of a hole in the plan, its bottom and its top."""


@dataclass(frozen=True, slots=True)
class _Hole:
    """A hole in a wall, or where there is none."""

    start: tuple[float, float]
    end: tuple[float, float]
    bottom: float
    top: float
    sides: frozenset[int]

    def corners(self) -> list[Place]:
        return [(x, z, height) for x, z in (self.start, self.end) for height in (self.bottom, self.top)]

    def distance(self, place: Place) -> float:
        """Returns how far a place is from the hole in the plan, in metres."""
        (x, z), (end_x, end_z) = self.start, self.end
        along_x, along_z = end_x - x, end_z - z
        square = along_x**2 + along_z**2
        share = ((place[0] - x) * along_x + (place[1] - z) * along_z) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        return math.hypot(place[0] - x - share * along_x, place[1] - z - share * along_z)


@dataclass(frozen=True, slots=True)
class Extent:
    """What a box takes of a house."""

    corners: list[Place]
    rooms: frozenset[int]
    """Those that it may reach into."""


class Portals:
    """The rooms of a scene and the holes between them."""

    def __init__(self, scene: Scene) -> None:
        self._rooms = [room_floor(room) for room in scene.rooms]
        self._bounds = shapely.bounds(self._rooms).reshape(-1, 2, 2)
        self._is_box = np.isclose(shapely.area(self._rooms), np.prod(np.diff(self._bounds, axis=1)[:, 0], axis=1))
        self.top_m = max((room.height for room in scene.rooms), default=0.0)  # an eye above it looks over the walls
        found = [(*_ends(panel, hole), hole.bottom, hole.top) for panel in scene.panels for hole in panel.holes]
        found += [gap for line, height in _gaps(scene) for gap in self._by_sides(line, height)]
        # Both sides of a wall name its holes.
        self._holes = [_Hole(*each, sides) for each in dict.fromkeys(found) if (sides := self._sides(*each[:2]))]
        self._corners = [hole.corners() for hole in self._holes]
        self._seen: LRUCache[Place, list[tuple[int, Sector]] | None] = LRUCache(KEPT_EYES)

    def distances(self, places: np.ndarray) -> np.ndarray:
        """Returns how far places (n, 2) are from each room (n, rooms), in metres."""
        return np.stack([self.distances_from(room, places) for room in range(len(self._rooms))], axis=1)

    def distances_from(self, room: int, places: np.ndarray) -> np.ndarray:
        """Returns how far places (n, 2) are from a room (n,), in metres."""
        if not self._is_box[room]:
            return np.asarray(shapely.distance(self._rooms[room], shapely.points(places)))
        low, high = self._bounds[room]
        outside = np.maximum(np.maximum(low - places, places - high), 0.0)
        return np.asarray(np.hypot(outside[:, 0], outside[:, 1]))

    def seen_from(
        self, eye: Place, entry: Place | None = None, through: Sector = ALL
    ) -> list[tuple[int, Sector]] | None:
        """Returns in which directions which rooms are seen from an eye, a room as often as there are ways to it.

        None stands for everything: the eye is above the walls or outside. One that looks into a mirror is behind it;
        its lines enter the house at `entry`, in the directions of the mirror.
        """
        here = self._rooms_at(eye if entry is None else entry)
        if eye[2] > self.top_m or not here:
            return None
        holes = [
            (hole, ALL if hole.distance(eye) < IN_DOORWAY_M else Sector.of(eye, corners))
            for hole, corners in zip(self._holes, self._corners, strict=True)
        ]
        return [found for room in here for found in _reached(room, through, holes, frozenset())]

    def extent(self, low: Place, high: Place) -> "Extent":
        """Returns what a box along the house's axes takes of a house, for `may_see`."""
        middle = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2])
        reach = math.dist(low, high) / 2 + SAME_M
        touched = np.flatnonzero(self.distances(middle[None])[0] <= reach)
        corners = [(x, z, height) for x in (low[0], high[0]) for z in (low[1], high[1]) for height in (low[2], high[2])]
        return Extent(corners, frozenset(touched.tolist()))

    def may_see(self, eye: Place, extent: "Extent") -> bool:
        """Whether anything of an extent may be seen from an eye."""
        if not extent.rooms or not extent.rooms.isdisjoint(self._rooms_at(eye)):
            return True
        if eye not in self._seen:
            self._seen[eye] = self.seen_from(eye)
        sectors = self._seen[eye]
        if sectors is None:
            return True
        way = Sector.of(eye, extent.corners)
        return any(room in extent.rooms and sector.common(way) is not None for room, sector in sectors)

    def _rooms_at(self, place: Place) -> list[int]:
        """Returns the rooms that a place is in, or nearest to; none outside of the house."""
        away = self.distances(np.array([place[:2]]))[0]
        nearest = away.min(initial=np.inf)
        return np.flatnonzero(away <= nearest + SAME_M).tolist() if nearest < IN_DOORWAY_M else []

    def _by_sides(self, line: shapely.LineString, height: float) -> "Iterator[_Bare]":
        """Yields the stretches of a line without a wall, each between the same rooms all along."""
        ends = [(x, z) for x, z in np.round(shapely.get_coordinates(shapely.segmentize(line, STRETCH_M)), 6).tolist()]
        for _, pieces in itertools.groupby(itertools.pairwise(ends), lambda piece: self._sides(*piece)):
            first, *others = pieces
            yield first[0], (others[-1] if others else first)[1], 0.0, height

    def _sides(self, start: tuple[float, float], end: tuple[float, float]) -> frozenset[int]:
        line = shapely.LineString([start, end])
        near = np.flatnonzero(shapely.distance(self._rooms, shapely.centroid(line)) < BESIDE_M).tolist()
        return frozenset(near if len(near) > 1 else [*near, OUTSIDE])


def _ends(panel: WallPanel, hole: Hole) -> tuple[tuple[float, float], tuple[float, float]]:
    """Returns the ends of a hole in the plan, the lower first whichever side of the wall it is told from."""
    start, end = np.array(panel.start), np.array(panel.end)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    low, high = sorted(tuple(np.round(start + at * along, 6).tolist()) for at in (hole.left, hole.right))
    return low, high


def _gaps(scene: Scene) -> Iterator[tuple[shapely.LineString, float]]:
    """Yields the straight edges of rooms along which no wall stands from the floor to the ceiling, with that height."""
    walls = {
        height: shapely.union_all(
            [
                shapely.LineString([panel.start, panel.end]).buffer(WALL_M, quad_segs=1)
                for panel in scene.panels
                if panel.bottom < SHORT_M and panel.bottom + panel.height > height - SHORT_M
            ]
        )
        for height in {room.height for room in scene.rooms}
    }
    for room in scene.rooms:
        bare = room_floor(room).exterior.difference(walls[room.height])
        for part in shapely.get_parts(bare):
            for start, end in itertools.pairwise(shapely.get_coordinates(part).tolist()):
                yield shapely.LineString([start, end]), room.height


def _reached(
    room: int, sector: Sector, holes: list[tuple[_Hole, Sector]], passed: frozenset[int]
) -> Iterator[tuple[int, Sector]]:
    if room != OUTSIDE:
        yield room, sector
    for hole, directions in holes:
        common = sector.common(directions) if room in hole.sides else None
        if common is not None:
            for other in hole.sides - passed - {room}:
                yield from _reached(other, common, holes, passed | {room})
