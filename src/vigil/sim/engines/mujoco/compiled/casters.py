"""Ray casters that are used to compute light: Embree, or MuJoCo where Embree cannot be installed (Linux on ARM).

Embree casts about ten million rays a second; MuJoCo is many times slower.
"""

import threading
from contextlib import suppress
from typing import Any

import numpy as np

from vigil.sim.engines.mujoco.compiled.binding import mujoco

TriangleMesh: Any = None
EmbreeScene: Any = None
with suppress(ImportError):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene


class EmbreeCaster:
    """Ray caster that uses Embree."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._scene: Any = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int32))

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the length of each ray (see `RayCaster`)."""
        return self._scene.run(origins, directions, query="DISTANCE")


class MujocoCaster:
    """Ray caster that uses MuJoCo; only one thread can use it at a time."""

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
        self._lock = threading.Lock()
        mujoco.mj_kinematics(self._model, self._data)

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the length of each ray (see `RayCaster`)."""
        geom, rays = np.zeros(1, np.int32), zip(origins.astype(float), directions.astype(float), strict=True)
        with self._lock:
            far = [mujoco.mj_ray(self._model, self._data, *ray, None, 1, -1, geom) for ray in rays]
        lengths = np.array(far, np.float32)
        return np.where(lengths < 0.0, np.float32(np.inf), lengths)


def make_caster(vertices: np.ndarray, faces: np.ndarray) -> EmbreeCaster | MujocoCaster:
    """Return a ray caster for triangles."""
    return (MujocoCaster if EmbreeScene is None else EmbreeCaster)(vertices, faces)
