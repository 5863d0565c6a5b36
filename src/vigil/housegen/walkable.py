"""The floor that an agent can walk: nodes of the 0.25 m grid where its body fits, through doors that can be passed."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage
from shapely import MultiPoint, Polygon

from vigil.house import House
from vigil.housegen.solids import Body, Prism

GRID_M = 0.25
BODY_RADIUS = 0.2
BODY_BOTTOM, BODY_TOP = 0.05, 1.8
LEAST_SHARE = 0.9
JAMB_M = 0.08
"""Width that a door's frame takes from its hole on either side."""


@dataclass(slots=True, eq=False)
class Walkable:
    """The grid, and its largest connected part."""

    xs: np.ndarray
    zs: np.ndarray
    space: shapely.Geometry
    """Where the body's axis can be, obstacles aside."""
    obstacles: shapely.Geometry
    """Where it cannot be because of things."""
    free: np.ndarray
    main: np.ndarray

    @property
    def share(self) -> float:
        """Share of the free nodes that the largest part holds."""
        count = int(self.free.sum())
        return float(self.main.sum()) / count if count else 0.0

    def reaches(self, floor: Polygon) -> bool:
        """Whether a node of the largest part lies on a floor."""
        return bool((self.main & shapely.contains_xy(floor, self.xs, self.zs)).any())

    def is_start(self, x: float, z: float) -> bool:
        """Whether the body fits at a place beside nodes of the largest part."""
        if not shapely.contains_xy(self.space, x, z) or shapely.contains_xy(self.obstacles, x, z):
            return False
        near = np.hypot(self.xs - x, self.zs - z) <= GRID_M
        return bool((self.main & near).any())

    def can_serve(self, body: Body, reach_m: float) -> bool:
        """Whether someone can stand within reach of a body, clear of its leaves wherever they swing."""
        corners = body.box_corners()
        (x0, z0), (x1, z1) = corners.min(axis=0) - reach_m, corners.max(axis=0) + reach_m
        near = self.main & (self.xs >= x0) & (self.xs <= x1) & (self.zs >= z0) & (self.zs <= z1)
        points = shapely.points(self.xs[near], self.zs[near])
        ok = shapely.distance(points, Polygon(corners)) <= reach_m
        for openness in (0.5, 1.0):
            for prism in body.leaves(openness):
                if _is_in_way(prism):
                    ok &= shapely.distance(points, prism.polygon) > BODY_RADIUS
        return bool(ok.any())


def walkable_of(house: House, bodies: list[Body]) -> Walkable:
    """Returns the walkable floor; doors that can be opened count as passable."""
    floors = [Polygon([(point.x, point.z) for point in room.floor_polygon]) for room in house.document.rooms]
    space = shapely.union_all([*(floor.buffer(-BODY_RADIUS) for floor in floors), *_passages(house)])
    x0, z0, x1, z1 = MultiPoint([corner for floor in floors for corner in floor.exterior.coords]).bounds
    columns = np.arange(np.floor(x0 / GRID_M), np.ceil(x1 / GRID_M) + 1) * GRID_M
    rows = np.arange(np.floor(z0 / GRID_M), np.ceil(z1 / GRID_M) + 1) * GRID_M
    xs, zs = np.meshgrid(columns, rows)
    free = shapely.contains_xy(space, xs, zs)
    obstacles = shapely.union_all(shapely.buffer([prism.polygon for prism in _standing(bodies)], BODY_RADIUS))
    free &= ~shapely.contains_xy(obstacles, xs, zs)
    labels, count = ndimage.label(free)  # type: ignore[misc]
    main = labels == int(np.bincount(labels.ravel())[1:].argmax()) + 1 if count else np.zeros_like(free)
    return Walkable(xs, zs, space, obstacles, free, main)


def _standing(bodies: list[Body]) -> list[Prism]:
    """Returns what one walks around: things as they are, the leaves of doors that can open when they stand open."""
    found: list[Prism] = []
    for body in bodies:
        if not body.is_opening or body.category == "Window":
            found.extend(body.prisms())
        elif body.can_open:
            found.extend(body.leaves(1.0))
    return [prism for prism in found if _is_in_way(prism)]


def _is_in_way(prism: Prism) -> bool:
    return prism.bottom < BODY_TOP and prism.top > BODY_BOTTOM


def _passages(house: House) -> list[Polygon]:
    """Returns the strips through inner doors in which the body's axis can be."""
    walls = {wall.id: wall for wall in house.document.walls}
    strips: list[Polygon] = []
    for door in house.document.doors:
        if door.room0 == door.room1 or door.openable is False:
            continue
        polygon = walls[door.wall0].polygon
        start, end = (np.array((point.x, point.z)) for point in polygon[:2])
        direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
        normal = np.array((direction[1], -direction[0])) * (BODY_RADIUS + 0.01)
        xs = [point.x for point in door.hole_polygon]
        left = start + direction * (min(xs) + BODY_RADIUS + JAMB_M)
        right = start + direction * (max(xs) - BODY_RADIUS - JAMB_M)
        if max(xs) - min(xs) > 2 * (BODY_RADIUS + JAMB_M):
            strips.append(Polygon([left - normal, right - normal, right + normal, left + normal]))
    return strips
