"""Functions that make, join, move, turn, scale and measure meshes. `vigil.assets.kernel.shapes` has primitives."""

import math
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Literal

import numpy as np

from vigil.assets.kernel.asset import Mesh

Axis = Literal["x", "y", "z"]
Point3 = Sequence[float] | np.ndarray
ORIGIN = (0.0, 0.0, 0.0)
AXES = {"x": 0, "y": 1, "z": 2}


def mesh(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, uvs: np.ndarray) -> Mesh:
    """Return a Mesh with the array types that `Mesh` declares, and with normals of unit length."""
    lengths = np.sqrt(np.add.reduce(normals * normals, axis=1, keepdims=True))
    return Mesh(
        np.ascontiguousarray(vertices, np.float32),
        np.ascontiguousarray(faces, np.int32),
        np.ascontiguousarray(normals / np.maximum(lengths, 1e-12), np.float32),
        np.ascontiguousarray(uvs, np.float32),
    )


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """Return one mesh that consists of several meshes."""
    found = list(meshes)
    if len(found) == 1:
        return found[0]
    offsets = np.cumsum([0] + [len(part.vertices) for part in found[:-1]])
    return Mesh(
        np.concatenate([part.vertices for part in found]),
        np.concatenate([part.faces + np.int32(offset) for part, offset in zip(found, offsets, strict=True)]),
        np.concatenate([part.normals for part in found]),
        np.concatenate([part.uvs for part in found]),
    )


def translate(part: Mesh, offset: Point3) -> Mesh:
    """Return the mesh moved by `offset`."""
    return Mesh(part.vertices + np.asarray(offset, np.float32), part.faces, part.normals, part.uvs)


def scale(part: Mesh, factors: Point3, about: Point3 = ORIGIN) -> Mesh:
    """Return the mesh scaled along each axis about a point; a negative factor mirrors it."""
    factor, pivot = np.asarray(factors, np.float64), np.asarray(about, np.float64)
    faces = part.faces if np.prod(factor) > 0 else part.faces[:, ::-1]
    return mesh((part.vertices - pivot) * factor + pivot, faces, part.normals / factor, part.uvs)


def rotate(part: Mesh, axis: Point3 | Axis, degrees: float, about: Point3 = ORIGIN) -> Mesh:
    """Return the mesh turned about an axis through the point `about`, in the direction in which `Joint` turns."""
    matrix, pivot = rotation(axis, degrees), np.asarray(about, np.float64)
    return mesh((part.vertices - pivot) @ matrix.T + pivot, part.faces, part.normals @ matrix.T, part.uvs)


def rotation(axis: Point3 | Axis, degrees: float) -> np.ndarray:
    """Return the matrix (3, 3) of a rotation about an axis: a vector of any length, or "x", "y" or "z"."""
    along = np.eye(3)[AXES[axis]] if isinstance(axis, str) else np.asarray(axis, np.float64)
    return turn_about(along / np.linalg.norm(along), degrees)


def turn_about(unit: Sequence[float] | np.ndarray, degrees: float) -> np.ndarray:
    """Return the matrix (3, 3) of a rotation about a unit axis (Rodrigues' formula), in the direction of `Joint`."""
    x, y, z = unit
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sin, cos = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return cos * np.eye(3) + sin * cross + (1.0 - cos) * np.outer(unit, unit)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of vectors (..., 3); the same as numpy's, but faster for few vectors."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return product


def norms(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors along the last axis."""
    return np.sqrt(np.add.reduce(vectors * vectors, axis=-1))


@cache
def grid_faces(rows: int, columns: int, flip: bool = False) -> np.ndarray:
    """Return two triangles for each cell of a grid of vertices in row-major order. The array is shared: do not change
    it."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return faces[:, ::-1] if flip else faces


def bounds(parts: Iterable[Mesh]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner of the box around some meshes."""
    found = list(parts)
    lows = np.min([part.vertices.min(0) for part in found], axis=0)
    highs = np.max([part.vertices.max(0) for part in found], axis=0)
    return lows.astype(np.float64), highs.astype(np.float64)


def volume(part: Mesh) -> float:
    """Return the signed volume (m3), which is positive for a closed mesh whose faces point outward."""
    a, b, c = (part.vertices[part.faces[:, i]].astype(np.float64) for i in range(3))
    return float(np.einsum("ij,ij->", a, cross(b, c)) / 6)
