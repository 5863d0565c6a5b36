"""The floor of one room while it is furnished: what is taken, what must stay free, and where an agent can walk."""

import itertools

import numpy as np
from shapely import Polygon, contains_xy

from vigil.housegen.base.models import Block, Rect
from vigil.housegen.layout.floorplan import Corner, RoomPlan
from vigil.housegen.layout.openings import PlannedOpening
from vigil.housegen.layout.walls import room_edges
from vigil.scene.floor import largest_part
from vigil.scene.outlines import BODY_RADIUS_M, GRID_M

LEAST_WALKABLE = 0.93
"""Least share of the free grid nodes that must be connected. (For a whole house, the rule requires 0.9.)"""
EPS = 1e-6
DOORSTEP_M = 0.4
"""A body is in a door if the distances in x and in z from the middle of the doorstep add up to at most this (m)."""
FRAME_M = 0.09
"""How far (m) window frames and sills reach into the room."""
WALL_GAP = 0.02
"""Gap (m) between furniture and the wall behind it."""


class Floor:
    """The floor of a room. All its rectangles have sides along the axes, like the room itself."""

    def __init__(self, room: RoomPlan, openings: list[PlannedOpening]) -> None:
        self.room = room
        self.edges = room_edges(room)
        self.holes = {opening.id: span for opening in openings if (span := opening.span_in(room.number))}
        """Id of an opening -> the piece of the room's wall with its hole, and the hole's ends along this piece (m)."""
        self.openings = [opening for opening in openings if opening.id in self.holes]
        self.outside = _outside_rects(room.polygon)
        self.taken: list[Rect] = []
        self.clear: list[Rect] = [
            self._strip(opening, depth, margin=0.08)
            for opening in self.openings
            if (depth := opening.clear_depth()) > 0
        ]
        self.access: list[Rect] = []
        self.sweeps: list[Rect] = []
        windows = [opening for opening in self.openings if not opening.is_door]
        self.windows: list[Rect] = [self._strip(window, 0.35) for window in windows]
        self.window_frames: list[Block] = [
            (self._strip(window, FRAME_M), window.bottom, window.top) for window in windows
        ]
        """Blocks that are filled by the frames and sills of windows."""
        self.doorsteps = [
            self._strip(opening, 0.5) for opening in self.openings if opening.is_door and opening.openable is not False
        ]
        self.leaves: list[Rect] = [
            rect for opening in self.openings if opening.wall.room == room.number for rect in opening.leaves()
        ]
        x0, z0, x1, z1 = room.polygon.bounds
        xs = np.arange(np.ceil(x0 / GRID_M), np.floor(x1 / GRID_M) + 1) * GRID_M
        zs = np.arange(np.ceil(z0 / GRID_M), np.floor(z1 / GRID_M) + 1) * GRID_M
        self.grid_x, self.grid_z = np.meshgrid(xs, zs)
        core = room.polygon.buffer(-BODY_RADIUS_M - 0.01, join_style="mitre")
        self.walkable = contains_xy(core, self.grid_x, self.grid_z)

    def _strip(self, opening: PlannedOpening, depth: float, margin: float = 0.0) -> Rect:
        wall, left, right = self.holes[opening.id]
        return rect_of(wall.at(left - margin), wall.at(right + margin, depth))

    @property
    def area(self) -> float:
        """Area in square metres."""
        return self.room.polygon.area

    def fits(self, rects: np.ndarray, is_tall: bool = False) -> np.ndarray:
        """Return a mask (...) of the rectangles (..., 4) that lie in the room, on floor that is neither taken nor kept
        free.

        With `is_tall`, they must not be in front of windows either.
        """
        windows = self.windows if is_tall else []
        return _are_apart(rects, [*self.outside, *self.taken, *self.clear, *self.access, *self.sweeps, *windows])

    def is_open(self, rects: np.ndarray) -> np.ndarray:
        """Return a mask (...) of the rectangles (..., 4) that lie in the room and do not touch furniture."""
        return _are_apart(rects, [*self.outside, *self.taken])

    def is_clear(self, rects: np.ndarray) -> np.ndarray:
        """Return a mask (...) of the rectangles (..., 4) that lie in the room, clear of furniture and doors."""
        return _are_apart(rects, [*self.outside, *self.taken, *self.clear])

    def can_walk(self, more: list[Rect], access: list[Rect]) -> bool:
        """Return whether an agent can still walk to all doors and to the floor in front of all furniture.

        `more` are rectangles of furniture that would be added, and `access` is the floor in front of it.
        """
        free = self.free_grid(more)
        main = largest_part(free)
        if not main.any() or main.sum() < LEAST_WALKABLE * free.sum():
            return False
        xs, zs = self.grid_x[main], self.grid_z[main]
        return all(
            (np.abs(xs - (x0 + x1) / 2) + np.abs(zs - (z0 + z1) / 2) <= DOORSTEP_M).any()
            for x0, z0, x1, z1 in self.doorsteps
        ) and all(
            ((xs >= x0) & (xs <= x1) & (zs >= z0) & (zs <= z1)).any() for x0, z0, x1, z1 in [*self.access, *access]
        )

    def free_grid(self, more: list[Rect]) -> np.ndarray:
        """Return a mask (rows, columns) of the grid nodes where the body fits if furniture is added on the rectangles
        `more`."""
        free = self.walkable.copy()
        for x0, z0, x1, z1 in [*self.taken, *self.leaves, *more]:
            reach = BODY_RADIUS_M + 0.01
            free &= ~(
                (self.grid_x > x0 - reach)
                & (self.grid_x < x1 + reach)
                & (self.grid_z > z0 - reach)
                & (self.grid_z < z1 + reach)
            )
        return free


def rect_of(a: Corner, b: Corner) -> Rect:
    """Return the rectangle with two given opposite corners."""
    return min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])


def _outside_rects(polygon: Polygon) -> list[Rect]:
    """Return rectangles that together cover the area around a room; the room's walls are along the axes."""
    xs = sorted({x for x, _ in polygon.exterior.coords})
    zs = sorted({z for _, z in polygon.exterior.coords})
    far = 100.0
    rects: list[Rect] = [
        (-far, -far, xs[0], far),
        (xs[-1], -far, far, far),
        (-far, -far, far, zs[0]),
        (-far, zs[-1], far, far),
    ]
    for x0, x1 in itertools.pairwise(xs):
        for z0, z1 in itertools.pairwise(zs):
            if not contains_xy(polygon, (x0 + x1) / 2, (z0 + z1) / 2):
                rects.append((x0, z0, x1, z1))
    return rects


def _are_apart(rects: np.ndarray, blocks: list[Rect]) -> np.ndarray:
    """Return a mask (...) of the rectangles (..., 4) that do not overlap any of the `blocks`."""
    x0, z0, x1, z1 = np.moveaxis(rects[..., None, :], -1, 0)
    left, low, right, high = np.asarray(blocks).T
    are_apart = (x0 >= right - EPS) | (x1 <= left + EPS) | (z0 >= high - EPS) | (z1 <= low + EPS)
    return np.asarray(are_apart.all(axis=-1))
