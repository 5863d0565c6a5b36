"""What stops light: the fixed surfaces of a scene, and rays into them."""

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.scene import RayCaster, RenderState

FAR_M = 100.0
_SHORT_M = 1e-3


class Occluders:
    """Triangles that rays meet."""

    def __init__(self, caster: RayCaster) -> None:
        self._caster = caster

    def distances(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return how far each ray (n, 3) goes, in metres along its unit direction; `FAR_M` where it meets nothing."""
        if not len(origins):
            return np.zeros(0, np.float32)
        met = self._caster.cast(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32))
        return np.minimum(met, np.float32(FAR_M))

    def are_blocked(self, origins: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return whether anything stands between each point (n, 3) and some places (k, 3): (k, n)."""
        way = (ends[:, None] - origins).reshape(-1, 3)
        length = np.sqrt(np.einsum("ij,ij->i", way, way))
        far = self.distances(np.tile(origins, (len(ends), 1)), way / length[:, None])
        return (far < length - _SHORT_M).reshape(len(ends), len(origins))


def occluders_of(geometry: Geometry, state: RenderState, geoms: np.ndarray) -> Occluders:
    """Return the triangles of geoms where they are in a state."""
    vertices = np.concatenate([geometry.world(state, geom)[0] for geom in geoms])
    counts = [geometry.vertex_slices[geom].stop - geometry.vertex_slices[geom].start for geom in geoms]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    faces = [
        geometry.faces[geometry.face_slices[geom]] - geometry.vertex_slices[geom].start + start
        for geom, start in zip(geoms, starts, strict=True)
    ]
    return Occluders(geometry.scene.caster(vertices, np.concatenate(faces)))
