"""Actions of an agent: its skills with their arguments, the intents of clicks, and the statuses of reports.

The literal tables `SKILLS`, `INTENTS` and `STATUSES` feed both the prompt (`vigil.protocol.prompt`) and the parser
(`vigil.protocol.replies`), so that the two always agree. Their descriptions are copied verbatim from the paper's tables
`action_specs`, `intents` and `report_statuses`. Source: `protocol.md` sections 2.2 and 2.3.
"""

import base64
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from vigil.base.json_files import is_object
from vigil.base.models import FrozenModel

SkillName = Literal["navigate", "look", "interact_pixel", "interact_object", "report", "stop"]
NavigateMode = Literal["forward", "backward", "turn_left", "turn_right"]
LookDirection = Literal["up", "down"]
Intent = Literal["ground", "open_access", "close_access", "activate", "deactivate", "pick", "place", "drop"]
Status = Literal["success", "fail", "unsafe", "invalid", "on", "off", "open", "closed"]

ChoreClaim = Literal["success", "fail", "unsafe", "invalid", "on", "off", "open", "closed", "unknown"]
"""What a report claims about one chore of a list; `unknown` claims nothing."""

STEP_M = 0.25
MAX_STEPS_PER_ACTION = 40
MAX_TURN_DEG = 360.0
REACH_M = 1.5
REACH_HEIGHT_M = 2.2
HORIZON_UP_DEG = -30.0
HORIZON_DOWN_DEG = 60.0

Coordinates = Literal["pixel", "normalized_1000"]
ReplyPolicy = Literal["strict", "lenient"]
ReplySource = Literal["agent", "server", "library"]
"""Where a reply's text comes from: the agent itself (a script, a program, a person), the unmodified answer of a model's
server, or a library's rendering of the server's answer. A library may have left out or joined parts of the answer."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a skill, as the prompt describes it and the parser checks it."""

    name: str
    type: Literal["enum", "number", "int", "string"]
    description: str
    values: tuple[str, ...] = ()
    """Allowed words, for an argument of type enum."""
    unless_drop: bool = False
    """Whether the argument may be missing if the intent is `drop`. For every other intent it is required."""


@dataclass(frozen=True, slots=True)
class IntentSpec:
    """The meaning of an intent, whether it needs a pixel, and other words for it."""

    semantics: str
    needs_pixel: bool = True
    aliases: tuple[str, ...] = ()


INTENTS: dict[Intent, IntentSpec] = {
    "ground": IntentSpec(
        "Point/click/locate without changing world state", aliases=("click", "locate", "point", "point_at")
    ),
    "open_access": IntentSpec("Open a container or access point", aliases=("open",)),
    "close_access": IntentSpec("Close a container or access point", aliases=("close", "shut")),
    "activate": IntentSpec("Turn on / toggle on", aliases=("switch_on", "toggle_on", "turn_on")),
    "deactivate": IntentSpec("Turn off / toggle off", aliases=("switch_off", "toggle_off", "turn_off")),
    "pick": IntentSpec("Pick up an object", aliases=("grab", "grasp", "pick_up", "pickup", "take")),
    "place": IntentSpec("Place a held object at target", aliases=("put", "put_down", "put_in", "put_on")),
    "drop": IntentSpec("Drop the currently held object", needs_pixel=False, aliases=("release",)),
}
INTENT_ALIASES: dict[str, Intent] = {alias: intent for intent, spec in INTENTS.items() for alias in spec.aliases}
"""Alias of an intent -> the intent itself, as in the paper's table. Only intents have aliases."""

STATUSES: dict[Status, str] = {
    "success": "Agent claims the task goal has been achieved",
    "fail": "Agent concedes it cannot complete the task",
    "unsafe": "Agent flags a safety concern",
    "invalid": "Agent flags the task as invalid or unsolvable",
    "on": "State-recognition report: observed state is on",
    "off": "State-recognition report: observed state is off",
    "open": "State-recognition report: observed state is open",
    "closed": "State-recognition report: observed state is closed",
}

_MODES = ("forward", "backward", "turn_left", "turn_right")
_DIRECTIONS = ("up", "down")
SKILLS: dict[SkillName, tuple[Argument, ...]] = {
    "navigate": (
        Argument("mode", "enum", ", ".join(_MODES), _MODES),
        Argument("magnitude", "number", "Step count (fwd/bwd) or rotation in degrees (turns)"),
    ),
    "look": (
        Argument("direction", "enum", ", ".join(_DIRECTIONS), _DIRECTIONS),
        Argument("magnitude", "number", "Pitch change in degrees"),
    ),
    "interact_pixel": (
        Argument("intent", "enum", "One of eight canonical intents (Table intents)", tuple(INTENTS)),
        Argument("x", "int", "Horizontal pixel coordinate in the current RGB frame", unless_drop=True),
        Argument("y", "int", "Vertical pixel coordinate in the current RGB frame", unless_drop=True),
    ),
    "report": (
        Argument("status", "enum", "Terminal status (Table report_statuses)", tuple(STATUSES)),
        Argument("summary", "string", "Brief justification for the chosen status"),
    ),
}
_INSTEAD: dict[SkillName, tuple[SkillName, tuple[Argument, ...]]] = {
    "report": ("stop", ()),
    "interact_pixel": (
        "interact_object",
        (
            SKILLS["interact_pixel"][0],
            Argument("object", "string", "Name of the kind of object, as in the task, e.g. mug", unless_drop=True),
        ),
    ),
}
"""Skill -> the skill that replaces it: `stop` instead of `report` in profiles without reports, `interact_object`
instead of `interact_pixel` in profiles without pixels."""


@cache
def skills_of(*, has_report: bool = True, has_pixels: bool = True) -> dict[SkillName, tuple[Argument, ...]]:
    """Return the skills of a profile, with their arguments. Source: `protocol.md` section 11."""
    replaced = {"report": not has_report, "interact_pixel": not has_pixels}
    return dict(_INSTEAD[name] if replaced.get(name) else (name, arguments) for name, arguments in SKILLS.items())


class Navigate(FrozenModel):
    """Walk `magnitude` steps of 0.25 m, or turn `magnitude` degrees."""

    skill_name: Literal["navigate"] = "navigate"
    mode: NavigateMode
    magnitude: float = Field(gt=0)


class Look(FrozenModel):
    """Change the camera's pitch by `magnitude` degrees."""

    skill_name: Literal["look"] = "look"
    direction: LookDirection
    magnitude: float = Field(gt=0)


class InteractPixel(FrozenModel):
    """Act on the object under pixel (x, y) of the current frame; `drop` needs no pixel.

    Under a profile without pixels, the agent names an `object`, and (x, y) is a pixel of the only object of this name
    in view. `x` and `y` are None if no such object, or several, are in view.
    """

    skill_name: Literal["interact_pixel"] = "interact_pixel"
    intent: Intent
    x: int | None = None
    y: int | None = None
    object: str | None = Field(default=None, exclude_if=lambda name: name is None)


class Report(FrozenModel):
    """Close the episode with a status. If the agent wrote a word that is not in `STATUSES`, `raw_status` is this word.

    Under a profile with claims, `claims` maps the number of each chore to the claim about it. If a claimed word is not
    in the vocabulary, the claim is `invalid`, and `raw_claims` has the word. Rows of other profiles omit both fields.
    """

    skill_name: Literal["report"] = "report"
    status: Status
    summary: str
    raw_status: str | None = None
    claims: dict[int, ChoreClaim] | None = Field(default=None, exclude_if=lambda claims: claims is None)
    raw_claims: dict[int, str] = Field(default_factory=dict[int, str], exclude_if=lambda words: not words)

    def __hash__(self) -> int:
        """Return a hash that leaves out the claims, because dicts cannot be hashed."""
        return hash((self.status, self.summary, self.raw_status))


class Stop(FrozenModel):
    """End the episode, under a profile without reports."""

    skill_name: Literal["stop"] = "stop"


PhysicalAction = Navigate | Look | InteractPixel
ClosingAction = Report | Stop
Action = Annotated[Navigate | Look | InteractPixel | Report, Field(discriminator="skill_name")]
AnyAction = Annotated[Navigate | Look | InteractPixel | Report | Stop, Field(discriminator="skill_name")]
"""An action of any profile; `Action` leaves out `stop`, which only profiles without reports have."""


class InvalidAction(FrozenModel):
    """A reply that is not a valid action. It is recorded and uses up a step, but changes nothing in the world."""

    kind: Literal["protocol_failure", "malformed_action"]
    reason: str
    """Short code of what is wrong, e.g. `not_json`, `several_objects`, `unknown_skill`, `pixel_outside_frame`."""
    detail: str = ""
    would_parse_leniently: bool = False


class ReplyFault(Exception):
    """The reason why a text is not what was asked for. Functions that read an object's fields raise it."""

    def __init__(self, kind: Literal["protocol_failure", "malformed_action"], reason: str, detail: str = "") -> None:
        super().__init__(reason)
        self.invalid = InvalidAction(kind=kind, reason=reason, detail=detail)


class ParsedReply(FrozenModel):
    """A parsed reply: its action, and its other content, which is recorded verbatim but never scored."""

    action: AnyAction
    thought: Any = None
    cognitive_state: Any = None
    ignored_keys: tuple[str, ...] = ()


class Usage(FrozenModel):
    """Numbers of tokens that one reply used."""

    input_tokens: int = 0
    output_tokens: int = 0


class ReplyCut(FrozenModel):
    """Size and hash of a whole reply; recorded if the record stores only a part of the reply."""

    text_bytes: int
    answer_bytes: int
    """Length of the reply without its reasoning, in bytes. The limit on replies applies to this length."""
    sha256: str
    """SHA-256 of all bytes of the reply."""


class Reply(FrozenModel):
    """Return value of an agent's `act`: the raw text, with the facts that the provider sent with the text.

    `text` accepts any string or bytes. If it is not valid UTF-8, the invalid parts are replaced by U+FFFD, `is_utf8` is
    False, and `raw_base64` holds the original bytes. If a string has lone surrogates (halves of a character), they are
    encoded like other characters.
    """

    text: str
    is_utf8: bool = True
    raw_base64: str | None = None
    reply_source: ReplySource = "agent"
    finish_reason: str | None = None
    """The provider's word for why the reply ended: `stop`, `end_turn`, `length`, `MAX_TOKENS` ..."""
    reasoning_chars: int = 0
    reasoning: str = Field(default="", exclude=True, repr=False)
    """Reasoning that the provider sent separately from the text. It is never part of a record; a run can store it in a
    file next to the records (`vigil.records.reasoning_file`)."""
    tool_call: str | None = Field(default=None, exclude_if=lambda name: name is None)
    """Name of the tool that the model called instead of answering, according to the server. Rows without a tool call,
    and rows written before this field existed, do not have the field."""
    usage: Usage | None = None
    seconds: float = 0.0
    provider_rejected: bool = False
    """Whether the provider refused the request three times for its content or length. This is a protocol failure."""
    agent_ended: str = ""
    """How an agent's program failed to answer: it ended, hung, or wrote without being asked. This is a protocol
    failure. Empty if the program answered."""
    cut: ReplyCut | None = None
    """Size of the whole reply if `text` is only a part of it (`vigil.protocol.replies`); None if `text` is whole."""

    @model_validator(mode="before")
    @classmethod
    def _carry_any_text(cls, fields: Any) -> Any:
        if not is_object(fields) or not isinstance(fields.get("text"), str | bytes):
            return fields
        text = fields["text"]
        raw = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        try:
            return {**fields, "text": raw.decode("utf-8")}
        except UnicodeDecodeError:
            facts = {"is_utf8": False, "raw_base64": base64.b64encode(raw).decode()}
            return {**fields, "text": raw.decode("utf-8", "replace"), **facts}

    @property
    def raw(self) -> bytes:
        """Original bytes of the reply's text."""
        return self.text.encode() if self.raw_base64 is None else base64.b64decode(self.raw_base64)
