"""Hidden facts: the world at a moment, what an action did, and what to change before the start.

None of these types may reach an agent (see the import rules in `tests/test_imports.py`).
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.base.geometry import Box, Pose, Vec3

StateQuery = Literal["is_open", "is_toggled"]
"""The two kinds of state that a thing can have."""

OPEN_ABOVE = 0.5
CLOSED_BELOW = 0.1

RefusalCode = Literal[
    "nothing_hit",  # the click met no object (wall, floor, ceiling, sky)
    "too_far",
    "not_openable",
    "not_toggleable",
    "not_pickupable",
    "not_a_receptacle",
    "already_so",  # open what is open, start what runs ...
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
    """Centre of the object's box."""
    box: Box
    """The object's body without moving leaves; follows the object."""
    openness: float | None = None
    """0 closed .. 1 open; None when it cannot be opened."""
    is_toggled: bool | None = None
    """None when it cannot be toggled."""
    is_held: bool = False
    visible: bool
    """The simulator's own verdict (embedded: >= 200 px and >= 25 % unoccluded, or wholly in view)."""
    visible_px: int
    """Pixels of the object in the frame."""
    open_px: int = 0
    """Pixels in the frame of the parts that tell open from closed; 0 for what cannot be opened."""
    toggle_px: int = 0
    """Pixels in the frame of the parts that tell on from off; 0 for what cannot be toggled."""
    nearest_visible_m: float | None = None
    """Camera to its nearest visible point; None when no pixel is visible."""
    box_distance_m: float
    """Floor-plane distance, body axis to the box."""
    center_distance_m: float
    """Euclidean distance, agent position to object position, as the simulator reports it."""
    parent: str | None = None
    """Direct parent: the receptacle that it rests on or in; None on the floor or in the hand."""
    support_chain: tuple[str, ...] = ()
    """Parent, parent's parent, ..."""
    inside: tuple[str, ...] = ()
    """What it lies inside of, nearest first: receptacles on whose interior surfaces (a shelf, a drawer, the floor of a
    basin or a bowl) the object, or something below it in its support chain, rests."""
    not_on: tuple[str, ...] = Field(default=(), exclude_if=lambda ids: not ids)
    """What bears it though it does not lie on it, nearest first: what has to be opened to reach it, open or shut (a
    drawer, a cupboard, a box), with all that bears that; and what bears a fixed hollow that it lies in (the countertop
    of a sink). Left out of what is written where there is none; rows of rules 1 and 2 never hold it."""
    over: tuple[str, ...] = ()
    """Receptacles among the reported objects that have a support surface on which the object lies
    within the tolerance of protocol.md section 4 (lowest point within 0.1 m above the surface,
    centre within the surface, grown by 0.1 m when the object has no known support)."""
    over_inside: tuple[str, ...] = ()
    """The same for their interior surfaces alone, below their rim or ceiling and within the receptacle's box."""

    def state_px(self, state: StateQuery) -> int:
        """Return the pixels in the frame that tell a state."""
        return self.open_px if state == "is_open" else self.toggle_px


class WorldState(_Fact):
    """The hidden world at a moment: the agent, and the objects that were asked about."""

    agent: Pose
    held: str | None = None
    objects: dict[str, ObjectState] = Field(default_factory=dict)


class Effect(_Fact):
    """What the simulator did with one action."""

    hit: str | None = None
    """Id of the object under the clicked pixel."""
    hit_category: str | None = None
    near: tuple[str, ...] = ()
    """Ids of the objects within 3 px of the click, the hit one included, sorted; with a drawer what it is part of."""
    click_m: float | None = None
    """Floor-plane distance, body axis to the clicked point; None when the ray met nothing."""
    moved_m: float = 0.0
    """Distance travelled (magnitude, also backward)."""
    turned_deg: float = 0.0
    pitched_deg: float = 0.0
    too_far: bool = False
    path_blocked: bool = False
    blocked_by: str | None = None
    """Id of the object (or wall) that stopped a movement or a leaf."""
    refusal: RefusalCode | None = None
    """Why the action did nothing; None when it was carried out."""
    changed: tuple[str, ...] = ()
    """Ids of the objects whose state or place changed."""
    capped: bool = False
    """The magnitude exceeded 40 steps or 360 degrees and was executed as that cap."""


class Placement(_Fact):
    """Where to put an object before the start: its box centre and its rotation (x, y, z; deg)."""

    position: Vec3
    rotation: Vec3 = Vec3(0.0, 0.0, 0.0)
    parent: str | None = None


class ObjectSetup(_Fact):
    """What to change about one object before the start; None leaves it as the house says."""

    openness: float | None = Field(default=None, ge=0.0, le=1.0)
    is_toggled: bool | None = None
    placement: Placement | None = None
    is_absent: bool = False
    """The object is taken out of the scene (its children with it)."""
    is_broken: bool = Field(default=False, exclude_if=lambda is_broken: not is_broken)
    """The machine does not start, and a notice on its front says so; left out of what is written where it is not so."""


class Setup(_Fact):
    """What to change in a house before an episode starts."""

    objects: dict[str, ObjectSetup] = Field(default_factory=dict)
    held: str | None = None
    """Id of the pickupable object that is in the hand at the start."""

    @model_validator(mode="after")
    def _is_consistent(self) -> "Setup":
        held = self.objects.get(self.held) if self.held is not None else None
        if held is not None and (held.is_absent or held.placement is not None):
            raise ValueError(f"{self.held!r} is to be in the hand, and also absent or placed elsewhere; say one")
        for object_id, change in self.objects.items():
            if change.is_broken and (change.is_toggled or change.is_absent):
                raise ValueError(f"{object_id!r} is to be broken, and also to run or to be absent; say one")
            if change.placement is None:
                continue
            if change.is_absent:
                raise ValueError(f"{object_id!r} is to be placed and to be absent; say one")
            self._check_parents(object_id)
        return self

    def _check_parents(self, object_id: str) -> None:
        """Raise ValueError when what an object is placed on rests on the object itself, is absent, or is held."""
        chain, parent = [object_id], self._parent(object_id)
        while parent is not None:
            if parent in chain:
                raise ValueError(f"{' on '.join(map(repr, [*chain, parent]))}: a thing cannot be placed on itself")
            if parent == self.held:
                raise ValueError(f"{chain[-1]!r} is to be placed on {parent!r}, which is to be in the hand")
            if parent in self.objects and self.objects[parent].is_absent:
                raise ValueError(f"{chain[-1]!r} is to be placed on {parent!r}, which is to be absent")
            chain.append(parent)
            parent = self._parent(parent)

    def _parent(self, object_id: str) -> str | None:
        change = self.objects.get(object_id)
        return None if change is None or change.placement is None else change.placement.parent
