"""The scene that is drawn: its unchanging description (`RenderScene`) and its changing state (`RenderState`).

Lengths are metres in a right-handed frame: x right, y forward, z up. A geom is one surface of one material.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.materials import Material
from vigil.scene.portals import Portals

MAX_POINT_LIGHTS = 2
"""Greatest number of point lights that the shader takes."""


class RayCaster(Protocol):
    """Rays into triangles that do not move. Two threads may cast at once."""

    def cast(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the length (n,) float32 of rays (n, 3) float32 along unit directions; at least 100 m on a miss."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PointLight:
    """The light of a lamp that is on."""

    place: np.ndarray
    """Position (3,) of the lamp in metres."""
    colour: np.ndarray
    """Colour (3,) of the light times its strength."""


@dataclass(frozen=True, slots=True, eq=False)
class RenderState:
    """The poses and the looks of a scene's geoms at a moment; the arrays may be views."""

    positions: np.ndarray
    """Positions (geoms, 3) of the geoms in metres."""
    rotations: np.ndarray
    """Rotation matrices (geoms, 3, 3) of the geoms."""
    is_visible: np.ndarray
    """(geoms,) whether each geom is drawn where it is in view."""
    is_held: np.ndarray
    """(geoms,) whether each geom is in the hand."""
    materials: np.ndarray
    """(geoms,) index of each geom's material."""
    lamp_colours: np.ndarray
    """(rooms, 3) colour times strength of each room's lamp."""

    def copy(self) -> "RenderState":
        """Return the state with copied arrays."""
        return RenderState(*(getattr(self, each.name).copy() for each in fields(self)))

    def is_elsewhere(self, other: "RenderState") -> np.ndarray:
        """Return whether each geom (geoms,) has another pose than in another state."""
        is_turned = (self.rotations != other.rotations).any(axis=(1, 2))
        return is_turned | (self.positions != other.positions).any(axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class RenderScene:
    """The unchanging description of a scene. The first geoms are its structure."""

    meshes: list[Mesh]
    """With uvs in repeats of the texture."""
    geom_meshes: np.ndarray
    """(geoms,) index of each geom's mesh."""
    structure_kinds: tuple[str, ...]
    """Kind of each structural geom: `wall`, `floor`, `ceiling`, `skirting`, `exterior` or `ground`."""
    structure_rooms: np.ndarray
    """(geoms,) number of the only room from which a structural geom is visible; -1 for all others."""
    furniture: np.ndarray
    """(geoms,) number of the object to which each geom belongs, a drawer to its chest; -1 for structure."""
    boxes: np.ndarray
    """(geoms, 6) centre and half size of the box around each geom, in the geom's frame."""
    radii: np.ndarray
    """(geoms,) radius of the sphere around each geom; inf for an endless plane."""
    materials: tuple[Material, ...]
    lamps: np.ndarray
    """(rooms, 3) position of each room's lamp."""
    portals: Portals
    static_occluders: np.ndarray
    """Geoms that stop light: structure and the fixed parts of furniture, except glass and objects on top."""
    caster: Callable[[np.ndarray, np.ndarray], RayCaster]
    """Makes a ray caster of vertices (n, 3) and faces (m, 3)."""
    initial: RenderState
    """The poses at the start, with everything visible as if it were present, whole and off."""
    cache: dict[str, Any] = field(default_factory=dict)
    """Results that the renderer computes from the scene once."""

    def with_furniture(self, is_chosen: np.ndarray) -> np.ndarray:
        """Return which geoms (geoms,) belong to an object of which any geom is chosen (geoms,)."""
        return np.isin(self.furniture, self.furniture[is_chosen])
