"""What may be in a picture: what is neither out of view nor in a room that no line of sight reaches.

Drawing everything would change only single pixels along the seams between rooms. There, the edge of the next room's
wall or ceiling has the same depth as the edge of this room's wall or ceiling, and might be drawn instead.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from vigil.rendering.scene import RenderScene, RenderState
from vigil.rendering.structure_parts import MARGIN_M, StructureParts
from vigil.rendering.viewer import Viewer
from vigil.scene.portals import IN_ROOM_M, Place, Portals
from vigil.scene.sectors import ALL, Sector, Spans, overlap

_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """What depends only on the poses of a scene's geoms."""

    positions: np.ndarray
    rotations: np.ndarray
    middles: np.ndarray
    """Middles (n, 3) of the boxes around all geoms, and then around all parts of the structure."""
    halves: np.ndarray
    """Vectors (3, n, 3) from each box's middle to the middles of three of its sides, with a margin."""
    corners: np.ndarray
    """Corners (8, n, 3) of the boxes."""
    touches: np.ndarray
    """Whether (n, rooms + 1) each geom or part may reach into each room; the last column stands for the outside. It is
    False in all columns for what may be visible from anywhere, such as an object in a doorway."""


@dataclass(frozen=True, slots=True, eq=False)
class InView:
    """What of a scene may be in a picture."""

    geoms: np.ndarray
    """Numbers of the geoms."""
    parts: np.ndarray
    """Numbers of the parts of the structure; of the structure's geoms only these need be drawn."""

    def without(self, geoms: list[int]) -> "InView":
        """Return the same without some geoms."""
        return InView(self.geoms[~np.isin(self.geoms, geoms)], self.parts) if geoms else self


def in_view(scene: RenderScene, parts: StructureParts, state: RenderState, viewer: Viewer) -> InView:
    """Return what is visible and not certainly outside the picture."""
    placed, sides, geoms = _placed(scene, parts, state), viewer.sides(), len(state.positions)
    normals = sides[:, :3].T
    farthest_in = placed.middles @ normals + sides[:, 3] + sum(np.abs(half @ normals) for half in placed.halves)
    is_near = np.asarray((farthest_in >= 0.0).all(axis=1))
    is_near[: len(scene.structure_kinds)] = False  # their parts decide
    sectors = _sectors(scene.portals, viewer)
    if sectors is not None:
        whole = [room for room, sector in sectors if sector == ALL]
        left = np.flatnonzero(is_near & ~placed.touches[:, whole].any(axis=1))
        spans = Spans.of(viewer.eye, placed.corners[:, left])
        is_near[left] = _is_in_sectors(placed.touches[left], sectors, spans)
    shown = np.flatnonzero(is_near[geoms:])
    is_near[parts.geoms[shown]] = True
    return InView(np.flatnonzero((is_near[:geoms] | state.is_held) & state.is_visible), shown)


def _placed(scene: RenderScene, parts: StructureParts, state: RenderState) -> _Placed:
    """Return what depends only on the poses; it is computed again only when a pose has changed."""
    found: _Placed | None = scene.cache.get("placed")
    if (
        found is None
        or not np.array_equal(found.positions, state.positions)
        or not np.array_equal(found.rotations, state.rotations)
    ):
        positions, rotations = state.positions.copy(), state.rotations.copy()
        middles = np.einsum("nij,nj->ni", rotations, scene.boxes[:, :3]) + positions
        halves = np.moveaxis(rotations * (scene.boxes[:, None, 3:] + MARGIN_M), 2, 0)
        middles, halves = np.concatenate([middles, parts.middles]), np.concatenate([halves, parts.halves], axis=1)
        corners = middles + np.tensordot(_SIGNS, halves, 1)
        touches = np.concatenate([_touches(scene, positions), parts.touches])
        scene.cache["placed"] = found = _Placed(positions, rotations, middles, halves, corners, touches)
    return found


def _touches(scene: RenderScene, positions: np.ndarray) -> np.ndarray:
    """Return the rows of `_Placed.touches` for all geoms."""
    away = scene.portals.distances(positions[:, :2])
    touches = np.zeros((len(positions), away.shape[1] + 1), dtype=bool)
    touches[:, :-1] = (away <= scene.radii[:, None] + MARGIN_M) & (away.min(axis=1) <= IN_ROOM_M)[:, None]
    return touches


def _sectors(portals: Portals, viewer: Viewer) -> list[tuple[int, Sector]] | None:
    """Return (room, directions to it) for the visible rooms; None if every room may be visible."""
    mirror = viewer.mirror
    if mirror is None:
        return portals.visible_rooms(_place(viewer.eye))
    spans = Spans.of(viewer.eye, mirror.reach[:, None])
    through = Sector(*(float(each[0]) for each in (spans.start, spans.width, spans.low, spans.high)))
    before = np.unique(mirror.face + MARGIN_M * mirror.normal, axis=0)
    return portals.visible_rooms(_place(viewer.eye), map(_place, before), through)


def _place(point: np.ndarray) -> Place:
    """Return a point as x, z and height, which `Portals` uses."""
    x, z, height = point.tolist()
    return x, z, height


def _is_in_sectors(touches: np.ndarray, sectors: list[tuple[int, Sector]], spans: Spans) -> np.ndarray:
    """Return a mask (n,) of what is in a room that is visible in its direction, or in no room."""
    in_sector = touches[:, [room for room, _ in sectors]].T & overlap([sector for _, sector in sectors], spans)
    return np.asarray(in_sector.any(axis=0) | ~touches.any(axis=1))
