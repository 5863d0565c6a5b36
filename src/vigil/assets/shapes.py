"""Mesh primitives for the makers of assets, in the frame of `vigil.assets.asset`.

Every function returns triangles that wind outward, unit normals and uvs. Uvs are metres along the
surface (u along the longer side of a box's face, so that wood grain runs along a board), except where
`panel` and `disc` are told to fit a picture: then they run from (0, 0), bottom left as seen from
outside, to (1, 1). Triangle counts are kept low; `bevel` and smooth normals make edges catch light.
"""

from collections.abc import Sequence
from functools import cache

import mapbox_earcut
import numpy as np

from vigil.assets.asset import Mesh
from vigil.assets.meshes import (
    AXES,
    ORIGIN,
    Axis,
    Point3,
    bounds,
    cross,
    merge,
    mesh,
    rotate,
    rotation,
    scale,
    translate,
    volume,
)

__all__ = [
    "ORIGIN",
    "Axis",
    "Mesh",
    "Point3",
    "bounds",
    "box",
    "cushion",
    "cylinder",
    "disc",
    "ellipsoid",
    "extrude",
    "lathe",
    "loft",
    "merge",
    "mesh",
    "panel",
    "rotate",
    "rotation",
    "rounded_box",
    "rounded_rectangle",
    "scale",
    "slab",
    "span",
    "translate",
    "tube",
    "volume",
]

_THINNEST_M = 1e-5
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)


def _box_topology() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns signs (24, 3), face axes (24,), plain faces (12, 3) and bevel faces (32, 3)."""
    signs, axes, index = [], [], {}
    for axis in range(3):
        for corner in _CORNERS:
            index[(axis, *corner)] = len(signs)
            signs.append(corner)
            axes.append(axis)
    flat: list[list[int]] = []
    bevels: list[list[int]] = []

    def face(quad: list[int], out: np.ndarray, into: list[list[int]]) -> None:
        points = np.array([signs[i] + 0.1 * signs[i][axes[i]] * np.eye(3)[axes[i]] for i in quad])
        turn = cross(points[1] - points[0], points[2] - points[0]) @ out
        ordered = quad if turn > 0 else quad[::-1]
        into.append(ordered[:3])
        if len(ordered) == 4:
            into.append([ordered[0], ordered[2], ordered[3]])

    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            loop = []
            for sb, sc in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = np.zeros(3)
                corner[[axis, b, c]] = side, sb, sc
                loop.append(index[(axis, *corner)])
            face(loop, side * np.eye(3)[axis], flat)
        for sb in (-1.0, 1.0):
            for sc in (-1.0, 1.0):
                ends = []
                for sa in (-1.0, 1.0):
                    corner = np.zeros(3)
                    corner[[axis, b, c]] = sa, sb, sc
                    ends.append(tuple(corner))
                out = np.zeros(3)
                out[[b, c]] = sb, sc
                face(
                    [index[(b, *ends[0])], index[(b, *ends[1])], index[(c, *ends[1])], index[(c, *ends[0])]],
                    out,
                    bevels,
                )
    for corner in _CORNERS:
        face([index[(axis, *corner)] for axis in range(3)], corner, bevels)
    return np.array(signs), np.array(axes), np.array(flat), np.array(bevels)


_BOX_SIGNS, _BOX_AXES, _BOX_FLAT, _BOX_BEVELS = _box_topology()
_BOX_NORMALS = _BOX_SIGNS * np.eye(3)[_BOX_AXES]
_BOX_SIDES = tuple(np.flatnonzero(axis == _BOX_AXES) for axis in range(3))
_BOX_IS_FACED = _BOX_AXES[:, None] == np.arange(3)


def box(size: Point3, center: Point3 = ORIGIN, bevel: float = 0.0) -> Mesh:
    """Returns a box: 12 triangles, or 44 with bevelled edges that shade as if rounded."""
    half = np.maximum(np.abs(np.asarray(size, np.float64)) / 2, _THINNEST_M)
    cut = min(bevel, 0.45 * half.min() * 2)
    inset = np.where(_BOX_IS_FACED, half, half - cut)
    vertices = _BOX_SIGNS * inset + np.asarray(center, np.float64)
    faces = np.concatenate([_BOX_FLAT, _BOX_BEVELS]) if cut > 0 else _BOX_FLAT
    return mesh(vertices, faces, _BOX_NORMALS, _box_uvs(vertices, half))


def _box_uvs(vertices: np.ndarray, half: np.ndarray) -> np.ndarray:
    uvs = np.empty((len(vertices), 2))
    for side, (b, c) in zip(_BOX_SIDES, ((1, 2), (0, 2), (0, 1)), strict=True):
        u, v = (b, c) if half[b] >= half[c] else (c, b)
        uvs[side, 0], uvs[side, 1] = vertices[side, u], vertices[side, v]
    return uvs


def span(low: Point3, high: Point3, bevel: float = 0.0) -> Mesh:
    """Returns the box between two corners."""
    first, last = np.asarray(low, np.float64), np.asarray(high, np.float64)
    return box(last - first, (first + last) / 2, bevel)


def rounded_box(size: Point3, center: Point3 = ORIGIN, radius: float = 0.02, puff: float = 0.0) -> Mesh:
    """Returns a box with round edges (108 triangles; 192 when `puff`, metres, bulges its top and bottom)."""
    half = np.maximum(np.abs(np.asarray(size, np.float64)) / 2, _THINNEST_M)
    round_by = min(max(radius, _THINNEST_M / 2), 0.98 * half.min())
    flat = half - round_by
    grids = [np.unique([-half[i], -flat[i], *([0.0] if puff else []), flat[i], half[i]]) for i in range(3)]
    vertices, normals, faces, uvs, count = [], [], [], [], 0
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        across, along = np.meshgrid(grids[b], grids[c], indexing="ij")
        for side in (-1.0, 1.0):
            points = np.empty((*across.shape, 3))
            points[..., axis], points[..., b], points[..., c] = side * half[axis], across, along
            core = np.clip(points, -flat, flat)
            normal = points - core
            normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
            vertices.append((core + round_by * normal).reshape(-1, 3))
            normals.append(normal.reshape(-1, 3))
            u, v = (across, along) if half[b] >= half[c] else (along, across)
            uvs.append(np.stack([u, v], -1).reshape(-1, 2))
            faces.append(_grid_faces(*across.shape, flip=side < 0) + count)
            count += across.size
    points, outward = np.concatenate(vertices), np.concatenate(normals)
    if puff:
        swell = puff * np.prod(1 - (points[:, [0, 2]] / half[[0, 2]]) ** 2, axis=1)
        points[:, 1] = points[:, 1] / half[1] * (half[1] - puff + swell)
        outward[:, [0, 2]] += 2 * puff * points[:, [0, 2]] / half[[0, 2]] ** 2 * np.abs(outward[:, 1:2])
    return mesh(points + np.asarray(center, np.float64), np.concatenate(faces), outward, np.concatenate(uvs))


def cushion(size: Point3, center: Point3 = ORIGIN) -> Mesh:
    """Returns a soft box: round edges and a swollen top and bottom, filling `size` exactly."""
    width, height, depth = size
    return rounded_box(size, center, 0.45 * min(width, height, depth), 0.18 * height)


@cache
def _grid_faces(rows: int, columns: int, flip: bool = False) -> np.ndarray:
    """Returns two triangles per cell of a grid of vertices in row-major order; not to be written to."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return faces[:, ::-1] if flip else faces


def lathe(profile: Sequence[tuple[float, float]], center: Point3 = ORIGIN, segments: int = 18) -> Mesh:
    """Returns a profile of (radius, y) turned about the vertical.

    The profile runs with its outside on the right: up along an outer wall, inwards over a lid, down an
    inner wall. Corners sharper than 35 degrees stay sharp.
    """
    points = np.asarray(profile, np.float64)
    points = points[np.concatenate([[True], np.abs(np.diff(points, axis=0)).max(1) > 1e-9])]
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    slopes = np.stack([steps[:, 1], -steps[:, 0]], 1) / lengths[:, None]
    ends = np.repeat(slopes, 2, axis=0)
    joined = np.einsum("ij,ij->i", slopes[:-1], slopes[1:]) > np.cos(np.radians(35))
    middle = np.where(joined[:, None], slopes[:-1] + slopes[1:], 0.0)
    ends[1:-1:2] = np.where(joined[:, None], middle, ends[1:-1:2])
    ends[2::2] = np.where(joined[:, None], middle, ends[2::2])
    rings = np.repeat(points, 2, axis=0)[1:-1]
    travel = np.repeat(np.concatenate([[0.0], np.cumsum(lengths)]), 2)[1:-1]
    angles = np.linspace(0, 2 * np.pi, segments + 1)
    circle = np.stack([np.sin(angles), np.cos(angles)], 1)
    vertices = np.stack(
        [rings[:, None, 0] * circle[:, 0], np.broadcast_to(rings[:, None, 1], (len(rings), segments + 1)),
         rings[:, None, 0] * circle[:, 1]], -1)  # fmt: skip
    normals = np.stack(
        [ends[:, None, 0] * circle[:, 0], np.broadcast_to(ends[:, None, 1], (len(ends), segments + 1)),
         ends[:, None, 0] * circle[:, 1]], -1)  # fmt: skip
    uvs = np.stack(np.broadcast_arrays(angles[None] * points[:, 0].max(), travel[:, None]), -1)
    is_flat = np.abs(ends[:, 1]) > 0.97 * np.linalg.norm(ends, axis=1)
    uvs = np.where(is_flat[:, None, None], vertices[..., [0, 2]], uvs)
    faces = []
    for first in range(0, len(rings), 2):
        quads = _grid_faces(2, segments + 1, flip=True) + first * (segments + 1)
        keep = np.array([rings[first, 0] > 1e-9, rings[first + 1, 0] > 1e-9])
        halves = np.split(quads, 2)
        faces += [halves[i] for i in range(2) if keep.all() or _is_solid(halves[i], vertices.reshape(-1, 3))]
    return mesh(vertices.reshape(-1, 3) + np.asarray(center), np.concatenate(faces), normals.reshape(-1, 3),
                uvs.reshape(-1, 2))  # fmt: skip


def _is_solid(faces: np.ndarray, vertices: np.ndarray) -> bool:
    a, b, c = vertices[faces[0]]
    return bool(np.linalg.norm(cross(b - a, c - a)) > 1e-12)


def cylinder(
    radius: float,
    height: float,
    center: Point3 = ORIGIN,
    axis: Axis = "y",
    segments: int = 16,
    top: float | None = None,
) -> Mesh:
    """Returns a capped cylinder about `axis`; with `top` its radius tapers to that at the upper end."""
    upper = radius if top is None else top
    profile = [(0.0, -height / 2), (radius, -height / 2), (upper, height / 2), (0.0, height / 2)]
    return translate(_stand(lathe(profile, segments=segments), axis), center)


def _stand(part: Mesh, axis: Axis) -> Mesh:
    """Returns a mesh made along y laid along `axis` instead."""
    return part if axis == "y" else rotate(part, "z", -90) if axis == "x" else rotate(part, "x", 90)


def ellipsoid(size: Point3, center: Point3 = ORIGIN, segments: int = 16, rings: int = 8) -> Mesh:
    """Returns an ellipsoid of full `size`."""
    return translate(scale(_ball(segments, rings), size), center)


@cache
def _ball(segments: int, rings: int) -> Mesh:
    angles = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    return lathe([(max(np.cos(a), 0.0) / 2, np.sin(a) / 2) for a in angles], segments=segments)


def tube(path: Sequence[Point3] | np.ndarray, radius: float | Sequence[float], segments: int = 8) -> Mesh:
    """Returns a round rod along a path of points (n, 3), capped; `radius` may vary from point to point."""
    points = np.asarray(path, np.float64)
    radii = np.broadcast_to(np.asarray(radius, np.float64), (len(points),))
    tangents = np.gradient(points, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), _THINNEST_M)
    side = cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    angles = np.linspace(0, 2 * np.pi, segments + 1)
    rings = []
    for point, tangent, size in zip(points, tangents, radii, strict=True):
        side = side - tangent * (side @ tangent)
        side /= max(float(np.linalg.norm(side)), _THINNEST_M)
        other = cross(tangent, side)
        rings.append(point + size * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other))
    return loft(np.array(rings))


def loft(rings: np.ndarray, cap: bool = True) -> Mesh:
    """Returns a skin over closed rings (k, n, 3), each repeating its first point, with flat caps.

    Rings run counter-clockwise about the way they follow each other; those that do not are turned round.
    """
    points = np.asarray(rings, np.float64)
    count, around, _ = points.shape
    along = np.gradient(points, axis=0)
    ring = (np.roll(points[:, :-1], -1, 1) - np.roll(points[:, :-1], 1, 1))[:, [*range(around - 1), 0]]
    normals = cross(ring, along)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2).max(0)
    travel = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=2).max(1))])
    uvs = np.stack(np.broadcast_arrays(travel[:, None], np.concatenate([[0], np.cumsum(steps)])[None]), -1)
    parts = [
        mesh(points.reshape(-1, 3), _grid_faces(count, around, flip=True), normals.reshape(-1, 3), uvs.reshape(-1, 2))
    ]
    if cap:
        for end, inner in ((0, 1), (-1, -2)):
            parts.append(_cap(points[end, :-1], points[end].mean(0) - points[inner].mean(0)))
    whole = merge(parts)
    if cap and volume(whole) < 0:
        body = parts[0]
        parts[0] = Mesh(body.vertices, body.faces[:, ::-1], -body.normals, body.uvs)
        whole = merge(parts)
    return whole


def _cap(ring: np.ndarray, direction: np.ndarray) -> Mesh:
    """Returns a fan over a convex ring (n, 3) that faces `direction`."""
    middle, count = ring.mean(0), len(ring)
    vertices = np.concatenate([[middle], ring])
    faces = np.stack([np.zeros(count, int), np.arange(count) + 1, np.roll(np.arange(count), -1) + 1], 1)
    normal = cross(ring - middle, np.roll(ring, -1, 0) - middle).sum(0)
    if normal @ direction < 0:
        faces, normal = faces[:, ::-1], -normal
    axes = np.argsort(np.abs(normal))[:2]
    return mesh(vertices, faces, np.broadcast_to(normal, vertices.shape), vertices[:, np.sort(axes)])


def extrude(polygon: Sequence[tuple[float, float]] | np.ndarray, low: float, high: float, axis: Axis = "y") -> Mesh:
    """Returns a prism over a simple polygon, concave ones too.

    The polygon is (x, z) for axis y, (x, y) for axis z and (z, y) for axis x; it spans low..high along
    the axis. Side edges turning by less than 35 degrees shade smoothly.
    """
    outline = np.asarray(polygon, np.float64)
    following = np.roll(outline, -1, 0)
    area = np.sum(outline[:, 0] * following[:, 1] - following[:, 0] * outline[:, 1])
    if area < 0:
        outline = outline[::-1]
        following = np.roll(outline, -1, 0)
    count = len(outline)
    edges = following - outline
    lengths = np.maximum(np.linalg.norm(edges, axis=1), _THINNEST_M)
    outward = np.stack([edges[:, 1], -edges[:, 0]], 1) / lengths[:, None]
    before, after = np.roll(outward, 1, 0), np.roll(outward, -1, 0)
    smooth = np.cos(np.radians(35))
    first = np.where((np.einsum("ij,ij->i", before, outward) > smooth)[:, None], before + outward, outward)
    last = np.where((np.einsum("ij,ij->i", after, outward) > smooth)[:, None], after + outward, outward)
    travel = np.concatenate([[0], np.cumsum(lengths)])
    sides = np.concatenate([np.c_[outline, np.full(count, low)], np.c_[following, np.full(count, low)],
                            np.c_[following, np.full(count, high)], np.c_[outline, np.full(count, high)]])  # fmt: skip
    side_normals = np.c_[np.concatenate([first, last, last, first]), np.zeros(4 * count)]
    side_uvs = np.stack([np.concatenate([travel[:-1], travel[1:], travel[1:], travel[:-1]]), sides[:, 2]], 1)
    a, b, c, d = (np.arange(count) + i * count for i in range(4))
    quads = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    inner = mapbox_earcut.triangulate_float64(outline, np.array([count], np.uint32)).reshape(-1, 3).astype(int)
    corners = outline[inner]
    first_edge, second_edge = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turn = first_edge[:, 0] * second_edge[:, 1] - first_edge[:, 1] * second_edge[:, 0]
    inner = np.where((turn > 0)[:, None], inner, inner[:, ::-1])
    lid, floor = np.c_[outline, np.full(count, high)], np.c_[outline, np.full(count, low)]
    vertices = np.concatenate([sides, lid, floor])
    normals = np.concatenate([side_normals, np.tile([0, 0, 1.0], (count, 1)), np.tile([0, 0, -1.0], (count, 1))])
    faces = np.concatenate([quads, inner + 4 * count, inner[:, ::-1] + 5 * count])
    order = {"y": [0, 2, 1], "z": [0, 1, 2], "x": [2, 1, 0]}[axis]
    faces = faces if axis == "z" else faces[:, ::-1]
    return mesh(vertices[:, order], faces, normals[:, order], np.concatenate([side_uvs, outline, outline]))


def rounded_rectangle(width: float, depth: float, radius: float, steps: int = 4) -> np.ndarray:
    """Returns the outline (n, 2) of a rectangle with round corners about the origin."""
    radius = min(radius, width / 2 - 1e-4, depth / 2 - 1e-4)
    angles = np.linspace(0, np.pi / 2, steps + 1)
    corners = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        turned = angles + quarter * np.pi / 2
        middle = np.array([sx * (width / 2 - radius), sy * (depth / 2 - radius)])
        corners.append(middle + radius * np.stack([np.cos(turned), np.sin(turned)], 1))
    return np.concatenate(corners)


def slab(size: Point3, center: Point3 = ORIGIN, radius: float = 0.05) -> Mesh:
    """Returns a flat board whose corners, seen from above, are round."""
    x, y, z = center
    part = extrude(rounded_rectangle(size[0], size[2], radius), y - size[1] / 2, y + size[1] / 2)
    return translate(part, (x, 0.0, z))


def disc(radius: float, center: Point3 = ORIGIN, axis: Axis = "y", segments: int = 18, fit: bool = False) -> Mesh:
    """Returns a flat circle that faces along +axis; `fit` lays one picture over it."""
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], 1)
    outline = np.concatenate([[[0.0, 0.0]], circle])
    faces = np.stack([np.zeros(segments, int), np.arange(segments) + 1, np.roll(np.arange(segments), -1) + 1], 1)
    right, up = _sight(axis, 1)
    vertices = radius * (outline[:, :1] * right + outline[:, 1:] * up) + np.asarray(center)
    return mesh(vertices, faces[:, ::-1], np.tile(cross(up, right), (segments + 1, 1)),
                outline / 2 + 0.5 if fit else radius * outline)  # fmt: skip


def panel(width: float, height: float, center: Point3 = ORIGIN, facing: str = "+z", fit: bool = True) -> Mesh:
    """Returns a flat rectangle facing "+x" ... "-z"; with `fit` one upright picture covers it.

    For "+y" and "-y" the picture's top points away from the front (to -z).
    """
    right, up = _sight(facing[1], -1 if facing[0] == "-" else 1)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    vertices = signs[:, :1] * width * right + signs[:, 1:] * height * up + np.asarray(center, np.float64)
    uvs = signs + 0.5 if fit else signs * [width, height]
    return mesh(vertices, np.array([[0, 2, 1], [0, 3, 2]]), np.tile(cross(up, right), (4, 1)), uvs)


def _sight(axis: str, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns what is right and up to somebody who looks at a face; cross(up, right) points at him.

    The frame is left-handed: who looks along -z has +x on his left.
    """
    outward = side * np.eye(3)[AXES[axis]]
    up = np.array([0, 0, -1.0]) if axis == "y" else np.array([0, 1.0, 0])
    return cross(outward, up), up
