"""Triangles for drawing. They are small, because light is known only at vertices but varies across a large face."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.meshes import merge

LONGEST_EDGE_M = 0.53
"""Longest edge (m) of a triangle; a quarter of the height of a door is a little shorter."""


def refined(meshes: Sequence[Mesh], longest: float = LONGEST_EDGE_M) -> list[Mesh]:
    """Return the same surfaces with edges halved until no edge is longer than `longest` metres.

    Whether an edge is halved depends only on the edge itself, so that triangles on both sides agree and no gap opens.
    Refining many meshes together is much faster than refining them one by one.
    """
    # The diagonal of the box around a mesh is at least as long as its edges.
    is_coarse = [
        len(mesh.vertices) > 0 and float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) > longest for mesh in meshes
    ]
    coarse = [mesh for mesh, chosen in zip(meshes, is_coarse, strict=True) if chosen]
    if not coarse:
        return list(meshes)
    fine = iter(_apart(*_refined_together(merge(coarse), longest), [len(mesh.vertices) for mesh in coarse]))
    return [next(fine) if chosen else mesh for mesh, chosen in zip(meshes, is_coarse, strict=True)]


def _refined_together(mesh: Mesh, longest: float) -> tuple[Mesh, np.ndarray]:
    """Return the refined mesh and, for each of its vertices (n,), a connected vertex of the original mesh."""
    origins = np.arange(len(mesh.vertices))
    done = []
    while True:
        corners = mesh.vertices[mesh.faces]
        is_long = ((corners - corners[:, [1, 2, 0]]) ** 2).sum(axis=2) > longest**2
        is_open = is_long.any(axis=1)
        done.append(mesh.faces[~is_open])
        if not is_open.any():
            return replace(mesh, faces=np.concatenate(done)), origins
        mesh, chosen = _halved(replace(mesh, faces=mesh.faces[is_open]), is_long[is_open])
        origins = np.concatenate([origins, origins[chosen]])


def _apart(mesh: Mesh, origins: np.ndarray, counts: list[int]) -> Iterator[Mesh]:
    """Yield the separate meshes that were refined as one; `counts` are their numbers of vertices before refining."""
    owners = np.repeat(np.arange(len(counts)), counts)[origins]
    order = np.argsort(owners, kind="stable")
    places = np.empty(len(order), dtype=np.int32)
    places[order] = np.arange(len(order), dtype=np.int32)
    face_owners = owners[mesh.faces[:, 0]]
    faces = places[mesh.faces[np.argsort(face_owners, kind="stable")]]
    ends, face_ends = (np.cumsum(np.bincount(each, minlength=len(counts)))[:-1] for each in (owners, face_owners))
    vertices, normals, uvs = (np.split(each[order], ends) for each in (mesh.vertices, mesh.normals, mesh.uvs))
    starts = [0, *ends.tolist()]
    parts = np.split(faces, face_ends)
    for points, facing, uv, start, part in zip(vertices, normals, uvs, starts, parts, strict=True):
        yield Mesh(points, part - np.int32(start), facing, uv)


def _halved(mesh: Mesh, is_long: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """Return the mesh with the edges in the mask `is_long` (m, 3) halved, and one end (k,) of each new vertex's edge.

    Edge i of a face goes from corner i to corner i + 1.
    """
    faces = mesh.faces
    first, last = faces[is_long].astype(np.int64), np.roll(faces, -1, axis=1)[is_long].astype(np.int64)
    count = len(mesh.vertices)
    edges, place = np.unique(np.minimum(first, last) * count + np.maximum(first, last), return_inverse=True)
    chosen = np.stack(np.divmod(edges, count), axis=1)
    middles = np.full(faces.shape, -1, dtype=np.int32)
    middles[is_long] = len(mesh.vertices) + place.reshape(-1)
    normals = mesh.normals[chosen].sum(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    halved = Mesh(
        np.concatenate([mesh.vertices, mesh.vertices[chosen].mean(axis=1)]),
        _pieces(faces, middles),
        np.concatenate([mesh.normals, normals]),
        np.concatenate([mesh.uvs, mesh.uvs[chosen].mean(axis=1)]),
    )
    return halved, chosen[:, 0]


def _pieces(faces: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Return the triangles (k, 3) of faces cut at edges' middles; `middles` (m, 3) are vertices, -1 where not cut."""
    count = (middles >= 0).sum(axis=1)
    parts = [faces[count == 0]]
    for number, first in ((1, 0), (2, 1), (3, 0)):
        chosen = count == number
        if not chosen.any():
            continue
        # Turn the corners so that a single cut edge comes first, and of two cut edges the uncut one last.
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
