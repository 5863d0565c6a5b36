"""The rooms that may be visible from a place: those that a straight line can reach through doorways and windows.

The answer may name too many rooms, but never too few. It ignores door leaves, compares directions instead of exact
lines, and treats rooms without a wall between them as one space. Places are (x, z) of the plan, or (x, z, height), in
metres.
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
"""Number that is used instead of a room's number for everything outside the rooms."""
BESIDE_M = 0.3
"""A hole (doorway or window) leads into a room if the room is at most this far (m) from the hole's middle."""
IN_DOORWAY_M = 0.4
"""From a place closer than this (m) to a hole, everything behind the hole may be visible."""
IN_ROOM_M = 0.02
"""A place at most this far (m) from a room counts as in the room."""
WALL_M = 0.1
"""A wall at most this far (m) from the edge of a room is a wall of the room."""
SLIT_M = 0.02
"""An edge of a room counts as closed if its walls leave gaps of at most this size (m) along the edge and in height."""
STRETCH_M = 0.5
"""An edge without a wall is divided into parts of at most this length (m). At the middle of each part, the rooms next
to it are looked up."""
MAX_CACHED_EYES = 256
"""Number of places and views for which rooms are cached."""

Place = tuple[float, float, float]
"""Place as (x, z, height) in metres."""
_End = tuple[float, float]
_View = tuple[Place, tuple[Place, ...], Sector]
"""Arguments of `Portals.visible_rooms`."""


@dataclass(frozen=True, slots=True)
class _Portal:
    """A hole in a wall: its two ends in the plan, and the heights (m) of its bottom and top."""

    start: _End
    end: _End
    bottom: float
    top: float
    sides: frozenset[int]
    """Numbers of the spaces that the hole connects."""

    def corners(self) -> list[Place]:
        return [(x, z, height) for x, z in (self.start, self.end) for height in (self.bottom, self.top)]

    def distance(self, place: Place) -> float:
        """Return the distance (m) in the plan between a place and the hole."""
        (x, z), (end_x, end_z) = self.start, self.end
        along_x, along_z = end_x - x, end_z - z
        square = along_x**2 + along_z**2
        share = ((place[0] - x) * along_x + (place[1] - z) * along_z) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        return math.hypot(place[0] - x - share * along_x, place[1] - z - share * along_z)


@dataclass(frozen=True, slots=True)
class Extent:
    """A box in a house, and the rooms that the box is in."""

    corners: list[Place]
    rooms: frozenset[int]
    """Numbers of the rooms that the box may reach into; empty if the middle of the box is outside all rooms."""


class Portals:
    """The rooms of a scene and the holes between them."""

    def __init__(self, scene: Scene) -> None:
        self._rooms = [room_floor(room) for room in scene.rooms]
        self._bounds = shapely.bounds(self._rooms).reshape(-1, 2, 2)
        self._is_box = np.isclose(shapely.area(self._rooms), np.prod(np.diff(self._bounds, axis=1)[:, 0], axis=1))
        self._top_m = min((room.height for room in scene.rooms), default=0.0)
        self._spaces = self._space_numbers([edge for room in scene.rooms for edge in _open_edges(room, scene.panels)])
        """Number of each room's space (rooms without a wall between them are one space); the last entry is the number
        of the outside's space."""
        # Both sides of a wall name its holes.
        found = dict.fromkeys(
            (*_ends(panel, hole), hole.bottom, hole.top) for panel in scene.panels for hole in panel.holes
        )
        sides = [frozenset(self._spaces[list(self._rooms_beside(*each[:2]))].tolist()) for each in found]
        self._holes = [_Portal(*each, between) for each, between in zip(found, sides, strict=True) if len(between) > 1]
        self._corners = [hole.corners() for hole in self._holes]
        self._rooms_of: LRUCache[Place, list[int]] = LRUCache(MAX_CACHED_EYES)
        self._seen: LRUCache[_View, list[tuple[int, Sector]] | None] = LRUCache(MAX_CACHED_EYES)

    def connected_rooms(self) -> list[list[int]]:
        """Return groups of room numbers. Walls separate the groups, but not the rooms of one group."""
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
        """Return (room, directions) for each room that may be visible from an eye, and for `OUTSIDE`; a room is listed
        once for each way to it.

        Return None if everything may be visible, because the eye is outside all rooms or above the lowest ceiling.
        `entries` and `through` describe a view in a mirror, whose eye is behind the mirror: the lines of sight enter
        the house at the places `entries`, in the directions `through`.
        """
        key = eye, tuple(entries), through
        if key not in self._seen:
            self._seen[key] = self._find_visible(eye, key[1] or (eye,), through)
        return self._seen[key]

    def _find_visible(self, eye: Place, entries: tuple[Place, ...], through: Sector) -> list[tuple[int, Sector]] | None:
        """Return what `visible_rooms` returns, without a cache."""
        spaces: set[int] = set()
        for place in entries:
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
            for room, its_space in zip([*range(len(self._rooms)), OUTSIDE], self._spaces.tolist(), strict=True)
            if its_space == reached
        ]

    def extent(self, low: Place, high: Place) -> Extent:
        """Return the extent of a box whose sides are along the house's axes, for use in `may_see`."""
        away = self.distances(np.array([[(low[0] + high[0]) / 2, (low[1] + high[1]) / 2]]))[0]
        is_inside = away.min(initial=np.inf) <= IN_ROOM_M
        reach = math.dist(low, high) / 2 + IN_ROOM_M
        corners = [(x, z, height) for x in (low[0], high[0]) for z in (low[1], high[1]) for height in (low[2], high[2])]
        return Extent(corners, frozenset(np.flatnonzero(away <= reach).tolist() if is_inside else ()))

    def may_see(self, eye: Place, extent: Extent) -> bool:
        """Return whether any part of an extent may be visible from an eye."""
        if not extent.rooms or not extent.rooms.isdisjoint(self._rooms_at(eye)):
            return True
        sectors = self.visible_rooms(eye)
        if sectors is None:
            return True
        way = Sector.of(eye, extent.corners)
        return any(room in extent.rooms and sector.intersection(way) is not None for room, sector in sectors)

    def _rooms_at(self, place: Place) -> list[int]:
        """Return the rooms that a place is in."""
        if place not in self._rooms_of:
            away = self.distances(np.array([place[:2]]))[0]
            self._rooms_of[place] = np.flatnonzero(away <= IN_ROOM_M).tolist()
        return self._rooms_of[place]

    def _space_numbers(self, edges: list[tuple[_End, _End]]) -> np.ndarray:
        """Return the number of each room's space (rooms + 1,); the last entry is the number of the outside's space.

        `edges` are lines without a wall, as pairs of ends; the rooms on the two sides of such a line are one space.
        """
        numbers = np.arange(len(self._rooms) + 1)
        for edge in edges:
            joined = numbers[list(self._rooms_beside(*edge))]
            numbers[np.isin(numbers, joined)] = joined.min()
        return numbers

    def _rooms_beside(self, start: _End, end: _End) -> set[int]:
        """Return the rooms next to the middle of a line, and `OUTSIDE` if one side of the middle is in no room."""
        (x, z), (end_x, end_z) = start, end
        middle = np.array([(x + end_x) / 2, (z + end_z) / 2])
        across = np.array([z - end_z, end_x - x]) / max(math.hypot(end_x - x, end_z - z), 1e-9) * BESIDE_M / 2
        away = self.distances(np.array([middle, middle + across, middle - across]))
        found = set(np.flatnonzero(away[0] < BESIDE_M).tolist())
        return found | {OUTSIDE} if (away[1:].min(axis=1) > WALL_M).any() else found


def _ends(panel: WallPanel, hole: Hole) -> tuple[_End, _End]:
    """Return the ends of a hole in the plan, sorted so that the two panels of a wall give the same result."""
    start, end = np.array(panel.start), np.array(panel.end)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    low, high = sorted(tuple(np.round(start + at * along, 6).tolist()) for at in (hole.left, hole.right))
    return low, high


def _open_edges(room: RoomShape, panels: list[WallPanel]) -> Iterator[tuple[_End, _End]]:
    """Yield short parts (two ends each) of a room's edges along which no wall reaches from floor to ceiling."""
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
    """Yield each space that lines of sight from `space` can reach, and the part of `sector` in which they reach it."""
    yield space, sector
    for hole, directions in holes:
        common = sector.intersection(directions) if space in hole.sides else None
        if common is not None:
            for other in hole.sides - passed - {space}:
                yield from _visible_spaces(other, common, holes, passed | {space})
