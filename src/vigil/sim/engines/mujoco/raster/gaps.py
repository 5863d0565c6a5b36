"""Where little light comes while things are shut: inside of them, and between their parts.

Leaves stop no light, so what lies behind one is lit as if it were open, and would shine through the gap between two.
"""

import numpy as np

from vigil.sim.engines.mujoco.compiled.model import GLASS, HIDDEN, CompiledModel, Placed
from vigil.sim.engines.mujoco.raster.geometry import Geometry
from vigil.sim.engines.mujoco.raster.irradiance import Samples
from vigil.sim.engines.mujoco.raster.occluders import Occluders, occluders_of

LIFT_M = 0.0005
GAP_M, INSIDE_M = 0.05, 0.6
"""What a leaf faces nearer than this is beside it; what a case has nearer than this before it shuts it."""
FRONT, BESIDE = 1, (0, 2)
"""The axis of a body's frame that points to its thing's front, and those that point to its sides, top and bottom."""
FARTHEST_SIDE_M, ENCLOSED_ON = 3.0, 3
"""What has parts of its thing this near on so many of its four sides lies inside of it: no case is larger."""


def shut_away(model: CompiledModel, geometry: Geometry, geoms: np.ndarray, samples: Samples) -> np.ndarray:
    """Returns which samples (n,) on geoms (n,) face another moving part of the same thing, near enough."""
    found = np.zeros(len(geoms), dtype=bool)
    placed, bodies = list(model.things.values()), model.native.geom_bodyid[geoms]
    for body in np.unique(bodies[model.geom_things[geoms] >= 0]).tolist():
        chosen = np.flatnonzero(bodies == body)
        thing = placed[model.geom_things[geoms[chosen[0]]]]
        others = _others(model, thing, body)
        if not len(others):
            continue
        leaves, normals = occluders_of(model, geometry, others), samples.normals[chosen]
        origins = samples.points[chosen] + np.float32(LIFT_M) * normals
        is_shut = leaves.distances(origins, normals) < GAP_M
        if body == model.native.geom_bodyid[thing.geoms[0]]:
            axes = model.data.xmat[body].reshape(3, 3).astype(np.float32)
            is_behind = leaves.distances(origins, normals) < INSIDE_M
            is_behind |= leaves.distances(origins, np.broadcast_to(axes[:, FRONT], normals.shape)) < INSIDE_M
            behind = np.flatnonzero(is_behind & ~is_shut)
            case = occluders_of(model, geometry, _lit_parts(model, thing))
            is_shut[behind] = _enclosed(case, origins[behind], axes[:, BESIDE].T)
        found[chosen] = is_shut
    return found


def _enclosed(case: Occluders, origins: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Returns which points (n, 3) have the case beside them, along both directions of most of the axes (k, 3)."""
    stopped = np.zeros(len(origins), dtype=int)
    for way in (*axes, *-axes):
        stopped += case.distances(origins, np.broadcast_to(way, origins.shape)) < FARTHEST_SIDE_M
    return stopped >= ENCLOSED_ON


def _others(model: CompiledModel, thing: Placed, body: int) -> np.ndarray:
    """Returns the geoms of a thing that are no part of one of its bodies and stop light."""
    parts = _lit_parts(model, thing)
    return parts[model.native.geom_bodyid[parts] != body]


def _lit_parts(model: CompiledModel, thing: Placed) -> np.ndarray:
    """Returns the geoms of a thing that stop light."""
    return thing.geoms[~np.isin(model.native.geom_group[thing.geoms], (HIDDEN, GLASS))]
