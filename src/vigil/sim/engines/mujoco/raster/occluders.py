"""What stops light: the fixed surfaces of a scene, and rays into them. The only module that imports the ray caster.

Embree casts some ten million rays a second. Where there is no wheel of it (Linux on ARM) MuJoCo casts them, which takes
many times as long.
"""

from contextlib import suppress
from typing import Any, Protocol

import numpy as np

from vigil.sim.engines.mujoco.compiled.binding import mujoco
from vigil.sim.engines.mujoco.compiled.model import CompiledModel
from vigil.sim.engines.mujoco.raster.geometry import Geometry

TriangleMesh: Any = None
EmbreeScene: Any = None
with suppress(ImportError):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

FAR_M = 100.0
_SHORT_M = 1e-3
THREADS = 1 if EmbreeScene is None else 2
"""So many threads do what is done at once: MuJoCo casts rays from one alone."""


class _Caster(Protocol):
    def cast(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return how far rays (n, 3) float32 along unit directions go; more than `FAR_M` where they meet nothing."""
        ...


class EmbreeCaster:
    """Rays cast by Embree."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._scene: Any = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int32))

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return how far the rays go."""
        return self._scene.run(origins, directions, query="DISTANCE")


class MujocoCaster:
    """Rays cast by MuJoCo."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        spec = mujoco.MjSpec()
        spec.add_mesh(
            name="all",
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            uservert=np.asarray(vertices, np.float64).ravel(),
            userface=np.asarray(faces, np.int32).ravel(),
        )
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="all")
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return how far the rays go."""
        geom = np.zeros(1, np.int32)
        met = [
            mujoco.mj_ray(self._model, self._data, origin, way, None, 1, -1, geom)
            for origin, way in zip(origins.astype(np.float64), directions.astype(np.float64), strict=True)
        ]
        far = np.array(met, np.float32)
        return np.where(far < 0.0, np.float32(2.0 * FAR_M), far)


class Occluders:
    """Triangles that rays meet."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._caster: _Caster = (MujocoCaster if EmbreeScene is None else EmbreeCaster)(vertices, faces)

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


def occluders_of(model: CompiledModel, geometry: Geometry, geoms: np.ndarray) -> Occluders:
    """Return the triangles of geoms where they are in a model."""
    vertices = np.concatenate([geometry.world(model, geom)[0] for geom in geoms])
    counts = [geometry.vertex_slices[geom].stop - geometry.vertex_slices[geom].start for geom in geoms]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    faces = [
        geometry.faces[geometry.face_slices[geom]] - geometry.vertex_slices[geom].start + start
        for geom, start in zip(geoms, starts, strict=True)
    ]
    return Occluders(vertices, np.concatenate(faces))
