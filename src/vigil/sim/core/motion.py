"""Where the agent's body fits and how far it can walk. The body is an upright cylinder.

Obstacles are the solid parts of walls, and the solids of things between 0.05 and 1.8 m above the floor. Leaves (doors,
lids, drawers) count at their present openness. A walk is free if the body stays clear of every obstacle. The body may
already overlap an obstacle where the walk begins, for example a leaf that was closed against the body. Such an obstacle
only blocks a walk that would come still nearer to it, so the body can always walk away.
"""

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.base.geometry import Vec3, rotate_floor
from vigil.protocol.house import EXTERIOR
from vigil.scene.outlines import BODY_RADIUS_M, GRID_M, floor_of_rooms, room_floor, thing_shapes, wall_shapes
from vigil.scene.things import Scene

CENTRE_SHARE = 0.25
"""Radius of the body's core, as a share of the body's radius. At a start, the core must be clear of obstacles."""
TOUCH_M = 1e-6
"""Tolerance (m) in comparisons of distances, so that a body that exactly touches an obstacle is clear of it."""


class CollisionMap:
    """The obstacles of a scene on the floor plane."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._inside = floor_of_rooms(scene.rooms)
        shapely.prepare(self._inside)
        self._wall_shapes = [(panel.id, shape) for panel in scene.panels for shape in wall_shapes(panel)]
        self._thing_shapes: dict[str, list[BaseGeometry]] = {}
        self._tree: shapely.STRtree | None = None
        self._shapes = np.empty(0, dtype=object)
        self._owners: list[str] = []

    def refresh(self, ids: set[str]) -> None:
        """Drop the cached shapes of the things with these ids, because these things have changed."""
        for thing_id in ids:
            self._thing_shapes.pop(thing_id, None)
        self._tree = None

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room whose floor contains a position; None outside every room."""
        point = shapely.Point(position.x, position.z)
        return next((room.id for room in self._scene.rooms if room_floor(room).covers(point)), None)

    def can_stand(self, position: Vec3) -> bool:
        """Return whether the body fits at a position, i.e. it is inside the rooms and clear of obstacles."""
        point = shapely.Point(position.x, position.z)
        return bool(self._inside.contains(point)) and not len(self._near(point))

    def is_inside(self, shape: BaseGeometry) -> bool:
        """Return whether a shape on the floor plane is inside the rooms."""
        return bool(self._inside.covers(shape))

    def centre_is_free(self, position: Vec3) -> bool:
        """Return whether the core of the body (`CENTRE_SHARE`) is inside a room and clear of obstacles."""
        point = shapely.Point(position.x, position.z)
        return bool(self._inside.contains(point)) and not len(self._near(point, BODY_RADIUS_M * CENTRE_SHARE))

    def blocker(self, start: Vec3, end: Vec3, *, leaves_overlaps: bool = False) -> str | None:
        """Return the id of the obstacle nearest to `start` that stops the body between two positions.

        Return `EXTERIOR` when only the edge of the floor stops the body, and None when the way is free. If the body's
        axis is inside an obstacle at both positions, this obstacle stops the body unless `leaves_overlaps` is true.
        """
        sweep = shapely.LineString([(start.x, start.z), (end.x, end.z)])
        origin = shapely.Point(start.x, start.z)
        hits = self._near(sweep)
        if len(hits):
            owners = sorted({self._owners[hit] for hit in hits})
            before, during, ending = (
                self._gaps(owners, hits, shape) for shape in (origin, sweep, shapely.Point(end.x, end.z))
            )
            deeper = during < np.minimum(before, BODY_RADIUS_M) - TOUCH_M
            if not leaves_overlaps:
                deeper |= (before <= TOUCH_M) & (ending <= TOUCH_M)
            if deeper.any():
                return min(
                    (gap, owner) for gap, owner, is_deeper in zip(before, owners, deeper, strict=True) if is_deeper
                )[1]
        return None if self._inside.covers(sweep) else EXTERIOR

    def reachable(self, start: Vec3, step_m: float = GRID_M, yaw: float = 0.0) -> np.ndarray:
        """Return the places (n, 2; x and z) that the body can reach on a grid through `start`, along grid edges.

        The grid is turned by `yaw` (deg).
        """
        from scipy.sparse import coo_array  # noqa: PLC0415 - loads over 200 modules
        from scipy.sparse.csgraph import breadth_first_order  # noqa: PLC0415 - the same

        cells, free = self._free_grid(start, step_m, yaw)
        index = {(int(i), int(k)): number for number, (i, k) in enumerate(cells)}
        if (0, 0) not in index:
            return free[:0]
        edges = [(a, index[near]) for (i, k), a in index.items() for near in ((i + 1, k), (i, k + 1)) if near in index]
        pairs = np.array(edges, dtype=np.int64).reshape(-1, 2)
        sweeps = np.array(shapely.linestrings(np.stack([free[pairs[:, 0]], free[pairs[:, 1]]], axis=1)), ndmin=1)
        blocked = self._any_near(sweeps) | ~shapely.covers(self._inside, sweeps)
        first = index[0, 0]
        for edge in np.flatnonzero((pairs == first).any(axis=1)):  # the start may touch something
            near = free[pairs[edge][pairs[edge] != first][0]]
            blocked[edge] = self.blocker(start, Vec3(float(near[0]), start.y, float(near[1]))) is not None
        open_pairs = pairs[~blocked].T
        graph = coo_array((np.ones(open_pairs.shape[1]), open_pairs), shape=(len(free), len(free)))
        return free[np.sort(breadth_first_order(graph, first, directed=False, return_predecessors=False))]

    def _free_grid(self, start: Vec3, step_m: float, yaw: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the grid cells in which the body fits: (n, 2) as numbers of steps from `start`, and (n, 2) as x and z
        in metres.

        The cell of `start` is always among them.
        """
        left, low, right, high = self._inside.bounds
        if yaw:
            reach = math.hypot(right - left, high - low)
            left, right, low, high = start.x - reach, start.x + reach, start.z - reach, start.z + reach
        columns = np.arange(math.ceil((left - start.x) / step_m), math.floor((right - start.x) / step_m) + 1)
        rows = np.arange(math.ceil((low - start.z) / step_m), math.floor((high - start.z) / step_m) + 1)
        cells = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1).reshape(-1, 2)
        offsets = np.column_stack(rotate_floor(cells[:, 0], cells[:, 1], yaw)) if yaw else cells
        places = np.array([start.x, start.z]) + offsets * step_m
        points = np.array(shapely.points(places), ndmin=1)
        fits = shapely.contains(self._inside, points) & ~self._any_near(points)
        fits |= (cells == 0).all(axis=1)
        return cells[fits], places[fits]

    def _gaps(self, owners: list[str], hits: np.ndarray, shape: BaseGeometry) -> np.ndarray:
        """Return the distance (m) from `shape` to the nearest obstacle of each owner (thing), among those in `hits`."""
        gaps = shapely.distance(self._shapes[hits], shape)
        names = np.array([self._owners[hit] for hit in hits])
        return np.array([gaps[names == owner].min() for owner in owners])

    def _any_near(self, shapes: np.ndarray) -> np.ndarray:
        tree = self._indexed()
        near = np.zeros(len(shapes), dtype=bool)
        near[tree.query(shapes, predicate="dwithin", distance=BODY_RADIUS_M - TOUCH_M)[0]] = True
        return near

    def _near(self, shape: BaseGeometry, within_m: float = BODY_RADIUS_M) -> np.ndarray:
        return np.sort(self._indexed().query(shape, predicate="dwithin", distance=within_m - TOUCH_M))

    def _indexed(self) -> shapely.STRtree:
        if self._tree is None:
            owned = list(self._wall_shapes)
            for thing in self._scene.things.values():
                if thing.is_present and not thing.is_held:
                    if thing.id not in self._thing_shapes:
                        self._thing_shapes[thing.id] = thing_shapes(thing)
                    owned.extend((thing.id, shape) for shape in self._thing_shapes[thing.id])
            self._owners = [owner for owner, _ in owned]
            self._shapes = np.array([shape for _, shape in owned] or [], dtype=object)
            self._tree = shapely.STRtree(self._shapes)
        return self._tree
