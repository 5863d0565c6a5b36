"""Mesh primitives for the makers of assets, in the frame of `vigil.assets.kernel.asset`.

Every function returns triangles that face outward, unit normals and uvs. Uvs are metres along the surface; on a box, u
is along the longer side of each face, so that wood grain follows a board. `panel` and `disc` can show one picture
instead: their uvs then go from (0, 0), bottom left as seen from outside, to (1, 1). Shapes have few triangles; bevels
and smooth normals let edges catch light.
"""

import itertools
from collections.abc import Sequence
from functools import cache

import mapbox_earcut
import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.meshes import (
    AXES,
    ORIGIN,
    Axis,
    Point3,
    bounds,
    cross,
    grid_faces,
    merge,
    mesh,
    norms,
    rotate,
    rotation,
    scale,
    translate,
    volume,
)
from vigil.assets.kernel.revolved import SMOOTH, cylinder, ellipsoid, fan, lathe, loft, tube

__all__ = [
    "ORIGIN",
    "Axis",
    "Mesh",
    "Point3",
    "bounds",
    "box",
    "boxes",
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
_SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
_SQUARE_FACES = np.array([[0, 2, 1], [0, 3, 2]])
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
_BOX_SIGNS, _BOX_AXES = np.tile(_CORNERS, (3, 1)), np.repeat(np.arange(3), 8)
"""Signs (24, 3) of the coordinates of a box's vertices, and the axis (24,) of the face to which each vertex belongs."""


def _vertex(faced: int, axis: int, *place: float) -> int:
    """Return the vertex of a box's face on axis `faced`; `place` is its signs along `axis` and the next two axes."""
    return 8 * faced + sum((4, 2, 1)[(axis + step) % 3] for step, sign in enumerate(place) if sign > 0)


def _facing(face: list[int], out: np.ndarray) -> list[list[int]]:
    """Return the triangles of a box's face with three or four vertices, ordered so that `out` sees their outside."""
    points = np.array([_BOX_SIGNS[i] * (1 + 0.1 * (np.arange(3) == _BOX_AXES[i])) for i in face])
    turn = cross(points[1] - points[0], points[2] - points[0]) @ out
    ordered = face if turn > 0 else face[::-1]
    return [ordered[:3]] if len(ordered) == 3 else [ordered[:3], [ordered[0], ordered[2], ordered[3]]]


def _box_topology() -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of a box's faces (12, 3) and bevels (32, 3)."""
    flat: list[list[int]] = []
    bevels: list[list[int]] = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            loop = [_vertex(axis, axis, side, *place) for place in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            flat += _facing(loop, side * np.eye(3)[axis])
        for sb, sc in itertools.product((-1.0, 1.0), repeat=2):
            ends = ((b, -1.0), (b, 1.0), (c, 1.0), (c, -1.0))
            quad = [_vertex(faced, axis, sa, sb, sc) for faced, sa in ends]
            bevels += _facing(quad, sb * np.eye(3)[b] + sc * np.eye(3)[c])
    for number, corner in enumerate(_CORNERS):
        bevels += _facing([8 * axis + number for axis in range(3)], corner)
    return np.array(flat), np.array(bevels)


_BOX_FLAT, _BOX_BEVELS = _box_topology()
_BOX_FACES = _BOX_FLAT.astype(np.int32), np.concatenate([_BOX_FLAT, _BOX_BEVELS]).astype(np.int32)
"""Triangles of a box without bevels, and of a box with bevels."""
_BOX_NORMALS = (_BOX_SIGNS * np.eye(3)[_BOX_AXES]).astype(np.float32)
_BOX_IS_FACED = _BOX_AXES[:, None] == np.arange(3)


def box(size: Point3, at: Point3 = ORIGIN, bevel: float = 0.0) -> Mesh:
    """Return a box: 12 triangles, or 44 if a `bevel` is given; bevelled edges are shaded as if they were round."""
    half = np.maximum(np.abs(np.asarray(size, np.float64)) / 2, _THINNEST_M)
    cut = min(bevel, 0.45 * half.min() * 2)
    inset = np.where(_BOX_IS_FACED, half, half - cut)
    vertices = _BOX_SIGNS * inset + np.asarray(at, np.float64)
    uvs = vertices.take(_box_uvs(*(half[1:] > half[:-1]).tolist(), bool(half[2] > half[0])))
    return Mesh(vertices.astype(np.float32), _BOX_FACES[bool(cut > 0)], _BOX_NORMALS, uvs.astype(np.float32))


def boxes(sizes: Sequence[Point3], centers: Sequence[Point3]) -> Mesh:
    """Return many boxes without bevels as one mesh, which is faster than making each box separately."""
    half = np.maximum(np.abs(np.asarray(sizes, np.float64)) / 2, _THINNEST_M)
    vertices = _BOX_SIGNS * half[:, None] + np.asarray(centers, np.float64)[:, None]
    orders = np.column_stack([half[:, 1:] > half[:, :-1], half[:, 2] > half[:, 0]]).tolist()
    uvs = [corners.take(_box_uvs(*order)) for corners, order in zip(vertices, orders, strict=True)]
    starts = len(_BOX_SIGNS) * np.arange(len(half))[:, None, None]
    faces, normals = (_BOX_FLAT + starts).reshape(-1, 3), np.tile(_BOX_NORMALS, (len(half), 1))
    return mesh(vertices.reshape(-1, 3), faces, normals, np.concatenate(uvs))


@cache
def _box_uvs(is_y_over_x: bool, is_z_over_y: bool, is_z_over_x: bool) -> np.ndarray:
    """Return indices (24, 2) of a box's uvs in its flattened vertices; u is along the longer side of a face."""
    u_v_of_sides = [
        (2, 1) if is_z_over_y else (1, 2),
        (2, 0) if is_z_over_x else (0, 2),
        (1, 0) if is_y_over_x else (0, 1),
    ]
    return 3 * np.arange(24)[:, None] + np.array(u_v_of_sides)[_BOX_AXES]


def span(low: Point3, high: Point3, bevel: float = 0.0) -> Mesh:
    """Return the box between two corners."""
    first, last = np.asarray(low, np.float64), np.asarray(high, np.float64)
    return box(last - first, (first + last) / 2, bevel)


def rounded_box(size: Point3, at: Point3 = ORIGIN, radius: float = 0.02, puff: float = 0.0) -> Mesh:
    """Return a box with round edges. `puff` (m) bulges its top and bottom; it then has 192 triangles instead of 108."""
    half = np.maximum(np.abs(np.asarray(size, np.float64)) / 2, _THINNEST_M)
    round_by = min(max(radius, _THINNEST_M / 2), 0.98 * half.min())
    flat = half - round_by
    grids = [np.unique([-half[i], -flat[i], *([0.0] if puff else []), flat[i], half[i]]) for i in range(3)]
    points, uvs, faces, count = [], [], [], 0
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        shape = len(grids[b]), len(grids[c])
        face = np.empty((*shape, 3))
        face[..., b], face[..., c] = grids[b][:, None], grids[c]
        for side in (-1.0, 1.0):
            face[..., axis] = side * half[axis]
            points.append(face.reshape(-1, 3).copy())
            uvs.append(points[-1][:, [b, c] if half[b] >= half[c] else [c, b]])
            faces.append(grid_faces(*shape, flip=side < 0) + count)
            count += len(points[-1])
    corners = np.concatenate(points)
    core = np.minimum(np.maximum(corners, -flat), flat)
    outward = corners - core
    outward /= norms(outward)[:, None]
    vertices = core + round_by * outward
    if puff:
        swell = puff * np.prod(1 - (vertices[:, [0, 2]] / half[[0, 2]]) ** 2, axis=1)
        vertices[:, 1] = vertices[:, 1] / half[1] * (half[1] - puff + swell)
        outward[:, [0, 2]] += 2 * puff * vertices[:, [0, 2]] / half[[0, 2]] ** 2 * np.abs(outward[:, 1:2])
    return mesh(vertices + np.asarray(at, np.float64), np.concatenate(faces), outward, np.concatenate(uvs))


def cushion(size: Point3, at: Point3 = ORIGIN) -> Mesh:
    """Return a soft box that exactly fills `size`: its edges are round, and its top and bottom bulge."""
    width, height, depth = size
    return rounded_box(size, at, 0.45 * min(width, height, depth), 0.18 * height)


def extrude(polygon: Sequence[tuple[float, float]] | np.ndarray, low: float, high: float, axis: Axis = "y") -> Mesh:
    """Return a prism over a polygon without crossings, which may be concave.

    The polygon is (x, z) for axis y, (x, y) for axis z and (z, y) for axis x. The prism reaches from `low` to `high`
    along the axis. Side edges that turn by less than 35 degrees are shaded smoothly.
    """
    outline = np.asarray(polygon, np.float64)
    count = len(outline)
    before, after = np.arange(count) - 1, np.arange(1, count + 1) % count
    following = outline[after]
    if np.sum(outline[:, 0] * following[:, 1] - following[:, 0] * outline[:, 1]) < 0:
        outline = outline[::-1]
        following = outline[after]
    edges = following - outline
    lengths = np.maximum(norms(edges), _THINNEST_M)
    outward = np.stack([edges[:, 1], -edges[:, 0]], 1) / lengths[:, None]
    is_smooth = (outward * outward[after]).sum(1)[:, None] > SMOOTH
    last = np.where(is_smooth, outward + outward[after], outward)
    first = np.where(is_smooth[before], outward[before] + outward, outward)
    travel = np.concatenate([[0], np.cumsum(lengths)])
    vertices, normals, uvs = np.empty((6, count, 3)), np.zeros((6, count, 3)), np.empty((6, count, 2))
    vertices[[0, 3, 4, 5], :, :2], vertices[[1, 2], :, :2] = outline, following
    vertices[[0, 1, 5], :, 2], vertices[[2, 3, 4], :, 2] = low, high
    normals[[0, 3], :, :2], normals[[1, 2], :, :2] = first, last
    normals[4, :, 2], normals[5, :, 2] = 1.0, -1.0
    uvs[[0, 3], :, 0], uvs[[1, 2], :, 0] = travel[:-1], travel[1:]
    uvs[:4, :, 1], uvs[4:] = vertices[:4, :, 2], outline
    lid = _triangulated(outline)
    faces = np.concatenate([_sides(count), lid + 4 * count, lid[:, ::-1] + 5 * count])
    order = {"y": [0, 2, 1], "z": [0, 1, 2], "x": [2, 1, 0]}[axis]
    faces = faces if axis == "z" else faces[:, ::-1]
    return mesh(vertices.reshape(-1, 3)[:, order], faces, normals.reshape(-1, 3)[:, order], uvs.reshape(-1, 2))


@cache
def _sides(count: int) -> np.ndarray:
    """Return the triangles of a prism's sides, between four rings of `count` vertices.

    The rings are the starts and the ends of the edges at the bottom, then the ends and the starts at the top.
    """
    a, b, c, d = (np.arange(count) + i * count for i in range(4))
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def _triangulated(outline: np.ndarray) -> np.ndarray:
    """Return the triangles (n, 3), counter-clockwise, of a polygon without crossings."""
    faces = mapbox_earcut.triangulate_float64(outline, np.array([len(outline)], np.uint32)).reshape(-1, 3).astype(int)
    corners = outline[faces]
    first_edge, second_edge = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turn = first_edge[:, 0] * second_edge[:, 1] - first_edge[:, 1] * second_edge[:, 0]
    return np.where((turn > 0)[:, None], faces, faces[:, ::-1])


def rounded_rectangle(width: float, depth: float, radius: float, steps: int = 4) -> np.ndarray:
    """Return the outline (n, 2) of a rectangle with round corners; its middle is the origin."""
    radius = min(radius, width / 2 - 1e-4, depth / 2 - 1e-4)
    angles = np.linspace(0, np.pi / 2, steps + 1)
    corners = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        turned = angles + quarter * np.pi / 2
        middle = np.array([sx * (width / 2 - radius), sy * (depth / 2 - radius)])
        corners.append(middle + radius * np.stack([np.cos(turned), np.sin(turned)], 1))
    return np.concatenate(corners)


def slab(size: Point3, at: Point3 = ORIGIN, radius: float = 0.05) -> Mesh:
    """Return a flat board whose four corners, as seen from above, are round."""
    x, y, z = at
    part = extrude(rounded_rectangle(size[0], size[2], radius), y - size[1] / 2, y + size[1] / 2)
    return translate(part, (x, 0.0, z))


def disc(radius: float, at: Point3 = ORIGIN, axis: Axis = "y", segments: int = 18, fit: bool = False) -> Mesh:
    """Return a flat disc that faces the positive direction of `axis`; with `fit`, one picture covers the disc."""
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], 1)
    outline = np.concatenate([[[0.0, 0.0]], circle])
    right, up, outward = _sight(axis, 1)
    vertices = radius * (outline[:, :1] * right + outline[:, 1:] * up) + np.asarray(at)
    uvs = outline / 2 + 0.5 if fit else radius * outline
    return mesh(vertices, fan(segments)[:, ::-1], np.full_like(vertices, outward), uvs)


def panel(width: float, height: float, at: Point3 = ORIGIN, facing: str = "+z", fit: bool = True) -> Mesh:
    """Return a flat rectangle that faces a direction ("+x" ... "-z"); with `fit`, one upright picture covers it.

    On a panel that faces "+y" or "-y", the top of the picture points to the back (-z).
    """
    right, up, outward = _sight(facing[1], -1 if facing[0] == "-" else 1)
    vertices = _SQUARE[:, :1] * width * right + _SQUARE[:, 1:] * height * up + np.asarray(at, np.float64)
    uvs = _SQUARE + 0.5 if fit else _SQUARE * [width, height]
    return mesh(vertices, _SQUARE_FACES, np.full_like(vertices, outward), uvs)


@cache
def _sight(axis: str, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the directions right, up and towards the viewer, for a viewer who looks at one side of a box.

    The frame is left-handed, so a viewer who looks along -z has +x on the left.
    """
    outward = side * np.eye(3)[AXES[axis]]
    up = np.array([0, 0, -1.0]) if axis == "y" else np.array([0, 1.0, 0])
    right = cross(outward, up)
    return right, up, cross(up, right)
