"""Which rooms can be seen from a place: those to which a straight line leads through doorways and windows.

All of it is in the plan, seen from above; heights are left out, and leaves stop no line, so a room too many is named
now and then and none too few.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from vigil.scene.outlines import room_floor
from vigil.scene.things import Scene, WallPanel

OUTSIDE = -1
BESIDE_M = 0.3
"""A hole leads into the rooms that are this near to its middle."""
IN_DOORWAY_M = 0.4
"""So near to a hole everything may be seen through it."""
_FULL = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class _Arc:
    """Directions in the plan, from an angle (radians) on."""

    start: float
    width: float

    def common(self, other: "_Arc") -> "_Arc | None":
        """Returns the directions that both have; None when there are none."""
        if other.width >= _FULL:
            return self
        if self.width >= _FULL:
            return other
        first = (other.start - self.start + np.pi) % _FULL - np.pi
        low, high = max(first, 0.0), min(first + other.width, self.width)
        return _Arc(self.start + low, high - low) if low <= high else None


@dataclass(frozen=True, slots=True)
class _Hole:
    start: tuple[float, float]
    end: tuple[float, float]
    sides: frozenset[int]

    def arc_from(self, eye: tuple[float, float]) -> _Arc:
        """Returns the directions in which the hole lies."""
        line = shapely.LineString([self.start, self.end])
        if shapely.distance(line, shapely.Point(eye)) < IN_DOORWAY_M:
            return _Arc(0.0, _FULL)
        first, last = (float(np.arctan2(z - eye[1], x - eye[0])) for x, z in (self.start, self.end))
        turn = (last - first + np.pi) % _FULL - np.pi
        return _Arc(min(first, first + turn), abs(turn))


class Portals:
    """The rooms of a scene and the holes between them."""

    def __init__(self, scene: Scene) -> None:
        self._rooms = [room_floor(room) for room in scene.rooms]
        self._bounds = shapely.bounds(self._rooms).reshape(-1, 2, 2)
        self._is_box = np.isclose(shapely.area(self._rooms), np.prod(np.diff(self._bounds, axis=1)[:, 0], axis=1))
        self.top_m = max((room.height for room in scene.rooms), default=0.0)  # an eye above it looks over the walls
        self._holes = [
            _Hole(start, end, sides)
            for panel in scene.panels
            for start, end in _ends(panel)
            if (sides := self._sides(start, end))
        ]

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

    def visible_from(self, eye: tuple[float, float]) -> np.ndarray:
        """Returns whether each room can be seen from a place (x, z) in the house; all from outside of it."""
        seen = np.zeros(len(self._rooms), dtype=bool)
        here = np.flatnonzero(self.distances(np.array([eye]))[0] < IN_DOORWAY_M)
        if not len(here):
            return ~seen
        arcs = [(hole, hole.arc_from(eye)) for hole in self._holes]
        for room in here.tolist():
            seen[list(_reached(room, _Arc(0.0, _FULL), arcs, frozenset()))] = True
        return seen

    def _sides(self, start: tuple[float, float], end: tuple[float, float]) -> frozenset[int]:
        line = shapely.LineString([start, end])
        near = np.flatnonzero(shapely.distance(self._rooms, shapely.centroid(line)) < BESIDE_M).tolist()
        return frozenset(near if len(near) > 1 else [*near, OUTSIDE])


def _ends(panel: WallPanel) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    start, end = np.array(panel.start), np.array(panel.end)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    for hole in panel.holes:
        (x, z), (other_x, other_z) = start + hole.left * along, start + hole.right * along
        yield (float(x), float(z)), (float(other_x), float(other_z))


def _reached(room: int, arc: _Arc, arcs: list[tuple[_Hole, _Arc]], passed: frozenset[int]) -> Iterator[int]:
    if room != OUTSIDE:
        yield room
    for hole, directions in arcs:
        common = arc.common(directions) if room in hole.sides else None
        if common is not None:
            for other in hole.sides - passed - {room}:
                yield from _reached(other, common, arcs, passed | {room})
