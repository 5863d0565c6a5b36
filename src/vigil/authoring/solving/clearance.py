"""How much room there is on the floor around walls and around those things that somebody knows of.

A grid of distances, for a body that steers by sight: coarser than `vigil.authoring.solving.free_space`, and quickly
made anew when one more thing comes into view.
"""

import math
from collections.abc import Iterable

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from vigil.authoring.solving.paths import Point2
from vigil.scene.outlines import thing_shapes, wall_shapes, whole_floor
from vigil.scene.things import Scene, Thing

CELL_M = 0.05
WIDEST_M = 0.5
"""More room than this is not told apart."""
SQUEEZE_M = 0.17
"""The least room that one still tries to pass with: the body's radius, less than what sight is good for."""
ROOM_M = (SQUEEZE_M, 0.2, 0.22, 0.25, 0.3, 0.35)
DISLIKE = (40.0, 12.0, 6.0, 2.5, 1.3, 1.0)
"""How many times longer a way seems that leaves so much room."""
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


class ClearanceGrid:
    """Distances (m) from the cells of a scene's floor to its walls and things, kept thing by thing."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        floor = whole_floor(scene.rooms)
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
            np.minimum(shapely.distance(shapely.points(grid_x, grid_z), walls), WIDEST_M),
            0.0,
        )
        self._things: dict[tuple, tuple[tuple[slice, slice], np.ndarray]] = {}

    def room(self, things: Iterable[Thing]) -> np.ndarray:
        """Returns the distance (m) of every cell to the nearest wall or named thing, at most WIDEST_M."""
        found = self._bare.copy()
        for thing in things:
            window, gaps = self._around(thing)
            np.minimum(found[window], gaps, out=found[window])
        return found

    def cells(self, points: np.ndarray) -> np.ndarray:
        """Returns the cells (n, 2) nearest to points (n, 2) of x, z, those outside moved to the border."""
        return np.clip(np.rint((points - self.origin) / CELL_M).astype(int), 0, np.array(self.shape) - 1)

    def place(self, cell: np.ndarray) -> Point2:
        """Returns the place (x, z) of a cell."""
        return float(self._x[cell[0]]), float(self._z[cell[1]])

    def _around(self, thing: Thing) -> tuple[tuple[slice, slice], np.ndarray]:
        key = thing.id, thing.position, thing.rotation, thing.openness
        if key not in self._things:
            shape = shapely.unary_union(thing_shapes(thing))
            reach = np.array([-WIDEST_M, WIDEST_M])
            first, last = self.cells(np.array(shape.bounds).reshape(2, 2) + reach[:, None])
            window = slice(first[0], last[0] + 1), slice(first[1], last[1] + 1)
            x, z = np.meshgrid(self._x[window[0]], self._z[window[1]], indexing="ij")
            self._things[key] = window, shapely.distance(shapely.points(x, z), shape)
        return self._things[key]


class WaysTo:
    """The least disliked ways from everywhere to one place, over the room that there is."""

    def __init__(self, grid: ClearanceGrid, room: np.ndarray, place: Point2) -> None:
        self._grid = grid
        self._dislike = np.interp(room, ROOM_M, DISLIKE)
        self._is_open = room >= SQUEEZE_M
        self._goal = grid.cells(np.array([place]))[0]
        self._is_open[tuple(self._goal)] = True
        costs, self._next = dijkstra(
            self._graph(), directed=False, indices=int(np.ravel_multi_index(tuple(self._goal), grid.shape)),
            return_predecessors=True,
        )  # fmt: skip
        self.costs = costs.reshape(grid.shape)

    def leads_from(self, place: Point2) -> bool:
        """Whether there is a way from a place."""
        return self._entry(place) is not None

    def waypoint(self, place: Point2) -> Point2 | None:
        """Returns the farthest place on the way from `place` that one may as well go straight to; None without a way."""
        entry = self._entry(place)
        if entry is None:
            return None
        trail = self._trail(entry)
        best = trail[min(1, len(trail) - 1)]
        for cell in trail[:: max(1, len(trail) // 40)]:
            along = self.costs[tuple(trail[0])] - self.costs[tuple(cell)]
            if self._straight_cost(place, self._grid.place(cell)) <= 1.15 * along + CELL_M:
                best = cell
        if self._straight_cost(place, self._grid.place(trail[-1])) <= 1.15 * self.costs[tuple(trail[0])] + CELL_M:
            best = trail[-1]
        return self._grid.place(best)

    def cost_of(self, start: Point2, end: Point2) -> float:
        """Returns how long the way is by going straight to `end` first; inf where one cannot."""
        cell = self._grid.cells(np.array([end]))[0]
        return self._straight_cost(start, end) + float(self.costs[tuple(cell)])

    def _straight_cost(self, start: Point2, end: Point2) -> float:
        length = math.dist(start, end)
        count = max(2, math.ceil(length / CELL_M) + 1)
        points = np.linspace(start, end, count)
        cells = self._grid.cells(points)[1:]
        if not self._is_open[cells[:, 0], cells[:, 1]].all():
            return math.inf
        return length * float(self._dislike[cells[:, 0], cells[:, 1]].mean())

    def _entry(self, place: Point2) -> np.ndarray | None:
        """Returns the cell nearest to a place from which there is a way, within a step of it; None without."""
        cell = self._grid.cells(np.array([place]))[0]
        low = np.maximum(cell - 5, 0)
        window = self.costs[low[0] : cell[0] + 6, low[1] : cell[1] + 6]
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

    def _graph(self) -> coo_array:
        index = np.arange(self._is_open.size).reshape(self._is_open.shape)
        sources, targets, lengths = [], [], []
        for down, aside in _STEPS:
            here, there = _pair(index, down, aside)
            is_open = _pair(self._is_open, down, aside)
            dislike = _pair(self._dislike, down, aside)
            joined = is_open[0] & is_open[1]
            sources.append(here[joined])
            targets.append(there[joined])
            lengths.append(CELL_M * math.hypot(down, aside) * (dislike[0] + dislike[1])[joined] / 2)
        count = self._is_open.size
        pairs = np.concatenate(sources), np.concatenate(targets)
        return coo_array((np.concatenate(lengths), pairs), shape=(count, count))


def _pair(grid: np.ndarray, down: int, aside: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a grid's cells beside those one step down and aside of them."""
    rows, columns = grid.shape
    if aside >= 0:
        return grid[: rows - down, : columns - aside], grid[down:, aside:]
    return grid[: rows - down, -aside:], grid[down:, : columns + aside]
