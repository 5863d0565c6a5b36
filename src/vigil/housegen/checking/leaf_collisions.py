"""Collisions of moving leaves: triangles of leaves (with handles and trims) are tested against triangles of other
things.

Walls are not tested here, because `vigil.scene.partitions` ensures that leaves do not reach into them.
"""

from collections.abc import Iterable, Iterator
from functools import lru_cache

import numpy as np

from vigil.assets.kernel.asset import Asset
from vigil.scene.geometry import box_corners, part_boxes, part_motion
from vigil.scene.supports import ancestors, moves_with
from vigil.scene.things import Scene, Thing

OPENNESS_SAMPLES = tuple(step / 24 for step in range(25))
"""Values of openness at which leaves are tested."""
SKIN_M = 0.002
"""Two things that overlap to at most this depth (m) only touch."""
PARALLEL = 1e-12
"""An edge counts as parallel to a triangle's plane if the product of the edge (m) and the triangle's normal is below
this (m^3). The unit is m^3 because the length of this normal is an area."""


class LeafCollisions:
    """Collisions of a scene's leaves, lids and drawers with other things, found in the shapes that are drawn."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._things = list(scene.things.values())
        boxes = [_box_around(thing, {0.0, thing.openness}, is_whole=True) for thing in self._things]
        self._boxes = np.array(boxes).reshape(-1, 2, 3)
        self._carriers = {thing.id: ancestors(scene, thing) for thing in self._things}

    def first_pierced(self, thing: Thing) -> Thing | None:
        """Return the first other thing that the thing's moving parts cut through; None if there is none."""
        swept = _box_around(thing, OPENNESS_SAMPLES, is_whole=False)
        near = (self._things[index] for index in np.flatnonzero(_overlap(self._boxes[:, 0], self._boxes[:, 1], swept)))
        for other in near:
            is_furniture = thing.is_drawer and other.id == thing.parent
            if other is thing or is_furniture or moves_with(thing, other, self._carriers[other.id]):
                continue
            fixed = _triangles(other, {0.0, other.openness})
            fixed = fixed[_overlap(fixed.min(axis=1), fixed.max(axis=1), swept)]
            if len(fixed) and any(_intersect(leaf, fixed) for leaf in _leaf_positions(thing)):
                return other
        return None


@lru_cache(maxsize=4096)
def drawn_triangles(asset: Asset) -> tuple[tuple[str | None, np.ndarray], ...]:
    """Return (joint, triangles (n, 3, 3)) for the body, whose joint is None, and for each moving part."""
    found: dict[str | None, list[np.ndarray]] = {}
    for part in asset.parts:
        if part.shown != "on" and len(part.mesh.faces):
            found.setdefault(part.joint, []).append(part.mesh.vertices[part.mesh.faces].astype(float))
    return tuple((joint, np.concatenate(meshes)) for joint, meshes in found.items())


def _triangles(thing: Thing, states: set[float]) -> np.ndarray:
    """Return all triangles (n, 3, 3) of a thing; moving parts are repeated at each openness in `states`."""
    places = [
        _moved(thing, joint, mesh, openness)
        for joint, mesh in drawn_triangles(thing.asset)
        for openness in (sorted(states) if joint is not None else (0.0,))
    ]
    return np.concatenate(places) if places else np.empty((0, 3, 3))


def _moved(thing: Thing, joint: str | None, mesh: np.ndarray, openness: float) -> np.ndarray:
    return part_motion(thing, joint, openness)(mesh.reshape(-1, 3)).reshape(-1, 3, 3)


def _leaf_positions(thing: Thing) -> Iterator[np.ndarray]:
    """Yield the triangles (n, 3, 3) of all moving parts, once for each openness."""
    moving = [(joint, mesh) for joint, mesh in drawn_triangles(thing.asset) if joint is not None]
    for openness in OPENNESS_SAMPLES:
        yield np.concatenate([_moved(thing, joint, mesh, openness) for joint, mesh in moving])


def _box_around(thing: Thing, samples: Iterable[float], *, is_whole: bool) -> np.ndarray:
    """Return the lowest and highest corner (2, 3) of the box around a thing at all `samples` of openness.

    Unless `is_whole`, the box contains only the moving parts.
    """
    corners = [
        part_motion(thing, joint, openness)(box_corners(low, high))
        for joint, low, high in part_boxes(thing.asset)
        if is_whole or joint is not None
        for openness in samples
    ]
    return _box_of(np.concatenate([np.empty((0, 3)), *corners]))


def _box_of(triangles: np.ndarray) -> np.ndarray:
    """Return the lowest and highest corner (2, 3) of the box around triangles.

    If there are no triangles, return an empty box, which overlaps no box.
    """
    corners = triangles.reshape(-1, 3)
    if not len(corners):
        return np.array([[np.inf] * 3, [-np.inf] * 3])
    return np.array([corners.min(axis=0), corners.max(axis=0)])


def _overlap(low: np.ndarray, high: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return a mask (n,) of the boxes, with corners (n, 3), that overlap `box` and do not only touch it."""
    return ((low < box[1] - SKIN_M) & (high > box[0] + SKIN_M)).all(axis=1)


def _intersect(one: np.ndarray, two: np.ndarray) -> bool:
    """Return whether any triangles of two sets (n, 3, 3) pass through each other."""
    near_one = one[_overlap(one.min(axis=1), one.max(axis=1), _box_of(two))]
    if not len(near_one):
        return False
    near_two = two[_overlap(two.min(axis=1), two.max(axis=1), _box_of(near_one))]
    return len(near_two) > 0 and (_has_piercing_edge(near_one, near_two) or _has_piercing_edge(near_two, near_one))


def _has_piercing_edge(edged: np.ndarray, faces: np.ndarray) -> bool:
    """Return whether an edge of the triangles `edged` passes through a triangle of `faces` by more than `SKIN_M`."""
    starts = edged.reshape(-1, 3)
    along = np.roll(edged, -1, axis=1).reshape(-1, 3) - starts
    origin, first, second = faces[:, 0], faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]
    normals = np.cross(first, second)
    lengths = np.linalg.norm(normals, axis=1)
    steep = along @ normals.T
    before = starts @ normals.T - (origin * normals).sum(axis=1)
    after = before + steep
    skin = SKIN_M * lengths
    passes = (np.minimum(before, after) < -skin) & (np.maximum(before, after) > skin) & (np.abs(steep) > PARALLEL)
    edge, face = np.nonzero(passes)
    if not len(edge):
        return False
    points = starts[edge] - along[edge] * (before[edge, face] / steep[edge, face])[:, None] - origin[face]
    unit = normals[face] / (lengths[face] ** 2)[:, None]
    share_first = (np.cross(points, second[face]) * unit).sum(axis=1)
    share_second = (np.cross(first[face], points) * unit).sum(axis=1)
    return bool(((share_first >= 0) & (share_second >= 0) & (share_first + share_second <= 1)).any())
