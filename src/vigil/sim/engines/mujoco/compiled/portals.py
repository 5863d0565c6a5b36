"""What can be seen from a place, by the rooms: that to which a straight line leads through doorways and windows.

Rooms and holes are boxes without walls between them, and leaves stop no line, so something is named too much now and
then, and nothing too little.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from vigil.scene.outlines import room_floor
from vigil.scene.things import Hole, Scene, WallPanel

OUTSIDE = -1
BESIDE_M = 0.3
"""A hole leads into the rooms that are this near to its middle."""
IN_DOORWAY_M = 0.4
"""So near to a hole everything may be seen through it."""
SAME_M = 0.02
"""An eye is in all rooms that are not this much farther from it than the nearest."""
_FULL = 2.0 * np.pi


@dataclass(frozen=True, slots=True, eq=False)
class Spans:
    """The directions in which some things lie from an eye; each of the arrays is (n,)."""

    start: np.ndarray
    """From this angle in the plan on (radians), over `width`."""
    width: np.ndarray
    low: np.ndarray
    """Between these slopes: metres up a metre in the plan."""
    high: np.ndarray

    @staticmethod
    def of(eye: np.ndarray, corners: np.ndarray) -> "Spans":
        """Returns the directions from an eye (3,) to all that lies between the corners (k, n, 3) of each thing."""
        x, y, z = np.moveaxis(corners - eye, -1, 0)
        angle = np.arctan2(y.mean(axis=0), x.mean(axis=0))
        turns = (np.arctan2(y, x) - angle + np.pi) % _FULL - np.pi
        first, last = turns.min(axis=0), turns.max(axis=0)
        is_around = last - first >= np.pi
        nearest = np.maximum((x * np.cos(angle) + y * np.sin(angle)).min(axis=0), 0.0)
        nearest[is_around] = 0.0
        farthest = np.hypot(x, y).max(axis=0)
        lowest, highest = z.min(axis=0), z.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.where(lowest < 0.0, lowest / nearest, lowest / farthest)
            high = np.where(highest > 0.0, highest / nearest, highest / farthest)
        return Spans(angle + first, np.where(is_around, _FULL, last - first), low, high)

    def sectors(self) -> "list[Sector]":
        """Returns the directions of each thing."""
        columns = zip(self.start.tolist(), self.width.tolist(), self.low.tolist(), self.high.tolist(), strict=True)
        return [Sector(*each) for each in columns]


@dataclass(frozen=True, slots=True)
class Sector:
    """Directions from an eye: an arc of the plan from an angle on (radians), between two slopes."""

    start: float
    width: float
    low: float = -np.inf
    high: float = np.inf

    def common(self, other: "Sector") -> "Sector | None":
        """Returns directions that hold all that both have; None when there are none."""
        low, high = max(self.low, other.low), min(self.high, other.high)
        if low > high:
            return None
        if self.width >= _FULL or other.width >= _FULL:
            arc = other if self.width >= _FULL else self
            return Sector(arc.start, arc.width, low, high)
        first = (other.start - self.start + np.pi) % _FULL - np.pi
        start, end = max(first, 0.0), min(first + other.width, self.width)
        return Sector(self.start + start, end - start, low, high) if start <= end else None

    def holds_any(self, spans: Spans) -> np.ndarray:
        """Returns in which of the directions to things (n,) something of this lies."""
        first = (spans.start - self.start + np.pi) % _FULL - np.pi
        is_across = (np.maximum(first, 0.0) <= np.minimum(first + spans.width, self.width)) | (spans.width >= _FULL)
        return (is_across | (self.width >= _FULL)) & (spans.low <= self.high) & (spans.high >= self.low)


ALL = Sector(0.0, _FULL)


@dataclass(frozen=True, slots=True)
class _Hole:
    """A hole in a wall, in MuJoCo's frame."""

    start: tuple[float, float]
    end: tuple[float, float]
    bottom: float
    top: float
    sides: frozenset[int]

    @property
    def line(self) -> shapely.LineString:
        return shapely.LineString([self.start, self.end])

    def corners(self) -> list[tuple[float, float, float]]:
        return [(x, y, height) for x, y in (self.start, self.end) for height in (self.bottom, self.top)]


class Portals:
    """The rooms of a scene and the holes between them."""

    def __init__(self, scene: Scene) -> None:
        self._rooms = [room_floor(room) for room in scene.rooms]
        self._bounds = shapely.bounds(self._rooms).reshape(-1, 2, 2)
        self._is_box = np.isclose(shapely.area(self._rooms), np.prod(np.diff(self._bounds, axis=1)[:, 0], axis=1))
        self.top_m = max((room.height for room in scene.rooms), default=0.0)  # an eye above it looks over the walls
        # Both sides of a wall name its holes.
        self._holes = list(
            dict.fromkeys(
                _Hole(*ends, hole.bottom, hole.top, sides)
                for panel in scene.panels
                for hole in panel.holes
                if (sides := self._sides(*(ends := _ends(panel, hole))))
            )
        )
        self._lines = np.array([hole.line for hole in self._holes])
        self._corners = np.array([hole.corners() for hole in self._holes]).reshape(-1, 4, 3).swapaxes(0, 1)

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
        self, eye: np.ndarray, entry: np.ndarray | None = None, through: Sector = ALL
    ) -> list[tuple[int, Sector]] | None:
        """Returns in which directions which rooms are seen from an eye (3,), a room as often as there are ways to it.

        None stands for everything: the eye is above the walls or outside. One that looks into a mirror is behind it;
        its lines enter the house at `entry` (3,), in the directions of the mirror.
        """
        if eye[2] > self.top_m:
            return None
        away = self.distances(np.array([eye if entry is None else entry])[:, :2])[0]
        if away.min(initial=np.inf) >= IN_DOORWAY_M:
            return None
        is_near = shapely.distance(self._lines, shapely.Point(eye[:2])) < IN_DOORWAY_M
        sectors = Spans.of(eye, self._corners).sectors()
        holes = [
            (hole, ALL if near else sector)
            for hole, near, sector in zip(self._holes, is_near.tolist(), sectors, strict=True)
        ]
        here = np.flatnonzero(away <= away.min() + SAME_M).tolist()
        return [found for room in here for found in _reached(room, through, holes, frozenset())]

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
