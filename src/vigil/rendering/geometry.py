"""All triangles of a scene in one list, with the geom to which each of them belongs."""

import itertools
from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.rendering.meshes import LONGEST_EDGE_M, refined
from vigil.rendering.scene import RenderScene, RenderState

ATLAS_KINDS = ("wall", "floor", "ceiling")
"""Kinds of structure whose light is stored in the lightmap atlas; other geoms store their light at their vertices."""
HAND_BOXES = 4
BOARD_EDGE_M = 0.16
"""Longest edge (m) of a skirting board's triangles. A short board that had vertices only at its two ends would be dark,
because its ends are in corners."""
_LONGEST_EDGES_M = {**dict.fromkeys((*ATLAS_KINDS, "ground"), np.inf), "skirting": BOARD_EDGE_M}


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """Vertices (in the frames of their geoms) and faces. The boxes of the hand come after the scene's geoms."""

    scene: RenderScene
    vertices: np.ndarray
    """Positions (n, 3) float32 in metres."""
    normals: np.ndarray
    """Unit normals (n, 3) float32."""
    uvs: np.ndarray
    """Texture coordinates (n, 2) float32, in repeats of the texture."""
    geoms: np.ndarray
    """Number (n,) int32 of each vertex's geom."""
    faces: np.ndarray
    """Triangles (m, 3) int32 as numbers of vertices."""
    vertex_slices: list[slice]
    """Geom -> its vertices."""
    face_slices: list[slice]
    """Geom -> its faces."""
    is_in_atlas: np.ndarray
    """Whether (geoms,) each geom's light is stored in the lightmap atlas."""
    hand: np.ndarray
    """Numbers of the boxes of the hand; each box is a cube of 1 m with its middle at the origin."""

    def world(self, state: RenderState, geom: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the points and the normals of a geom in the world, each (k, 3) float32, posed as in a state."""
        part = self.vertex_slices[geom]
        turn = state.rotations[geom].astype(np.float32)
        return self.vertices[part] @ turn.T + state.positions[geom].astype(np.float32), self.normals[part] @ turn.T


def geometry_of(scene: RenderScene) -> Geometry:
    """Return the triangles of a scene."""
    longest = np.full(len(scene.meshes), LONGEST_EDGE_M)
    kinds = scene.structure_kinds
    longest[scene.geom_meshes[: len(kinds)]] = [_LONGEST_EDGES_M.get(kind, LONGEST_EDGE_M) for kind in kinds]
    made = dict(enumerate(scene.meshes))
    for edge in (LONGEST_EDGE_M, BOARD_EDGE_M):
        coarse = np.flatnonzero(longest == edge).tolist()
        made |= zip(coarse, refined([made[number] for number in coarse], edge), strict=True)
    hand = np.arange(len(scene.geom_meshes), len(scene.geom_meshes) + HAND_BOXES)
    is_in_atlas = np.zeros(len(scene.geom_meshes) + HAND_BOXES, dtype=bool)
    is_in_atlas[: len(kinds)] = np.isin(kinds, ATLAS_KINDS)
    meshes = [*(made[number] for number in scene.geom_meshes.tolist()), *[_box()] * HAND_BOXES]
    counts = [len(mesh.vertices) for mesh in meshes]
    starts = np.concatenate([[0], np.cumsum(counts)])
    face_starts = np.concatenate([[0], np.cumsum([len(mesh.faces) for mesh in meshes])])
    return Geometry(
        scene,
        np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32),
        np.concatenate([mesh.normals for mesh in meshes]).astype(np.float32),
        np.concatenate([mesh.uvs for mesh in meshes]).astype(np.float32),
        np.repeat(np.arange(len(meshes), dtype=np.int32), counts),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]).astype(np.int32),
        _slices(starts),
        _slices(face_starts),
        is_in_atlas,
        hand,
    )


def _slices(starts: np.ndarray) -> list[slice]:
    return [slice(a, b) for a, b in itertools.pairwise(starts.tolist())]


def _box() -> Mesh:
    """Return a cube with sides of 1 m and its middle at the origin."""
    vertices, normals, faces = [], [], []
    for axis, sign in itertools.product(range(3), (-0.5, 0.5)):
        across, up = np.eye(3)[(axis + 1) % 3] / 2, np.eye(3)[(axis + 2) % 3] / 2
        outward = np.eye(3)[axis] * sign
        corners = [-across - up, across - up, across + up, -across + up]
        first = len(vertices)
        vertices += [outward + corner for corner in (corners if sign > 0 else corners[::-1])]
        normals += [2 * outward] * 4
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return Mesh(np.array(vertices), np.array(faces), np.array(normals), np.zeros((len(vertices), 2)))
