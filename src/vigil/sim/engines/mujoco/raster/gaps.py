"""Where little light comes while things are shut: inside of them, and between their parts.

Leaves stop no light, so what lies behind one is lit as if it were open, and would shine through the gap between two.
"""

import numpy as np

from vigil.sim.engines.mujoco.compiled.model import GLASS, HIDDEN, CompiledModel, Placed
from vigil.sim.engines.mujoco.raster.geometry import Geometry
from vigil.sim.engines.mujoco.raster.irradiance import Samples
from vigil.sim.engines.mujoco.raster.occluders import occluders_of

LIFT_M = 0.0005
GAP_M, INSIDE_M = 0.05, 0.6
"""What a leaf faces nearer than this is beside it; what a case has nearer than this before it shuts it."""
FRONT = 1
"""The axis of a body's frame that points to its thing's front."""


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
        found[chosen] = leaves.distances(origins, normals) < GAP_M
        if body == model.native.geom_bodyid[thing.geoms[0]]:
            front = model.data.xmat[body].reshape(3, 3)[:, FRONT].astype(np.float32)
            for ways in (normals, np.broadcast_to(front, normals.shape)):
                found[chosen] |= leaves.distances(origins, ways) < INSIDE_M
    return found


def _others(model: CompiledModel, thing: Placed, body: int) -> np.ndarray:
    """Returns the geoms of a thing that are no part of one of its bodies and stop light."""
    native, parts = model.native, thing.geoms
    return parts[(native.geom_bodyid[parts] != body) & ~np.isin(native.geom_group[parts], (HIDDEN, GLASS))]
