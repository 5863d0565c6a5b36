"""Geoms that need not be drawn: those out of view, and those that no line of sight through the rooms reaches.

Drawing them as well would change only single pixels along the seams between rooms. There, the edge of the next room's
wall or ceiling has the same depth as the edge of this room's wall or ceiling, and might be drawn instead.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from vigil.rendering.scene import RenderScene, RenderState
from vigil.rendering.viewer import Viewer
from vigil.scene.portals import IN_ROOM_M, Place, Portals
from vigil.scene.sectors import Sector, Spans

MARGIN_M = 0.01
_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """What depends only on the poses of a scene's geoms."""

    positions: np.ndarray
    rotations: np.ndarray
    corners: np.ndarray
    """Corners (8, geoms, 3), in the world, of the boxes around all geoms, with a margin."""
    touches: np.ndarray
    """Whether (geoms, rooms) each geom may reach into each room; False for geoms outside all rooms."""


def invisible_geoms(scene: RenderScene, state: RenderState, viewer: Viewer) -> np.ndarray:
    """Return a mask (geoms,) of the geoms that are certainly not in the picture."""
    sides = viewer.sides()
    farthest_in = state.positions @ sides[:, :3].T + sides[:, 3] + scene.radii[:, None] + MARGIN_M
    is_unseen = np.asarray((farthest_in < 0.0).any(axis=1))
    asked = np.flatnonzero(~is_unseen & np.isfinite(scene.radii))
    placed = _placed(scene, state)
    corners = placed.corners[:, asked]
    is_out = ((corners @ sides[:, :3].T + sides[:, 3]).max(axis=0) < 0.0).any(axis=1)
    sectors = _sectors(scene.portals, viewer)
    if sectors is not None:
        left = np.flatnonzero(~is_out)
        spans = Spans.of(viewer.eye, corners[:, left])
        is_out[left] = _is_elsewhere(placed.touches[asked[left]], sectors, spans)
    is_unseen[asked] = is_out
    return is_unseen & ~state.is_held


def _placed(scene: RenderScene, state: RenderState) -> _Placed:
    """Return what depends only on the poses; it is computed again only when a pose has changed."""
    found: _Placed | None = scene.cache.get("placed")
    if (
        found is None
        or not np.array_equal(found.positions, state.positions)
        or not np.array_equal(found.rotations, state.rotations)
    ):
        positions, rotations = state.positions.copy(), state.rotations.copy()
        own = scene.boxes[:, :3] + _SIGNS[:, None] * (scene.boxes[:, 3:] + MARGIN_M)
        corners = np.einsum("kni,nji->knj", own, rotations) + positions
        scene.cache["placed"] = found = _Placed(positions, rotations, corners, _touches(scene, positions))
    return found


def _touches(scene: RenderScene, positions: np.ndarray) -> np.ndarray:
    """Return a mask (geoms, rooms) of the rooms into which each geom may reach; structure is in one room only."""
    away = scene.portals.distances(positions[:, :2])
    touches = (away <= scene.radii[:, None] + MARGIN_M) & (away.min(axis=1) <= IN_ROOM_M)[:, None]
    structure = slice(len(scene.structure_kinds))
    touches[structure] = scene.structure_rooms[structure, None] == np.arange(touches.shape[1])
    return touches


def _sectors(portals: Portals, viewer: Viewer) -> list[tuple[int, Sector]] | None:
    """Return (room, directions to it) for the visible rooms; None if every room may be visible."""
    mirror = viewer.mirror
    if mirror is None:
        return portals.visible_rooms(_place(viewer.eye))
    through = Sector.of(viewer.eye.tolist(), mirror.reach.tolist())
    before = np.unique(mirror.face + MARGIN_M * mirror.normal, axis=0)
    return portals.visible_rooms(_place(viewer.eye), map(_place, before), through)


def _place(point: np.ndarray) -> Place:
    """Return a point as x, z and height, which `Portals` uses."""
    x, z, height = point.tolist()
    return x, z, height


def _is_elsewhere(touches: np.ndarray, sectors: list[tuple[int, Sector]], spans: Spans) -> np.ndarray:
    """Return a mask (n,) of the geoms that are in rooms, but not in a room that is visible in their direction."""
    is_seen = np.logical_not(touches.any(axis=1))
    for room, sector in sectors:
        is_seen |= touches[:, room] & sector.overlaps(spans)
    return ~is_seen
