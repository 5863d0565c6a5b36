"""Space taken by the objects of one room: their boxes, and the space through which their leaves move.

Leaves are doors, drawers and lids.
"""

from collections.abc import Iterable

from vigil.housegen.base.models import Block, PlacedObject, Rect, turned_rect
from vigil.housegen.furnishing.floor import Floor

SWING_GAP = 0.01
"""Least gap (m) between moving leaves and walls or other objects, because handles and rims stick out of the solids."""
TOUCH_M = 0.005
"""Two blocks that overlap in height by at most this (m) only touch."""


class Occupancy:
    """The blocks that objects take in a room, and the blocks that leaves move through.

    No block of one object may overlap a block of another.
    """

    def __init__(self, floor: Floor, pieces: Iterable[PlacedObject]) -> None:
        self._outside = floor.outside
        self._frames = floor.window_frames
        self._hung: list[Block] = []
        self._pieces: list[tuple[PlacedObject, Block]] = []
        self._swings: list[tuple[PlacedObject, Block]] = []
        for piece in pieces:
            self.add(piece)

    def add(self, piece: PlacedObject) -> None:
        """Add an object that has been placed in the room, and everything on and in it."""
        for found in piece.with_contents():
            self._pieces.append((found, found.block()))
            swing = found.swing()
            if swing is not None:
                self._swings.append((found, swing))
            if piece.is_on_wall:
                self._hung.append(found.block())

    def has_room_for(self, piece: PlacedObject, parent: PlacedObject | None = None) -> bool:
        """Return whether a new object on `parent` is clear of all leaves, and its own leaves can move."""
        own, swing = piece.block(), piece.swing()
        stands = not piece.is_on_wall and (parent is None or not parent.is_on_wall)
        if stands and any(_overlap(own, block, 0.0) for block in [*self._frames, *self._hung]):
            return False
        if any(other is not parent and _overlap(own, block, SWING_GAP) for other, block in self._swings):
            return False
        if swing is None:
            return True
        others = [block for other, block in [*self._pieces, *self._swings] if other is not parent]
        return (
            all(are_apart(swing[0], wall, SWING_GAP) for wall in self._outside)
            and not any(_overlap(swing, block, SWING_GAP) for block in [*(self._frames if parent else ()), *others])
            and not _hits_parent(swing, own, parent)
        )


def are_apart(a: Rect, b: Rect, gap: float) -> bool:
    """Return whether two rectangles are at least `gap` apart."""
    return a[2] + gap <= b[0] or a[0] >= b[2] + gap or a[3] + gap <= b[1] or a[1] >= b[3] + gap


def _overlap(one: Block, two: Block, gap: float) -> bool:
    """Return whether two blocks overlap, or are less than `gap` apart."""
    is_level = min(one[2], two[2]) - max(one[1], two[1]) > TOUCH_M
    return is_level and not are_apart(one[0], two[0], gap)


def _hits_parent(swing: Block, own: Block, parent: PlacedObject | None) -> bool:
    """Return whether an object's leaf hits the object's parent; solids of the parent around the object are ignored.

    `swing` is the block that the leaf moves through, and `own` is the object's block.
    """
    if parent is None:
        return False
    x, y, z = parent.position
    for solid in parent.model.asset.solids:
        xs, zs = zip(*solid.polygon, strict=True)
        rect = turned_rect((min(xs), min(zs), max(xs), max(zs)), x, z, parent.yaw)
        block = (rect, y + solid.bottom, y + solid.top)
        if _overlap(swing, block, 0.0) and not _overlap(own, block, 0.0):
            return True
    return False
