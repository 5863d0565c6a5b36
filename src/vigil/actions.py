"""Skills, intents, statuses and actions: the four things that an agent can do.

Source: `protocol.md` sections 2.2 and 2.3; the paper's tables `action_specs`, `intents`, `report_statuses`.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

SkillName = Literal["navigate", "look", "interact_pixel", "report"]
NavigateMode = Literal["forward", "backward", "turn_left", "turn_right"]
LookDirection = Literal["up", "down"]
Intent = Literal["ground", "open_access", "close_access", "activate", "deactivate", "pick", "place", "drop"]
Status = Literal["success", "fail", "unsafe", "invalid", "on", "off", "open", "closed"]

STEP_M = 0.25
MAX_STEPS_PER_ACTION = 40
MAX_TURN_DEG = 360.0
REACH_M = 1.5
REACH_HEIGHT_M = 2.2
HORIZON_UP_DEG = -30.0
HORIZON_DOWN_DEG = 60.0


class _Action(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Navigate(_Action):
    """Walk `magnitude` steps of 0.25 m, or turn `magnitude` degrees."""

    skill_name: Literal["navigate"] = "navigate"
    mode: NavigateMode
    magnitude: float = Field(gt=0, allow_inf_nan=False)


class Look(_Action):
    """Change the camera's pitch by `magnitude` degrees."""

    skill_name: Literal["look"] = "look"
    direction: LookDirection
    magnitude: float = Field(gt=0, allow_inf_nan=False)


class InteractPixel(_Action):
    """Act on the object under pixel (x, y) of the current frame; `drop` needs no pixel."""

    skill_name: Literal["interact_pixel"] = "interact_pixel"
    intent: Intent
    x: int | None = None
    y: int | None = None


class Report(_Action):
    """Close the episode. `raw_status` is what the agent wrote when it is not in the vocabulary."""

    skill_name: Literal["report"] = "report"
    status: Status
    summary: str
    raw_status: str | None = None


PhysicalAction = Navigate | Look | InteractPixel
Action = Annotated[Navigate | Look | InteractPixel | Report, Field(discriminator="skill_name")]


class InvalidAction(_Action):
    """A reply that is no action: data, not an error. Uses up a step and changes nothing."""

    kind: Literal["protocol_failure", "malformed_action"]
    reason: str
    """A short code, e.g. `not_json`, `several_objects`, `unknown_skill`, `pixel_outside_frame`."""
    detail: str = ""
    would_parse_leniently: bool = False


class ParsedReply(_Action):
    """An action with what came along: kept verbatim, never scored."""

    action: Action
    thought: Any = None
    cognitive_state: Any = None
    ignored_keys: tuple[str, ...] = ()


class Usage(_Action):
    """Tokens that one reply took."""

    input_tokens: int = 0
    output_tokens: int = 0


class Reply(_Action):
    """What an agent's `act` returns: its raw text, with what the provider said about it."""

    text: str
    finish_reason: str | None = None
    reasoning_chars: int = 0
    usage: Usage | None = None
    seconds: float = 0.0
    provider_rejected: bool = False
    """The provider refused because of content or length, three times: a protocol failure."""
