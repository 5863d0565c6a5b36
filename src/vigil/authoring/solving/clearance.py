"""Clearance grids: distances on the floor to walls and to the things that an agent knows.

They are for an agent that finds its way by sight. They are coarser than `vigil.scene.floor`, but quick to compute again
when another thing comes into view.
"""

import math
from collections.abc import Mapping

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.scene.floor import Point2, grid_graph
from vigil.scene.outlines import floor_of_rooms, thing_shapes, wall_shapes
from vigil.scene.things import Scene, Thing

CELL_M = 0.05
MAX_CLEARANCE_M = 0.5
"""Maximum clearance (m) that is computed. Larger clearances count as this value."""
MIN_CLEARANCE_M = 0.17
"""Minimum clearance (m) with which an agent tries to pass: less than the body's radius, because sight is inexact."""
CLEARANCE_STEPS_M = (MIN_CLEARANCE_M, 0.2, 0.22, 0.25, 0.3, 0.35)
COST_FACTORS = (40.0, 12.0, 6.0, 2.5, 1.3, 1.0)
"""Cost per metre at each of the clearances `CLEARANCE_STEPS_M`. Between them, the cost is interpolated."""
MAX_DETOUR_FACTOR, TRIED_CORNERS = 1.15, 40
"""Maximum cost of a straight line, relative to the part of the route that it replaces, and number of lines tried."""
ENTRY_CELLS, NEXT_CELLS = 5, 5
"""Maximum distance (cells) from a place to a cell with a route, and minimum distance (cells) to the next waypoint."""


class ClearanceGrid:
    """Distances (m) from the cells of a scene's floor to its walls and things. They are cached for each thing."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        floor = floor_of_rooms(scene.rooms)
        left, low, right, high = floor.bounds
        self.origin = np.array([left, low])
        self.shape = math.ceil((right - left) / CELL_M) + 1, math.ceil((high - low) / CELL_M) + 1
        self._x, self._z = (
            start + np.arange(count) * CELL_M for start, count in zip(self.origin, self.shape, strict=True)
        )
        grid_x, grid_z = np.meshgrid(self._x, self._z, indexing="ij")
        walls = shapely.unary_union([shape for panel in scene.panels for shape in wall_shapes(panel)])
        self._bare = np.where(
            shapely.contains_xy(floor, grid_x, grid_z),
            np.minimum(shapely.distance(shapely.points(grid_x, grid_z), walls), MAX_CLEARANCE_M),
            0.0,
        )
        self._things: dict[tuple, tuple[tuple[int, int], np.ndarray]] = {}
        self._shapes: dict[tuple, list[BaseGeometry]] = {}

    def is_in_the_way(self, thing: Thing) -> bool:
        """Return whether the agent's body can collide with a thing in its current state."""
        return thing.is_present and not thing.is_held and bool(self._shapes_of(thing))

    def clearances(self, things: Mapping[str, Thing], shifts_m: Mapping[str, Point2] | None = None) -> np.ndarray:
        """Return each cell's distance (m) to the nearest wall or thing, at most `MAX_CLEARANCE_M`; an array of `shape`.

        `shifts_m` maps thing ids to offsets (x, z; m) by which things are assumed to be displaced, rounded to cells.
        """
        found = self._bare.copy()
        for name, thing in things.items():
            (left, low), gaps = self._around(thing)
            across, up = (round(shift / CELL_M) for shift in (shifts_m or {}).get(name, (0.0, 0.0)))
            left, low = left + across, low + up
            cut_left, cut_low = max(-left, 0), max(-low, 0)
            gaps = gaps[cut_left : max(self.shape[0] - left, 0), cut_low : max(self.shape[1] - low, 0)]
            window = found[left + cut_left :, low + cut_low :][: gaps.shape[0], : gaps.shape[1]]
            np.minimum(window, gaps, out=window)
        return found

    def cells(self, points: np.ndarray) -> np.ndarray:
        """Return the indices (n, 2) of the cells nearest to points (n, 2) in x, z (border cells for points outside)."""
        return np.clip(np.rint((points - self.origin) / CELL_M).astype(int), 0, np.array(self.shape) - 1)

    def place(self, cell: np.ndarray) -> Point2:
        """Return the place (x, z; m) of a cell, whose two indices are in `cell` (2,)."""
        return float(self._x[cell[0]]), float(self._z[cell[1]])

    def _around(self, thing: Thing) -> tuple[tuple[int, int], np.ndarray]:
        """Return the first cell of a window around a thing, and the distances (m) from its cells to the thing."""
        key = _placement_key(thing)
        if key not in self._things:
            shape = shapely.unary_union(self._shapes_of(thing))
            reach = np.array([-MAX_CLEARANCE_M, MAX_CLEARANCE_M])
            first, last = self.cells(np.array(shape.bounds).reshape(2, 2) + reach[:, None])
            x, z = np.meshgrid(self._x[first[0] : last[0] + 1], self._z[first[1] : last[1] + 1], indexing="ij")
            self._things[key] = (int(first[0]), int(first[1])), shapely.distance(shapely.points(x, z), shape)
        return self._things[key]

    def _shapes_of(self, thing: Thing) -> list[BaseGeometry]:
        key = _placement_key(thing)
        if key not in self._shapes:
            self._shapes[key] = thing_shapes(thing)
        return self._shapes[key]


def _placement_key(thing: Thing) -> tuple:
    """Return a cache key for a thing's outlines on the floor."""
    return thing.id, thing.position, thing.rotation, thing.openness


class RoutesTo:
    """The cheapest routes from all cells to one place. They depend on the clearances along them."""

    def __init__(self, grid: ClearanceGrid, clearances: np.ndarray, place: Point2) -> None:
        from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415 - loads over 200 modules

        self._grid = grid
        goal = tuple(int(index) for index in grid.cells(np.array([place]))[0])
        is_open = clearances >= MIN_CLEARANCE_M
        is_open[goal] = True
        costs, self._next = dijkstra(
            grid_graph(is_open, CELL_M, np.interp(clearances, CLEARANCE_STEPS_M, COST_FACTORS), cuts_corners=True),
            directed=False,
            indices=int(np.ravel_multi_index(goal, grid.shape)),
            return_predecessors=True,
        )
        self.costs = costs.reshape(grid.shape)

    def waypoint(self, place: Point2, clearances: np.ndarray) -> Point2 | None:
        """Return the farthest point on the route from `place` that can be reached straight at little extra cost.

        None if there is no route. `clearances` are the clearances that the agent assumes.
        """
        entry = self._entry(place)
        if entry is None:
            return None
        trail = self._trail(entry)
        best = trail[min(NEXT_CELLS, len(trail) - 1)]
        for cell in [*trail[:: max(1, len(trail) // TRIED_CORNERS)], trail[-1]]:
            along = float(self.costs[tuple(trail[0])] - self.costs[tuple(cell)])
            if self._straight_cost(place, self._grid.place(cell), clearances) <= MAX_DETOUR_FACTOR * along + CELL_M:
                best = cell
        return self._grid.place(best)

    def cost_of(self, start: Point2, end: Point2, clearances: np.ndarray) -> float:
        """Return the cost of walking straight from `start` to `end`, and then along the route from `end`; inf if the
        straight part is blocked.
        """
        cell = self._grid.cells(np.array([end]))[0]
        return self._straight_cost(start, end, clearances) + float(self.costs[tuple(cell)])

    def _straight_cost(self, start: Point2, end: Point2, clearances: np.ndarray) -> float:
        length = math.dist(start, end)
        count = max(2, math.ceil(length / CELL_M) + 1)
        points = np.linspace(start, end, count)
        cells = self._grid.cells(points)[1:]
        along = clearances[cells[:, 0], cells[:, 1]]
        if (along < MIN_CLEARANCE_M).any():
            return math.inf
        return length * float(np.interp(along, CLEARANCE_STEPS_M, COST_FACTORS).mean())

    def _entry(self, place: Point2) -> np.ndarray | None:
        """Return the nearest cell (2,) with a route, at most `ENTRY_CELLS` from a place; None if there is none."""
        cell = self._grid.cells(np.array([place]))[0]
        low, end = np.maximum(cell - ENTRY_CELLS, 0), cell + ENTRY_CELLS + 1
        window = self.costs[low[0] : end[0], low[1] : end[1]]
        found = np.argwhere(np.isfinite(window)) + low
        if not len(found):
            return None
        return found[int(np.argmin(((found - cell) ** 2).sum(axis=1)))]

    def _trail(self, cell: np.ndarray) -> list[np.ndarray]:
        at = int(np.ravel_multi_index(tuple(cell), self._grid.shape))
        trail = []
        while at >= 0:
            trail.append(np.array(np.unravel_index(at, self._grid.shape)))
            at = int(self._next[at])
        return trail
