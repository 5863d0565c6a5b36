"""Scene: a house as things with shapes, states and positions, without an engine.

`vigil.scene.build` builds it, `vigil.sim.core` changes it, and an engine draws it and casts rays in it. All coordinates
are in THOR's frame (`vigil.base.geometry`).
"""

from dataclasses import dataclass, field

import numpy as np

from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Vec3
from vigil.protocol.house import MaterialRef


@dataclass(slots=True, eq=False)
class Thing:
    """An object of the house, or a door or window, with its present state."""

    id: str
    category: str
    asset: Asset
    position: Vec3
    """Centre of the closed asset's bounding box."""
    rotation: Vec3
    """Euler angles in degrees, applied z, then x, then y (Unity's order)."""
    parent: str | None = None
    """Id of the thing that it rests on or in, or of a drawer's furniture; None on the floor or a wall."""
    is_pickupable: bool = False
    is_openable: bool = False
    is_toggleable: bool = False
    is_receptacle: bool = False
    openness: float = 0.0
    """Openness from 0 (closed) to 1."""
    is_toggled: bool = False
    """Whether it is switched on."""
    is_broken: bool = False
    """Whether it does not start; a notice on its front says so."""
    is_held: bool = False
    """Whether it is in the hand, or on or in what is in the hand."""
    from_hand: Vec3 | None = None
    """Position relative to the held thing's (m, along the house's axes) while it is held; else None."""
    is_present: bool = True
    """Whether it is in the house; an object that the setup removed is not."""
    is_structure: bool = False
    """Whether it is a door, door frame or window, which fills a hole and never moves as a whole."""
    parent_joint: str | None = None
    """Name of the parent's joint that carries it, e.g. when it lies in a drawer; else None."""
    surface: str | None = None
    """Name of the parent's surface on which it rests; None on the floor, or where no surface is known."""
    is_drawer: bool = False
    """Whether it is a drawer that opens separately: part of its parent, and never moved without it."""


@dataclass(frozen=True, slots=True)
class Hole:
    """A rectangular hole in a wall panel.

    `left` and `right` are metres along the panel from its start; `bottom` and `top` are metres above its bottom.
    """

    left: float
    right: float
    bottom: float
    top: float


@dataclass(frozen=True, slots=True)
class WallPanel:
    """A vertical rectangle seen from its room's side."""

    id: str
    room_id: str
    """Id of the room that it is seen from; "exterior" for the outside of the house."""
    start: tuple[float, float]
    """First bottom point (x, z)."""
    end: tuple[float, float]
    """Second bottom point (x, z)."""
    bottom: float
    """Height (m) of its bottom."""
    height: float
    """Distance (m) from its bottom to its top."""
    normal: tuple[float, float]
    """Unit vector (x, z) towards the side that it is seen from."""
    material: MaterialRef
    holes: tuple[Hole, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class RoomShape:
    """The floor, ceiling and light of a room."""

    id: str
    room_type: str
    polygon: np.ndarray
    """Corners (n, 2) of the floor, x and z."""
    height: float
    """Height (m) of the ceiling."""
    floor_material: MaterialRef
    ceiling_material: MaterialRef | None
    light: Vec3
    """Position of the room's light."""
    light_rgb: tuple[float, float, float]
    light_intensity: float


@dataclass(slots=True, eq=False)
class Scene:
    """Everything in a house."""

    rooms: list[RoomShape]
    panels: list[WallPanel]
    things: dict[str, Thing] = field(default_factory=dict)
    """Things by id: objects in the document's order, then doors and windows."""
    notes: list[str] = field(default_factory=list)
    """Lines about what was guessed about assets, and what could not be done as the house says."""
