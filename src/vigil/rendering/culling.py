"""Geoms that need not be drawn: those out of view, and those that no line of sight through the rooms reaches.

Drawing them as well would change only single pixels along the seams between rooms. There, the edge of the next room's
wall or ceiling has the same depth as the edge of this room's wall or ceiling, and might be drawn instead.
"""

import itertools

import numpy as np

from vigil.rendering.scene import RenderScene, RenderState
from vigil.rendering.viewer import Viewer
from vigil.scene.portals import IN_ROOM_M, Place, Portals
from vigil.scene.sectors import Sector, Spans

MARGIN_M = 0.01
_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def invisible_geoms(scene: RenderScene, state: RenderState, viewer: Viewer) -> np.ndarray:
    """Return a mask (geoms,) of the geoms that are certainly not in the picture."""
    sides = viewer.sides()
    farthest_in = state.positions @ sides[:, :3].T + sides[:, 3] + scene.radii[:, None] + MARGIN_M
    is_unseen = np.asarray((farthest_in < 0.0).any(axis=1))
    asked = np.flatnonzero(~is_unseen & np.isfinite(scene.radii))
    corners = _corners(scene.boxes[asked], state, asked)
    is_out = ((corners @ sides[:, :3].T + sides[:, 3]).max(axis=0) < 0.0).any(axis=1)
    sectors = _sectors(scene.portals, viewer)
    if sectors is not None:
        left = np.flatnonzero(~is_out)
        is_out[left] = _is_elsewhere(scene, state, sectors, asked[left], Spans.of(viewer.eye, corners[:, left]))
    is_unseen[asked] = is_out
    return is_unseen & ~state.is_held


def _corners(boxes: np.ndarray, state: RenderState, geoms: np.ndarray) -> np.ndarray:
    """Return the corners (8, n, 3), in the world, of the boxes (n, 6) around geoms (n,) in the poses of a state."""
    own = boxes[:, :3] + _SIGNS[:, None] * (boxes[:, 3:] + MARGIN_M)
    return np.einsum("kni,nji->knj", own, state.rotations[geoms]) + state.positions[geoms]


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


def _is_elsewhere(
    scene: RenderScene, state: RenderState, sectors: list[tuple[int, Sector]], geoms: np.ndarray, spans: Spans
) -> np.ndarray:
    """Return a mask (n,) of the geoms that are in rooms, but in none of the rooms visible in their direction."""
    reach = scene.radii[geoms] + MARGIN_M
    away = scene.portals.distances(state.positions[geoms, :2])
    touches = (away <= reach[:, None]) & (away.min(axis=1) <= IN_ROOM_M)[:, None]
    structure = geoms < len(scene.structure_kinds)
    touches[structure] = scene.structure_rooms[geoms[structure], None] == np.arange(touches.shape[1])
    is_seen = ~touches.any(axis=1)
    for room, sector in sectors:
        is_seen |= touches[:, room] & sector.overlaps(spans)
    return ~is_seen
