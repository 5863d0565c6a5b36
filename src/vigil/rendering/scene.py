"""The scene that is drawn: a description that never changes (`RenderScene`), and a state that does (`RenderState`).

Lengths are metres in a right-handed frame: x right, y forward, z up. A geom is a surface with one material.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.materials import Material
from vigil.scene.portals import Portals

MAX_POINT_LIGHTS = 2
"""Greatest number of point lights that the shader can use."""
CastRays = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Ray caster: returns the length (n,) float32 of rays from origins (n, 3) along unit directions (n, 3) to triangles
that do not move; 100 m or more on a miss. Two threads may use it at once."""


@dataclass(frozen=True, slots=True, eq=False)
class PointLight:
    """The light of a lamp that is on."""

    place: np.ndarray
    """Position (3,) of the lamp in metres."""
    colour: np.ndarray
    """Colour (3,) of the light multiplied by its strength."""


@dataclass(frozen=True, slots=True, eq=False)
class RenderState:
    """The poses and looks of a scene's geoms at one moment. The arrays may be views of other arrays, not copies."""

    positions: np.ndarray
    """Positions (geoms, 3) of the geoms in metres."""
    rotations: np.ndarray
    """Rotation matrices (geoms, 3, 3) of the geoms."""
    is_visible: np.ndarray
    """Whether (geoms,) each geom is drawn when it is in view."""
    is_held: np.ndarray
    """Whether (geoms,) each geom is in the hand."""
    materials: np.ndarray
    """Index (geoms,) of each geom's material."""
    lamp_colours: np.ndarray
    """Colour (rooms, 3) of each room's lamp multiplied by its strength."""

    def copy(self) -> "RenderState":
        """Return the state with copied arrays."""
        return RenderState(*(getattr(self, each.name).copy() for each in fields(self)))

    def is_elsewhere(self, other: "RenderState") -> np.ndarray:
        """Return a mask (geoms,) of the geoms whose pose is not the same as in `other`."""
        is_turned = (self.rotations != other.rotations).any(axis=(1, 2))
        return is_turned | (self.positions != other.positions).any(axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class RenderScene:
    """The description of a scene, which does not change. Its first geoms are the structure (e.g. walls and floors)."""

    meshes: list[Mesh]
    """Meshes of the scene; their texture coordinates (uvs) count repeats of the texture."""
    geom_meshes: np.ndarray
    """Index (geoms,) of each geom's mesh."""
    structure_kinds: tuple[str, ...]
    """Kind of each geom of the structure: `wall`, `floor`, `ceiling`, `skirting`, `exterior` or `ground`."""
    structure_rooms: np.ndarray
    """Number (geoms,) of the only room from which a geom of the structure is visible; -1 for other geoms."""
    furniture: np.ndarray
    """Number (geoms,) of each geom's object; for a drawer, the number of its furniture; -1 for structure."""
    boxes: np.ndarray
    """Centre and half size (geoms, 6) of the box around each geom, in the geom's frame."""
    radii: np.ndarray
    """Radius (geoms,) of the sphere around each geom; inf for an endless plane."""
    materials: tuple[Material, ...]
    lamps: np.ndarray
    """Position (rooms, 3) of each room's lamp."""
    portals: Portals
    static_occluders: np.ndarray
    """Geoms that block light: structure and the fixed parts of furniture, except glass and the objects on furniture."""
    caster: Callable[[np.ndarray, np.ndarray], CastRays]
    """Function that makes a ray caster from vertices (n, 3) and faces (m, 3)."""
    initial: RenderState
    """The state at the start, in which every thing counts as present, as not broken and as switched off."""
    cache: dict[str, Any] = field(default_factory=dict)
    """Results that the renderer computes from the scene only once."""

    def with_furniture(self, is_chosen: np.ndarray) -> np.ndarray:
        """Return a mask (geoms,) of all geoms whose object also has a geom in the mask `is_chosen` (geoms,)."""
        return np.isin(self.furniture, self.furniture[is_chosen])
