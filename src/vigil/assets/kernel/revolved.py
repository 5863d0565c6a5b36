"""Round meshes, made by turning about an axis or along a path (conventions: see `vigil.assets.kernel.shapes`)."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.meshes import (
    ORIGIN,
    Axis,
    Point3,
    cross,
    grid_faces,
    merge,
    mesh,
    norms,
    rotate,
    scale,
    translate,
    volume,
)

SMOOTH = float(np.cos(np.radians(35)))
"""Cosine of 35 degrees. An edge is shaded smoothly if the angle between its two faces is smaller than 35 degrees."""
_NO_RADIUS_M = 1e-9
_SHORTEST_M = 1e-5


def lathe(profile: Sequence[tuple[float, float]], at: Point3 = ORIGIN, segments: int = 18) -> Mesh:
    """Return the mesh of a profile of (radius, y) that is turned about the vertical axis.

    Seen in the profile's direction, the outside is on the right: the profile goes up an outer wall, inward over a lid,
    down an inner wall. Corners sharper than 35 degrees stay sharp.
    """
    points = np.asarray(profile, np.float64)
    is_new = np.abs(points[1:] - points[:-1]).max(1) > 1e-9
    points = points[np.concatenate([[True], is_new])]
    steps = points[1:] - points[:-1]
    lengths = norms(steps)
    rings = np.repeat(points, 2, axis=0)[1:-1]
    travel = np.repeat(np.concatenate([[0.0], np.cumsum(lengths)]), 2)[1:-1]
    outward = _outward(np.stack([steps[:, 1], -steps[:, 0]], 1) / lengths[:, None])
    angles, circle = _circle(segments)
    vertices, normals = _spun(rings, circle), _spun(outward, circle)
    uvs = np.empty((*vertices.shape[:2], 2))
    uvs[..., 0], uvs[..., 1] = angles * points[:, 0].max(), travel[:, None]
    is_flat = np.abs(outward[:, 1]) > 0.97 * norms(outward)
    uvs[is_flat] = vertices[is_flat][..., ::2]
    faces = _lathe_faces(tuple((np.abs(rings[:, 0]) > _NO_RADIUS_M).tolist()), segments)
    return mesh(vertices.reshape(-1, 3) + np.asarray(at), faces, normals.reshape(-1, 3), uvs.reshape(-1, 2))


def _outward(slopes: np.ndarray) -> np.ndarray:
    """Return the normals (2 n, 2) at both ends of each of a profile's n segments; smooth joins share one normal."""
    is_smooth = (slopes[:-1] * slopes[1:]).sum(1) > SMOOTH
    shared = (slopes[:-1] + slopes[1:])[is_smooth]
    normals = np.repeat(slopes, 2, axis=0)
    normals[1:-1:2][is_smooth] = shared
    normals[2::2][is_smooth] = shared
    return normals


@cache
def _circle(segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles (segments + 1,) of a full circle, and their sines and cosines."""
    angles = np.linspace(0, 2 * np.pi, segments + 1)
    return angles, np.stack([np.sin(angles), np.cos(angles)], 1)


def _spun(profile: np.ndarray, circle: np.ndarray) -> np.ndarray:
    """Return the points (n, segments + 1, 3) of (radius, y) pairs (n, 2) turned around a circle."""
    spun = np.empty((len(profile), len(circle), 3))
    np.multiply(profile[:, :1, None], circle, out=spun[..., ::2])
    spun[..., 1] = profile[:, 1:]
    return spun


@cache
def _lathe_faces(has_radius: tuple[bool, ...], segments: int) -> np.ndarray:
    """Return the triangles of the bands between neighbouring rings. At a ring of radius 0, a cell is one triangle."""
    faces = []
    for first in range(0, len(has_radius), 2):
        halves = np.split(grid_faces(2, segments + 1, flip=True) + first * (segments + 1), 2)
        faces += [half for half, is_kept in zip(halves, has_radius[first : first + 2][::-1], strict=True) if is_kept]
    return np.concatenate(faces)


def cylinder(
    radius: float,
    length: float,
    at: Point3 = ORIGIN,
    axis: Axis = "y",
    segments: int = 16,
    top: float | None = None,
) -> Mesh:
    """Return a cylinder about `axis` with caps; if `top` is given, it is the radius of the upper end."""
    upper = radius if top is None else top
    profile = [(0.0, -length / 2), (radius, -length / 2), (upper, length / 2), (0.0, length / 2)]
    part = lathe(profile, segments=segments)
    return translate(part if axis == "y" else rotate(part, "z", -90) if axis == "x" else rotate(part, "x", 90), at)


def ellipsoid(size: Point3, at: Point3 = ORIGIN, segments: int = 16, rings: int = 8) -> Mesh:
    """Return an ellipsoid whose bounding box has the given `size`."""
    return translate(scale(_ball(segments, rings), size), at)


@cache
def _ball(segments: int, rings: int) -> Mesh:
    angles = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    return lathe([(max(np.cos(a), 0.0) / 2, np.sin(a) / 2) for a in angles], segments=segments)


def tube(path: Sequence[Point3] | np.ndarray, radius: float | Sequence[float], segments: int = 8) -> Mesh:
    """Return a round rod with caps along a path of points (n, 3); `radius` may be one number or one for each point."""
    points = np.asarray(path, np.float64)
    radii = np.broadcast_to(np.asarray(radius, np.float64), (len(points),)).tolist()
    tangents = _gradient(points)
    tangents /= np.maximum(norms(tangents)[:, None], _SHORTEST_M)
    side = cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    sines, cosines = (column[:, None] for column in _circle(segments)[1].T)
    rings = np.empty((len(points), segments + 1, 3))
    for ring, point, tangent, size in zip(rings, points, tangents, radii, strict=True):
        side = side - tangent * (side @ tangent)
        side /= max(float(np.sqrt(side @ side)), _SHORTEST_M)
        ring[:] = point + size * (cosines * side + sines * cross(tangent, side))
    return loft(rings)


def loft(rings: np.ndarray, cap: bool = True) -> Mesh:
    """Return a skin over closed rings (k, n, 3), with flat caps; each ring repeats its first point at the end.

    Rings should run counter-clockwise about the direction from each to the next; other rings are reversed.
    """
    points = np.asarray(rings, np.float64)
    count, around, _ = points.shape
    before, after = _ring_neighbours(around)
    normals = cross(points[:, after] - points[:, before], _gradient(points))
    steps = norms(points[:, 1:] - points[:, :-1]).max(0)
    lengths = norms(points[1:] - points[:-1]).max(1)
    uvs = np.zeros((count, around, 2))
    uvs[1:, :, 0], uvs[:, 1:, 1] = np.cumsum(lengths)[:, None], np.cumsum(steps)
    body = mesh(points.reshape(-1, 3), grid_faces(count, around, flip=True), normals.reshape(-1, 3), uvs.reshape(-1, 2))
    if not cap:
        return body
    middles = points[[0, 1, -2, -1]].mean(1)
    caps = [
        _cap(points[0, :-1], middles[0] - middles[1]),
        _cap(points[-1, :-1], middles[3] - middles[2]),
    ]
    whole = merge([body, *caps])
    if volume(whole) < 0:
        whole = merge([Mesh(body.vertices, body.faces[:, ::-1], -body.normals, body.uvs), *caps])
    return whole


def _gradient(points: np.ndarray) -> np.ndarray:
    """Return numpy's gradient along the first axis for unit steps."""
    gradient = np.empty_like(points)
    gradient[1:-1] = (points[2:] - points[:-2]) / 2.0
    gradient[0], gradient[-1] = points[1] - points[0], points[-1] - points[-2]
    return gradient


@cache
def _ring_neighbours(around: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the points before and after each point of a closed ring, which repeats its first point."""
    index = np.arange(around - 1)
    closed = [*index, 0]
    return np.roll(index, 1)[closed], np.roll(index, -1)[closed]


def _cap(ring: np.ndarray, direction: np.ndarray) -> Mesh:
    """Return a cap for a convex ring (n, 3): triangles around the ring's middle that face `direction`."""
    middle, count = ring.mean(0), len(ring)
    vertices = np.concatenate([[middle], ring])
    faces = fan(count)
    spokes = ring - middle
    normal = cross(spokes, spokes[faces[:, 2] - 1]).sum(0)
    if normal @ direction < 0:
        faces, normal = faces[:, ::-1], -normal
    axes = np.argsort(np.abs(normal))[:2]
    return mesh(vertices, faces, np.full_like(vertices, normal), vertices[:, np.sort(axes)])


@cache
def fan(count: int) -> np.ndarray:
    """Return the triangles between vertex 0 and a ring of `count` others. The array is shared: do not change it."""
    index = np.arange(count)
    return np.stack([np.zeros(count, int), index + 1, np.roll(index, -1) + 1], 1)
