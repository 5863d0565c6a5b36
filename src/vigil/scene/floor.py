"""The floor of a scene: the regions where the agent's body can be, and the shortest walks in them.

`FreeSpace` computes the regions from things and walls. `WalkableMap`, `ShortestPaths` and `grid_graph` only use
polygons and grids.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
import shapely
from cachetools import LRUCache
from shapely.geometry.base import BaseGeometry

from vigil.base.geometry import Box, Pose, Vec3, heading
from vigil.protocol.actions import REACH_M
from vigil.scene.outlines import BODY_RADIUS_M, floor_of_rooms, footprint, thing_shapes, wall_shapes
from vigil.scene.things import Scene, Thing

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MARGIN_M = 0.03
"""Distance (m), in addition to the body's radius, that planned walks stay away from obstacles."""
TIGHT_M = 0.001
"""Distance (m), in addition to the body's radius, that the regions of exact maps stay away from obstacles."""
ARC_SEGMENTS = 16
"""Number of segments that approximate each quarter circle when an outline is grown."""
ROOM_TO_MOVE_M = 0.4
"""Length (m) of free floor that an agent's start pose needs ahead or to one side."""
PLAN_CACHE_SIZE = 32
"""Number of arrangements of things for which the free floor is cached."""
SIDES_DEG = (0.0, -90.0, 90.0)
PLACES_M = 0.05
"""Distance (m) between neighbouring places that `places_within` returns."""
SAME_PLACE_M = 1e-6
"""A place at most this far (m) from a region counts as inside the region."""
_RADII = (BODY_RADIUS_M + TIGHT_M, BODY_RADIUS_M + MARGIN_M)
CELL_M = 0.05
SNAP_M, TRIED_ENTRIES = 0.45, 200
"""A walk from a place begins at a nearby cell: greatest distance (m) of this cell, and number of cells tried."""
SAME_POINT_M = 1e-9
PATH_CACHE_SIZE = 8
"""Number of start places for which a map caches the shortest walks."""
_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1))

Point2 = tuple[float, float]
_Placement = tuple[str, Vec3, Vec3, float]
"""A thing's id, and all that its outlines on the floor depend on: its position, rotation and openness."""


class WalkableMap:
    """The places (x, z; m) where the body's axis may be, as a region and as a grid of cells inside it."""

    def __init__(
        self,
        roomy: BaseGeometry | Callable[[], BaseGeometry],
        tight: BaseGeometry | None = None,
        cell_m: float = CELL_M,
    ) -> None:
        """Make a map of two regions of floor in which the vertical axis of the agent's body may be.

        `roomy` keeps a margin to obstacles; it may be a function, which is called when the region is first needed.
        `tight` is every place that the simulator allows (default: the same as `roomy`).
        """
        self._given = roomy
        self.tight = self.roomy if tight is None else tight
        shapely.prepare(self.tight)
        self._cell_m = cell_m
        self._walks: LRUCache[Point2, ShortestPaths] = LRUCache(PATH_CACHE_SIZE)

    @cached_property
    def roomy(self) -> BaseGeometry:
        """The region where the body's axis may be if the body keeps a margin to obstacles."""
        region = self._given() if callable(self._given) else self._given
        shapely.prepare(region)
        return region

    @cached_property
    def cells(self) -> np.ndarray:
        """Centres (n, 2; x and z in metres) of the cells inside the roomy region, in a fixed order."""
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
    def _graph(self) -> "csr_array":
        cells = np.flatnonzero(self._mask)
        return grid_graph(self._mask, self._cell_m)[cells][:, cells]

    @cached_property
    def exact(self) -> "WalkableMap":
        """A map of all places that the simulator allows, without the margin."""
        return WalkableMap(self.tight, self.tight, self._cell_m)

    def can_stand(self, point: Point2) -> bool:
        """Return whether the body's axis may be at a point (x, z), even in the margin around obstacles."""
        return bool(shapely.contains_xy(self.tight, *point))

    def is_straight(self, start: Point2, end: Point2) -> bool:
        """Return whether the body can go in a straight line from one point to another and stay in the roomy region."""
        return self.roomy.covers(shapely.LineString([start, end])) if start != end else self.can_stand(start)

    def entry(self, point: Point2) -> int | None:
        """Return the index of the nearest cell to which the body can walk straight from `point`, or None."""
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
        """Return the shortest walks from `start` (x, z) to all cells. The walks are cached."""
        if start not in self._walks:
            self._walks[start] = ShortestPaths(self, start)
        return self._walks[start]


class ShortestPaths:
    """The shortest walks from one place to all cells: their corners and lengths.

    They are found when they are first needed.
    """

    def __init__(self, plan: WalkableMap, start: Point2) -> None:
        self.plan = plan
        self.start = start

    @property
    def lengths(self) -> np.ndarray:
        """Lengths (m) of the walks to all cells; inf if a cell is out of reach."""
        return self._found[0]

    @cached_property
    def _found(self) -> tuple[np.ndarray, np.ndarray]:
        """The lengths of the walks, and for each cell the cell before it on the walk, or a negative number."""
        from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415 - loads over 200 modules

        plan, entry = self.plan, self.plan.entry(self.start)
        if entry is None:
            return np.full(len(plan.cells), math.inf), np.full(len(plan.cells), -1, dtype=np.int64)
        found, before = dijkstra(plan._graph, directed=False, indices=entry, return_predecessors=True)
        return found + math.dist(self.start, plan.cells[entry]), before

    def corners_to(self, cell: int) -> list[Point2] | None:
        """Return the corners (x, z) of the walk to a cell, up to its centre; None if no walk reaches the cell."""
        if not math.isfinite(self.lengths[cell]):
            return None
        trail = []
        while cell >= 0:
            trail.append((float(self.plan.cells[cell, 0]), float(self.plan.cells[cell, 1])))
            cell = int(self._found[1][cell])
        trail.reverse()
        return _straightened(self.plan, self.start, trail)


def _straightened(plan: WalkableMap, start: Point2, trail: Sequence[Point2]) -> list[Point2]:
    """Return a few points of the trail, chosen so that the body can go straight from each point to the next."""
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


def grid_graph(
    is_open: np.ndarray, step_m: float, costs: np.ndarray | None = None, *, cuts_corners: bool = False
) -> "csr_array":
    """Return a graph of a grid: its nodes are all cells in row-major order, its edges join neighbouring open cells.

    An edge's weight is its length (m). If `costs` (per metre) are given, the weight is multiplied by the mean cost of
    the two cells. A diagonal edge exists only if the two cells next to it are open, too, unless `cuts_corners` is true.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - loads over 200 modules

    index = np.arange(is_open.size).reshape(is_open.shape)
    sources, targets, lengths = [], [], []
    for down, aside in _STEPS:
        joined = np.logical_and(*_neighbours(is_open, down, aside))
        if down and aside and not cuts_corners:
            joined &= np.logical_and(*_neighbours(is_open, down, -aside))
        here, there = _neighbours(index, down, aside)
        sources.append(here[joined])
        targets.append(there[joined])
        length = np.full(len(sources[-1]), step_m * math.hypot(down, aside))
        lengths.append(length if costs is None else length * np.add(*_neighbours(costs, down, aside))[joined] / 2)
    pairs = np.concatenate(sources), np.concatenate(targets)
    return coo_array((np.concatenate(lengths), pairs), shape=(is_open.size, is_open.size)).tocsr()


def largest_part(free: np.ndarray) -> np.ndarray:
    """Return a mask of the largest group of free cells that touch along the axes; all False if no cell is free."""
    from scipy import ndimage  # noqa: PLC0415 - loads over 200 modules

    labels, count = ndimage.label(free)  # type: ignore[misc] - SciPy's stubs allow other results
    return labels == int(np.bincount(labels.ravel())[1:].argmax()) + 1 if count else np.zeros_like(free)


def _neighbours(grid: np.ndarray, down: int, aside: int) -> tuple[np.ndarray, np.ndarray]:
    """Return two views of a grid: its cells, and for each cell the cell `down` rows below and `aside` columns right."""
    rows, columns = grid.shape
    if aside >= 0:
        return grid[: rows - down, : columns - aside], grid[down:, aside:]
    return grid[: rows - down, -aside:], grid[down:, : columns + aside]


class FreeSpace:
    """The free floor of a scene. Results are cached for each arrangement of things."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._floor = floor_of_rooms(scene.rooms)
        self._walls = shapely.unary_union([shape for panel in scene.panels for shape in wall_shapes(panel)])
        self._grown_walls = {radius: self._walls.buffer(radius, quad_segs=ARC_SEGMENTS) for radius in _RADII}
        self._things: dict[_Placement, _FloorShapes] = {}
        self._covered: dict[tuple[_Placement, _Placement], bool] = {}
        self._plans: LRUCache[tuple[_Placement, ...], WalkableMap] = LRUCache(PLAN_CACHE_SIZE)
        self._bare: LRUCache[tuple[_Placement, ...], BaseGeometry] = LRUCache(PLAN_CACHE_SIZE)

    def plan(self) -> WalkableMap:
        """Return the walkable map of the scene in its current state."""
        standing = self._standing()
        key = tuple(standing)
        if key not in self._plans:
            tight, roomy = (partial(self._free, radius, list(standing.values())) for radius in _RADII)
            self._plans[key] = WalkableMap(roomy, tight())
        return self._plans[key]

    def bare(self) -> BaseGeometry:
        """Return the part of the floor that no thing and no wall covers in the current state."""
        standing = self._standing()
        key = tuple(standing)
        if key not in self._bare:
            taken = [shape for each in standing.values() for shape in each.shapes]
            self._bare[key] = self._floor.difference(shapely.unary_union([self._walls, *taken]))
        return self._bare[key]

    def _standing(self) -> dict[_Placement, "_FloorShapes"]:
        """Return (id, placement) -> outlines, for all present things that can matter to the free floor.

        A thing is left out if it is held, or if the outlines of what it rests on cover its own.
        """
        found: dict[_Placement, _FloorShapes] = {}
        for thing in self.scene.things.values():
            if thing.is_present and not thing.is_held:
                key = _placement(thing)
                below = self.scene.things.get(thing.parent or "")
                is_on = below is not None and below.is_present and not below.is_held
                if not (below and is_on and self._covers(_placement(below), key)):
                    found[key] = self._shapes_of(key)
        return found

    def _shapes_of(self, key: _Placement) -> "_FloorShapes":
        """Return the outlines of a thing whose present placement is `key`. They are cached."""
        if key not in self._things:
            shapes = thing_shapes(self.scene.things[key[0]])
            whole = shapely.unary_union(shapes)
            grown = {radius: whole.buffer(radius, quad_segs=ARC_SEGMENTS) for radius in _RADII}
            self._things[key] = _FloorShapes(shapes, grown)
        return self._things[key]

    def _covers(self, below: _Placement, above: _Placement) -> bool:
        """Return whether a thing's outlines cover those of a thing on it, also grown by each radius. This is cached."""
        if (below, above) not in self._covered:
            outer, inner = self._shapes_of(below), self._shapes_of(above)
            is_within = shapely.unary_union(outer.shapes).covers(shapely.unary_union(inner.shapes))
            self._covered[below, above] = is_within and all(
                outer.grown[radius].covers(inner.grown[radius]) for radius in _RADII
            )
        return self._covered[below, above]

    def _free(self, radius: float, standing: list["_FloorShapes"]) -> BaseGeometry:
        """Return the region in which the axis of a body with this radius (m) can be."""
        return self._floor.difference(
            shapely.unary_union([self._grown_walls[radius], *(each.grown[radius] for each in standing)])
        )


def _placement(thing: Thing) -> _Placement:
    return thing.id, thing.position, thing.rotation, thing.openness


@dataclass(frozen=True, slots=True)
class _FloorShapes:
    """The outlines of a thing on the floor."""

    shapes: list[BaseGeometry]
    grown: Mapping[float, BaseGeometry]
    """Radius (m) of a body -> the union of all outlines, grown by this radius."""


def has_room_to_move(free: BaseGeometry, pose: Pose) -> bool:
    """Return whether a body at a pose in a free region can go `ROOM_TO_MOVE_M` ahead or to one side."""
    place = pose.position
    for side in SIDES_DEG:
        x, z = heading(pose.rotation + side)
        end = place.x + ROOM_TO_MOVE_M * x, place.z + ROOM_TO_MOVE_M * z
        if free.covers(shapely.LineString([(place.x, place.z), end])):
            return True
    return False


def is_cut_off(free: BaseGeometry, place: Point2, box: Box) -> bool:
    """Return whether a body at `place` cannot walk to within reach of a box; False if `place` is not in `free`."""
    here = shapely.Point(place)
    parts = [part for part in shapely.get_parts(free) if part.distance(here) < SAME_PLACE_M]
    outline = footprint(box)
    return bool(parts) and all(part.distance(outline) > REACH_M for part in parts)


def places_within(floor: BaseGeometry, box: Box, within_m: float) -> np.ndarray:
    """Return places (n, 2; x and z) on a floor that are at most `within_m` from a box.

    They are the points of a grid, and points along the border of the area that is near enough.
    """
    near = floor.intersection(footprint(box).buffer(within_m, quad_segs=4 * ARC_SEGMENTS))
    if near.is_empty:
        return np.empty((0, 2))
    left, low, right, high = near.bounds
    columns = np.arange(math.floor(left / PLACES_M), math.ceil(right / PLACES_M) + 1) * PLACES_M
    rows = np.arange(math.floor(low / PLACES_M), math.ceil(high / PLACES_M) + 1) * PLACES_M
    grid = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1).reshape(-1, 2)
    edges = shapely.get_coordinates(shapely.segmentize(near, PLACES_M))
    return np.concatenate([edges, grid[shapely.contains_xy(near, grid[:, 0], grid[:, 1])]])
