"""What parts the rooms, and whether a shape reaches through it.

Partitions are the walls without thickness: windows fill their holes, and shut doors theirs; an open doorway is free. A
shape that reaches less than `THROUGH_M` through one stays on its side.
"""

from functools import lru_cache

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError

from vigil.assets.asset import Asset
from vigil.sim.geometry import Prism, convex_hull, part_motion, penetrations, place_of
from vigil.sim.motion import polygon_of, wall_prisms
from vigil.sim.scene import Scene, Thing
from vigil.world import CLOSED_BELOW

THROUGH_M = 0.0005
"""How deep a moving part may reach into a partition: half of what the walls are checked to."""
KEPT_ANSWERS = 4096
"""How many answers about what sticks through are remembered in a scene."""


class Partitions:
    """The walls, windows and shut doors of a scene as upright planes."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._walls = [(panel.id, prism) for panel in scene.panels for prism in wall_prisms(panel)]
        self._answers: dict[tuple, str | None] = {}

    def now(self) -> list[tuple[str, Prism]]:
        """Returns (id, plane) of every wall, window and shut door."""
        things = (thing for thing in self._scene.things.values() if thing.is_structure)
        return self._walls + [(thing.id, _plane_of(thing)) for thing in things if _fills_its_hole(thing)]

    def blocker(self, thing: Thing, path: list[float]) -> str | None:
        """Returns the id of what the thing's moving parts would reach through on a path of openness; None if nothing.

        Where they reach through something at the path's first openness, they may do so as deep as that.
        """
        within = _within(thing)
        near = [(owner, plane) for owner, plane in self.now() if owner != thing.id and _meets(within, plane)]
        if not near:
            return None
        hulls = [_leaves(thing, openness) for openness in path]
        planes = [plane for _, plane in near]
        deepest = penetrations(hulls[0], planes).max(axis=0, initial=0.0) + THROUGH_M
        for leaves in hulls:
            excess = penetrations(leaves, planes).max(axis=0, initial=-1.0) - deepest
            if excess.max() > 0.0:
                return near[int(excess.argmax())][0]
        return None

    def sticks_through(self, thing: Thing, openness: float) -> str | None:
        """Returns the id of what the thing's parts reach through at an openness, deeper than shut; None if nothing.

        Every reset asks the same of the same things, so the answers are kept.
        """
        shut = tuple(each.id for each in self._scene.things.values() if each.is_structure and _fills_its_hole(each))
        key = thing.id, thing.asset, thing.position, thing.rotation, openness, shut
        if key not in self._answers:
            if len(self._answers) >= KEPT_ANSWERS:
                self._answers.clear()
            self._answers[key] = self.blocker(thing, [0.0, openness])
        return self._answers[key]

    def crosses(self, footprints: np.ndarray, bottoms: np.ndarray, height: float) -> np.ndarray:
        """Returns which of n floor shapes, over `bottoms` (n,) and so high, touch a partition."""
        is_hit = np.zeros(len(bottoms), dtype=bool)
        left, low, right, high = shapely.total_bounds(footprints)
        for _, plane in self.now():
            if _meets((left, low, right, high), plane):
                is_level = (plane.bottom < bottoms + height) & (plane.top > bottoms)
                is_hit |= is_level & shapely.intersects(footprints, polygon_of(plane))
        return is_hit


def _fills_its_hole(thing: Thing) -> bool:
    return thing.category == "Window" or (thing.category == "Doorway" and thing.openness < CLOSED_BELOW)


def _plane_of(thing: Thing) -> Prism:
    half_x, half_y = thing.asset.size.x / 2, thing.asset.size.y / 2
    ends = place_of(thing)(np.array([[-half_x, 0.0, 0.0], [half_x, 0.0, 0.0]]))
    return Prism(ends[:, [0, 2]], thing.position.y - half_y, thing.position.y + half_y)


@lru_cache(maxsize=4096)
def leaf_points(asset: Asset) -> tuple[tuple[str, np.ndarray], ...]:
    """Returns (joint, corners of the convex hull of all it carries, (n, 3), closed) of an asset."""
    found: list[tuple[str, np.ndarray]] = []
    for joint in asset.joints:
        meshes = [part.mesh.vertices for part in asset.parts if part.joint == joint.name and len(part.mesh.vertices)]
        if meshes:
            found.append((joint.name, _hull_corners(np.unique(np.concatenate(meshes).astype(np.float64), axis=0))))
    return tuple(found)


def _hull_corners(points: np.ndarray) -> np.ndarray:
    try:
        return points[np.sort(ConvexHull(points).vertices)]
    except (QhullError, ValueError):  # flat: every point counts
        return points


def _leaves(thing: Thing, openness: float) -> list[Prism]:
    prisms: list[Prism] = []
    for joint, corners in leaf_points(thing.asset):
        points = part_motion(thing, joint, openness)(corners)
        heights = points[:, 1]
        prisms.append(Prism(convex_hull(points[:, [0, 2]]), float(heights.min()), float(heights.max()), joint))
    return prisms


@lru_cache(maxsize=4096)
def _reach(asset: Asset) -> float:
    """Returns how far (m) from the asset's middle its moving parts can ever be."""
    joints = {joint.name: joint for joint in asset.joints}
    reaches = [0.0]
    for name, corners in leaf_points(asset):
        joint = joints[name]
        if joint.kind == "slide":
            reaches.append(float(np.linalg.norm(corners, axis=1).max()) + abs(joint.travel))
        else:
            arms = np.linalg.norm(corners - np.array(joint.origin), axis=1)
            reaches.append(float(np.linalg.norm(joint.origin) + arms.max()))
    return max(reaches)


def _within(thing: Thing) -> tuple[float, float, float, float]:
    reach = _reach(thing.asset)
    x, _, z = thing.position
    return x - reach, z - reach, x + reach, z + reach


def _meets(within: tuple[float, float, float, float], plane: Prism) -> bool:
    x0, z0, x1, z1 = plane.bounds
    return x0 <= within[2] and x1 >= within[0] and z0 <= within[3] and z1 >= within[1]
