"""Descriptions of a compiled scene and of its present state for the renderer."""

import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.materials import material
from vigil.rendering.scene import RenderScene, RenderState
from vigil.scene.portals import Portals
from vigil.scene.things import Scene, Thing
from vigil.sim.engines.mujoco.compiled.binding import NativeData, NativeModel
from vigil.sim.engines.mujoco.compiled.builder import HELD, HIDDEN, LAWN_HALF_M, THING, ModelBuilder
from vigil.sim.engines.mujoco.compiled.casters import make_caster
from vigil.sim.engines.mujoco.compiled.lights import Lamps

HANGING_M = 0.1
"""A thing hangs from the ceiling if its top is at most this far (m) below the ceiling."""
THIN_M, OFF_FLOOR_M = 0.24, 0.3
"""If a thing is thinner than THIN_M and more than OFF_FLOOR_M above the floor (m), its shadow is too fine to store."""


def render_state(data: NativeData, groups: np.ndarray, materials: np.ndarray, lamps: Lamps) -> RenderState:
    """Return the present state of a model for the renderer; its poses and materials are views of the arguments.

    `groups` and `materials` have the group and the number of the material of each geom.
    """
    return RenderState(
        data.geom_xpos, data.geom_xmat.reshape(-1, 3, 3), groups != HIDDEN, groups == HELD, materials, lamps.strengths()
    )


def render_scene(
    scene: Scene, builder: ModelBuilder, native: NativeModel, placed: RenderState, lamps: Lamps
) -> RenderScene:
    """Return the renderer's description of a model; `placed` is the state in which its things have been placed."""
    state = placed.copy()
    furniture = np.full(native.ngeom, -1)
    state.is_visible[:], state.is_held[:] = True, False
    for thing in scene.things.values():
        own = builder.things[thing.id]
        whole = builder.things.get(thing.parent or "", own) if thing.is_drawer else own
        geoms = own.geoms
        furniture[geoms] = whole.index
        state.is_visible[geoms], state.materials[geoms] = own.shown_off, own.materials_off
    rooms = {room.id: number for number, room in enumerate(scene.rooms)}
    shell_rooms = [rooms.get(shell.room_id or "", -1) for shell in builder.shells]
    return RenderScene(
        meshes=[*(_mesh(native, number) for number in range(native.nmesh)), _lawn()],
        geom_meshes=np.where(native.geom_dataid < 0, native.nmesh, native.geom_dataid),
        structure_kinds=builder.structure_kinds,
        structure_rooms=np.array([*shell_rooms, *[-1] * (native.ngeom - len(shell_rooms))]),
        furniture=furniture,
        boxes=native.geom_aabb,
        radii=np.where(native.geom_rbound > 0.0, native.geom_rbound, np.inf),  # 0: an endless plane
        materials=tuple(builder.materials),
        lamps=lamps.places,
        portals=Portals(scene),
        static_occluders=_static_occluders(scene, builder),
        caster=make_caster,
        initial=state,
    )


def _static_occluders(scene: Scene, builder: ModelBuilder) -> np.ndarray:
    height = max(room.height for room in scene.rooms)
    chosen = list(range(len(builder.shells)))
    for thing in scene.things.values():
        # Objects on furniture are too small for light that is stored at vertices.
        if thing.is_pickupable or thing.parent is not None or not thing.is_present or _shades_little(thing, height):
            continue
        placed = builder.things[thing.id]
        # The door to the outside has a leaf but does not open.
        is_body = np.array([not thing.is_openable or joint is None for joint in placed.joints], dtype=bool)
        chosen += placed.geoms[is_body & (placed.groups == THING) & placed.shown_on & placed.shown_off].tolist()
    return np.array(chosen, dtype=int)


def _shades_little(thing: Thing, height: float) -> bool:
    """Return whether a thing casts little shadow: it hangs from the ceiling near the lamps, or is thin like a shelf."""
    if thing.is_structure:
        return False
    size, half = thing.asset.size, thing.asset.size.y / 2
    hangs = abs(thing.position.y + half - height) < HANGING_M and half < height / 4
    return hangs or (min(size) < THIN_M and thing.position.y - half > OFF_FLOOR_M)


def _mesh(native: NativeModel, number: int) -> Mesh:
    # Vertices, normals and uvs have the same numbers, as in `Mesh`.
    first, last = native.mesh_vertadr[number], native.mesh_vertadr[number] + native.mesh_vertnum[number]
    face = native.mesh_faceadr[number]
    return Mesh(
        native.mesh_vert[first:last],
        native.mesh_face[face : face + native.mesh_facenum[number]],
        native.mesh_normal[first:last],
        native.mesh_texcoord[first:last],
    )


def _lawn() -> Mesh:
    """Return the mesh of the ground outside; it is as large as the model's ground plane."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32) * LAWN_HALF_M
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), (4, 3))
    return Mesh(
        np.column_stack([corners, np.zeros(4, np.float32)]),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        up,
        corners / material("grass").metres,
    )
