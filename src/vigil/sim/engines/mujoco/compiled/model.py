"""The MuJoCo model of a scene, with the tables that lead back to the scene."""

import copy
from dataclasses import dataclass, replace

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
    """A compiled scene."""

    native: NativeModel
    data: NativeData
    things: dict[str, CompiledThing]
    geom_things: np.ndarray
    """(geoms + 1,) int32 thing of each geom, -1 for structure; the last entry, -1, stands for no geom."""
    geom_roles: np.ndarray
    """(geoms + 1,) uint8 bits of `vigil.sim.core.engine`; the last entry, 0, stands for no geom."""
    lamps: lights.Lamps
    structure_bounds: Bounds
    """Boxes around the structure, which never moves."""
    render_scene: RenderScene
    """The renderer's description of the model as it was built; copies share it."""
    _bounds: Bounds | None = None
    """Boxes around all geoms where they are now; None until first used."""

    @property
    def triangles(self) -> int:
        """Number of triangles, including those that are hidden."""
        meshes = self.native.geom_dataid[self.native.geom_dataid >= 0]
        return int(self.native.mesh_facenum[meshes].sum())

    def place(self, thing: Thing) -> None:
        """Write a thing's pose and state; `update_kinematics` must follow."""
        self.things[thing.id].place(thing, self.native, self.data)

    def render_state(self) -> RenderState:
        """Return the present state for the renderer."""
        return render_state(self.native, self.data, self.lamps)

    def copy(self) -> "CompiledModel":
        """Return an independent copy of the model in its present state."""
        native = copy.copy(self.native)
        data = mujoco.MjData(native)
        mujoco.mj_copyData(data, native, self.data)
        return replace(self, native=native, data=data, lamps=replace(self.lamps))

    def update_kinematics(self) -> None:
        """Update everything that is derived from the poses."""
        mujoco.mj_kinematics(self.native, self.data)
        self._bounds = None

    def bounds(self) -> Bounds:
        """Return boxes around all geoms where they are now."""
        if self._bounds is None:
            placed = geom_bounds(self.native, self.data, np.flatnonzero(self.geom_things[:-1] >= 0))
            self._bounds = self.structure_bounds.joined(placed)
        return self._bounds


def build(scene: Scene) -> CompiledModel:
    """Return the model of a scene in its present state."""
    builder = ModelBuilder(scene)
    native = builder.compile()
    data = mujoco.MjData(native)
    for thing_id, placed in builder.things.items():
        placed.place(scene.things[thing_id], native, data)
    mujoco.mj_kinematics(native, data)
    lamps = lights.lamps_of(scene)
    return CompiledModel(
        native,
        data,
        builder.things,
        np.array([*builder.geom_things, -1], dtype=np.int32),
        np.array([*builder.geom_roles, 0], dtype=np.uint8),
        lamps,
        structure_bounds(native, data, np.arange(len(builder.structure_kinds))),
        render_scene(scene, builder, native, data, lamps),
    )
