"""Hidden state: the world at a moment, the effect of an action, and the changes before the start.

None of these types may reach an agent (see the import rules in `tests/test_imports.py`).
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.base.geometry import Box, Pose, Vec3

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


class _Fact(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ObjectState(_Fact):
    """One object's hidden state at a moment, seen from where the agent stands."""

    category: str
    position: Vec3
    """Centre of `box`."""
    box: Box
    """Box of the object's body without its moving parts (doors, lids, drawers); it moves with the object."""
    openness: float | None = None
    """Openness from 0 (closed) to 1 (open); None if the object cannot be opened."""
    is_toggled: bool | None = None
    """Whether the object is on; None if it cannot be toggled."""
    is_held: bool = False
    visible: bool
    """Visibility according to the simulator (embedded: >= 200 px and >= 25 % unoccluded, or wholly in view)."""
    visible_px: int
    """Pixels of the object in the frame."""
    open_px: int = 0
    """Pixels in the frame of the parts that show open or closed; 0 if the object cannot be opened."""
    toggle_px: int = 0
    """Pixels in the frame of the parts that show on or off; 0 if the object cannot be toggled."""
    nearest_visible_m: float | None = None
    """Distance (m) from the camera to the nearest visible point; None if no pixel is visible."""
    box_distance_m: float
    """Floor-plane distance (m) from the agent's body axis to the box."""
    center_distance_m: float
    """Euclidean distance (m) from agent to object position, as the simulator reports it."""
    parent: str | None = None
    """Receptacle that the object directly rests on or in; None on the floor or in the hand."""
    support_chain: tuple[str, ...] = ()
    """The parent, its parent, and so on."""
    inside: tuple[str, ...] = ()
    """Receptacles that contain the object, nearest first: the object, or a thing below it in its support chain,
    rests on one of their interior surfaces (a shelf, a drawer, the bottom of a bowl)."""
    not_on: tuple[str, ...] = Field(default=(), exclude_if=lambda ids: not ids)
    """Supports in the chain that the object does not count as lying on, nearest first. If a container that opens
    (drawer, cupboard, box) holds the object, these are the container and all supports below it. If a fixed hollow (a
    sink) holds it, this is the support of the hollow (the countertop). Omitted from rows if empty; rows of rules 1 and
    2 never have it."""
    over: tuple[str, ...] = ()
    """Receptacles among the reported objects that have a support surface on which the object lies
    within the tolerance of protocol.md section 4 (lowest point within 0.1 m above the surface,
    centre within the surface, grown by 0.1 m when the object has no known support)."""
    over_inside: tuple[str, ...] = ()
    """Like `over`, only for interior surfaces, below their rim or ceiling and within the receptacle's box."""

    def state_px(self, state: StateQuery) -> int:
        """Return the number of pixels in the frame that show a state."""
        return self.open_px if state == "is_open" else self.toggle_px


class WorldState(_Fact):
    """The hidden world at a moment: the agent and the requested objects."""

    agent: Pose
    held: str | None = None
    objects: dict[str, ObjectState] = Field(default_factory=dict)


class Effect(_Fact):
    """The effect of one action in the simulator."""

    hit: str | None = None
    """Id of the object under the clicked pixel."""
    hit_category: str | None = None
    near: tuple[str, ...] = ()
    """Sorted ids of the objects within 3 px of the click, including the object that was hit. With a drawer, its
    furniture is also listed."""
    click_m: float | None = None
    """Floor-plane distance (m) from the body axis to the clicked point; None if the ray hit nothing."""
    moved_m: float = 0.0
    """Distance travelled (m), positive for backward moves too."""
    turned_deg: float = 0.0
    pitched_deg: float = 0.0
    too_far: bool = False
    path_blocked: bool = False
    blocked_by: str | None = None
    """Id of the object (or wall) that stopped the agent or a moving part (door, lid or drawer)."""
    refusal: RefusalCode | None = None
    """Reason why the action did nothing; None if it was executed."""
    changed: tuple[str, ...] = ()
    """Ids of the objects whose state or place changed."""
    capped: bool = False
    """Whether the magnitude exceeded 40 steps or 360 degrees and was reduced to that limit."""


class Placement(_Fact):
    """The place of an object before the start: its box centre and its rotation (x, y, z; deg)."""

    position: Vec3
    rotation: Vec3 = Vec3(0.0, 0.0, 0.0)
    parent: str | None = None


class ObjectSetup(_Fact):
    """Changes to one object before the start; None leaves the state as the house has it."""

    openness: float | None = Field(default=None, ge=0.0, le=1.0)
    is_toggled: bool | None = None
    placement: Placement | None = None
    is_absent: bool = False
    """Whether the object and its children are removed from the scene."""
    is_broken: bool = Field(default=False, exclude_if=lambda is_broken: not is_broken)
    """Whether the machine does not start, as a notice on its front says; omitted from files if False."""


class Setup(_Fact):
    """Changes to a house before an episode starts."""

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
        """Raise ValueError if the support of a placed object rests on the object itself, is absent, or is held."""
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
