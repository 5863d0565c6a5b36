"""The walls of a scene as rectangles with doorways, and what passes through them: reckoned apart from the simulator."""

from collections.abc import Iterator

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.scene.geometry import part_motion
from vigil.scene.things import Hole, Scene, Thing, WallPanel

EDGE_M = 0.001
"""A ray that passes so near to a hole's edge or a panel's end may do either."""
FLOOR_M = 0.01


def vertices_of(thing: Thing, openness: float | None = None, *, moving: bool = False) -> np.ndarray:
    """Return the (n, 3) vertices of the thing's parts, of the moving ones alone if asked, where they are."""
    parts = [part for part in thing.asset.parts if part.joint is not None or not moving]
    found = [part_motion(thing, part.joint, openness)(part.mesh.vertices.astype(np.float64)) for part in parts]
    return np.concatenate(found) if found else np.empty((0, 3))


def floors_of(scene: Scene) -> dict[str, shapely.Polygon]:
    """Return the floor of every room."""
    return {room.id: shapely.Polygon(room.polygon) for room in scene.rooms}


def containing_floor(thing: Thing, floors: dict[str, shapely.Polygon]) -> BaseGeometry:
    """Return the floor on which most of a thing is; of a door or window, all floors that it borders on."""
    flat = vertices_of(thing, 0.0)[:, [0, 2]]
    shape = shapely.MultiPoint(flat).convex_hull
    if thing.is_structure:
        return shapely.unary_union([floor for floor in floors.values() if floor.distance(shape) < FLOOR_M])
    return max(floors.values(), key=lambda floor: (floor.intersection(shape).area, -floor.distance(shape)))


class WallShell:
    """Every panel of a scene as a rectangle in its plane, with its holes."""

    def __init__(self, scene: Scene) -> None:
        self._panels = [panel for panel in scene.panels if np.hypot(*np.subtract(panel.end, panel.start)) > FLOOR_M]

    def crossings(self, starts: np.ndarray, ends: np.ndarray, *, windows_are_holes: bool) -> np.ndarray:
        """Return for n segments the share of the way at which each first meets a wall; inf where it meets none."""
        first = np.full(len(starts), np.inf)
        for panel in self._panels:
            first = np.minimum(first, _crossing(panel, starts, ends, windows_are_holes))
        return first

    def joints(self) -> Iterator[np.ndarray]:
        """Yield points at which walls meet each other, the floor, the ceiling or the edge of a hole."""
        for panel in self._panels:
            start, along = np.array(panel.start), np.subtract(panel.end, panel.start)
            length = float(np.hypot(*along))
            low, high = panel.bottom, panel.bottom + panel.height
            places = [(at, y) for at in (0.0, length) for y in np.linspace(low + 0.02, high - 0.02, 9)]
            places += [(at, y) for at in np.linspace(0.0, length, 7) for y in (low, high)]
            for hole in panel.holes:
                places += [(at, y) for at in (hole.left, hole.right) for y in np.linspace(hole.bottom, hole.top, 7)]
                places += [(at, y) for at in np.linspace(hole.left, hole.right, 5) for y in (hole.bottom, hole.top)]
            for at, y in places:
                x, z = start + along / length * at
                yield np.array([x, y, z])


def _crossing(panel: WallPanel, starts: np.ndarray, ends: np.ndarray, windows_are_holes: bool) -> np.ndarray:
    origin, along = np.array(panel.start), np.subtract(panel.end, panel.start)
    length = float(np.hypot(*along))
    along = along / length
    normal = np.array([along[1], -along[0]])
    before = (starts[:, [0, 2]] - origin) @ normal
    after = (ends[:, [0, 2]] - origin) @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        share = before / (before - after)
    met = starts + np.nan_to_num(share)[:, None] * (ends - starts)
    u, y = (met[:, [0, 2]] - origin) @ along, met[:, 1]
    is_in = (share > 1e-9) & (share < 1.0) & (u > EDGE_M) & (u < length - EDGE_M)
    is_in &= (y > panel.bottom + EDGE_M) & (y < panel.bottom + panel.height - EDGE_M)
    for hole in panel.holes:
        if windows_are_holes or _is_doorway(panel, hole):
            is_in &= ~((u > hole.left - EDGE_M) & (u < hole.right + EDGE_M) & (y < hole.top + EDGE_M)
                       & (y > hole.bottom - EDGE_M))  # fmt: skip
    return np.where(is_in, share, np.inf)


def _is_doorway(panel: WallPanel, hole: Hole) -> bool:
    return hole.bottom <= panel.bottom + FLOOR_M
