"""Hidden state: the world at a moment, the effect of an action, and the changes to a house before the start.

None of these types may reach an agent (see the import rules in `tests/test_imports.py`).
"""

from typing import Literal

from pydantic import Field, model_validator

from vigil.base.geometry import Box, Pose, Vec3
from vigil.base.models import FrozenModel

StateQuery = Literal["is_open", "is_toggled"]
"""The two kinds of state that an object can have."""

OPEN_ABOVE = 0.5
CLOSED_BELOW = 0.1

RefusalCode = Literal[
    "nothing_hit",  # the click met no object (wall, floor, ceiling, sky)
    "too_far",
    "not_openable",
    "not_toggleable",
    "not_pickupable",
    "not_a_receptacle",
    "already_so",  # e.g. opening an open object, starting a running one
    "interlock",  # e.g. a running microwave refuses to open
    "blocked_by_object",  # a leaf or drawer would hit something
    "blocked_by_agent",
    "hand_full",
    "hand_empty",
    "receptacle_closed",
    "no_room",  # nothing fits at the clicked point or within 0.3 m, or no free place to drop
    "path_blocked",
    "object_occupied",  # the object carries something and cannot be picked
    "out_of_order",  # a broken machine does not start
]


class ObjectState(FrozenModel):
    """The hidden state of one object at a moment, with its pixels in the frame and its distances from the agent."""

    category: str
    position: Vec3
    """Centre of `box`."""
    box: Box
    """Box around the object without its moving parts (doors, lids, drawers). The box moves with the object."""
    openness: float | None = None
    """Openness from 0 (closed) to 1 (open); None if the object cannot be opened."""
    is_toggled: bool | None = None
    """Whether the object is on; None if it cannot be toggled."""
    is_held: bool = False
    visible: bool
    """Whether the simulator counts the object as visible. The embedded simulator requires that at least 200 px and 25 %
    of the object are unoccluded, or that the object is wholly in view."""
    visible_px: int
    """Number of pixels of the object in the frame."""
    open_px: int = 0
    """Number of pixels in the frame of the parts that show whether the object is open; 0 if it cannot be opened."""
    toggle_px: int = 0
    """Number of pixels in the frame of the parts that show whether the object is on; 0 if it cannot be toggled."""
    nearest_visible_m: float | None = None
    """Distance (m) from the camera to the nearest visible point of the object; None if no pixel of it is visible."""
    box_distance_m: float
    """Floor-plane distance (m) from the agent's body axis to the box."""
    center_distance_m: float
    """Euclidean distance (m) from the agent's position to the object's position, as the simulator reports it."""
    parent: str | None = None
    """Receptacle that the object directly rests on or in; None on the floor or in the hand."""
    support_chain: tuple[str, ...] = ()
    """Ids of the supports below the object: its parent, the parent's parent, and so on."""
    inside: tuple[str, ...] = ()
    """Receptacles that contain the object, nearest first. A receptacle contains the object if the object, or a support
    below it, rests on an interior surface of the receptacle (a shelf, a drawer, the bottom of a bowl)."""
    not_on: tuple[str, ...] = Field(default=(), exclude_if=lambda ids: not ids)
    """Supports in `support_chain` that the object does not count as lying on, nearest first. If the object is in a
    container that opens (drawer, cupboard, box), these are the container and all supports below the container. If
    the object is in a fixed hollow (a sink), this is the support of the hollow (the countertop). Rows do not have
    the field if it is empty; rows of rules 1 and 2 never have it."""
    over: tuple[str, ...] = ()
    """Receptacles among the reported objects that the object lies on, with the tolerance of protocol.md section 4. The
    object's lowest point must be at most 0.1 m above a support surface of the receptacle, and the object's centre
    must be within the surface. If the object has no known support, the surface is enlarged by 0.1 m for this check."""
    over_inside: tuple[str, ...] = ()
    """Like `over`, but only for interior surfaces. The object must also be below the rim or ceiling of the interior,
    and within the receptacle's box. `scene.supports.receptacles_below` decides both."""

    def state_px(self, state: StateQuery) -> int:
        """Return the number of pixels in the frame that show a state."""
        return self.open_px if state == "is_open" else self.toggle_px


class WorldState(FrozenModel):
    """The hidden world at a moment: the agent and the objects whose states were requested."""

    agent: Pose
    held: str | None = None
    objects: dict[str, ObjectState] = Field(default_factory=dict)


class Effect(FrozenModel):
    """The effect of one action in the simulator: what was hit, how far the agent moved, and what changed or was
    refused."""

    hit: str | None = None
    """Id of the object under the clicked pixel; None if there is no object."""
    hit_category: str | None = None
    near: tuple[str, ...] = ()
    """Sorted ids of the objects within 3 px of the click, including the object that was hit. If a drawer is listed, the
    furniture that has the drawer is also listed."""
    click_m: float | None = None
    """Floor-plane distance (m) from the agent's body axis to the clicked point; None if the click's ray hit nothing."""
    moved_m: float = 0.0
    """Distance (m) that the agent moved; also positive for backward moves."""
    turned_deg: float = 0.0
    pitched_deg: float = 0.0
    too_far: bool = False
    path_blocked: bool = False
    blocked_by: str | None = None
    """Id of the object or wall that stopped the agent, or stopped a moving part (door, lid or drawer)."""
    refusal: RefusalCode | None = None
    """Reason why the action did nothing; None if it was executed."""
    changed: tuple[str, ...] = ()
    """Ids of the objects whose state or place changed."""
    capped: bool = False
    """Whether the requested magnitude was above the limit (40 steps or 360 degrees) and was reduced to this limit."""


class Placement(FrozenModel):
    """The place of an object before the start: the centre of its box, and its rotation (x, y, z; deg)."""

    position: Vec3
    rotation: Vec3 = Vec3(0.0, 0.0, 0.0)
    parent: str | None = None


class ObjectSetup(FrozenModel):
    """Changes to one object before the start. A field that is None changes nothing."""

    openness: float | None = Field(default=None, ge=0.0, le=1.0)
    is_toggled: bool | None = None
    placement: Placement | None = None
    is_absent: bool = False
    """Whether the object and its children are removed from the scene."""
    is_broken: bool = Field(default=False, exclude_if=lambda is_broken: not is_broken)
    """Whether the machine is broken: it does not start, and a notice on it says so. Omitted from files if False."""


class Setup(FrozenModel):
    """Changes to a house before an episode starts: changed objects, and the object in the hand."""

    objects: dict[str, ObjectSetup] = Field(default_factory=dict)
    held: str | None = None
    """Id of the pickupable object that is in the hand at the start."""

    @model_validator(mode="after")
    def _is_consistent(self) -> "Setup":
        held = self.objects.get(self.held) if self.held is not None else None
        if held is not None and (held.is_absent or held.placement is not None):
            raise ValueError(
                f"{self.held!r} cannot be in the hand and also absent or placed elsewhere; choose one of these"
            )
        for object_id, change in self.objects.items():
            if change.is_broken and (change.is_toggled or change.is_absent):
                raise ValueError(f"{object_id!r} cannot be broken and also running or absent; choose one of these")
            if change.placement is None:
                continue
            if change.is_absent:
                raise ValueError(f"{object_id!r} cannot be both placed and absent; choose one of these")
            self._check_parents(object_id)
        return self

    def _check_parents(self, object_id: str) -> None:
        """Raise ValueError if the support of a placed object is absent, held, or resting on the object itself."""
        chain, parent = [object_id], self._parent(object_id)
        while parent is not None:
            if parent in chain:
                raise ValueError(f"{' on '.join(map(repr, [*chain, parent]))}: a thing cannot be placed on itself")
            if parent == self.held:
                raise ValueError(f"{chain[-1]!r} cannot be placed on {parent!r}, because {parent!r} is in the hand")
            if parent in self.objects and self.objects[parent].is_absent:
                raise ValueError(f"{chain[-1]!r} cannot be placed on {parent!r}, because {parent!r} is absent")
            chain.append(parent)
            parent = self._parent(parent)

    def _parent(self, object_id: str) -> str | None:
        change = self.objects.get(object_id)
        return None if change is None or change.placement is None else change.placement.parent
