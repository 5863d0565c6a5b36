"""Whether a thing's doors, drawers and lids stay in its room on their way, all that is drawn of them counted."""

from functools import lru_cache

import numpy as np
import shapely
from shapely import MultiPoint, Polygon

from vigil.assets.asset import Asset, Joint
from vigil.housegen.solids import Body, moved_points

THROUGH_M = 0.0005
"""Leaves may reach so far through a wall, and as far as they do shut."""
STEPS = np.arange(65) / 64
"""Openness at which leaves are looked at."""


def leaves_room(body: Body, floors: list[Polygon]) -> bool:
    """Whether a part of the body's leaves is in no room at an openness, or not wholly; `floors` are prepared."""
    boxes = [(joint, _corners(points)) for joint, points in _drawn(body.asset)]
    if not boxes:
        return False
    places = np.concatenate([_places(body, joint, corners).reshape(-1, 2) for joint, corners in boxes])
    about = shapely.box(*places.min(axis=0), *places.max(axis=0))
    return not any(floor.contains(about) for floor in floors) and _leaves_exactly(body, floors)


def _leaves_exactly(body: Body, floors: list[Polygon]) -> bool:
    for joint, points in _drawn(body.asset):
        places = _places(body, joint, points)
        beyond = min(float(shapely.distance(floor, shapely.points(places[0])).max()) for floor in floors)
        grown = [floor.buffer(beyond + THROUGH_M, join_style="mitre") for floor in floors]
        hulls = shapely.convex_hull(np.array([MultiPoint(at) for at in places], dtype=object))
        if not np.logical_or.reduce([shapely.contains(floor, hulls) for floor in grown]).all():
            return True
    return False


def _places(body: Body, joint: Joint, points: np.ndarray) -> np.ndarray:
    """Returns where points that a joint carries are over the floor: (steps, n, 2)."""
    return body.over_floor(moved_points(points, joint, STEPS)[..., [0, 2]])


@lru_cache(maxsize=4096)
def _drawn(asset: Asset) -> tuple[tuple[Joint, np.ndarray], ...]:
    """Returns each joint with the vertices of all that it carries, (n, 3), closed."""
    found: list[tuple[Joint, np.ndarray]] = []
    for joint in asset.joints:
        meshes = [part.mesh.vertices for part in asset.parts if part.joint == joint.name and len(part.mesh.vertices)]
        if meshes:
            found.append((joint, np.concatenate(meshes).astype(float)))
    return tuple(found)


def _corners(points: np.ndarray) -> np.ndarray:
    low, high = points.min(axis=0), points.max(axis=0)
    return np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
