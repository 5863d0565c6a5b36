"""Walls: the edges of every room, cut into pieces where another room begins behind the wall."""

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

from shapely import Point

from vigil.housegen.layout.floorplan import Corner, RoomLayout, RoomPlan


@dataclass(frozen=True)
class WallPiece:
    """A straight part of a room's wall with one neighbour behind it. From start to end, the room is on the right."""

    room: int
    """Number of the room."""
    behind: int | None
    """Number of the room behind the wall piece; None when the outside is behind it."""
    start: Corner
    end: Corner

    @cached_property
    def length(self) -> float:
        """Length in metres."""
        return math.dist(self.start, self.end)

    @cached_property
    def direction(self) -> Corner:
        """Unit vector from the start to the end."""
        return (self.end[0] - self.start[0]) / self.length, (self.end[1] - self.start[1]) / self.length

    @cached_property
    def inward(self) -> Corner:
        """Unit normal that points into the room."""
        x, z = self.direction
        return z, -x

    @cached_property
    def yaw(self) -> float:
        """Yaw (deg) of an object with its back to the wall."""
        x, z = self.inward
        return math.degrees(math.atan2(x, z)) % 360.0

    def at(self, along: float, into: float = 0.0) -> Corner:
        """Return the floor point `along` metres from the start and `into` metres inside the room."""
        (dx, dz), (nx, nz) = self.direction, self.inward
        return self.start[0] + along * dx + into * nx, self.start[1] + along * dz + into * nz

    def along(self, point: Corner) -> float:
        """Return how far (m) a floor point is from the start, measured along the piece."""
        dx, dz = self.direction
        return (point[0] - self.start[0]) * dx + (point[1] - self.start[1]) * dz

    def into(self, point: Corner) -> float:
        """Return how far (m) a floor point is from the wall, measured into the room."""
        nx, nz = self.inward
        return (point[0] - self.start[0]) * nx + (point[1] - self.start[1]) * nz

    @property
    def id(self) -> str:
        """Id, in the house document, of the wall panel on the side of the room."""
        return f"wall|{self.room}|{self._place()}"

    @property
    def exterior_id(self) -> str:
        """Id, in the house document, of the wall panel on the outside."""
        return f"wall|exterior|{self._place()}"

    def _place(self) -> str:
        (x0, z0), (x1, z1) = sorted((self.start, self.end))
        return f"{x0:.2f}|{z0:.2f}|{x1:.2f}|{z1:.2f}"


def room_edges(room: RoomPlan) -> list[WallPiece]:
    """Return one uncut piece for each straight wall of the room. The pieces do not say which room is behind."""
    corners = room.corners
    return [
        WallPiece(room.number, None, start, end) for start, end in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]


def wall_pieces(plan: RoomLayout) -> list[WallPiece]:
    """Return all wall pieces, room by room."""
    pieces: list[WallPiece] = []
    for room in plan.rooms:
        others = [other for other in plan.rooms if other.number != room.number]
        for edge in room_edges(room):
            pieces.extend(_cut(edge, others))
    return pieces


def _cut(edge: WallPiece, others: list[RoomPlan]) -> list[WallPiece]:
    cuts = {0.0, round(edge.length, 4)}
    for other in others:
        for corner in other.corners:
            along = edge.along(corner)
            is_on_line = math.dist(edge.at(along), corner) < 1e-6
            if is_on_line and 1e-6 < along < edge.length - 1e-6:
                cuts.add(round(along, 4))
    marks = sorted(cuts)
    pieces: list[WallPiece] = []
    for left, right in itertools.pairwise(marks):
        probe = Point(edge.at((left + right) / 2, -0.05))
        behind = next((other.number for other in others if other.polygon.contains(probe)), None)
        start, end = _rounded(edge.at(left)), _rounded(edge.at(right))
        if pieces and pieces[-1].behind == behind:
            start = pieces.pop().start
        pieces.append(WallPiece(edge.room, behind, start, end))
    return pieces


def _rounded(corner: Corner) -> Corner:
    return round(corner[0], 3), round(corner[1], 3)


def facing_piece(piece: WallPiece, pieces: list[WallPiece]) -> WallPiece:
    """Return the piece that covers the same part of the wall as `piece`, seen from the room behind it."""
    return next(
        other
        for other in pieces
        if other.room == piece.behind and other.start == piece.end and other.end == piece.start
    )
