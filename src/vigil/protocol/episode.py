"""Episodes and the eight families: the task, the house and the budgets.

The table `FAMILIES` is data: nothing branches on a family's name when an episode is scored. `register_family` adds
custom families to it. Source: `protocol.md` section 4 and the paper's table `family_specs`.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from vigil.base.geometry import Pose
from vigil.errors import SettingError, did_you_mean
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG, Action
from vigil.protocol.goals import Goal
from vigil.protocol.world import Setup


def _check_family(name: str) -> str:
    if name not in FAMILIES:
        raise ValueError(
            f"there is no family {name!r}; the families are {', '.join(FAMILIES)}. One of one's own is known where its "
            "module is imported: `vigil run --import MODULE`, VIGIL_IMPORT=MODULE for any command"
        )
    return name


Family = Annotated[str, AfterValidator(_check_family)]
"""A name in `FAMILIES`."""
Tier = Literal["diagnostic", "compositional"]
TargetSize = Literal["large", "medium", "small"]
Skill = Literal["navigate", "look", "interact_pixel", "interact_pixel(ground)", "report"]

DEFAULT_HORIZON_DEG = 30.0
MAX_INSTRUCTION_CHARS = 2000
MAX_FLOOR_M = 0.01
"""Maximum distance of a start from height 0, where the floors of houses are."""
MAX_COORDINATE_M = 200.0
"""Maximum coordinate in an episode; the largest houses are about 50 m long."""
MAX_TURN_DEG = 360.0
"""Maximum rotation; more than a whole turn is a typo."""


@dataclass(frozen=True, slots=True)
class FamilySpec:
    """One row of the table of families."""

    name: str
    tier: Tier
    visible_at_start: bool
    max_steps: int
    max_invalid: int
    skills: tuple[Skill, ...]
    """Expected skills; a recorded solution uses no others."""
    goal_kinds: tuple[str, ...]

    @property
    def start_horizon(self) -> float | None:
        """The camera pitch to start with; None when the author is free to choose (`look` is expected)."""
        return None if "look" in self.skills else DEFAULT_HORIZON_DEG


_ACT = ("navigate", "interact_pixel", "report")
FAMILIES: dict[Family, FamilySpec] = {
    "PG": FamilySpec(
        "Pixel Grounding", "diagnostic", True, 5, 3, ("interact_pixel(ground)", "report"), ("target_grounded",)
    ),
    "DA": FamilySpec("Distance Approach", "diagnostic", True, 12, 4, ("navigate", "report"), ("agent_near_target",)),
    "VS": FamilySpec("View Search", "diagnostic", False, 20, 6, ("navigate", "look", "report"), ("object_state",)),
    "SV": FamilySpec("State Verification", "diagnostic", True, 5, 2, ("look", "report"), ("report_status",)),
    "AI": FamilySpec("Approach and Interact", "compositional", True, 25, 8, _ACT, ("object_state", "object_held")),
    "SI": FamilySpec(
        "Search and Interact",
        "compositional",
        False,
        35,
        10,
        ("navigate", "look", "interact_pixel", "report"),
        ("object_state", "object_held"),
    ),
    "SM": FamilySpec(
        "Sequential Manipulation", "compositional", True, 30, 10, _ACT, ("object_held", "object_at_receptacle")
    ),
    "CR": FamilySpec("Constraint Resolving", "compositional", True, 40, 12, _ACT, ("object_state", "object_held")),
}

EXTRA_GOAL_KINDS: dict[Family, tuple[str, ...]] = {"SM": ("all_of",)}
"""Kinds of goals that a family may use in addition to the paper's: several places or states at once."""
SUITE_GOAL_KINDS: dict[Family, tuple[str, ...]] = {"SI": ("all_of", "object_at_receptacle")}
"""Kinds of goals that a family may use only in the packs of a suite (`vigil.packs.pack.protocol_faults`)."""


def allowed_goal_kinds(family: Family) -> tuple[str, ...]:
    """Return the kinds of goals that a family may use in any pack."""
    return (*FAMILIES[family].goal_kinds, *EXTRA_GOAL_KINDS.get(family, ()))


def register_family(name: str, spec: FamilySpec) -> None:
    """Add a custom family to `FAMILIES`, in this process only; its goals must be of the existing kinds.

    Raises SettingError for a name that is taken or is not two capital letters, and for an unknown kind of goal.
    """
    if not re.fullmatch(r"[A-Z]{2}", name):
        raise SettingError(f"Family {name!r}: a family is named by two capital letters, as {', '.join(FAMILIES)} are.")
    if FAMILIES.get(name, spec) != spec:
        raise SettingError(f"Family {name!r} is {FAMILIES[name].name!r} already. Choose another name.")
    known = [kind.model_fields["kind"].default for kind in get_args(get_args(Goal)[0])]
    for kind in spec.goal_kinds:
        if kind not in known:
            hint = did_you_mean(kind, known)
            raise SettingError(f"Family {name!r}: goal kind {kind!r} does not exist.{hint} Known: {', '.join(known)}.")
    FAMILIES[name] = spec


def parse_families(names: Iterable[str]) -> tuple[Family, ...]:
    """Return the families of these names in the table's order; a name may list several, as in "PG,sm".

    Raises SettingError for a name that is not a family.
    """
    wanted = {word.strip().upper() for name in names for word in name.split(",")}
    for word in sorted(wanted - FAMILIES.keys()):
        hint = did_you_mean(word, FAMILIES)
        raise SettingError(f"Family {word!r} does not exist.{hint} The families: {', '.join(FAMILIES)}.")
    return tuple(family for family in FAMILIES if family in wanted)


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class HouseRef(_Model):
    """A house by name, pinned by the SHA-256 of its canonical JSON."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")


class Provenance(_Model):
    """Origin of an episode, and its validation and review."""

    author: str = ""
    template: str = ""
    """Name of the authoring template, e.g. `reveal_pick` (SM) or `interlock` (CR)."""
    seed: int | None = None
    validated: bool = False
    solution_steps: int | None = None
    reviewed: Literal["approved", "rejected"] | None = None
    notes: str = ""


class Episode(_Model):
    """One task in one house; everything but `instruction` is hidden from the agent."""

    id: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,199}$")
    family: Family
    house: HouseRef
    start: Pose
    setup: Setup = Field(default_factory=Setup)
    instruction: str = Field(min_length=1, max_length=MAX_INSTRUCTION_CHARS)
    goal: Goal
    bindings: dict[str, str] = Field(default_factory=dict)
    """Role (target, receptacle, obstacle ...) -> object id."""
    max_steps: int = Field(ge=1, le=1000)
    max_invalid: int = Field(ge=0, le=1000)
    target_size: TargetSize | None = None
    provenance: Provenance = Field(default_factory=Provenance)

    @model_validator(mode="after")
    def _fits_family(self) -> "Episode":
        kinds = (*allowed_goal_kinds(self.family), *SUITE_GOAL_KINDS.get(self.family, ()))
        if self.goal.kind not in kinds:
            raise ValueError(f"family {self.family} asks for a goal of kind {' or '.join(kinds)}, not {self.goal.kind}")
        if (self.family == "CR") != (self.goal.constraint is not None):
            raise ValueError("a goal has a constraint in family CR, and only there")
        if (self.family == "SM") != bool(self.goal.chain):
            raise ValueError("a goal has a chain in family SM, and only there")
        return self

    @model_validator(mode="after")
    def _is_within_bounds(self) -> "Episode":
        x, y, z = self.start.position
        if abs(y) > MAX_FLOOR_M:
            raise ValueError(f"start.position.y is {y:g} m; the agent starts on the floor, at height 0")
        if not HORIZON_UP_DEG <= self.start.horizon <= HORIZON_DOWN_DEG:
            raise ValueError(
                f"start.horizon is {self.start.horizon:g} degrees; the camera turns from {HORIZON_UP_DEG:g} "
                f"to {HORIZON_DOWN_DEG:g}"
            )
        places: dict[str, Sequence[float]] = {"start.position": (x, z)}
        turns: dict[str, Sequence[float]] = {"start.rotation": (self.start.rotation,)}
        for object_id, change in self.setup.objects.items():
            if change.placement is not None:
                places[f"setup.objects.{object_id}.placement.position"] = change.placement.position
                turns[f"setup.objects.{object_id}.placement.rotation"] = change.placement.rotation
        for place, numbers in places.items():
            if max(map(abs, numbers)) > MAX_COORDINATE_M:
                raise ValueError(
                    f"{place} is {_format_numbers(numbers)}; no house reaches further than {MAX_COORDINATE_M:g} m"
                )
        for place, numbers in turns.items():
            if max(map(abs, numbers)) > MAX_TURN_DEG:
                raise ValueError(f"{place} is {_format_numbers(numbers)} degrees; no turn is beyond {MAX_TURN_DEG:g}")
        return self

    def bound_ids(self) -> list[str]:
        """Return the ids of all objects whose hidden state is recorded at every step, sorted."""
        held = {self.setup.held} if self.setup.held else set()
        return sorted({*self.bindings.values(), *self.goal.ids(), *held})


def _format_numbers(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:g}" for number in numbers)


class Solution(_Model):
    """A recorded sequence of actions, the closing report included, that solves an episode."""

    episode_id: str
    actions: tuple[Action, ...]
