"""Builds the MuJoCo model of a scene. Each thing and each of its joints is a mocap body, i.e. a body moved by code."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from vigil.assets.kernel.asset import Asset, Mesh, Part
from vigil.assets.kernel.materials import Material, material
from vigil.assets.kernel.meshes import merge
from vigil.assets.kernel.textures import texture
from vigil.assets.notice import notice_parts
from vigil.base.caches import cached_while_alive
from vigil.scene.things import Scene, Thing
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.binding import NativeBody, NativeData, NativeModel, mujoco
from vigil.sim.engines.mujoco.compiled.structure import shells_of, tint_of

STRUCTURE, THING, GLASS, HIDDEN, HELD, ONLY = range(6)
"""Groups of geoms (MuJoCo's parts of bodies). A geom's group decides whether the geom is drawn and met by rays."""
GROUPS = 6
GROUND_M, LAWN_HALF_M = -0.02, 60.0
"""Height (m) of the ground outside, and half of the ground's side length (m)."""
Tint = tuple[float, float, float] | None


@dataclass(frozen=True, slots=True, eq=False)
class MeshPiece:
    """The parts of an asset that form one geom."""

    mesh: Mesh
    """The mesh in MuJoCo's frame."""
    joint: str | None
    material: str
    material_on: str | None
    shown: Literal["always", "on", "off", "broken"]
    roles: int
    is_glass: bool


@cached_while_alive
def pieces_of(asset: Asset) -> tuple[MeshPiece, ...]:
    """Return the pieces of an asset and of its notice; parts with the same joint, material and role are one piece."""
    groups: dict[tuple, list[Part]] = {}
    for part in (*asset.parts, *notice_parts(asset)):
        roles = BEARS_OPEN * part.bears_open + BEARS_TOGGLE * part.bears_toggle
        key = part.joint, part.material, part.material_on, part.shown, roles, part.is_glass
        groups.setdefault(key, []).append(part)
    return tuple(
        MeshPiece(
            merge(
                Mesh(frames.points(each.vertices), frames.faces(each.faces), frames.points(each.normals), each.uvs)
                for each in (part.mesh for part in parts)
            ),
            *key,
        )
        for key, parts in groups.items()
    )


@dataclass(slots=True, eq=False)
class CompiledThing:
    """The bodies and geoms of a thing; arrays and `joints` have an entry for each geom."""

    index: int
    bodies: list[tuple[int, str | None]]
    """(mocap index, joint) of each body; the joint of the first body is None."""
    geoms: np.ndarray
    joints: list[str | None]
    """Joint that carries each geom; None for a geom of the first body."""
    groups: np.ndarray
    """Group of each geom while it is visible."""
    shown_on: np.ndarray
    """Whether each geom is drawn while the thing is on."""
    shown_off: np.ndarray
    """Whether each geom is drawn while the thing is off."""
    notices: np.ndarray
    """Whether each geom is drawn only while the thing is broken."""
    materials_on: np.ndarray
    """Number of each geom's material while the thing is on."""
    materials_off: np.ndarray
    """Number of each geom's material while the thing is off."""

    def place(self, thing: Thing, data: NativeData, groups: np.ndarray, materials: np.ndarray) -> None:
        """Write the thing's pose into MuJoCo's data, and its state into the groups and materials (geoms,) of all geoms.

        The caller must call `mj_kinematics` afterwards.
        """
        for mocap, joint in self.bodies:
            position, matrix = frames.thing_place(thing, joint)
            data.mocap_pos[mocap] = position
            data.mocap_quat[mocap] = frames.quaternion(matrix)
        shown = self.shown_on if thing.is_toggled else self.shown_off
        if thing.is_broken:
            shown = shown | self.notices
        visible = HELD if thing.is_held else self.groups
        groups[self.geoms] = np.where(shown & thing.is_present, visible, HIDDEN)
        materials[self.geoms] = self.materials_on if thing.is_toggled else self.materials_off


class ModelBuilder:
    """A MuJoCo model that is being built from a scene, with tables of its geoms."""

    def __init__(self, scene: Scene) -> None:
        self._spec = mujoco.MjSpec()
        self._meshes: dict[MeshPiece, dict[str, Any]] = {}
        self._material_numbers: dict[tuple[str, Tint], int] = {}
        self._mocaps = 0
        self.materials: list[Material] = []
        self.geom_things: list[int] = []
        """Index of the thing of each geom; -1 for a geom of the structure (walls, floors, ceilings)."""
        self.geom_roles: list[int] = []
        self.shells = shells_of(scene)
        """Structural surfaces. The model's first geoms are these, in the same order; the next geom is the ground."""
        self.structure_kinds = (*(shell.kind for shell in self.shells), "ground")
        for number, shell in enumerate(self.shells):
            look = self._material(shell.material.name, tint_of(shell.material))
            mesh = self._add_mesh(f"structure{number}", shell.mesh, self.materials[look].metres)
            self._add_geom(self._spec.worldbody, look, STRUCTURE, (-1, 0), mesh)
        ground = {
            "type": mujoco.mjtGeom.mjGEOM_PLANE,
            "size": [LAWN_HALF_M, LAWN_HALF_M, 1.0],
            "pos": [0.0, 0.0, GROUND_M],
        }
        self._add_geom(self._spec.worldbody, self._material("grass"), STRUCTURE, (-1, 0), ground)
        self.things = {thing.id: self._add_thing(index, thing) for index, thing in enumerate(scene.things.values())}

    def compile(self) -> NativeModel:
        """Return the compiled model.

        Textures are drawn while MuJoCo compiles, because MuJoCo then releases Python's global lock.
        """
        with ThreadPoolExecutor(1) as other:
            compiling = other.submit(self._spec.compile)
            for each in self.materials:
                if each.texture_name is not None:
                    texture(each.texture_name)
            return compiling.result()

    def _add_thing(self, index: int, thing: Thing) -> CompiledThing:
        bodies: dict[str | None, NativeBody] = {}
        mocaps: list[tuple[int, str | None]] = []
        pieces = pieces_of(thing.asset)
        first = len(self.geom_things)
        for joint in dict.fromkeys([None, *(piece.joint for piece in pieces)]):
            mocaps.append((self._mocaps, joint))
            bodies[joint] = self._spec.worldbody.add_body(mocap=True)
            self._mocaps += 1
        # MuJoCo numbers geoms body by body, so pieces are added in the order of their bodies.
        ordered = [piece for joint in bodies for piece in pieces if piece.joint == joint]
        off = np.array([self._add_piece(bodies[piece.joint], piece, index) for piece in ordered], dtype=int)
        on = [
            look if piece.material_on is None else self._material(piece.material_on)
            for piece, look in zip(ordered, off.tolist(), strict=True)
        ]
        return CompiledThing(
            index,
            mocaps,
            np.arange(first, first + len(ordered)),
            [piece.joint for piece in ordered],
            np.array([GLASS if piece.is_glass else THING for piece in ordered], dtype=int),
            np.array([piece.shown in ("always", "on") for piece in ordered], dtype=bool),
            np.array([piece.shown in ("always", "off") for piece in ordered], dtype=bool),
            np.array([piece.shown == "broken" for piece in ordered], dtype=bool),
            np.array(on, dtype=int),
            off,
        )

    def _add_piece(self, body: NativeBody, piece: MeshPiece, thing: int) -> int:
        """Add a mesh piece to a body as a geom; return the number of its material."""
        look = self._material(piece.material)
        if piece not in self._meshes:
            name = f"mesh{len(self._meshes)}"
            self._meshes[piece] = self._add_mesh(name, piece.mesh, self.materials[look].metres)
        self._add_geom(body, look, THING, (thing, piece.roles), self._meshes[piece])
        return look

    def _material(self, name: str, tint: Tint = None) -> int:
        """Return the number of a material; add the material if it is new."""
        key = name, tint
        if key not in self._material_numbers:
            number = self._material_numbers[key] = len(self.materials)
            self.materials.append(material(name, tint))
            self._spec.add_material(name=f"material{number}", rgba=list(self.materials[number].rgba))
        return self._material_numbers[key]

    def _add_mesh(self, name: str, mesh: Mesh, metres_per_repeat: float) -> dict[str, Any]:
        """Add a mesh; return the arguments with which a geom of the mesh's shape is added."""
        # MuJoCo takes lists over in half the time of arrays.
        self._spec.add_mesh(
            name=name,
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            uservert=mesh.vertices.ravel().tolist(),
            usernormal=mesh.normals.ravel().tolist(),
            userface=mesh.faces.ravel().tolist(),
            usertexcoord=(mesh.uvs / metres_per_repeat).ravel().tolist(),
        )
        return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}

    def _add_geom(self, body: NativeBody, look: int, group: int, owner: tuple[int, int], shape: dict[str, Any]) -> None:
        """Add a geom. `look` is the number of its material; `owner` is the index of its thing and its role bits."""
        body.add_geom(**shape, material=f"material{look}", contype=0, conaffinity=0, group=group, mass=0)
        self.geom_things.append(owner[0])
        self.geom_roles.append(owner[1])
