"""Scene: a house as a collection of things with shapes, states and positions, without an engine.

`vigil.scene.build` builds a scene, `vigil.sim.core` changes it, and an engine draws it and casts rays into it. All
coordinates are in THOR's frame (`vigil.base.geometry`).
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
    """Id of the thing on or in which this thing rests (for a drawer, its furniture); None on the floor or a wall."""
    is_pickupable: bool = False
    is_openable: bool = False
    is_toggleable: bool = False
    is_receptacle: bool = False
    openness: float = 0.0
    """Openness from 0 (closed) to 1."""
    is_toggled: bool = False
    """Whether the thing is switched on."""
    is_broken: bool = False
    """Whether the thing stays off when the agent tries to switch it on; a notice on its front says so."""
    is_held: bool = False
    """Whether the thing is in the agent's hand, or lies on or in the thing that is in the hand."""
    from_hand: Vec3 | None = None
    """Position (m, along the house's axes) of a held thing relative to the thing in the hand; None if not held."""
    is_present: bool = True
    """Whether the thing is in the house; False for an object that the setup removed."""
    is_structure: bool = False
    """Whether the thing is a door, door frame or window, which fills a hole in a wall and never moves as a whole."""
    parent_joint: str | None = None
    """Name of the parent's joint that carries the thing, e.g. when the thing lies in a drawer; else None."""
    surface: str | None = None
    """Name of the parent's surface on which the thing rests; None on the floor or if the surface is not known."""
    is_drawer: bool = False
    """Whether the thing is a drawer that opens separately. It is part of its parent and moves only with the parent."""


@dataclass(frozen=True, slots=True)
class Hole:
    """A rectangular hole in a wall panel.

    `left` and `right` are metres along the panel from its start; `bottom` and `top` are metres above the panel's
    bottom.
    """

    left: float
    right: float
    bottom: float
    top: float


@dataclass(frozen=True, slots=True)
class WallPanel:
    """One side of a wall: a vertical rectangle that is seen from one room."""

    id: str
    room_id: str
    """Id of the room from which the panel is seen; "exterior" for the outside of the house."""
    start: tuple[float, float]
    """First end (x, z) of the bottom edge."""
    end: tuple[float, float]
    """Second end (x, z) of the bottom edge."""
    bottom: float
    """Height (m) of the panel's bottom."""
    height: float
    """Distance (m) from the panel's bottom to its top."""
    normal: tuple[float, float]
    """Unit vector (x, z) towards the side from which the panel is seen."""
    material: MaterialRef
    holes: tuple[Hole, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class RoomShape:
    """The floor, ceiling and light of a room."""

    id: str
    room_type: str
    polygon: np.ndarray
    """Corners (n, 2) of the floor as x, z."""
    height: float
    """Height (m) of the ceiling."""
    floor_material: MaterialRef
    ceiling_material: MaterialRef | None
    light: Vec3
    """Position of the room's light."""
    light_rgb: tuple[float, float, float]


@dataclass(slots=True, eq=False)
class Scene:
    """The scene of a house: its things, rooms and walls."""

    rooms: list[RoomShape]
    panels: list[WallPanel]
    things: dict[str, Thing] = field(default_factory=dict)
    """Things by id: objects in the document's order, then doors and windows."""
    notes: list[str] = field(default_factory=list)
    """Lines for people: one for each guess about an asset, and one for each part of the document that was not used."""
