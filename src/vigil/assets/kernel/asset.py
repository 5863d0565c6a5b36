"""What an asset is: meshes with materials, joints, support surfaces and solids, in its own frame.

The asset frame is THOR's: metres, x right, y up, z to the front (where the asset's door, screen or
seat faces). The origin is the centre of the bounding box when the asset is *closed and off*. Makers
of assets are in modules of their own; this module has only the types.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from vigil.base.geometry import Vec3


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh. The corners of a face are ordered so that cross(v1 - v0, v2 - v0) points outward."""

    vertices: np.ndarray  # (n, 3) float32, metres
    faces: np.ndarray  # (m, 3) int32
    normals: np.ndarray  # (n, 3) float32, unit, outward
    uvs: np.ndarray  # (n, 2) float32, in metres along the surface unless the material says otherwise


@dataclass(frozen=True, slots=True)
class Joint:
    """The motion of a part when the asset opens, in proportion to openness: a hinge turns it, a slide shifts it."""

    name: str
    kind: Literal["hinge", "slide"]
    axis: Vec3
    """Unit axis in the asset frame. A hinge turns v to v cos a + (axis x v) sin a + axis (axis . v)(1 - cos a), by
    Rodrigues' formula, about `origin`. So a positive angle about +y moves +z towards +x (clockwise from above, like
    yaw)."""
    origin: Vec3
    travel: float
    """Degrees (hinge) or metres (slide) at openness 1; a negative value reverses the direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A part of an asset: one mesh with one material."""

    name: str
    mesh: Mesh
    material: str
    """Name of the material, which `vigil.assets.kernel.materials.material` looks up."""
    material_on: str | None = None
    """Name of the material while the asset is on; None if the part looks the same on and off."""
    joint: str | None = None
    """Joint that carries the part; None for the body."""
    bears_open: bool = False
    """Whether the part's pixels show whether the asset is open or closed (leaf, lid, drawer front)."""
    bears_toggle: bool = False
    """Whether the part's pixels show whether the asset is on or off (screen, shade, flame, indicator, water)."""
    is_glass: bool = False
    """Whether the part is transparent; a click on it still hits the asset."""
    shown: Literal["always", "on", "off", "broken"] = "always"
    """When the part is drawn: always, or only while the asset is on (e.g. a flame), off, or broken (a notice)."""


@dataclass(frozen=True, slots=True)
class Surface:
    """A horizontal rectangle on which things can stand."""

    name: str
    center: Vec3
    """Middle of the rectangle in the asset frame; its y is the height at which things rest."""
    size_x: float
    size_z: float
    clearance: float = 10.0
    """Free height (m) above the surface."""
    is_inside: bool = False
    """Whether the surface is in a hollow of the asset (a shelf of a fridge, a drawer, the floor of a basin); False if
    it is on a top, a rim or an open rack."""
    needs_opening: bool = False
    """Whether the surface can be reached only while the asset is open (a fridge's shelf, a drawer). If so, `is_inside`
    is True, too."""
    joint: str | None = None
    """Joint that carries the surface (e.g. of a drawer's bottom); None if the surface is on the body."""


@dataclass(frozen=True, slots=True)
class Solid:
    """An upright prism that takes up space: agents cannot walk through it, and things cannot be put there."""

    polygon: tuple[tuple[float, float], ...]
    """Corners (x, z) of the convex footprint, in the asset frame."""
    bottom: float
    top: float
    joint: str | None = None


@dataclass(frozen=True, slots=True)
class Glow:
    """The light that an asset gives while it is on."""

    position: Vec3
    rgb: tuple[float, float, float]
    intensity: float


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Asset:
    """The shape of one thing, in the size that a house asked for."""

    category: str
    size: Vec3
    """Size (m) of the bounding box when the asset is closed."""
    parts: tuple[Part, ...]
    solids: tuple[Solid, ...]
    """Prisms that are obstacles; a prism that moves names its joint."""
    joints: tuple[Joint, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    body: tuple[Vec3, Vec3] | None = None
    """Lowest and highest corner of the body without doors, lids and drawers; None if it fills the bounding box."""
    glow: Glow | None = None
    tags: frozenset[str] = field(default_factory=frozenset)
    """Words that people would use for this variant, the colour first, e.g. {"red", "striped"}."""

    @property
    def can_open(self) -> bool:
        """Whether the asset has a moving part."""
        return bool(self.joints)

    @property
    def has_glass(self) -> bool:
        """Whether a part of the asset is of glass."""
        return any(part.is_glass for part in self.parts)
