"""What need not be drawn: geoms beside the view, and things in rooms that no line of sight reaches.

The frame is the same without.
"""

import numpy as np

from vigil.sim.engines.mujoco.compiled.model import HELD, CompiledModel
from vigil.sim.engines.mujoco.raster.viewer import Viewer

MARGIN_M = 0.01


def unseen(model: CompiledModel, viewer: Viewer) -> np.ndarray:
    """Returns which geoms (ngeom,) leave no trace in a picture."""
    eye = viewer.eye
    native, data = model.native, model.data
    radius = np.where(native.geom_rbound > 0.0, native.geom_rbound, np.inf)  # 0: a plane without end
    farthest_in = (data.geom_xpos - eye) @ _sides(viewer).T + radius[:, None] + MARGIN_M
    is_beside = (farthest_in < 0.0).any(axis=1)
    visible = _visible_rooms(model, viewer)
    if not visible.all():
        ahead = np.flatnonzero(~is_beside & (model.geom_things[:-1] >= 0))
        is_beside[ahead[_is_elsewhere(model, visible, radius, ahead)]] = True
        is_beside[[geom for geom, room in model.structure_rooms.items() if not visible[room]]] = True
    return is_beside & (native.geom_group != HELD)


def _visible_rooms(model: CompiledModel, viewer: Viewer) -> np.ndarray:
    """Returns whether each room can be seen; behind a mirror, and from above without the ceilings, all can."""
    if viewer.clip is not None or viewer.eye[2] > model.portals.top_m:
        return np.ones(len(model.lamps.rooms), dtype=bool)
    return model.portals.visible_from((float(viewer.eye[0]), float(viewer.eye[1])))


def _is_elsewhere(model: CompiledModel, visible: np.ndarray, radius: np.ndarray, geoms: np.ndarray) -> np.ndarray:
    """Returns which of the geoms touch rooms, but none that is visible."""
    if not len(geoms):
        return np.zeros(0, dtype=bool)
    touches = model.portals.distances(model.data.geom_xpos[geoms, :2]) <= radius[geoms, None] + MARGIN_M
    return np.any(touches, axis=1) & ~np.any(touches & visible, axis=1)


def _sides(viewer: Viewer) -> np.ndarray:
    """Returns the inward unit normals (5, 3) of the view's four sides and of the plane through the eye."""
    right, up, backward = viewer.axes.T
    width, height = viewer.slopes
    inward = np.array(
        [
            -backward,
            right - width * backward,
            -right - width * backward,
            up - height * backward,
            -up - height * backward,
        ]
    )
    return inward / np.linalg.norm(inward, axis=1, keepdims=True)
