"""Scene -> MuJoCo model with the tables that lead back to the scene."""

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
    """A compiled scene with the tables that lead back to it."""

    native: NativeModel
    data: NativeData
    things: dict[str, CompiledThing]
    geom_things: np.ndarray
    """(ngeom + 1,) int32: thing of each geom, -1 for structure and for "no geom" in the last place."""
    geom_roles: np.ndarray
    lamps: lights.Lamps
    structure_bounds: Bounds
    """Boxes around what never moves."""
    render_scene: RenderScene
    """What the renderer needs to know of the model as it was built; its copies share it."""
    _bounds: Bounds | None = None
    """Around everything where it is now; None until it is asked for."""

    @property
    def triangles(self) -> int:
        """How many triangles the scene has, hidden looks of its things included."""
        meshes = self.native.geom_dataid[self.native.geom_dataid >= 0]
        return int(self.native.mesh_facenum[meshes].sum())

    def place(self, thing: Thing) -> None:
        """Takes over a thing's place and state; `update_kinematics` must follow."""
        self.things[thing.id].place(thing, self.native, self.data)

    def render_state(self) -> RenderState:
        """Return where everything is now and how it looks."""
        return render_state(self.native, self.data, self.lamps)

    def copy(self) -> "CompiledModel":
        """Return a model of the same scene, everything where it is now, that changes by itself."""
        native = copy.copy(self.native)
        data = mujoco.MjData(native)
        mujoco.mj_copyData(data, native, self.data)
        return replace(self, native=native, data=data, lamps=replace(self.lamps))

    def update_kinematics(self) -> None:
        """Carries the places over to everything derived from them."""
        mujoco.mj_kinematics(self.native, self.data)
        self._bounds = None

    def bounds(self) -> Bounds:
        """Return boxes around everything where it is now."""
        if self._bounds is None:
            placed = geom_bounds(self.native, self.data, np.flatnonzero(self.geom_things[:-1] >= 0))
            self._bounds = self.structure_bounds.joined(placed)
        return self._bounds


def build(scene: Scene) -> CompiledModel:
    """Return the scene's model, every thing in its place."""
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
