"""Partitions between rooms, and whether a shape reaches through them.

Partitions are walls, windows and shut doors; an open doorway is free. A partition has no thickness. A shape that
reaches at most `THROUGH_M` through a partition counts as being on one side of it.
"""

import numpy as np
import shapely

from vigil.assets.kernel.asset import Asset
from vigil.base.caches import cached_while_alive
from vigil.protocol.world import CLOSED_BELOW
from vigil.scene.geometry import (
    Prism,
    box_corners,
    convex_hull,
    joint_motion,
    part_boxes,
    part_motion,
    penetrations,
    place_of,
)
from vigil.scene.outlines import polygon_of, wall_prisms
from vigil.scene.things import Scene, Thing

THROUGH_M = 0.0005
"""How deep (m) a moving part may reach into a partition."""
OPENNESS_SAMPLES = np.linspace(0.0, 1.0, 65)
"""Values of openness that are tested to find how far moving parts can open."""
BETWEEN_M = 0.005
"""A part of 4 m length reaches at most this much further (m) between two tested values of openness than at these.

This holds even if only every second value of `OPENNESS_SAMPLES` is tested.
"""
MAX_CACHED_ANSWERS = 4096
"""Number of answers of `Partitions.reaches_through` that are cached in a scene."""


class Partitions:
    """The walls, windows and shut doors of a scene as upright planes."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.walls = [(panel.id, prism) for panel in scene.panels for prism in wall_prisms(panel)]
        """(id, plane) of each part of a wall; the caller must not change the list."""
        self._answers: dict[tuple, str | None] = {}

    def now(self) -> list[tuple[str, Prism]]:
        """Return (id, plane) of every wall, every window, and every door that is shut now."""
        planes = list(self.walls)
        for thing in self._scene.things.values():
            if thing.is_structure and _fills_its_hole(thing):
                half_x, half_y = thing.asset.size.x / 2, thing.asset.size.y / 2
                ends = place_of(thing)(np.array([[-half_x, 0.0, 0.0], [half_x, 0.0, 0.0]]))
                planes.append((thing.id, Prism(ends[:, [0, 2]], thing.position.y - half_y, thing.position.y + half_y)))
        return planes

    def blocker(self, thing: Thing, path: list[float]) -> str | None:
        """Return the id of a partition that the thing's moving parts would reach through at any openness in `path`.

        Return None if there is no such partition. A part that already reaches into a partition at the first openness in
        `path` may reach equally deep at the other values. The answers are cached, because every reset of an episode,
        and every click that opens the thing, needs the same answers.
        """
        shut = tuple(each.id for each in self._scene.things.values() if each.is_structure and _fills_its_hole(each))
        key = thing.id, thing.asset, thing.position, thing.rotation, tuple(path), shut
        if key not in self._answers:
            if len(self._answers) >= MAX_CACHED_ANSWERS:
                self._answers.clear()
            self._answers[key] = self._blocker(thing, path)
        return self._answers[key]

    def _blocker(self, thing: Thing, path: list[float]) -> str | None:
        """Return what `blocker` returns, without a cache."""
        within = _reach_bounds(thing)
        near = [(owner, plane) for owner, plane in self.now() if owner != thing.id and bounds_overlap(within, plane)]
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

    def reaches_through(self, thing: Thing, openness: float) -> str | None:
        """Return the id of a partition that the thing's parts reach through more deeply at an openness than when shut.

        Return None if there is no such partition.
        """
        return self.blocker(thing, [0.0, openness])

    def crosses(self, footprints: np.ndarray, bottoms: np.ndarray, height: float) -> np.ndarray:
        """Return a mask (n,) of the solids that touch a partition.

        Solid i stands on `footprints[i]`, its bottom is at `bottoms[i]` metres, and it is `height` metres high.
        """
        is_hit = np.zeros(len(bottoms), dtype=bool)
        left, low, right, high = shapely.total_bounds(footprints)
        for _, plane in self.now():
            if bounds_overlap((left, low, right, high), plane):
                is_level = (plane.bottom < bottoms + height) & (plane.top > bottoms)
                is_hit |= is_level & shapely.intersects(footprints, polygon_of(plane))
        return is_hit


def _fills_its_hole(thing: Thing) -> bool:
    return thing.category == "Window" or (thing.category == "Doorway" and thing.openness < CLOSED_BELOW)


@cached_while_alive
def leaf_points(asset: Asset) -> tuple[tuple[str, np.ndarray], ...]:
    """Return (joint, points) for each joint of an asset that carries meshes.

    The points (n, 3), in the closed asset's frame, include all corners of the convex hull of the joint's meshes.
    """
    found: list[tuple[str, np.ndarray]] = []
    for joint in asset.joints:
        meshes = [part.mesh.vertices for part in asset.parts if part.joint == joint.name and len(part.mesh.vertices)]
        if meshes:
            found.append((joint.name, _hull_points(np.concatenate(meshes).astype(np.float64))))
    return tuple(found)


def _hull_points(points: np.ndarray) -> np.ndarray:
    """Return, for each height, the corners of the convex hull of the points at this height.

    The result includes all corners of the convex hull of all points.
    """
    heights, level = np.unique(points[:, 1], return_inverse=True)
    flat = [convex_hull(points[level == number][:, [0, 2]]) for number in range(len(heights))]
    return np.concatenate(
        [np.insert(corners, 1, height, axis=1) for corners, height in zip(flat, heights, strict=True)]
    )


def _leaves(thing: Thing, openness: float) -> list[Prism]:
    """Return one upright prism for each joint; it contains everything that the joint carries, at an openness."""
    prisms: list[Prism] = []
    for joint, corners in leaf_points(thing.asset):
        points = part_motion(thing, joint, openness)(corners)
        heights = points[:, 1]
        prisms.append(Prism(convex_hull(points[:, [0, 2]]), float(heights.min()), float(heights.max()), joint))
    return prisms


@cached_while_alive
def _swept(asset: Asset) -> np.ndarray:
    """Return the corners (8, 3), in the asset frame, of a box around an asset's moving parts at every openness."""
    joints = {joint.name: joint for joint in asset.joints}
    boxes = [(joints[name], box_corners(low, high)) for name, low, high in part_boxes(asset) if name in joints]
    places = [
        joint_motion(joint, openness)(corners)
        for joint, corners in boxes
        for openness in OPENNESS_SAMPLES[::2].tolist()
    ]
    points = np.concatenate([np.zeros((1, 3)), *places])
    return box_corners(points.min(axis=0) - BETWEEN_M, points.max(axis=0) + BETWEEN_M)


def _reach_bounds(thing: Thing) -> tuple[float, float, float, float]:
    """Return bounds (least x, least z, greatest x, greatest z) of the thing's moving parts at every openness."""
    corners = place_of(thing)(_swept(thing.asset))
    x, _, z = corners.min(axis=0).tolist()
    right, _, back = corners.max(axis=0).tolist()
    return x, z, right, back


def bounds_overlap(within: tuple[float, ...], plane: Prism) -> bool:
    """Return whether a prism's bounds overlap or touch other bounds (least x, least z, greatest x, greatest z)."""
    x0, z0, x1, z1 = plane.bounds
    return x0 <= within[2] and x1 >= within[0] and z0 <= within[3] and z1 >= within[1]
