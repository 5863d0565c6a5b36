"""The triangles that face an eye, by the kind of their surface, in the order in which they are drawn.

The triangles of a scene are divided among boxes: a box around each geom that is not structure, and one around each part
of the structure.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.scene import RenderState
from vigil.rendering.structure_parts import StructureParts

GLOSSY = 0.35
"""Surfaces with at least this gloss reflect their surroundings."""
BEHIND_M = 0.001
"""The eye is behind a triangle if it is at least this far (m) behind the triangle's plane. OpenGL does not draw such
triangles either, but takes longer to leave them out."""


@dataclass(frozen=True, slots=True)
class SurfaceKind:
    """A kind of surface; all surfaces of one kind are drawn by the same shader program."""

    is_in_atlas: bool
    is_glossy: bool

    def definitions(self, point_lights: int) -> tuple[str, ...]:
        """Return the preprocessor definitions of the shader program for this number of point lights."""
        names = ["IN_ATLAS"] * self.is_in_atlas + ["GLOSSY"] * self.is_glossy
        return (*names, f"POINT_LIGHTS {point_lights}")


KINDS = tuple(SurfaceKind(is_in_atlas, is_glossy) for is_in_atlas in (False, True) for is_glossy in (False, True))
TRANSPARENT = SurfaceKind(is_in_atlas=False, is_glossy=True)
"""The kind of transparent surfaces, which are drawn last."""
GROUPS = (*KINDS, TRANSPARENT)
"""The kind of each group of triangles. The groups are drawn in this order."""


@dataclass(frozen=True, slots=True, eq=False)
class Facing:
    """Triangles that face an eye."""

    faces: np.ndarray
    """Triangles (n, 3) int32 as numbers of vertices, in the order in which they are drawn."""
    owners: np.ndarray
    """Index (n,) of each triangle's box among the boxes that were asked for."""
    groups: list[slice]
    """The triangles of each of `GROUPS`."""


class Triangles:
    """All triangles of a scene, with their planes in the frames of their geoms."""

    def __init__(self, geometry: Geometry, parts: StructureParts) -> None:
        self.geometry, self.parts = geometry, parts
        scene = geometry.scene
        structure, geoms = len(scene.structure_kinds), len(scene.geom_meshes)
        self.geoms = np.concatenate([np.arange(geoms), parts.geoms])
        """Geom (boxes,) of each box. The first boxes are those of the geoms; those of the structure's geoms are empty,
        because the boxes of its parts follow."""
        numbers = np.arange(len(geometry.faces), dtype=np.int32)
        own = [numbers[part] for part in geometry.face_slices[structure:geoms]]
        self._by_box = [*[numbers[:0]] * structure, *own, *parts.faces]
        corners = geometry.vertices[geometry.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(across, axis=1, keepdims=True)
        self._normals = np.divide(across, areas, out=np.zeros_like(across), where=areas > 0.0)
        self._offsets = np.einsum("ni,ni->n", self._normals, corners[:, 0])
        self._is_transparent = np.array([material.rgba[3] < 1.0 for material in scene.materials], dtype=bool)
        self._is_glossy = np.array(
            [material.shininess >= GLOSSY or material.emission > 0.0 for material in scene.materials], dtype=bool
        )

    def faces_of(self, geoms: np.ndarray) -> np.ndarray:
        """Return all triangles (n, 3) of geoms, as numbers of vertices."""
        slices = self.geometry.face_slices
        return np.concatenate([self.geometry.faces[slices[geom]] for geom in geoms.tolist()])

    def groups_of(self, geoms: np.ndarray, materials: np.ndarray) -> np.ndarray:
        """Return the index (n,) in `GROUPS` of geoms (n,) that have these materials (n,)."""
        opaque = 2 * self.geometry.is_in_atlas[geoms] + self._is_glossy[materials]
        return np.where(self._is_transparent[materials], len(KINDS), opaque)

    def facing(self, state: RenderState, eye: np.ndarray, boxes: np.ndarray, middles: np.ndarray) -> Facing:
        """Return the triangles of boxes (n,) whose middles are `middles` (n, 3), without those that face away.

        Opaque surfaces are drawn nearest first, transparent ones farthest first.
        """
        geoms = self.geoms[boxes]
        groups = self.groups_of(geoms, state.materials[geoms])
        away = np.linalg.norm(middles - eye, axis=1)
        order = np.lexsort((np.where(groups == len(KINDS), -away, away), groups))
        own = [self._by_box[box] for box in boxes[order].tolist()]
        owners = np.repeat(order, [len(each) for each in own])
        numbers = np.concatenate([np.zeros(0, np.int32), *own])
        eyes = np.einsum("nij,ni->nj", state.rotations[geoms], eye - state.positions[geoms]).astype(np.float32)
        heights = np.einsum("ni,ni->n", self._normals[numbers], eyes[owners]) - self._offsets[numbers]
        is_facing = heights > -BEHIND_M
        owners = owners[is_facing]
        ends = np.searchsorted(groups[owners], np.arange(len(GROUPS) + 1)).tolist()
        parts = [slice(start, stop) for start, stop in itertools.pairwise(ends)]
        return Facing(self.geometry.faces[numbers[is_facing]], owners, parts)
