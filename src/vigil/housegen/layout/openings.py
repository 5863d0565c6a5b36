"""Openings: doors, open passages, the front door and windows. Each has a place in a wall and an asset that fills it."""

from dataclasses import dataclass

import numpy as np

from vigil.base.geometry import Vec3
from vigil.housegen.base.models import Rect
from vigil.housegen.base.randomness import chance, pick, pick_weighted, shuffled
from vigil.housegen.base.tables import TABLES
from vigil.housegen.layout.floorplan import RoomLayout
from vigil.housegen.layout.walls import WallPiece, facing_piece, wall_pieces
from vigil.scene.geometry import moving_prisms_of
from vigil.scene.things import Thing
from vigil.scene.walls import DOOR_DEPTH_M

DOOR_WIDTH = 1.0
DOUBLE_WIDTH = 1.6
DOOR_HEIGHT = 2.1
CORNER_GAP = 0.2
"""Width (m) of wall that remains on each side of an opening."""
DOOR_CLEAR = 1.05
"""Depth (m) of the floor kept free on both sides of a door with a leaf, so that the leaf can swing."""
PASSAGE_CLEAR = 0.75
DOOR_VARIANTS = 12
WINDOW_VARIANTS = 12

WINDOW_HEIGHTS: dict[str, list[float]] = TABLES["window_heights"]
"""Kind of room -> heights (m) that its windows may have; the tops of windows are level with those of doors."""
WINDOWS_PER_ROOM = {"Kitchen": (1, 2), "LivingRoom": (1, 3), "Bedroom": (1, 2), "Bathroom": (0, 1)}
"""Kind of room -> least and greatest number of its windows."""


@dataclass(frozen=True, slots=True)
class PlannedOpening:
    """A hole in a wall, and the door or window in the hole. The hole is in the panels on both sides of the wall."""

    id: str
    category: str
    asset_id: str
    wall: WallPiece
    left: float
    """Distance (m) along `wall` at which the hole begins."""
    right: float
    """Distance (m) along `wall` at which the hole ends."""
    bottom: float = 0.0
    """Height (m) of the hole's bottom."""
    top: float = DOOR_HEIGHT
    """Height (m) of the hole's top."""
    other: WallPiece | None = None
    """The same part of the wall, seen from the room behind it; None if the outside is behind it."""
    openable: bool | None = None
    openness: float | None = None

    @property
    def is_door(self) -> bool:
        """Whether the opening is a door or an open passage; False for a window."""
        return self.category != "Window"

    @property
    def middle(self) -> float:
        """Distance (m) of the opening's middle along the wall."""
        return (self.left + self.right) / 2

    def clear_depth(self) -> float:
        """Return the depth (m) of the floor in front of the opening that must be free."""
        if not self.is_door:
            return 0.0
        return DOOR_CLEAR if self.category == "Doorway" and self.openable else PASSAGE_CLEAR

    def leaves(self) -> list[Rect]:
        """Return the rectangles of floor under the open leaves, in the room into which the leaves swing."""
        from vigil.assets.making import make  # noqa: PLC0415 - reads the descriptions of all shapes

        if self.category != "Doorway" or not self.openable:
            return []
        size = Vec3(round(self.right - self.left, 4), round(self.top - self.bottom, 4), DOOR_DEPTH_M)
        asset = make(self.category, size, int(self.asset_id.rpartition("_")[2]))
        x, z = self.wall.at(self.middle)
        thing = Thing(self.id, self.category, asset, Vec3(x, 0.0, z), Vec3(0.0, self.wall.yaw, 0.0))
        return [leaf.bounds for leaf in moving_prisms_of(thing, 1.0)]

    def span_in(self, room: int) -> tuple[WallPiece, float, float] | None:
        """Return the piece of the room's wall with the hole, and the hole's ends along it; None if there is no hole."""
        if self.wall.room == room:
            return self.wall, self.left, self.right
        if self.other is not None and self.other.room == room:
            return self.other, self.other.length - self.right, self.other.length - self.left
        return None


class _FreeWall:
    """The parts of walls that are still free for openings, and the variants of the house's doors and windows."""

    def __init__(self, door_variant: int, window_variant: int) -> None:
        self.door_variant = door_variant
        self.window_variant = window_variant
        self._used: dict[frozenset[tuple[float, float]], list[tuple[float, float]]] = {}

    def choose(self, piece: WallPiece, width: float, rng: np.random.Generator) -> tuple[float, float] | None:
        """Return a free place (left, right) for an opening of this width (m), and take it; None if none is free."""
        room = piece.length - 2 * CORNER_GAP - width
        if room < 0:
            return None
        used = self._used.setdefault(frozenset((piece.start, piece.end)), [])
        is_turned = piece.start > piece.end  # both sides of a wall share what is used, along one direction
        spans = [(piece.length - right, piece.length - left) for left, right in used] if is_turned else used
        for _ in range(8):
            at = CORNER_GAP + room * (0.5 if chance(rng, 0.25) else float(rng.random()))
            left, right = round(at, 3), round(at + width, 3)
            if all(right + 0.25 <= low or left >= high + 0.25 for low, high in spans):
                used.append((piece.length - right, piece.length - left) if is_turned else (left, right))
                return left, right
        return None


def cut_openings(plan: RoomLayout, rng: np.random.Generator) -> list[PlannedOpening] | None:
    """Return the plan's doors and windows; None if a door between two rooms does not fit into their wall."""
    pieces = wall_pieces(plan)
    free = _FreeWall(door_variant=int(rng.integers(DOOR_VARIANTS)), window_variant=int(rng.integers(WINDOW_VARIANTS)))
    openings: list[PlannedOpening] = []
    for link in plan.links:
        door = _inner_door(link, plan, pieces, free, rng)
        if door is None:
            return None
        openings.append(door)
    front = _front_door(plan, pieces, free, rng)
    if front is not None:
        openings.append(front)
    for room in plan.rooms:
        openings.extend(_windows(room.number, room.kind, pieces, free, rng))
    return openings


def _inner_door(
    link: tuple[int, int], plan: RoomLayout, pieces: list[WallPiece], free: _FreeWall, rng: np.random.Generator
) -> PlannedOpening | None:
    near, far = shuffled(rng, link)
    walls = [piece for piece in pieces if piece.room == near and piece.behind == far]
    kinds = {plan.room(near).kind, plan.room(far).kind}
    is_private = bool(kinds & {"Bathroom", "Bedroom"})
    category = "Doorway" if chance(rng, 0.85 if is_private else 0.45) else "Doorframe"
    width = DOUBLE_WIDTH if category == "Doorframe" and chance(rng, 0.4) else DOOR_WIDTH
    for wall in sorted(walls, key=lambda piece: -piece.length):
        span = free.choose(wall, width, rng)
        if span is None and width > DOOR_WIDTH:
            width = DOOR_WIDTH
            span = free.choose(wall, width, rng)
        if span is None:
            continue
        key, asset_id = f"door|{min(link)}|{max(link)}", f"vigil_{category}_{free.door_variant}"
        other, openable, openness = facing_piece(wall, pieces), None, None
        if category == "Doorway":
            openable, openness = True, 0.0 if chance(rng, 0.4) else 1.0
        return PlannedOpening(key, category, asset_id, wall, *span, other=other, openable=openable, openness=openness)
    return None


def _front_door(
    plan: RoomLayout, pieces: list[WallPiece], free: _FreeWall, rng: np.random.Generator
) -> PlannedOpening | None:
    order = {"LivingRoom": 0, "Kitchen": 1, "Bedroom": 2, "Bathroom": 3}
    for room in sorted(plan.rooms, key=lambda room: order[room.kind]):
        walls = [piece for piece in pieces if piece.room == room.number and piece.behind is None]
        for wall in shuffled(rng, walls):
            span = free.choose(wall, DOOR_WIDTH, rng)
            if span is not None:
                asset_id = f"vigil_Doorway_{int(rng.integers(DOOR_VARIANTS))}"
                return PlannedOpening(
                    f"door|1|{room.number}", "Doorway", asset_id, wall, *span, openable=False, openness=0.0
                )
    return None


def _windows(
    room: int, kind: str, pieces: list[WallPiece], free: _FreeWall, rng: np.random.Generator
) -> list[PlannedOpening]:
    walls = [piece for piece in pieces if piece.room == room and piece.behind is None and piece.length >= 1.2]
    low, high = WINDOWS_PER_ROOM[kind]
    found: list[PlannedOpening] = []
    for _ in range(int(rng.integers(low, high + 1)) * 2):
        if not walls or len(found) >= high:
            break
        wall = pick_weighted(rng, walls, [piece.length for piece in walls])
        width = pick(rng, (0.6, 0.8)) if kind == "Bathroom" else pick(rng, (0.9, 1.2, 1.5, 1.8))
        height = pick(rng, WINDOW_HEIGHTS[kind])
        span = free.choose(wall, width, rng)
        if span is None:
            continue
        asset_id, bottom = f"vigil_Window_{free.window_variant}", round(DOOR_HEIGHT - height, 3)
        found.append(PlannedOpening(f"window|{room}|{len(found)}", "Window", asset_id, wall, *span, bottom))
    return found[: int(rng.integers(low, high + 1))] if len(found) > low else found
