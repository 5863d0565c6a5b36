"""Triangles for drawing: fine enough that light, which is known at the vertices, may bend on large faces."""

from dataclasses import dataclass

import numpy as np

LONGEST_EDGE_M = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class DrawnMesh:
    """Triangles with one normal and one texture place a vertex."""

    vertices: np.ndarray
    """(n, 3) float32 metres."""
    normals: np.ndarray
    """(n, 3) float32, unit."""
    uvs: np.ndarray
    """(n, 2) float32, in repeats of the texture."""
    faces: np.ndarray
    """(m, 3) int32."""


def refined(mesh: DrawnMesh, longest: float = LONGEST_EDGE_M) -> DrawnMesh:
    """Returns the same surface with every edge halved until none is longer than `longest` metres.

    Whether an edge is halved depends on that edge alone, so neighbours agree and no seam opens.
    """
    while True:
        corners = mesh.vertices[mesh.faces]
        lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        is_long = lengths > longest
        if not is_long.any():
            return mesh
        mesh = _halved(mesh, is_long)


def _halved(mesh: DrawnMesh, is_long: np.ndarray) -> DrawnMesh:
    """Returns the mesh with the marked edges (m, 3) cut in the middle; edge i runs from corner i to corner i + 1."""
    faces = mesh.faces
    first, last = faces[is_long].astype(np.int64), np.roll(faces, -1, axis=1)[is_long].astype(np.int64)
    count = len(mesh.vertices)
    edges, place = np.unique(np.minimum(first, last) * count + np.maximum(first, last), return_inverse=True)
    chosen = np.stack(np.divmod(edges, count), axis=1)
    middles = np.full(faces.shape, -1, dtype=np.int32)
    middles[is_long] = len(mesh.vertices) + place.reshape(-1)
    normals = mesh.normals[chosen].sum(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return DrawnMesh(
        np.concatenate([mesh.vertices, mesh.vertices[chosen].mean(axis=1)]),
        np.concatenate([mesh.normals, normals]),
        np.concatenate([mesh.uvs, mesh.uvs[chosen].mean(axis=1)]),
        _pieces(faces, middles),
    )


def _pieces(faces: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Returns the triangles into which each falls: one to four."""
    count = (middles >= 0).sum(axis=1)
    parts = [faces[count == 0]]
    for number, first in ((1, 0), (2, 1), (3, 0)):
        chosen = count == number
        if not chosen.any():
            continue
        # Turned so that a single cut edge comes first, and of two the uncut one last.
        turn = np.argmax(middles[chosen] >= 0, axis=1) if first == 0 else np.argmax(middles[chosen] < 0, axis=1) + 1
        order = (turn[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces[chosen], order, axis=1).T
        ab, bc, ca = np.take_along_axis(middles[chosen], order, axis=1).T
        if number == 1:
            triangles = [(a, ab, c), (ab, b, c)]
        elif number == 2:
            triangles = [(ab, b, bc), (a, ab, bc), (a, bc, c)]
        else:
            triangles = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        parts += [np.stack(corners, axis=1) for corners in triangles]
    return np.concatenate(parts).astype(np.int32)
