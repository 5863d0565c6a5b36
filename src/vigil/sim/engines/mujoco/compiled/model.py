"""The MuJoCo model of a scene, with tables that map the model's geoms to the scene's things."""

import threading
from dataclasses import dataclass, field, replace

import numpy as np

from vigil.rendering.scene import RenderScene, RenderState
from vigil.scene.things import Scene, Thing
from vigil.sim.engines.mujoco.compiled import lights
from vigil.sim.engines.mujoco.compiled.binding import NativeData, NativeModel, mujoco
from vigil.sim.engines.mujoco.compiled.bounds import Bounds, geom_bounds, structure_bounds
from vigil.sim.engines.mujoco.compiled.builder import CompiledThing, ModelBuilder
from vigil.sim.engines.mujoco.compiled.render_scene import render_scene, render_state


@dataclass(slots=True, eq=False)
class CompiledModel:
    """A compiled scene.

    MuJoCo's model, by far the largest part, is shared by all copies. What changes in a live scene is in the other
    arrays; the groups of geoms are written into MuJoCo's model for each cast of rays.
    """

    native: NativeModel
    data: NativeData
    groups: np.ndarray
    """Present group of each geom, (geoms,) int32; it decides whether the geom is drawn and met by rays."""
    materials: np.ndarray
    """Number of the present material of each geom, (geoms,) int32."""
    things: dict[str, CompiledThing]
    geom_things: np.ndarray
    """Index of the thing of each geom, (geoms + 1,) int32; -1 for structure. The last entry, -1, stands for no geom."""
    geom_roles: np.ndarray
    """Role bits (`vigil.sim.core.engine`) of each geom, (geoms + 1,) uint8. The last entry, 0, stands for no geom."""
    lamps: lights.Lamps
    structure_bounds: Bounds
    """Boxes around the structure, which never moves."""
    render_scene: RenderScene
    """The renderer's description of the model as it was built; copies of the model share it."""
    lock: threading.Lock = field(default_factory=threading.Lock)
    """Held while rays are cast, because copies of the model share the groups in MuJoCo's model."""
    _bounds: Bounds | None = None
    """Boxes around all geoms at their present places; None until first used."""

    @property
    def triangles(self) -> int:
        """Number of triangles of the model, including hidden triangles."""
        meshes = self.native.geom_dataid[self.native.geom_dataid >= 0]
        return int(self.native.mesh_facenum[meshes].sum())

    def place(self, thing: Thing) -> None:
        """Write a thing's pose and state into the model; the caller must call `update_kinematics` afterwards."""
        self.things[thing.id].place(thing, self.data, self.groups, self.materials)

    def render_state(self) -> RenderState:
        """Return the present state for the renderer."""
        return render_state(self.data, self.groups, self.materials, self.lamps)

    def copy(self) -> "CompiledModel":
        """Return an independent copy of the model in its present state."""
        data = mujoco.MjData(self.native)
        mujoco.mj_copyData(data, self.native, self.data)
        groups, materials = self.groups.copy(), self.materials.copy()
        return replace(self, data=data, groups=groups, materials=materials, lamps=replace(self.lamps))

    def update_kinematics(self) -> None:
        """Update everything in the model that is derived from the poses."""
        mujoco.mj_kinematics(self.native, self.data)
        self._bounds = None

    def bounds(self) -> Bounds:
        """Return boxes around all geoms at their present places."""
        if self._bounds is None:
            placed = geom_bounds(self.native, self.data, np.flatnonzero(self.geom_things[:-1] >= 0))
            self._bounds = self.structure_bounds.joined(placed)
        return self._bounds


def build(scene: Scene) -> CompiledModel:
    """Return the model of a scene in its present state."""
    builder = ModelBuilder(scene)
    native = builder.compile()
    data = mujoco.MjData(native)
    groups, materials = native.geom_group.copy(), native.geom_matid.copy()
    for thing_id, placed in builder.things.items():
        placed.place(scene.things[thing_id], data, groups, materials)
    mujoco.mj_kinematics(native, data)
    lamps = lights.lamps_of(scene)
    return CompiledModel(
        native,
        data,
        groups,
        materials,
        builder.things,
        np.array([*builder.geom_things, -1], dtype=np.int32),
        np.array([*builder.geom_roles, 0], dtype=np.uint8),
        lamps,
        structure_bounds(native, data, np.arange(len(builder.structure_kinds))),
        render_scene(scene, builder, native, render_state(data, groups, materials, lamps), lamps),
    )
