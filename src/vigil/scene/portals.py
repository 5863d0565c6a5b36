"""The rooms that may be visible from a place, i.e. those that a straight line reaches through doorways and windows.

The answer may name too many rooms, but never too few: directions are compared instead of lines, door leaves do not
block, and rooms without a wall between them are one space. Places are (x, z) of the plan, or (x, z, height), in metres.
"""

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from cachetools import LRUCache

from vigil.scene.outlines import room_floor
from vigil.scene.sectors import ALL, Sector
from vigil.scene.things import Hole, RoomShape, Scene, WallPanel

OUTSIDE = -1
"""Number that stands for everything outside the rooms."""
BESIDE_M = 0.3
"""Greatest distance (m) from a hole's middle to a room that the hole leads into."""
IN_DOORWAY_M = 0.4
"""Distance (m) from a hole below which everything behind the hole may be visible."""
IN_ROOM_M = 0.02
"""Greatest distance (m) from a room at which a place counts as in the room."""
WALL_M = 0.1
"""Greatest distance (m) of a wall from the edge of its room."""
SLIT_M = 0.02
"""Greatest gap (m), along a room's edge or in its height, that walls may leave and still count as closing the edge."""
STRETCH_M = 0.5
"""Greatest length (m) of the parts into which an edge without a wall is divided; at each part's middle the rooms
next to it are looked up."""
MAX_CACHED_EYES = 256
"""Number of places for which the visible rooms are cached."""

Place = tuple[float, float, float]
"""(x, z, height) in metres."""
_End = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Portal:
    """A hole in a wall, given by its two ends in the plan and by its lower and upper height (m)."""

    start: _End
    end: _End
    bottom: float
    top: float
    sides: frozenset[int]
    """Numbers of the spaces that the hole joins."""

    def corners(self) -> list[Place]:
        return [(x, z, height) for x, z in (self.start, self.end) for height in (self.bottom, self.top)]

    def distance(self, place: Place) -> float:
        """Return the distance (m) of a place from the hole in the plan."""
        (x, z), (end_x, end_z) = self.start, self.end
        along_x, along_z = end_x - x, end_z - z
        square = along_x**2 + along_z**2
        share = ((place[0] - x) * along_x + (place[1] - z) * along_z) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        return math.hypot(place[0] - x - share * along_x, place[1] - z - share * along_z)


@dataclass(frozen=True, slots=True)
class Extent:
    """A box in a house, with the rooms that it is in."""

    corners: list[Place]
    rooms: frozenset[int]
    """Numbers of the rooms that the box may reach into; empty when the box's middle is outside all rooms."""


class Portals:
    """The rooms of a scene and the holes between them."""

    def __init__(self, scene: Scene) -> None:
        self._rooms = [room_floor(room) for room in scene.rooms]
        self._bounds = shapely.bounds(self._rooms).reshape(-1, 2, 2)
        self._is_box = np.isclose(shapely.area(self._rooms), np.prod(np.diff(self._bounds, axis=1)[:, 0], axis=1))
        self._top_m = min((room.height for room in scene.rooms), default=0.0)
        self._spaces = self._space_numbers([edge for room in scene.rooms for edge in _open_edges(room, scene.panels)])
        """Number of the space of each room (rooms without a wall between them are one space); the last entry is for
        the outside."""
        # Both sides of a wall name its holes.
        found = dict.fromkeys(
            (*_ends(panel, hole), hole.bottom, hole.top) for panel in scene.panels for hole in panel.holes
        )
        sides = [frozenset(self._spaces[list(self._rooms_beside(*each[:2]))].tolist()) for each in found]
        self._holes = [_Portal(*each, between) for each, between in zip(found, sides, strict=True) if len(between) > 1]
        self._corners = [hole.corners() for hole in self._holes]
        self._seen: LRUCache[Place, list[tuple[int, Sector]] | None] = LRUCache(MAX_CACHED_EYES)

    def connected_rooms(self) -> list[list[int]]:
        """Return the numbers of the rooms, grouped by space: no wall separates the rooms of a group."""
        return [np.flatnonzero(self._spaces[:-1] == space).tolist() for space in np.unique(self._spaces[:-1])]

    def distances(self, places: np.ndarray) -> np.ndarray:
        """Return the distances (n, rooms) in metres of places (n, 2) from each room; 0 for a place inside the room."""
        return np.stack([self.distances_from(room, places) for room in range(len(self._rooms))], axis=1)

    def distances_from(self, room: int, places: np.ndarray) -> np.ndarray:
        """Return the distances (n,) in metres of places (n, 2) from a room; 0 for a place inside the room."""
        if not self._is_box[room]:
            return np.asarray(shapely.distance(self._rooms[room], shapely.points(places)))
        low, high = self._bounds[room]
        outside = np.maximum(np.maximum(low - places, places - high), 0.0)
        return np.asarray(np.hypot(outside[:, 0], outside[:, 1]))

    def visible_rooms(
        self, eye: Place, entries: Iterable[Place] = (), through: Sector = ALL
    ) -> list[tuple[int, Sector]] | None:
        """Return (room, directions) for each room that may be seen from an eye, once for each way to the room.

        Return None when everything may be visible, because the eye is outside all rooms or above the lowest ceiling.
        `entries` and `through` are for a view in a mirror: its eye is behind the mirror, and its lines enter the house
        at `entries`, in the directions `through`.
        """
        spaces: set[int] = set()
        for place in list(entries) or [eye]:
            here = self._rooms_at(place)
            if not here:
                return None
            spaces.update(self._spaces[here].tolist())
        if eye[2] > self._top_m:
            return None
        holes = [
            (hole, ALL if hole.distance(eye) < IN_DOORWAY_M else Sector.of(eye, corners))
            for hole, corners in zip(self._holes, self._corners, strict=True)
        ]
        return [
            (room, sector)
            for space in sorted(spaces)
            for reached, sector in _visible_spaces(space, through, holes, frozenset())
            for room in np.flatnonzero(self._spaces[:-1] == reached).tolist()
        ]

    def extent(self, low: Place, high: Place) -> Extent:
        """Return the extent, for `may_see`, of a box along the house's axes."""
        away = self.distances(np.array([[(low[0] + high[0]) / 2, (low[1] + high[1]) / 2]]))[0]
        is_inside = away.min(initial=np.inf) <= IN_ROOM_M
        reach = math.dist(low, high) / 2 + IN_ROOM_M
        corners = [(x, z, height) for x in (low[0], high[0]) for z in (low[1], high[1]) for height in (low[2], high[2])]
        return Extent(corners, frozenset(np.flatnonzero(away <= reach).tolist() if is_inside else ()))

    def may_see(self, eye: Place, extent: Extent) -> bool:
        """Return whether any part of an extent may be seen from an eye."""
        if not extent.rooms or not extent.rooms.isdisjoint(self._rooms_at(eye)):
            return True
        if eye not in self._seen:
            self._seen[eye] = self.visible_rooms(eye)
        sectors = self._seen[eye]
        if sectors is None:
            return True
        way = Sector.of(eye, extent.corners)
        return any(room in extent.rooms and sector.intersection(way) is not None for room, sector in sectors)

    def _rooms_at(self, place: Place) -> list[int]:
        """Return the rooms that a place is in."""
        return np.flatnonzero(self.distances(np.array([place[:2]]))[0] <= IN_ROOM_M).tolist()

    def _space_numbers(self, edges: list[tuple[_End, _End]]) -> np.ndarray:
        """Return the number of each room's space (rooms + 1,); the last entry is the number of the outside's space.

        `edges` are lines without a wall, given by their two ends; the rooms on both sides of such a line are one space.
        """
        numbers = np.arange(len(self._rooms) + 1)
        for edge in edges:
            joined = numbers[list(self._rooms_beside(*edge))]
            numbers[np.isin(numbers, joined)] = joined.min()
        return numbers

    def _rooms_beside(self, start: _End, end: _End) -> set[int]:
        """Return the rooms next to a line's middle, with `OUTSIDE` when one side of the middle has no room."""
        (x, z), (end_x, end_z) = start, end
        middle = np.array([(x + end_x) / 2, (z + end_z) / 2])
        across = np.array([z - end_z, end_x - x]) / max(math.hypot(end_x - x, end_z - z), 1e-9) * BESIDE_M / 2
        away = self.distances(np.array([middle, middle + across, middle - across]))
        found = set(np.flatnonzero(away[0] < BESIDE_M).tolist())
        return found | {OUTSIDE} if (away[1:].min(axis=1) > WALL_M).any() else found


def _ends(panel: WallPanel, hole: Hole) -> tuple[_End, _End]:
    """Return the ends of a hole in the plan, sorted, so that both panels of a wall give the same ends."""
    start, end = np.array(panel.start), np.array(panel.end)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    low, high = sorted(tuple(np.round(start + at * along, 6).tolist()) for at in (hole.left, hole.right))
    return low, high


def _open_edges(room: RoomShape, panels: list[WallPanel]) -> Iterator[tuple[_End, _End]]:
    """Yield the ends of short parts of a room's edges along which no wall reaches from floor to ceiling."""
    whole = [panel for panel in panels if panel.bottom < SLIT_M and panel.bottom + panel.height > room.height - SLIT_M]
    ends = np.array([(panel.start, panel.end) for panel in whole]).reshape(-1, 2, 2)
    for start, end in zip(room.polygon, np.roll(room.polygon, -1, axis=0), strict=True):
        length = float(np.linalg.norm(end - start))
        along = (end - start) / max(length, 1e-9)
        way = ends - start
        is_on = (np.abs(way @ (-along[1], along[0])) <= WALL_M).all(axis=1)
        covered = np.sort(way[is_on] @ along, axis=1)
        at = 0.0
        for first, last in [*covered[np.argsort(covered[:, 0])].tolist(), (length, length)]:
            bare = min(first, length) - at
            if bare > SLIT_M:
                cuts = np.linspace(at, at + bare, 1 + math.ceil(bare / STRETCH_M))
                yield from itertools.pairwise((x, z) for x, z in (start + cuts[:, None] * along).tolist())
            at = max(at, last)


def _visible_spaces(
    space: int, sector: Sector, holes: list[tuple[_Portal, Sector]], passed: frozenset[int]
) -> Iterator[tuple[int, Sector]]:
    """Yield each space that lines in a sector reach from one space, with the part of the sector that reaches it."""
    yield space, sector
    for hole, directions in holes:
        common = sector.intersection(directions) if space in hole.sides else None
        if common is not None:
            for other in hole.sides - passed - {space}:
                yield from _visible_spaces(other, common, holes, passed | {space})
