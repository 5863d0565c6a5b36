"""Walls (with holes for doors and windows), floors, ceilings and skirting of a scene, as meshes.

Surfaces that meet are cut along the same lines, and walls reach a little below the floor and above the ceiling. So no
gap is visible between them.
"""

from dataclasses import dataclass

import mapbox_earcut
import numpy as np
import shapely

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.meshes import merge
from vigil.protocol.house import EXTERIOR, MaterialRef
from vigil.scene.outlines import room_floor
from vigil.scene.things import Hole, RoomShape, Scene, WallPanel
from vigil.sim.engines.mujoco.compiled.frames import faces as facing
from vigil.sim.engines.mujoco.compiled.frames import points

CELL_M = 0.5
"""Size (m) of the cells into which surfaces are cut."""
OVERLAP_M = 0.02
"""How far (m) walls reach below the floor and above the ceiling."""
BEHIND_FRAME_M = 0.002
"""How far (m) walls reach behind the frame in a hole, so that no ray passes between wall and frame."""
SKIRTING_HEIGHT_M = 0.09
SKIRTING_DEPTH_M = 0.012
SKIRTING = MaterialRef(name="plastic/#e9e6df")
CEILING = MaterialRef(name="plaster/white")


@dataclass(frozen=True, slots=True, eq=False)
class Shell:
    """A structural surface, such as the walls of a room that have the same material."""

    kind: str
    """Kind of the surface: `wall`, `floor`, `ceiling`, `skirting` or `exterior`."""
    mesh: Mesh
    material: MaterialRef
    room_id: str | None = None
    """Id of the only room from which the surface is visible; None for other surfaces, such as an exterior wall."""


def shells_of(scene: Scene) -> list[Shell]:
    """Return the structural surfaces of a scene in a fixed order, one for each room and material."""
    shells = _walls(scene)
    for room in scene.rooms:
        shells.append(Shell("floor", _slab(room, 0.0, is_floor=True), room.floor_material, room.id))
        ceiling = _slab(room, room.height, is_floor=False)
        shells.append(Shell("ceiling", ceiling, room.ceiling_material or CEILING, room.id))
    boards = [board for panel in scene.panels if panel.room_id != EXTERIOR for board in _skirting(panel)]
    if boards:
        shells.append(Shell("skirting", merge(boards), SKIRTING))
    return shells


def tint_of(material: MaterialRef) -> tuple[float, float, float] | None:
    """Return the tint that a house gives a material; None if there is no tint."""
    color = material.color
    return None if color is None else (color.r, color.g, color.b)


def _walls(scene: Scene) -> list[Shell]:
    ends = [height for panel in scene.panels for height in (panel.bottom, panel.bottom + panel.height)]
    low, high = min(ends, default=0.0) - OVERLAP_M, max(ends, default=0.0) + OVERLAP_M
    holes = [_behind_frame(panel, hole) for panel in scene.panels for hole in panel.holes]
    sills = [height for hole in holes for height in (hole.bottom, hole.top)]
    grid = np.arange(np.ceil(low / CELL_M), np.floor(high / CELL_M) + 1) * CELL_M
    heights = _distinct(np.concatenate([grid, sills, ends]), low, high)
    groups: dict[tuple, list[WallPanel]] = {}
    for panel in scene.panels:
        groups.setdefault((panel.room_id, panel.material.name, tint_of(panel.material)), []).append(panel)
    return [
        Shell(
            EXTERIOR if panels[0].room_id == EXTERIOR else "wall",
            merge([_wall(panel, heights) for panel in panels]),
            panels[0].material,
            None if panels[0].room_id == EXTERIOR else panels[0].room_id,
        )
        for panels in groups.values()
    ]


def _behind_frame(panel: WallPanel, hole: Hole) -> Hole:
    """Return a hole made smaller on each side where a door or window frame covers the wall's edge."""
    bottom = hole.bottom if hole.bottom <= panel.bottom + 0.01 else hole.bottom + BEHIND_FRAME_M
    return Hole(hole.left + BEHIND_FRAME_M, hole.right - BEHIND_FRAME_M, bottom, hole.top - BEHIND_FRAME_M)


def _distinct(values: np.ndarray, low: float, high: float) -> np.ndarray:
    inside = values[(values > low + 1e-4) & (values < high - 1e-4)]
    ordered = np.sort(np.concatenate([[low, high], inside]))
    return ordered[np.concatenate([[True], np.diff(ordered) > 1e-4])]


def _course(panel: WallPanel) -> tuple[np.ndarray, np.ndarray, float]:
    """Return a panel's start (2,) on the floor plane, the unit vector (2,) along it, and its length (m)."""
    start, way = np.array(panel.start), np.subtract(panel.end, panel.start)
    length = float(np.linalg.norm(way))
    return start, way / max(length, 1e-9), length


def _wall(panel: WallPanel, heights: np.ndarray) -> Mesh:
    start, along, length = _course(panel)
    first = float(start @ along)
    holes = [_behind_frame(panel, hole) for hole in panel.holes]
    edges = np.array([edge for hole in holes for edge in (hole.left, hole.right)], dtype=float)
    grid = np.arange(np.ceil(first / CELL_M), np.floor((first + length) / CELL_M) + 1) * CELL_M - first
    across = _distinct(np.concatenate([grid, edges]), 0.0, length)
    low, high = panel.bottom - OVERLAP_M, panel.bottom + panel.height + OVERLAP_M
    up = _distinct(heights, low, high)
    u, v = np.meshgrid(across, up, indexing="ij")
    middle_u, middle_v = (across[:-1] + across[1:]) / 2, (up[:-1] + up[1:]) / 2
    solid = np.ones((len(middle_u), len(middle_v)), dtype=bool)
    for hole in holes:
        bottom = -np.inf if hole.bottom <= panel.bottom + 0.01 else hole.bottom
        solid &= ~np.outer(
            (middle_u > hole.left) & (middle_u < hole.right), (middle_v > bottom) & (middle_v < hole.top)
        )
    floor_points = start + along * u[..., None]
    vertices = np.stack([floor_points[..., 0], v, floor_points[..., 1]], axis=-1)
    normal = np.array([panel.normal[0], 0.0, panel.normal[1]])
    return _grid(vertices, solid, normal, np.stack([u + first, v], axis=-1))


def _grid(vertices: np.ndarray, keep: np.ndarray, normal: np.ndarray, uvs: np.ndarray) -> Mesh:
    """Return a mesh of the cells that `keep` selects from a grid of vertices (a, b, 3) in THOR's frame.

    The mesh faces along `normal`.
    """
    rows, columns = vertices.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    corners = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)[keep]
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return _facing(vertices.reshape(-1, 3), triangles, normal, uvs.reshape(-1, 2))


def _facing(vertices: np.ndarray, triangles: np.ndarray, normal: np.ndarray, uvs: np.ndarray) -> Mesh:
    used, triangles = np.unique(triangles, return_inverse=True)
    vertices, uvs, triangles = vertices[used], uvs[used], triangles.reshape(-1, 3)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    turned = np.cross(b - a, c - a) @ normal < 0
    triangles[turned] = facing(triangles[turned])
    normals = np.broadcast_to(normal, vertices.shape)
    return Mesh(points(vertices), facing(triangles).astype(np.int32), points(normals), uvs)


def _slab(room: RoomShape, height: float, *, is_floor: bool) -> Mesh:
    """Return a floor or ceiling, cut into cells."""
    polygon = room_floor(room)
    low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
    cuts = [
        _distinct(
            np.concatenate([np.arange(np.ceil(a / CELL_M), np.floor(b / CELL_M) + 1) * CELL_M, room.polygon[:, axis]]),
            a,
            b,
        )
        for axis, (a, b) in enumerate(zip(low, high, strict=True))
    ]
    x, z = np.meshgrid(*cuts, indexing="ij")
    cells = shapely.box(x[:-1, :-1], z[:-1, :-1], x[1:, 1:], z[1:, 1:])
    shapely.prepare(polygon)
    inside = shapely.covers(polygon.buffer(1e-6), cells)
    normal = np.array([0.0, 1.0 if is_floor else -1.0, 0.0])
    flat = np.stack([x, np.full_like(x, height), z], axis=-1)
    parts = [_grid(flat, inside, normal, np.stack([x, z], axis=-1))] if inside.any() else []
    cut = shapely.get_parts(shapely.intersection(polygon, cells[~inside]))
    parts += [_ears(piece, height, normal) for piece in cut if isinstance(piece, shapely.Polygon) and piece.area > 1e-6]
    return merge(parts)


def _ears(polygon: shapely.Polygon, height: float, normal: np.ndarray) -> Mesh:
    ring = np.array(polygon.exterior.coords)[:-1]
    triangles = mapbox_earcut.triangulate_float64(ring, np.array([len(ring)], dtype=np.uint32)).reshape(-1, 3)
    vertices = np.stack([ring[:, 0], np.full(len(ring), height), ring[:, 1]], axis=-1)
    return _facing(vertices, triangles.astype(np.int64), normal, ring)


def _skirting(panel: WallPanel) -> list[Mesh]:
    """Return the skirting boards along the foot of a wall. Holes that reach down to the floor have no boards."""
    gaps = sorted((hole.left, hole.right) for hole in panel.holes if hole.bottom < panel.bottom + SKIRTING_HEIGHT_M)
    stretches, at = [], 0.0
    for left, right in gaps:
        stretches.append((at, left))
        at = max(at, right)
    stretches.append((at, _course(panel)[2]))
    return [_board(panel, a, b) for a, b in stretches if b - a > 0.02]


def _board(panel: WallPanel, left: float, right: float) -> Mesh:
    (start, along, _), normal = _course(panel), np.array(panel.normal)
    count = max(2, int(np.ceil((right - left) / CELL_M)) + 1)
    u = np.linspace(left, right, count)
    profile = [(SKIRTING_DEPTH_M, 0.0), (SKIRTING_DEPTH_M, SKIRTING_HEIGHT_M - 0.008), (0.0, SKIRTING_HEIGHT_M)]
    rings = [start + along * u[:, None] + normal * depth for depth, _ in profile]
    lines = [
        np.stack([ring[:, 0], np.full(count, panel.bottom + height), ring[:, 1]], axis=-1)
        for ring, (_, height) in zip(rings, profile, strict=True)
    ]
    uvs = np.stack([np.stack([u, np.full(count, height)], axis=-1) for _, height in profile], axis=1)
    sloped = np.array([normal[0], 1.2, normal[1]]) / np.linalg.norm([normal[0], 1.2, normal[1]])
    faces = [
        _grid(np.stack(lines[i : i + 2], axis=1), np.ones((count - 1, 1), dtype=bool), side, uvs[:, i : i + 2])
        for i, side in ((0, np.array([normal[0], 0.0, normal[1]])), (1, sloped))
    ]
    return merge(faces)
