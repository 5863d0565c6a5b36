"""All triangles of a compiled scene in one list, with the geom to which each belongs."""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigil.assets.kernel.materials import material
from vigil.sim.engines.mujoco.compiled.model import CompiledModel
from vigil.sim.engines.mujoco.compiled.outdoors import LAWN_HALF_M
from vigil.sim.engines.mujoco.raster.meshes import LONGEST_EDGE_M, DrawnMesh, refined

ATLAS_KINDS = ("wall", "floor", "ceiling")
"""Structure whose light is kept in a picture of its planes; all else has it at the vertices."""

HAND_BOXES = 4
BOARD_EDGE_M = 0.12
"""The longest edge of a skirting board: a short one with ends alone, in a corner and beside a frame, is dark."""


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """Vertices in the frames of their geoms, and faces."""

    vertices: np.ndarray
    """(n, 3) float32 metres."""
    normals: np.ndarray
    """(n, 3) float32, unit."""
    uvs: np.ndarray
    """(n, 2) float32, in repeats of the texture."""
    geoms: np.ndarray
    """(n,) int32."""
    faces: np.ndarray
    """(m, 3) int32."""
    vertex_slices: list[slice]
    face_slices: list[slice]
    """Of each geom."""
    is_in_atlas: np.ndarray
    """(geoms,) bool."""
    hand: np.ndarray
    """The boxes of the gripper, numbered after the model's geoms; each has sides of 1 m about its middle."""

    def world(self, model: CompiledModel, geom: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the points and normals of a geom where it is now, each (k, 3) float32."""
        part = self.vertex_slices[geom]
        turn = model.data.geom_xmat[geom].reshape(3, 3).astype(np.float32)
        return self.vertices[part] @ turn.T + model.data.geom_xpos[geom].astype(np.float32), self.normals[part] @ turn.T


def geometry_of(model: CompiledModel) -> Geometry:
    """Return the triangles of a model."""
    native = model.native
    hand = np.arange(native.ngeom, native.ngeom + HAND_BOXES)
    charted = np.zeros(len(hand) + native.ngeom, dtype=bool)
    charted[[geom for geom, kind in model.structure_kinds.items() if kind in ATLAS_KINDS]] = True
    numbers = native.geom_dataid.tolist()
    made = {number: _lawn() if number < 0 else _mesh(native, number) for number in numbers}
    is_fine = {number: number < 0 or bool(charted[geom]) for geom, number in reversed(list(enumerate(numbers)))}
    boards = {numbers[geom] for geom, kind in model.structure_kinds.items() if kind == "skirting"}
    for longest, is_wanted in ((LONGEST_EDGE_M, False), (BOARD_EDGE_M, True)):
        coarse = [number for number in made if not is_fine[number] and (number in boards) == is_wanted]
        made |= dict(zip(coarse, refined([made[number] for number in coarse], longest), strict=True))
    meshes = [*(made[number] for number in numbers), *([_box()] * len(hand))]
    counts = [len(mesh.vertices) for mesh in meshes]
    starts = np.concatenate([[0], np.cumsum(counts)])
    face_starts = np.concatenate([[0], np.cumsum([len(mesh.faces) for mesh in meshes])])
    return Geometry(
        np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32),
        np.concatenate([mesh.normals for mesh in meshes]).astype(np.float32),
        np.concatenate([mesh.uvs for mesh in meshes]).astype(np.float32),
        np.repeat(np.arange(len(meshes), dtype=np.int32), counts),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]).astype(np.int32),
        _slices(starts),
        _slices(face_starts),
        charted,
        hand,
    )


def _slices(starts: np.ndarray) -> list[slice]:
    return [slice(a, b) for a, b in itertools.pairwise(starts.tolist())]


def _mesh(native: Any, number: int) -> DrawnMesh:
    # Vertices, normals and texture places are numbered alike: `Triangles` gives one of each a vertex.
    first, last = native.mesh_vertadr[number], native.mesh_vertadr[number] + native.mesh_vertnum[number]
    face = native.mesh_faceadr[number]
    return DrawnMesh(
        native.mesh_vert[first:last],
        native.mesh_normal[first:last],
        native.mesh_texcoord[first:last],
        native.mesh_face[face : face + native.mesh_facenum[number]],
    )


def _lawn() -> DrawnMesh:
    """Return the ground, as large as the plane that rays meet."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32) * LAWN_HALF_M
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), (4, 3))
    return DrawnMesh(
        np.column_stack([corners, np.zeros(4, np.float32)]),
        up,
        corners / material("grass").metres,
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )


def _box() -> DrawnMesh:
    """Return a cube with sides of 1 m about the origin."""
    vertices, normals, faces = [], [], []
    for axis, sign in itertools.product(range(3), (-0.5, 0.5)):
        across, up = np.eye(3)[(axis + 1) % 3] / 2, np.eye(3)[(axis + 2) % 3] / 2
        outward = np.eye(3)[axis] * sign
        corners = [-across - up, across - up, across + up, -across + up]
        first = len(vertices)
        vertices += [outward + corner for corner in (corners if sign > 0 else corners[::-1])]
        normals += [2 * outward] * 4
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return DrawnMesh(np.array(vertices), np.array(normals), np.zeros((len(vertices), 2)), np.array(faces))
