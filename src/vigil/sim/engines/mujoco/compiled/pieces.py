"""Meshes for MuJoCo: an asset's parts in MuJoCo's frame, merged by joint, material and role."""

from dataclasses import dataclass
from typing import Literal

from vigil.assets.kernel.asset import Asset, Mesh, Part
from vigil.assets.kernel.meshes import merge
from vigil.assets.notice import notice_parts
from vigil.base.caches import cached_while_alive
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE
from vigil.sim.engines.mujoco.compiled import frames


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
