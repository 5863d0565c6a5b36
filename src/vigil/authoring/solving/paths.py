"""Shortest walks in the floor plane: where a body can stand, how long the walks are, and their corners.

This module knows polygons only, not simulators or episodes. `free_space` makes the free region of a scene.
"""

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import shapely
from cachetools import LRUCache
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from shapely.geometry.base import BaseGeometry

CELL_M = 0.05
SNAP_M, TRIED_ENTRIES = 0.45, 200
"""Greatest distance (m) from a place to the cell where its walks begin, and number of cells tried."""
SAME_POINT_M = 1e-9
PATH_CACHE_SIZE = 8
"""Number of places whose shortest walks a map caches."""
_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1))

Point2 = tuple[float, float]


class WalkableMap:
    """The places (x, z; m) where the body's axis may be, as a region and as a grid of cells inside it."""

    def __init__(
        self,
        roomy: BaseGeometry | Callable[[], BaseGeometry],
        tight: BaseGeometry | None = None,
        cell_m: float = CELL_M,
    ) -> None:
        """Make a map of two regions; `roomy` may be a function that is called when the region is first needed.

        `roomy` keeps a margin from obstacles; `tight` is all that the simulator allows (default: the same).
        """
        self._given = roomy
        self.tight = self.roomy if tight is None else tight
        shapely.prepare(self.tight)
        self._cell_m = cell_m
        self._walks: LRUCache[Point2, ShortestPaths] = LRUCache(PATH_CACHE_SIZE)

    @cached_property
    def roomy(self) -> BaseGeometry:
        """The region that keeps a margin from obstacles."""
        region = self._given() if callable(self._given) else self._given
        shapely.prepare(region)
        return region

    @cached_property
    def cells(self) -> np.ndarray:
        """Centres (n, 2) in x, z (m) of the cells inside the roomy region, in a fixed order."""
        rows, columns = np.nonzero(self._mask)
        return np.column_stack([self._origin[0] + columns * self._cell_m, self._origin[1] + rows * self._cell_m])

    @cached_property
    def _origin(self) -> Point2:
        if self.roomy.is_empty:
            return 0.0, 0.0
        left, low, _, _ = self.roomy.bounds
        return math.floor(left / self._cell_m) * self._cell_m, math.floor(low / self._cell_m) * self._cell_m

    @cached_property
    def _mask(self) -> np.ndarray:
        if self.roomy.is_empty:
            return np.zeros((0, 0), dtype=bool)
        _, _, right, high = self.roomy.bounds
        columns = int((right - self._origin[0]) / self._cell_m) + 1
        rows = int((high - self._origin[1]) / self._cell_m) + 1
        x = self._origin[0] + np.arange(columns) * self._cell_m
        z = self._origin[1] + np.arange(rows) * self._cell_m
        grid_x, grid_z = np.meshgrid(x, z)
        return shapely.contains_xy(self.roomy, grid_x, grid_z)

    @cached_property
    def _graph(self) -> csr_array:
        mask = self._mask
        index = np.full(mask.shape, -1, dtype=np.int64)
        index[mask] = np.arange(int(mask.sum()))
        sources, targets, lengths = [], [], []
        for row_step, column_step in _STEPS:
            here, there = _shifted(index, row_step, column_step)
            joined = (here >= 0) & (there >= 0)
            if row_step and column_step:
                joined &= _corners_free(index, column_step)
            sources.append(here[joined])
            targets.append(there[joined])
            lengths.append(np.full(int(joined.sum()), self._cell_m * math.hypot(row_step, column_step)))
        count = int(mask.sum())
        pairs = np.concatenate(sources), np.concatenate(targets)
        return coo_array((np.concatenate(lengths), pairs), shape=(count, count)).tocsr()

    @cached_property
    def exact(self) -> "WalkableMap":
        """The map without margin, which has all places that the simulator allows."""
        return WalkableMap(self.tight, self.tight, self._cell_m)

    def can_stand(self, point: Point2) -> bool:
        """Return whether the body's axis may be at a point (x, z), without margin."""
        return bool(shapely.contains_xy(self.tight, *point))

    def is_straight(self, start: Point2, end: Point2) -> bool:
        """Return whether the body can go straight from one point to another with a margin."""
        return self.roomy.covers(shapely.LineString([start, end])) if start != end else self.can_stand(start)

    def entry(self, point: Point2) -> int | None:
        """Return the index of the nearest cell to which the body can go straight from `point`; None if none is near."""
        if not len(self.cells):
            return None
        apart = np.hypot(self.cells[:, 0] - point[0], self.cells[:, 1] - point[1])
        for cell in np.argsort(apart, kind="stable")[:TRIED_ENTRIES]:
            if apart[cell] > SNAP_M:
                return None
            line = shapely.LineString([point, self.cells[cell]])
            if apart[cell] < SAME_POINT_M or self.tight.covers(line):
                return int(cell)
        return None

    def walks_from(self, start: Point2) -> "ShortestPaths":
        """Return the shortest walks from `start` (x, z) to all cells, cached."""
        if start not in self._walks:
            self._walks[start] = ShortestPaths(self, start)
        return self._walks[start]


class ShortestPaths:
    """The shortest walks from one place: the length (m) to each cell (inf without a way) and the corners."""

    def __init__(self, plan: WalkableMap, start: Point2) -> None:
        self.plan = plan
        self.start = start
        entry = plan.entry(start)
        if entry is None:
            self.lengths = np.full(len(plan.cells), math.inf)
            self._before = np.full(len(plan.cells), -1, dtype=np.int64)
            return
        found, before = dijkstra(plan._graph, directed=False, indices=entry, return_predecessors=True)
        self.lengths = found + math.dist(start, plan.cells[entry])
        self._before = before

    def corners_to(self, cell: int) -> list[Point2] | None:
        """Return the corners (x, z) of the walk to a cell, the cell's centre last; None if there is no way."""
        if not math.isfinite(self.lengths[cell]):
            return None
        trail = []
        while cell >= 0:
            trail.append((float(self.plan.cells[cell, 0]), float(self.plan.cells[cell, 1])))
            cell = int(self._before[cell])
        trail.reverse()
        return _straightened(self.plan, self.start, trail)


def _straightened(plan: WalkableMap, start: Point2, trail: Sequence[Point2]) -> list[Point2]:
    """Return few of the trail's points such that the body can go straight from each to the next."""
    corners: list[Point2] = []
    here, at = start, 0
    while at < len(trail):
        if math.dist(here, trail[-1]) < SAME_POINT_M:
            break
        ahead = len(trail) - 1
        while ahead > at and not plan.is_straight(here, trail[ahead]):  # in large steps while far, then one by one
            ahead = at + (ahead - at) * 3 // 4 if ahead - at > 4 else ahead - 1
        while ahead + 1 < len(trail) and plan.is_straight(here, trail[ahead + 1]):
            ahead += 1
        here, at = trail[ahead], ahead + 1
        if not corners or math.dist(here, corners[-1]) > SAME_POINT_M:
            corners.append(here)
    return [corner for corner in corners if math.dist(corner, start) > SAME_POINT_M or corner is not corners[0]]


def _shifted(index: np.ndarray, row_step: int, column_step: int) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = index.shape
    down = slice(row_step, None), slice(0, rows - row_step)
    if column_step >= 0:
        side = slice(column_step, None), slice(0, columns - column_step)
    else:
        side = slice(0, columns + column_step), slice(-column_step, None)
    return index[down[1], side[1]], index[down[0], side[0]]


def _corners_free(index: np.ndarray, column_step: int) -> np.ndarray:
    """Return whether both cells next to a diagonal step are free, aligned with `_shifted(index, 1, column_step)`."""
    if column_step > 0:
        return (index[1:, :-1] >= 0) & (index[:-1, 1:] >= 0)
    return (index[1:, 1:] >= 0) & (index[:-1, :-1] >= 0)
