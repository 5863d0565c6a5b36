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
from vigil.sim.engines.mujoco.compiled.bounds import Bounds, piecewise_bounds, whole_bounds
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
class Placed:
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
    looks_on: np.ndarray
    """Material of each geom while toggled on, and ..."""
    looks_off: np.ndarray
    has_inside: bool
    """Whether it has room inside that is reached by opening it."""


@dataclass(slots=True, eq=False)
class CompiledModel:
    """A compiled scene with the tables that lead back to it."""

    native: NativeModel
    data: NativeData
    first: NativeData
    """Where everything was when the model was built; its copies share it."""
    things: dict[str, Placed]
    geom_things: np.ndarray
    """(ngeom + 1,) int32: thing of each geom, -1 for structure and for "no geom" in the last place."""
    geom_roles: np.ndarray
    body_things: np.ndarray
    """(bodies,): thing of each body that is placed."""
    wholes: np.ndarray
    """(things + 1,): what each thing is a drawer of, itself for all others; the last stands for what is no thing."""
    structure_kinds: dict[int, str]
    """Kind of each structural geom."""
    structure_rooms: dict[int, int]
    """Number of the room from which alone a structural geom is seen, where there is one."""
    lamps: lights.Lamps
    still: np.ndarray
    """Geoms that stop light: structure, and the bodies of furniture; no leaf that opens, no glass, nothing on top."""
    usual_groups: np.ndarray
    """The group of each geom while its thing is off, whole and there, and ..."""
    usual_looks: np.ndarray
    """its native material then: light that is cast once must not depend on how a thing looked at that time."""
    materials: tuple[Material, ...]
    """Of each native material."""
    portals: Portals
    keepsake: dict[str, Any]
    """What is derived from the model as it was built; its copies share it."""
    _bounds: Bounds | None = None
    """Around everything where it is now; None until it is asked for."""

    @property
    def triangles(self) -> int:
        """How many triangles the scene has, hidden looks of its things included."""
        meshes = self.native.geom_dataid[self.native.geom_dataid >= 0]
        return int(self.native.mesh_facenum[meshes].sum())

    def place(self, thing: Thing) -> None:
        """Takes over a thing's place and state; `settle` must follow."""
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
        self.native.geom_matid[placed.geoms] = placed.looks_on if thing.is_toggled else placed.looks_off

    def moved(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Returns which things (things + 1,) have a part whose place differs between two lists (bodies, ...) of places.

        Furniture and its drawers have moved when one of them has. The last, which never has, stands for what is no
        thing.
        """
        changed = np.flatnonzero((before != after).any(axis=1))
        has_moved = np.zeros(len(self.things) + 1, dtype=bool)
        if len(changed):
            has_moved[self.wholes[self.body_things[changed]]] = True
        return has_moved[self.wholes]

    def displaced(self) -> np.ndarray:
        """Returns which of the `still` geoms (k,) are absent, or not where they were when the model was built."""
        now, first = self.data, self.first
        is_absent = self.native.geom_group[self.still] == HIDDEN
        is_elsewhere = (now.geom_xpos[self.still] != first.geom_xpos[self.still]).any(axis=1)
        return is_absent | is_elsewhere | (now.geom_xmat[self.still] != first.geom_xmat[self.still]).any(axis=1)

    def copy(self) -> "CompiledModel":
        """Returns a model of the same scene, everything where it is now, that changes by itself."""
        native = copy.copy(self.native)
        data = mujoco.MjData(native)
        mujoco.mj_copyData(data, native, self.data)
        return replace(self, native=native, data=data, lamps=replace(self.lamps))

    def settle(self) -> None:
        """Carries the places over to everything derived from them."""
        mujoco.mj_kinematics(self.native, self.data)
        self._bounds = None

    def bounds(self) -> Bounds:
        """Returns boxes around everything where it is now."""
        if self._bounds is None:
            is_placed = self.geom_things[:-1] >= 0
            placed = whole_bounds(self.native, self.data, np.flatnonzero(is_placed))
            self._bounds = self._structure_bounds().joined(placed)
        return self._bounds

    def _structure_bounds(self) -> Bounds:
        """Returns boxes around what never moves."""
        if "bounds" not in self.keepsake:
            geoms = np.flatnonzero(self.geom_things[:-1] < 0)
            is_mesh = self.native.geom_dataid[geoms] >= 0
            endless = whole_bounds(self.native, self.data, geoms[~is_mesh])
            pieces = piecewise_bounds(self.native, self.data, geoms[is_mesh])
            self.keepsake["bounds"] = pieces.joined(endless)
        return self.keepsake["bounds"]


@dataclass(slots=True, eq=False)
class _Draft:
    """A model under construction."""

    spec: NativeSpec
    looks: MaterialTable
    meshes: dict[MeshPiece, str] = field(default_factory=dict)
    geom_things: list[int] = field(default_factory=list)
    geom_roles: list[int] = field(default_factory=list)
    swaps: dict[int, str] = field(default_factory=dict)
    joints: dict[int, str | None] = field(default_factory=dict)
    """The joint that carries each geom of a thing."""
    mocaps: int = 0


def build(scene: Scene) -> CompiledModel:
    """Returns the scene's model, every thing in its place."""
    spec = mujoco.MjSpec()
    draft = _Draft(spec, MaterialTable(spec))
    _settings(spec)
    kinds, rooms = _add_structure(draft, scene)
    things = {thing.id: _add_thing(draft, index, thing) for index, thing in enumerate(scene.things.values())}
    native = _compiled(draft)
    _resolve_looks(draft, native, things)
    model = CompiledModel(
        native,
        mujoco.MjData(native),
        mujoco.MjData(native),
        things,
        np.array([*draft.geom_things, -1], dtype=np.int32),
        np.array([*draft.geom_roles, 0], dtype=np.uint8),
        np.array([index for index, placed in enumerate(things.values()) for _ in placed.bodies], dtype=int),
        _wholes(scene, things),
        kinds,
        rooms,
        lights.lamps_of(scene),
        _still(draft, scene, kinds, things),
        _usual_groups(native, things),
        native.geom_matid.copy(),
        tuple(draft.looks.materials[native.material(number).name] for number in range(native.nmat)),
        Portals(scene),
        {},
    )
    for thing in scene.things.values():
        model.place(thing)
    model.settle()
    mujoco.mj_copyData(model.first, native, model.data)
    return model


def _usual_groups(native: NativeModel, things: dict[str, Placed]) -> np.ndarray:
    groups = native.geom_group.copy()
    for placed in things.values():
        groups[placed.geoms] = np.where(placed.shown_off, placed.groups, HIDDEN)
    return groups


def _compiled(draft: _Draft) -> NativeModel:
    """Returns the model; its textures are drawn at the same time, since MuJoCo does not hold Python's lock."""
    with ThreadPoolExecutor(1) as other:
        compiling = other.submit(draft.spec.compile)
        draft.looks.draw_textures()
        return compiling.result()


def _wholes(scene: Scene, things: dict[str, Placed]) -> np.ndarray:
    wholes = (thing.parent if thing.is_part and thing.parent in things else thing.id for thing in scene.things.values())
    return np.array([*(things[whole].index for whole in wholes), len(things)], dtype=int)


def _still(draft: _Draft, scene: Scene, kinds: dict[int, str], things: dict[str, Placed]) -> np.ndarray:
    height = max(room.height for room in scene.rooms)
    chosen = [geom for geom, kind in kinds.items() if kind != "ground"]
    for thing in scene.things.values():
        # What stands on furniture is too small for the light that is known at its vertices.
        if thing.is_pickupable or thing.parent is not None or not thing.is_present or _shades_little(thing, height):
            continue
        placed = things[thing.id]
        # A door that leads outside has a leaf, but stays shut.
        is_body = np.array([draft.joints[geom] is None or not thing.is_openable for geom in placed.geoms], dtype=bool)
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


def _add_structure(draft: _Draft, scene: Scene) -> tuple[dict[int, str], dict[int, int]]:
    """Adds walls, floors and the like. Returns the kind of each geom, and the room that it belongs to."""
    kinds, rooms = {}, {}
    numbers = {room.id: number for number, room in enumerate(scene.rooms)}
    for number, shell in enumerate(shells_of(scene)):
        kinds[len(draft.geom_things)] = shell.kind
        if shell.room_id in numbers:
            rooms[len(draft.geom_things)] = numbers[shell.room_id]
        _add_shell(draft, f"structure{number}", shell)
    kinds[len(draft.geom_things)] = "ground"
    outdoors.add_ground(draft.spec, draft.looks.name_of("grass"))
    draft.geom_things.append(-1)
    draft.geom_roles.append(0)
    return kinds, rooms


def _add_shell(draft: _Draft, name: str, shell: Shell) -> None:
    look = shell.material.name, tint_of(shell.material)
    _add_mesh(draft.spec, name, shell.triangles, draft.looks.metres(*look))
    _add_geom(draft, draft.spec.worldbody, name, draft.looks.name_of(*look), STRUCTURE)
    draft.geom_things.append(-1)
    draft.geom_roles.append(0)


def _add_thing(draft: _Draft, index: int, thing: Thing) -> Placed:
    bodies: dict[str | None, NativeBody] = {}
    mocaps: list[tuple[int, str | None]] = []
    pieces = pieces_of(thing.asset)
    first = len(draft.geom_things)
    for joint in dict.fromkeys([None, *(piece.joint for piece in pieces)]):
        mocaps.append((draft.mocaps, joint))
        bodies[joint] = draft.spec.worldbody.add_body(mocap=True)
        draft.mocaps += 1
    # MuJoCo numbers geoms body by body, so pieces go in by the order of their bodies.
    ordered = [piece for joint in bodies for piece in pieces if piece.joint == joint]
    for piece in ordered:
        _add_piece(draft, bodies[piece.joint], piece)
        draft.joints[len(draft.geom_things)] = piece.joint
        draft.geom_things.append(index)
        draft.geom_roles.append(piece.roles)
    geoms = np.arange(first, first + len(ordered))
    return Placed(
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


def _add_piece(draft: _Draft, body: NativeBody, piece: MeshPiece) -> None:
    if piece not in draft.meshes:
        name = f"mesh{len(draft.meshes)}"
        _add_mesh(draft.spec, name, piece.triangles, draft.looks.metres(piece.material))
        draft.meshes[piece] = name
    if piece.material_on is not None:
        draft.swaps[len(draft.geom_things)] = draft.looks.name_of(piece.material_on)
    _add_geom(draft, body, draft.meshes[piece], draft.looks.name_of(piece.material), THING)


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


def _add_geom(draft: _Draft, body: NativeBody, mesh: str, material: str, group: int) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=mesh,
        material=material,
        contype=0,
        conaffinity=0,
        group=group,
        mass=0,
    )


def _resolve_looks(draft: _Draft, native: NativeModel, things: dict[str, Placed]) -> None:
    for placed in things.values():
        placed.looks_off = native.geom_matid[placed.geoms].copy()
        placed.looks_on = placed.looks_off.copy()
        for place, geom in enumerate(placed.geoms):
            if geom in draft.swaps:
                placed.looks_on[place] = native.material(draft.swaps[geom]).id
