"""Scene: a house as things with shapes, states and places, without any engine.

Built by `vigil.scene.build`, moved by `vigil.sim.core.motion` and `vigil.sim.core.handling`, drawn and ray-cast by a
back end. All coordinates are in THOR's frame (`vigil.base.geometry`).
"""

from dataclasses import dataclass, field

import numpy as np

from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Vec3
from vigil.protocol.house import MaterialRef


@dataclass(slots=True, eq=False)
class Thing:
    """One object of the house, door and window included, with its present state."""

    id: str
    category: str
    asset: Asset
    position: Vec3
    """Centre of the asset's bounding box."""
    rotation: Vec3
    """Euler angles in degrees, applied z, then x, then y (Unity's order)."""
    parent: str | None = None
    is_pickupable: bool = False
    is_openable: bool = False
    is_toggleable: bool = False
    is_receptacle: bool = False
    openness: float = 0.0
    is_toggled: bool = False
    is_broken: bool = False
    """It does not start, and a notice on its front says so."""
    is_held: bool = False
    """In the hand, or carried on or in what is in the hand."""
    from_hand: Vec3 | None = None
    """While it is in the hand: its place as seen from the held thing's, in the house's directions."""
    is_present: bool = True
    is_structure: bool = False
    """A door, door frame or window: fills a hole and never moves as a whole."""
    parent_joint: str | None = None
    """The parent's joint that carries it (it lies in a drawer)."""
    surface: str | None = None
    """Name of the parent's surface on which it rests; None on the floor, or where no surface is known."""
    is_drawer: bool = False
    """A drawer with an openness of its own: it is part of its parent, and goes nowhere without it."""


@dataclass(frozen=True, slots=True)
class Hole:
    """A rectangular hole in a wall panel: along the panel (m from its first bottom point) and up."""

    left: float
    right: float
    bottom: float
    top: float


@dataclass(frozen=True, slots=True)
class WallPanel:
    """A vertical rectangle seen from its room's side."""

    id: str
    room_id: str
    """"exterior" for the outside of the house."""
    start: tuple[float, float]
    """First bottom point (x, z)."""
    end: tuple[float, float]
    bottom: float
    height: float
    normal: tuple[float, float]
    """Unit (x, z) towards the side it is seen from."""
    material: MaterialRef
    holes: tuple[Hole, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class RoomShape:
    """A room's floor and ceiling."""

    id: str
    room_type: str
    polygon: np.ndarray
    """(n, 2) corners x, z."""
    height: float
    floor_material: MaterialRef
    ceiling_material: MaterialRef | None
    light: Vec3
    light_rgb: tuple[float, float, float]
    light_intensity: float


@dataclass(slots=True, eq=False)
class Scene:
    """Everything in a house. Things are kept in the document's order."""

    rooms: list[RoomShape]
    panels: list[WallPanel]
    things: dict[str, Thing] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """What had to be guessed of the house's assets, or could not be as the house says, one line each."""
