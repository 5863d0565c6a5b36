"""Meshes for MuJoCo: an asset's parts in MuJoCo's frame, merged by joint, material and role."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from vigil.assets.kernel.asset import Asset, Part
from vigil.assets.notice import notice_parts
from vigil.sim.core.engine import BEARS_OPEN, BEARS_TOGGLE
from vigil.sim.engines.mujoco.compiled import frames


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """A mesh in MuJoCo's frame."""

    vertices: np.ndarray
    """(n, 3) float64, metres."""
    normals: np.ndarray
    """(n, 3) unit."""
    faces: np.ndarray
    """(m, 3) int32, counter-clockwise when seen from outside."""
    uvs: np.ndarray
    """(n, 2) metres."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshPiece:
    """The parts of an asset that form one geom."""

    triangles: Triangles
    joint: str | None
    material: str
    material_on: str | None
    shown: Literal["always", "on", "off", "broken"]
    roles: int
    is_glass: bool


def merge(meshes: list[Triangles]) -> Triangles:
    """Return meshes as one."""
    if len(meshes) == 1:
        return meshes[0]
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Triangles(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]).astype(np.int32),
        np.concatenate([mesh.uvs for mesh in meshes]),
    )


@lru_cache(maxsize=2048)
def pieces_of(asset: Asset) -> tuple[MeshPiece, ...]:
    """Return the asset's pieces, with its notice: as few as joints, materials and roles allow."""
    groups: dict[tuple, list[Part]] = {}
    for part in (*asset.parts, *notice_parts(asset)):
        groups.setdefault(
            (part.joint, part.material, part.material_on, part.shown, _roles(part), part.is_glass), []
        ).append(part)
    return tuple(MeshPiece(merge([_triangles(part) for part in parts]), *key) for key, parts in groups.items())


def _roles(part: Part) -> int:
    return BEARS_OPEN * part.bears_open + BEARS_TOGGLE * part.bears_toggle


def _triangles(part: Part) -> Triangles:
    mesh = part.mesh
    return Triangles(frames.points(mesh.vertices), frames.points(mesh.normals), frames.faces(mesh.faces), mesh.uvs)
