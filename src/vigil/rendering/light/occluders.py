"""Surfaces that block light, and rays that are cast at them."""

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.scene import CastRays, RenderState

FAR_M = 100.0
_SHORT_M = 1e-3


class Occluders:
    """Triangles that block light."""

    def __init__(self, cast: CastRays) -> None:
        self._cast = cast

    def distances(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the length (n,) in metres of rays from `origins` (n, 3) along unit directions; `FAR_M` for a miss."""
        if not len(origins):
            return np.zeros(0, np.float32)
        met = self._cast(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32))
        return np.minimum(met, np.float32(FAR_M))

    def are_blocked(self, origins: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return a mask (k, n) of the lines that are blocked. The lines run from n origins (n, 3) to k ends (k, 3)."""
        way = (ends[:, None] - origins).reshape(-1, 3)
        length = np.sqrt(np.einsum("ij,ij->i", way, way))
        far = self.distances(np.tile(origins, (len(ends), 1)), way / length[:, None])
        return (far < length - _SHORT_M).reshape(len(ends), len(origins))


def occluders_of(geometry: Geometry, state: RenderState, geoms: np.ndarray) -> Occluders:
    """Return the triangles of geoms in the poses of a state."""
    vertices = np.concatenate([geometry.world(state, geom)[0] for geom in geoms])
    counts = [geometry.vertex_slices[geom].stop - geometry.vertex_slices[geom].start for geom in geoms]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    faces = [
        geometry.faces[geometry.face_slices[geom]] - geometry.vertex_slices[geom].start + start
        for geom, start in zip(geoms, starts, strict=True)
    ]
    return Occluders(geometry.scene.caster(vertices, np.concatenate(faces)))
