"""What need not be drawn: geoms beside the view, and those to which no line of sight leads through the rooms.

The frame is the same without, but for single pixels along the seams between rooms: there the edge of a next room's wall
or ceiling lies in this one's, at the same depth, and would now and then win.
"""

import itertools

import numpy as np

from vigil.scene.portals import IN_ROOM_M, Place
from vigil.scene.sectors import Sector, Spans
from vigil.sim.engines.mujoco.compiled.model import HELD, CompiledModel
from vigil.sim.engines.mujoco.raster.viewer import Viewer

MARGIN_M = 0.01
_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def invisible_geoms(model: CompiledModel, viewer: Viewer) -> np.ndarray:
    """Return which geoms (ngeom,) leave no trace in a picture."""
    native, data = model.native, model.data
    radius = np.where(native.geom_rbound > 0.0, native.geom_rbound, np.inf)  # 0: a plane without end
    sides = viewer.sides()
    farthest_in = data.geom_xpos @ sides[:, :3].T + sides[:, 3] + radius[:, None] + MARGIN_M
    is_unseen = (farthest_in < 0.0).any(axis=1)
    asked = np.flatnonzero(~is_unseen & np.isfinite(radius))
    corners = _corners(model, asked)
    is_out = ((corners @ sides[:, :3].T + sides[:, 3]).max(axis=0) < 0.0).any(axis=1)
    sectors = _sectors(model, viewer)
    if sectors is not None:
        left = np.flatnonzero(~is_out)
        is_out[left] = _is_elsewhere(model, sectors, asked[left], Spans.of(viewer.eye, corners[:, left]))
    is_unseen[asked] = is_out
    return is_unseen & (native.geom_group != HELD)


def _corners(model: CompiledModel, geoms: np.ndarray) -> np.ndarray:
    """Return the corners (8, n, 3) of boxes around geoms where they are now."""
    turns, boxes = model.data.geom_xmat[geoms].reshape(-1, 3, 3), model.native.geom_aabb[geoms]
    own = boxes[:, :3] + _SIGNS[:, None] * (boxes[:, 3:] + MARGIN_M)
    return np.einsum("kni,nji->knj", own, turns) + model.data.geom_xpos[geoms]


def _sectors(model: CompiledModel, viewer: Viewer) -> list[tuple[int, Sector]] | None:
    """Return in which directions rooms are seen; None when all may be."""
    mirror = viewer.mirror
    if mirror is None:
        return model.portals.visible_rooms(_place(viewer.eye))
    through = Sector.of(viewer.eye.tolist(), mirror.reach.tolist())
    before = np.unique(mirror.face + MARGIN_M * mirror.normal, axis=0)
    return model.portals.visible_rooms(_place(viewer.eye), map(_place, before), through)


def _place(point: np.ndarray) -> Place:
    """Return a point of MuJoCo's frame as a place of the plan."""
    x, z, height = point.tolist()
    return x, z, height


def _is_elsewhere(
    model: CompiledModel, sectors: list[tuple[int, Sector]], geoms: np.ndarray, spans: Spans
) -> np.ndarray:
    """Return which of the geoms (n,) are in rooms, but in none that is seen in their direction."""
    reach = model.native.geom_rbound[geoms] + MARGIN_M
    away = model.portals.distances(model.data.geom_xpos[geoms, :2])
    touches = (away <= reach[:, None]) & (away.min(axis=1) <= IN_ROOM_M)[:, None]
    own = np.full(model.native.ngeom, -1)
    own[list(model.structure_rooms)] = list(model.structure_rooms.values())
    is_structure = model.geom_things[geoms] < 0
    touches[is_structure] = own[geoms[is_structure], None] == np.arange(touches.shape[1])
    is_seen = ~touches.any(axis=1)
    for room, sector in sectors:
        is_seen |= touches[:, room] & sector.overlaps(spans)
    return ~is_seen
