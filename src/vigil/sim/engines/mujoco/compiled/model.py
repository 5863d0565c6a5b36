"""Scene -> MuJoCo model: every thing is a mocap body, every joint of it another; nothing is simulated.

Geom groups say what is drawn and what rays meet. Placing a thing sets the poses of its bodies and the groups and
materials of its geoms; `mj_kinematics` does the rest.
"""

import copy
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from vigil.assets.kernel.materials import Material
from vigil.scene.portals import Portals
from vigil.scene.things import Scene, Thing
from vigil.sim.engines.mujoco.compiled import frames, lights, outdoors
from vigil.sim.engines.mujoco.compiled.binding import NativeBody, NativeData, NativeModel, NativeSpec, mujoco
from vigil.sim.engines.mujoco.compiled.bounds import Bounds, geom_bounds, piecewise_bounds
from vigil.sim.engines.mujoco.compiled.materials import MaterialTable
from vigil.sim.engines.mujoco.compiled.pieces import MeshPiece, Triangles, pieces_of
from vigil.sim.engines.mujoco.compiled.structure import Shell, shells_of, tint_of

STRUCTURE, THING, GLASS, HIDDEN, HELD, ONLY = range(6)
GROUPS = 6
FOVY_DEG = 90.0
HANGING_M = 0.1
"""A thing whose top is this near to the ceiling hangs from it."""
THIN_M, OFF_FLOOR_M = 0.24, 0.3
"""What hangs on a wall and is thinner than this along any side shades less than the light of walls is fine."""


@dataclass(slots=True, eq=False)
class CompiledThing:
    """Where a thing is found in the model."""

    index: int
    bodies: list[tuple[int, str | None]]
    """(mocap index, joint or None for the body)"""
    geoms: np.ndarray
    groups: np.ndarray
    """The group of each geom while it is to be seen."""
    shown_on: np.ndarray
    """Whether each geom is drawn while toggled on, and ..."""
    shown_off: np.ndarray
    notices: np.ndarray
    """Whether each geom is drawn while broken, and only then."""
    materials_on: np.ndarray
    """Material of each geom while toggled on, and ..."""
    materials_off: np.ndarray
    has_inside: bool
    """Whether it has room inside that is reached by opening it."""


@dataclass(slots=True, eq=False)
class CompiledModel:
    """A compiled scene with the tables that lead back to it."""

    native: NativeModel
    data: NativeData
    initial_data: NativeData
    """Where everything was when the model was built; its copies share it."""
    things: dict[str, CompiledThing]
    geom_things: np.ndarray
    """(ngeom + 1,) int32: thing of each geom, -1 for structure and for "no geom" in the last place."""
    geom_roles: np.ndarray
    body_things: np.ndarray
    """(bodies,): thing of each body that is placed."""
    furniture_index: np.ndarray
    """(things + 1,): what each thing is a drawer of, itself for all others; the last stands for what is no thing."""
    structure_kinds: dict[int, str]
    """Kind of each structural geom."""
    structure_rooms: dict[int, int]
    """Number of the room from which alone a structural geom is seen, where there is one."""
    lamps: lights.Lamps
    static_occluders: np.ndarray
    """Geoms that stop light: structure, and the bodies of furniture; no leaf that opens, no glass, nothing on top."""
    default_groups: np.ndarray
    """The group of each geom while its thing is off, whole and there, and ..."""
    default_materials: np.ndarray
    """its native material then: light that is cast once must not depend on how a thing looked at that time."""
    materials: tuple[Material, ...]
    """Of each native material."""
    portals: Portals
    shared_cache: dict[str, Any]
    """What is derived from the model as it was built; its copies share it."""
    _bounds: Bounds | None = None
    """Around everything where it is now; None until it is asked for."""

    @property
    def triangles(self) -> int:
        """How many triangles the scene has, hidden looks of its things included."""
        meshes = self.native.geom_dataid[self.native.geom_dataid >= 0]
        return int(self.native.mesh_facenum[meshes].sum())

    def place(self, thing: Thing) -> None:
        """Takes over a thing's place and state; `update_kinematics` must follow."""
        placed = self.things[thing.id]
        for mocap, joint in placed.bodies:
            position, matrix = frames.thing_place(thing, joint)
            self.data.mocap_pos[mocap] = position
            self.data.mocap_quat[mocap] = frames.quaternion(matrix)
        shown = placed.shown_on if thing.is_toggled else placed.shown_off
        if thing.is_broken:
            shown = shown | placed.notices
        if not thing.is_present:
            self.native.geom_group[placed.geoms] = HIDDEN
        else:
            groups = HELD if thing.is_held else placed.groups
            self.native.geom_group[placed.geoms] = np.where(shown, groups, HIDDEN)
        self.native.geom_matid[placed.geoms] = placed.materials_on if thing.is_toggled else placed.materials_off

    def moved_things(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return which things (things + 1,) have a part whose place differs between two lists (bodies, ...) of places.

        Furniture and its drawers have moved when one of them has. The last, which never has, stands for what is no
        thing.
        """
        changed = np.flatnonzero((before != after).any(axis=1))
        has_moved = np.zeros(len(self.things) + 1, dtype=bool)
        if len(changed):
            has_moved[self.furniture_index[self.body_things[changed]]] = True
        return has_moved[self.furniture_index]

    def displaced_occluders(self) -> np.ndarray:
        """Return which of the `static_occluders` geoms (k,) are absent, or not where they were at first."""
        now, first = self.data, self.initial_data
        is_absent = self.native.geom_group[self.static_occluders] == HIDDEN
        is_elsewhere = (now.geom_xpos[self.static_occluders] != first.geom_xpos[self.static_occluders]).any(axis=1)
        return (
            is_absent
            | is_elsewhere
            | (now.geom_xmat[self.static_occluders] != first.geom_xmat[self.static_occluders]).any(axis=1)
        )

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
            is_placed = self.geom_things[:-1] >= 0
            placed = geom_bounds(self.native, self.data, np.flatnonzero(is_placed))
            self._bounds = self._structure_bounds().joined(placed)
        return self._bounds

    def _structure_bounds(self) -> Bounds:
        """Return boxes around what never moves."""
        if "bounds" not in self.shared_cache:
            geoms = np.flatnonzero(self.geom_things[:-1] < 0)
            is_mesh = self.native.geom_dataid[geoms] >= 0
            endless = geom_bounds(self.native, self.data, geoms[~is_mesh])
            pieces = piecewise_bounds(self.native, self.data, geoms[is_mesh])
            self.shared_cache["bounds"] = pieces.joined(endless)
        return self.shared_cache["bounds"]


@dataclass(slots=True, eq=False)
class _ModelBuilder:
    """A model under construction."""

    spec: NativeSpec
    material_table: MaterialTable
    meshes: dict[MeshPiece, str] = field(default_factory=dict)
    geom_things: list[int] = field(default_factory=list)
    geom_roles: list[int] = field(default_factory=list)
    swaps: dict[int, str] = field(default_factory=dict)
    joints: dict[int, str | None] = field(default_factory=dict)
    """The joint that carries each geom of a thing."""
    mocaps: int = 0


def build(scene: Scene) -> CompiledModel:
    """Return the scene's model, every thing in its place."""
    spec = mujoco.MjSpec()
    builder = _ModelBuilder(spec, MaterialTable(spec))
    _settings(spec)
    kinds, rooms = _add_structure(builder, scene)
    things = {thing.id: _add_thing(builder, index, thing) for index, thing in enumerate(scene.things.values())}
    native = _compiled(builder)
    _resolve_materials(builder, native, things)
    model = CompiledModel(
        native,
        mujoco.MjData(native),
        mujoco.MjData(native),
        things,
        np.array([*builder.geom_things, -1], dtype=np.int32),
        np.array([*builder.geom_roles, 0], dtype=np.uint8),
        np.array([index for index, placed in enumerate(things.values()) for _ in placed.bodies], dtype=int),
        _furniture_index(scene, things),
        kinds,
        rooms,
        lights.lamps_of(scene),
        _static_occluders(builder, scene, kinds, things),
        _default_groups(native, things),
        native.geom_matid.copy(),
        tuple(builder.material_table.materials[native.material(number).name] for number in range(native.nmat)),
        Portals(scene),
        {},
    )
    for thing in scene.things.values():
        model.place(thing)
    model.update_kinematics()
    mujoco.mj_copyData(model.initial_data, native, model.data)
    return model


def _default_groups(native: NativeModel, things: dict[str, CompiledThing]) -> np.ndarray:
    groups = native.geom_group.copy()
    for placed in things.values():
        groups[placed.geoms] = np.where(placed.shown_off, placed.groups, HIDDEN)
    return groups


def _compiled(builder: _ModelBuilder) -> NativeModel:
    """Return the model; its textures are drawn at the same time, since MuJoCo does not hold Python's lock."""
    with ThreadPoolExecutor(1) as other:
        compiling = other.submit(builder.spec.compile)
        builder.material_table.draw_textures()
        return compiling.result()


def _furniture_index(scene: Scene, things: dict[str, CompiledThing]) -> np.ndarray:
    furniture_index = (
        thing.parent if thing.is_drawer and thing.parent in things else thing.id for thing in scene.things.values()
    )
    return np.array([*(things[whole].index for whole in furniture_index), len(things)], dtype=int)


def _static_occluders(
    builder: _ModelBuilder, scene: Scene, kinds: dict[int, str], things: dict[str, CompiledThing]
) -> np.ndarray:
    height = max(room.height for room in scene.rooms)
    chosen = [geom for geom, kind in kinds.items() if kind != "ground"]
    for thing in scene.things.values():
        # What stands on furniture is too small for the light that is known at its vertices.
        if thing.is_pickupable or thing.parent is not None or not thing.is_present or _shades_little(thing, height):
            continue
        placed = things[thing.id]
        # A door that leads outside has a leaf, but stays shut.
        is_body = np.array([builder.joints[geom] is None or not thing.is_openable for geom in placed.geoms], dtype=bool)
        chosen += placed.geoms[is_body & (placed.groups == THING) & placed.shown_on & placed.shown_off].tolist()
    return np.array(chosen, dtype=int)


def _shades_little(thing: Thing, height: float) -> bool:
    """Whether a thing shall stop no light: it hangs from the ceiling, where the lamps are, or is thin, as a shelf."""
    if thing.is_structure:
        return False
    size, half = thing.asset.size, thing.asset.size.y / 2
    hangs = abs(thing.position.y + half - height) < HANGING_M and half < height / 4
    return hangs or (min(size) < THIN_M and thing.position.y - half > OFF_FLOOR_M)


def _settings(spec: NativeSpec) -> None:
    spec.compiler.autolimits = False
    spec.stat.extent = 1.0
    spec.stat.center = [0.0, 0.0, 0.0]
    spec.stat.meansize = 1.0
    spec.worldbody.add_camera(name="eye", fovy=FOVY_DEG)


def _add_structure(builder: _ModelBuilder, scene: Scene) -> tuple[dict[int, str], dict[int, int]]:
    """Adds walls, floors and the like. Returns the kind of each geom, and the room that it belongs to."""
    kinds, rooms = {}, {}
    numbers = {room.id: number for number, room in enumerate(scene.rooms)}
    for number, shell in enumerate(shells_of(scene)):
        kinds[len(builder.geom_things)] = shell.kind
        if shell.room_id in numbers:
            rooms[len(builder.geom_things)] = numbers[shell.room_id]
        _add_shell(builder, f"structure{number}", shell)
    kinds[len(builder.geom_things)] = "ground"
    outdoors.add_ground(builder.spec, builder.material_table.name_of("grass"))
    builder.geom_things.append(-1)
    builder.geom_roles.append(0)
    return kinds, rooms


def _add_shell(builder: _ModelBuilder, name: str, shell: Shell) -> None:
    look = shell.material.name, tint_of(shell.material)
    _add_mesh(builder.spec, name, shell.triangles, builder.material_table.metres(*look))
    _add_geom(builder, builder.spec.worldbody, name, builder.material_table.name_of(*look), STRUCTURE)
    builder.geom_things.append(-1)
    builder.geom_roles.append(0)


def _add_thing(builder: _ModelBuilder, index: int, thing: Thing) -> CompiledThing:
    bodies: dict[str | None, NativeBody] = {}
    mocaps: list[tuple[int, str | None]] = []
    pieces = pieces_of(thing.asset)
    first = len(builder.geom_things)
    for joint in dict.fromkeys([None, *(piece.joint for piece in pieces)]):
        mocaps.append((builder.mocaps, joint))
        bodies[joint] = builder.spec.worldbody.add_body(mocap=True)
        builder.mocaps += 1
    # MuJoCo numbers geoms body by body, so pieces go in by the order of their bodies.
    ordered = [piece for joint in bodies for piece in pieces if piece.joint == joint]
    for piece in ordered:
        _add_piece(builder, bodies[piece.joint], piece)
        builder.joints[len(builder.geom_things)] = piece.joint
        builder.geom_things.append(index)
        builder.geom_roles.append(piece.roles)
    geoms = np.arange(first, first + len(ordered))
    return CompiledThing(
        index,
        mocaps,
        geoms,
        np.array([GLASS if piece.is_glass else THING for piece in ordered], dtype=int),
        np.array([piece.shown in ("always", "on") for piece in ordered], dtype=bool),
        np.array([piece.shown in ("always", "off") for piece in ordered], dtype=bool),
        np.array([piece.shown == "broken" for piece in ordered], dtype=bool),
        np.zeros(len(ordered), dtype=int),
        np.zeros(len(ordered), dtype=int),
        any(surface.needs_opening for surface in thing.asset.surfaces),
    )


def _add_piece(builder: _ModelBuilder, body: NativeBody, piece: MeshPiece) -> None:
    if piece not in builder.meshes:
        name = f"mesh{len(builder.meshes)}"
        _add_mesh(builder.spec, name, piece.triangles, builder.material_table.metres(piece.material))
        builder.meshes[piece] = name
    if piece.material_on is not None:
        builder.swaps[len(builder.geom_things)] = builder.material_table.name_of(piece.material_on)
    _add_geom(builder, body, builder.meshes[piece], builder.material_table.name_of(piece.material), THING)


def _add_mesh(spec: NativeSpec, name: str, triangles: Triangles, metres_per_repeat: float) -> None:
    # MuJoCo takes lists over in half the time of arrays.
    spec.add_mesh(
        name=name,
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        uservert=triangles.vertices.ravel().tolist(),
        usernormal=triangles.normals.ravel().tolist(),
        userface=triangles.faces.ravel().tolist(),
        usertexcoord=(triangles.uvs / metres_per_repeat).ravel().tolist(),
    )


def _add_geom(builder: _ModelBuilder, body: NativeBody, mesh: str, material: str, group: int) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=mesh,
        material=material,
        contype=0,
        conaffinity=0,
        group=group,
        mass=0,
    )


def _resolve_materials(builder: _ModelBuilder, native: NativeModel, things: dict[str, CompiledThing]) -> None:
    for placed in things.values():
        placed.materials_off = native.geom_matid[placed.geoms].copy()
        placed.materials_on = placed.materials_off.copy()
        for place, geom in enumerate(placed.geoms):
            if geom in builder.swaps:
                placed.materials_on[place] = native.material(builder.swaps[geom]).id
