"""Goals: what must be true in the hidden world for an episode to count as completed.

Pure functions of records; nothing here knows how an episode ended or what was reported
(`vigil.scoring` does). Source: `protocol.md` section 4, "Observability" and "Goals".
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

NEAR_M = 1.5
"""Distance threshold of `agent_near_target`, and the reach that progress is measured to."""


class Constraint(BaseModel):
    """What a constraint-resolving episode asks for besides its goal."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: Literal["object_open", "object_closed", "object_on", "object_off", "object_moved", "object_released"]
    """`object_moved`: taken up, or away from its place at reset by `distance_m` or more in the floor
    plane. `object_released`: no longer in the hand (the hand was emptied)."""
    object_id: str
    latched: bool
    """True for an event (met once is met), false for a state (must be so at closure)."""
    distance_m: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _moved_has_distance(self) -> "Constraint":
        if (self.kind == "object_moved") != (self.distance_m is not None):
            raise ValueError("`distance_m` belongs to `object_moved`, and `object_moved` needs it")
        return self


class _Goal(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    object_id: str
    """The target."""
    constraint: Constraint | None = None
    """CR only: must be resolved too."""
    chain: tuple["Link", ...] = ()
    """SM only: the ordered sub-conditions before the final one; they count for progress alone."""

    def ids(self) -> set[str]:
        """Returns the ids of all objects that the goal, its constraint and its chain name."""
        own = {self.object_id} | ({self.constraint.object_id} if self.constraint else set())
        return own.union(*(link.ids() for link in self.chain))


class TargetGrounded(_Goal):
    """The last `ground` click is on the target."""

    kind: Literal["target_grounded"] = "target_grounded"


class AgentNearTarget(_Goal):
    """The agent's body is less than `threshold_m` from the target's box, in the floor plane."""

    kind: Literal["agent_near_target"] = "agent_near_target"
    threshold_m: float = Field(default=NEAR_M, gt=0, allow_inf_nan=False)


class ObjectInState(_Goal):
    """The target is seen (latched), open or closed, on or off."""

    kind: Literal["object_state"] = "object_state"
    state: Literal["is_visible", "is_open", "is_toggled"]
    value: bool = True

    @model_validator(mode="after")
    def _seen_is_true(self) -> "ObjectInState":
        if self.state == "is_visible" and not self.value:
            raise ValueError("a goal can ask that something is seen, not that it is not")
        return self


class ObjectHeld(_Goal):
    """The target is in the hand."""

    kind: Literal["object_held"] = "object_held"


class ObjectAtReceptacle(_Goal):
    """The target lies in or on the receptacle."""

    kind: Literal["object_at_receptacle"] = "object_at_receptacle"
    receptacle_id: str

    def ids(self) -> set[str]:
        """Returns the ids of all objects that the goal, its constraint and its chain name."""
        return super().ids() | {self.receptacle_id}


class ReportStatus(_Goal):
    """The state of the target is observable when the episode is closed; the label is for the report."""

    kind: Literal["report_status"] = "report_status"
    state: Literal["is_open", "is_toggled"]


Link = Annotated[ObjectInState | ObjectHeld | ObjectAtReceptacle, Field(discriminator="kind")]
Goal = Annotated[
    TargetGrounded | AgentNearTarget | ObjectInState | ObjectHeld | ObjectAtReceptacle | ReportStatus,
    Field(discriminator="kind"),
]
for _variant in (TargetGrounded, AgentNearTarget, ObjectInState, ObjectHeld, ObjectAtReceptacle, ReportStatus):
    _variant.model_rebuild()
