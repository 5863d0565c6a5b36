"""Mirrors: the scene in front of a mirror is drawn by a camera behind it, and this picture is put onto the mirror."""

import itertools
from typing import Any

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.scene import RenderState
from vigil.rendering.ssao import release
from vigil.rendering.viewer import NEAR_M, Mirror, Viewer

MAX_MIRRORS = 2
"""Greatest number of mirrors that show a picture. These are the nearest in view; other mirrors are only shiny."""
_FLAT = 0.99


def mirrors_before(geometry: Geometry, state: RenderState, geoms: np.ndarray, viewer: Viewer) -> list[Mirror]:
    """Return the mirrors among the geoms whose face the viewer sees, nearest first, at most `MAX_MIRRORS`."""
    is_mirror = np.array([material.is_mirror for material in geometry.scene.materials])
    shiny = geoms[is_mirror[state.materials[geoms]]]
    away = ((state.positions[shiny] - viewer.eye) ** 2).sum(axis=1)
    nearest_first = shiny[np.argsort(away, kind="stable")].tolist()
    found = (_mirror(geometry, state, geom, viewer) for geom in nearest_first)
    return list(itertools.islice(filter(None, found), MAX_MIRRORS))


def _mirror(geometry: Geometry, state: RenderState, geom: int, viewer: Viewer) -> Mirror | None:
    """Return the mirror of a geom; None if no part of the geom's surface faces the eye.

    The mirror's plane is the plane that contains most of the surface that faces the eye.
    """
    points, normals = geometry.world(state, geom)
    eye = viewer.eye
    faces = geometry.faces[geometry.face_slices[geom]] - geometry.vertex_slices[geom].start
    corners, facing = points[faces], normals[faces].mean(axis=1)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    areas[((eye - corners.mean(axis=1)) * facing).sum(axis=1) <= 0.0] = 0.0
    if not areas.any():
        return None
    is_parallel = facing @ facing.T > _FLAT
    best = int((is_parallel * areas).sum(axis=1).argmax())
    normal = facing[best].astype(np.float64)
    chosen = corners[is_parallel[best]].reshape(-1, 3).astype(np.float64)
    return Mirror(geom, chosen.mean(axis=0), normal / np.linalg.norm(normal), box_of(points, viewer), points)


def box_of(points: np.ndarray, viewer: Viewer) -> tuple[int, int, int, int]:
    """Return the part of the frame (left, lower edge, width, height; pixels) that contains points (n, 3).

    A margin of one pixel is added. If a point is level with the eye or behind it, return the whole frame.
    """
    size = np.array([viewer.width, viewer.height])
    placed = np.column_stack([points, np.ones(len(points))]) @ viewer.matrix.T
    away = placed[:, 3:]
    if (away < NEAR_M).any():
        return 0, 0, viewer.width, viewer.height
    pixels = (placed[:, :2] / away + 1.0) / 2.0 * size
    low = np.clip(np.floor(pixels.min(axis=0)).astype(int) - 1, 0, size)
    high = np.clip(np.ceil(pixels.max(axis=0)).astype(int) + 1, low, size)
    left, lower = low.tolist()
    width, height = (high - low).tolist()
    return left, lower, width, height


class MirrorTargets:
    """Framebuffers for mirrored pictures of one size: one with several samples per pixel, others with one sample."""

    def __init__(self, context: Any, size: tuple[int, int], samples: int) -> None:
        self.pictures = [context.texture(size, 4) for _ in range(MAX_MIRRORS)]
        self.drawn = context.framebuffer(
            [context.renderbuffer(size, 4, samples=samples)], context.depth_renderbuffer(size, samples=samples)
        )
        self.flat = [context.framebuffer([each]) for each in self.pictures]

    def release(self) -> None:
        """Free the framebuffers."""
        for each in (self.drawn, *self.flat):
            release(each)
