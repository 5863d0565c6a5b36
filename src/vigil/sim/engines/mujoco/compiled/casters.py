"""Ray casters that are used to compute light: Embree, or MuJoCo where Embree cannot be installed (Linux on ARM).

Embree casts about ten million rays a second; MuJoCo is many times slower.
"""

import threading
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from vigil.rendering.scene import CastRays
from vigil.sim.engines.mujoco.compiled.binding import mujoco

TriangleMesh: Any = None
EmbreeScene: Any = None
with suppress(ImportError):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene


def embree_caster(vertices: np.ndarray, faces: np.ndarray) -> CastRays:
    """Return a ray caster that uses Embree."""
    scene: Any = EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int32))
    return partial(scene.run, query="DISTANCE")


def mujoco_caster(vertices: np.ndarray, faces: np.ndarray) -> CastRays:
    """Return a ray caster that uses MuJoCo; only one thread can use it at a time."""
    spec = mujoco.MjSpec()
    spec.add_mesh(
        name="all",
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        uservert=np.asarray(vertices, np.float64).ravel(),
        userface=np.asarray(faces, np.int32).ravel(),
    )
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="all")
    model, lock = spec.compile(), threading.Lock()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)

    def cast(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        geom, rays = np.zeros(1, np.int32), zip(origins.astype(float), directions.astype(float), strict=True)
        with lock:
            lengths = np.array([mujoco.mj_ray(model, data, *ray, None, 1, -1, geom) for ray in rays], np.float32)
        return np.where(lengths < 0.0, np.float32(np.inf), lengths)

    return cast


make_caster = mujoco_caster if EmbreeScene is None else embree_caster
"""Function that makes a ray caster for triangles."""
