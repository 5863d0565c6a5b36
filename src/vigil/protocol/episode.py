"""Episodes: the task, the house and the budgets. Source: `protocol.md` section 4."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field, model_validator

from vigil.base.geometry import Pose
from vigil.base.models import FrozenModel
from vigil.base.numbered_list import read_list
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG, Action
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import TargetSize
from vigil.protocol.goals import Chores, Goal
from vigil.protocol.world import Setup

MAX_INSTRUCTION_CHARS = 2000
MAX_FLOOR_M = 0.01
"""Maximum height (m) of an agent's start position above or below the floor, which is at height 0."""
MAX_COORDINATE_M = 200.0
"""Maximum coordinate (m) in an episode; the largest houses are about 50 m long."""
MAX_TURN_DEG = 360.0
"""Maximum rotation (deg) in an episode. A larger rotation is probably a typo and is refused."""


class HouseRef(FrozenModel):
    """Name of a house, with the SHA-256 of its canonical JSON, so that no other version of the house can be used."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")


class Provenance(FrozenModel):
    """Origin of an episode, and the results of its validation and review."""

    author: str = ""
    template: str = ""
    """Name of the authoring template that drafted the episode, e.g. `reveal_pick` (SM) or `interlock` (CR)."""
    seed: int | None = None
    validated: bool = False
    solution_steps: int | None = None
    reviewed: Literal["approved", "rejected"] | None = None
    notes: str = ""


class Episode(FrozenModel):
    """One task in one house; everything except `instruction` is hidden from the agent."""

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
        spec = FAMILIES[self.family]
        kinds = (*spec.allowed_goal_kinds, *spec.suite_goal_kinds)
        if self.goal.kind not in kinds:
            raise ValueError(f"family {self.family} needs a goal of kind {' or '.join(kinds)}, not {self.goal.kind}")
        if isinstance(self.goal, Chores) and len(read_list(self.instruction)) != len(self.goal.chores):
            raise ValueError(
                "the instruction of a list of chores has one numbered line for each chore, below its opening"
            )
        if (self.family == "CR") != (self.goal.constraint is not None):
            raise ValueError("a goal must have a constraint in family CR, and must not have one in any other family")
        if (self.family == "SM") != bool(self.goal.chain):
            raise ValueError("a goal must have a chain in family SM, and must not have one in any other family")
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
                raise ValueError(f"{place} is {_format_numbers(numbers)} degrees; the limit is {MAX_TURN_DEG:g}")
        return self

    def bound_ids(self) -> list[str]:
        """Return the ids of all objects whose hidden state is recorded at every step, sorted."""
        held: set[str] = {self.setup.held} if self.setup.held else set()
        return sorted({*self.bindings.values(), *self.goal.ids(), *held})


def _format_numbers(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:g}" for number in numbers)


class Solution(FrozenModel):
    """A recorded sequence of actions that solves an episode. The last action is the closing report."""

    episode_id: str
    actions: tuple[Action, ...]
