"""How much room there is on the floor around walls and around those things that somebody knows of.

A grid of distances, for a body that steers by sight: coarser than `vigil.authoring.solving.free_space`, and quickly
made anew when one more thing comes into view.
"""

import math
from collections.abc import Mapping

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from shapely.geometry.base import BaseGeometry

from vigil.authoring.solving.paths import Point2
from vigil.scene.outlines import floor_of_rooms, thing_shapes, wall_shapes
from vigil.scene.things import Scene, Thing

CELL_M = 0.05
MAX_CLEARANCE_M = 0.5
"""More room than this is not told apart."""
MIN_CLEARANCE_M = 0.17
"""The least room that one still tries to pass with: the body's radius, less than what sight is good for."""
CLEARANCE_STEPS_M = (MIN_CLEARANCE_M, 0.2, 0.22, 0.25, 0.3, 0.35)
COST_FACTORS = (40.0, 12.0, 6.0, 2.5, 1.3, 1.0)
"""How many times longer a way seems that leaves so much room."""
MAX_DETOUR_FACTOR, TRIED_CORNERS = 1.15, 40
"""How much more disliked a straight line may be than the way that it cuts short, and how many such lines are tried."""
ENTRY_CELLS, NEXT_CELLS = 5, 5
"""How far, in cells, one may stand from a way, and how far along it one looks at least."""
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


class ClearanceGrid:
    """Distances (m) from the cells of a scene's floor to its walls and things, kept thing by thing."""

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
        """Whether a body can run into a thing as it is now."""
        return thing.is_present and not thing.is_held and bool(self._shapes_of(thing))

    def clearances(self, things: Mapping[str, Thing], shifts_m: Mapping[str, Point2] | None = None) -> np.ndarray:
        """Return the distance (m) of every cell to the nearest wall or thing, at most WIDEST_M.

        `shifts_m` says by how much (x, z) things are taken to stand elsewhere; it is rounded to cells.
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
        """Return the cells (n, 2) nearest to points (n, 2) of x, z, those outside moved to the border."""
        return np.clip(np.rint((points - self.origin) / CELL_M).astype(int), 0, np.array(self.shape) - 1)

    def place(self, cell: np.ndarray) -> Point2:
        """Return the place (x, z) of a cell."""
        return float(self._x[cell[0]]), float(self._z[cell[1]])

    def _around(self, thing: Thing) -> tuple[tuple[int, int], np.ndarray]:
        """Return a thing's distances (m) around it, and the cell where they begin."""
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
    """Return what a thing's floor shapes follow from."""
    return thing.id, thing.position, thing.rotation, thing.openness


class RoutesTo:
    """The least disliked ways from everywhere to one place, over the room that there is."""

    def __init__(self, grid: ClearanceGrid, clearances: np.ndarray, place: Point2) -> None:
        self._grid = grid
        goal = tuple(int(index) for index in grid.cells(np.array([place]))[0])
        is_open = clearances >= MIN_CLEARANCE_M
        is_open[goal] = True
        costs, self._next = dijkstra(
            _graph(is_open, np.interp(clearances, CLEARANCE_STEPS_M, COST_FACTORS)),
            directed=False,
            indices=int(np.ravel_multi_index(goal, grid.shape)),
            return_predecessors=True,
        )
        self.costs = costs.reshape(grid.shape)

    def waypoint(self, place: Point2, clearances: np.ndarray) -> Point2 | None:
        """Return the farthest place on the way from a place that one may as well go straight to; None without a way.

        `clearances` is what one takes the room to be.
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
        """Return how long the way is by going straight to `end` first; inf where one cannot."""
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
        """Return the cell nearest to a place from which there is a way, within a step of it; None without."""
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


def _graph(is_open: np.ndarray, dislike: np.ndarray) -> coo_array:
    """Return how long the way seems from each open cell to the open ones beside it."""
    index = np.arange(is_open.size).reshape(is_open.shape)
    sources, targets, lengths = [], [], []
    for down, aside in _STEPS:
        here, there = _pair(index, down, aside)
        joined = np.logical_and(*_pair(is_open, down, aside))
        sources.append(here[joined])
        targets.append(there[joined])
        lengths.append(CELL_M * math.hypot(down, aside) * np.add(*_pair(dislike, down, aside))[joined] / 2)
    pairs = np.concatenate(sources), np.concatenate(targets)
    return coo_array((np.concatenate(lengths), pairs), shape=(is_open.size, is_open.size))


def _pair(grid: np.ndarray, down: int, aside: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a grid's cells beside those one step down and aside of them."""
    rows, columns = grid.shape
    if aside >= 0:
        return grid[: rows - down, : columns - aside], grid[down:, aside:]
    return grid[: rows - down, -aside:], grid[down:, : columns + aside]
