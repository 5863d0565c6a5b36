"""Replies: parses an agent's raw text into an action, or the reason why it is not an action.

The grammar is strict, and invalid replies are not repaired. Under the reply policy `lenient` more texts count as
actions; the policy is part of the identity of a run. Words of a closed vocabulary (skill, mode, direction, intent,
status) are stripped and case-folded; only intents have aliases. No reply raises an exception, whatever its bytes.
Source: `protocol.md` section 2.3.
"""

import hashlib
import math
import re
from dataclasses import dataclass
from typing import Any, Literal, cast

from vigil.base.json_files import is_object
from vigil.protocol.actions import (
    INTENT_ALIASES,
    INTENTS,
    SKILLS,
    STATUSES,
    Action,
    Argument,
    Coordinates,
    Intent,
    InteractPixel,
    InvalidAction,
    Look,
    Navigate,
    ParsedReply,
    Reply,
    ReplyCut,
    ReplyPolicy,
    Report,
)
from vigil.protocol.finish_reasons import hit_token_limit
from vigil.protocol.json_text import JsonFault, decode
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import CLOSING_MARKERS, is_unclosed, split_reasoning

MAX_REPLY_BYTES = 64 * 1024
"""Maximum size of the answer in bytes: everything in the reply except the reasoning, including white space."""
RECORDED_ANSWER_BYTES = 2 * MAX_REPLY_BYTES
"""Number of bytes stored of a reply whose answer is too long to be valid. They begin where the reasoning ends."""
RECORDED_REASONING_BYTES = 1024 * 1024
"""Number of bytes stored of a reply whose reasoning alone is too long. They are the last bytes of the reply."""
MAX_LENIENT_TRIES = 64
_STANDARD = Profile()

_BRACE = re.compile(r"[{}]")
_FENCE = re.compile(r"```[A-Za-z0-9_+-]*[ \t]*\r?\n?(.*?)```", re.DOTALL)
_REPLY_KEYS = ("skill_name", "arguments", "thought", "cognitive_state")


class _Fault(Exception):
    """The reason why a text is not an action; never raised outside this module."""

    def __init__(self, kind: Literal["protocol_failure", "malformed_action"], reason: str, detail: str = "") -> None:
        super().__init__(reason)
        self.kind: Literal["protocol_failure", "malformed_action"] = kind
        self.reason = reason
        self.detail = detail


@dataclass(frozen=True, slots=True)
class ReadReply:
    """A reply, separated into its parts."""

    answer: str
    """Text of the reply without the reasoning before it."""
    parsed: ParsedReply | InvalidAction
    """The action in the answer, or the reason why the answer is not an action."""

    @property
    def action(self) -> Action | None:
        """The action; None if the reply is invalid."""
        return self.parsed.action if isinstance(self.parsed, ParsedReply) else None

    @property
    def invalid(self) -> InvalidAction | None:
        """The reason why the reply is not an action; None if the reply is an action."""
        return self.parsed if isinstance(self.parsed, InvalidAction) else None

    @property
    def ignored_keys(self) -> tuple[str, ...]:
        """Keys of the answer that have no meaning."""
        return self.parsed.ignored_keys if isinstance(self.parsed, ParsedReply) else ()


def read_reply(reply: Reply, profile: Profile = _STANDARD) -> ReadReply:
    """Return the answer in a reply, with the action that it means. Facts from the provider (a rejection, the finish
    reason) can make the reply invalid."""
    answer = split_reasoning(reply.text)[0]
    return ReadReply(answer, _meaning(reply, answer, profile))


def _meaning(reply: Reply, answer: str, profile: Profile) -> ParsedReply | InvalidAction:
    if reply.provider_rejected:
        return InvalidAction(kind="protocol_failure", reason="provider_rejected")
    if reply.agent_ended:
        return InvalidAction(kind="protocol_failure", reason="agent_ended", detail=reply.agent_ended)
    if not reply.is_utf8:
        return InvalidAction(kind="protocol_failure", reason="not_utf8")
    if reply.cut is not None and reply.cut.answer_bytes > MAX_REPLY_BYTES:
        return _invalid(_too_long(reply.cut.answer_bytes))
    parsed = _parse_answer(answer, profile.coordinates, profile.reply_policy)
    if isinstance(parsed, InvalidAction) and parsed.reason == "empty":
        parsed = parsed.model_copy(update={"detail": _describe_empty(reply)})
    if hit_token_limit(reply.finish_reason) and isinstance(parsed, InvalidAction) and parsed.kind == "protocol_failure":
        return parsed.model_copy(update={"reason": "truncated", "detail": f"{parsed.reason} {parsed.detail}".strip()})
    return parsed


def _describe_empty(reply: Reply) -> str:
    """Return a description of what the server sent instead of an answer; empty if it sent nothing."""
    if reply.tool_call is not None:
        return f"the server sent a tool call ({_quoted(reply.tool_call)}) in the place of text"
    if reply.reasoning_chars:
        return f"all {reply.reasoning_chars} characters came as reasoning, and no answer followed"
    return ""


def parse_text(
    text: str | bytes, coordinates: Coordinates = "pixel", policy: ReplyPolicy = "strict"
) -> ParsedReply | InvalidAction:
    """Return the action in a raw reply, or the reason why there is no action. Never raises an exception."""
    try:
        whole = text.decode("utf-8") if isinstance(text, bytes) else text
        whole.encode("utf-8")  # the reasoning too: a string may hold lone surrogates, which UTF-8 cannot encode
    except UnicodeError:
        return InvalidAction(kind="protocol_failure", reason="not_utf8")
    return _parse_answer(split_reasoning(whole)[0], coordinates, policy)


def _parse_answer(answer: str, coordinates: Coordinates, policy: ReplyPolicy) -> ParsedReply | InvalidAction:
    size, answer = len(answer.encode("utf-8")), answer.strip()
    if size > MAX_REPLY_BYTES:
        return _invalid(_too_long(size))
    try:
        return _action_of(_only_object(answer), coordinates)
    except _Fault as fault:
        loose = _parse_leniently(answer, coordinates) if fault.kind == "protocol_failure" else None
        if loose is not None and policy == "lenient":
            return loose
        return _invalid(fault, would_parse_leniently=isinstance(loose, ParsedReply))


def _too_long(size: int) -> _Fault:
    return _Fault("protocol_failure", "too_long", f"{size} bytes, more than {MAX_REPLY_BYTES}")


def _invalid(fault: _Fault, *, would_parse_leniently: bool = False) -> InvalidAction:
    return InvalidAction(
        kind=fault.kind,
        reason=fault.reason,
        detail=fault.detail,
        would_parse_leniently=would_parse_leniently,
    )


# --- from the text to the object --------------------------------------------------------------------------------------


def _decode(text: str, start: int = 0) -> tuple[Any, int]:
    """Return the JSON value that begins at `start`, and the position where the value ends. Raises _Fault."""
    try:
        return decode(text, start)
    except JsonFault as fault:
        reason = _not_json_reason(text) if fault.reason == "not_json" else fault.reason
        raise _Fault("protocol_failure", reason, fault.detail) from None


def _only_object(answer: str) -> dict[str, Any]:
    value, end = _decode(answer)
    rest = answer[end:].lstrip()
    if rest:
        raise _Fault("protocol_failure", "several_objects" if rest.startswith("{") else "text_around_object")
    if not is_object(value):
        raise _Fault("protocol_failure", "not_an_object", type(value).__name__)
    for key in ("skill_name", "arguments"):
        if key not in value:
            raise _Fault("protocol_failure", "missing_key", key)
    return value


def _not_json_reason(text: str) -> str:
    if not text:
        return "empty"
    if text.startswith("{"):
        return "not_json"
    if is_unclosed(text):
        return "unclosed_reasoning"
    if text.startswith("```"):
        return "code_fence"
    return "text_around_object" if "{" in text else "no_object"


def _parse_leniently(answer: str, coordinates: Coordinates) -> ParsedReply | InvalidAction | None:
    """Return the action of the JSON object in a code fence or in prose; None unless there is exactly one object."""
    fences = _FENCE.findall(answer)
    found = _objects_in(fences[0] if len(fences) == 1 else answer)
    if len(found) != 1:
        return None
    try:
        return _action_of(found[0], coordinates)
    except _Fault as fault:
        return _invalid(fault)


def _objects_in(text: str) -> list[dict[str, Any]]:
    """Return the outermost JSON objects in the text that have both required keys.

    Return [] if the text is a list of objects or has an unclosed object, because it is then unclear which object is the
    answer.
    """
    found: list[dict[str, Any]] = []
    if _is_list(text):
        return []
    start = text.find("{")
    for _ in range(MAX_LENIENT_TRIES):
        if start < 0:
            return found
        try:
            value, end = _decode(text, start)
        except _Fault:
            end = _past_brace(text, start)
            if end < 0:
                return []
        else:
            if {"skill_name", "arguments"} <= value.keys():
                found.append(value)
        start = text.find("{", end)
    return []


def _is_list(text: str) -> bool:
    """Whether the text begins with a JSON list that contains objects."""
    text = text.strip()
    try:
        value, end = _decode(text)
    except _Fault:
        return False
    return isinstance(value, list) and "{" in text[:end]


def _past_brace(text: str, start: int) -> int:
    """Return the position after the brace that closes the brace at `start`; -1 if no brace closes it."""
    depth = 0
    for brace in _BRACE.finditer(text, start):
        depth += 1 if brace[0] == "{" else -1
        if depth == 0:
            return brace.end()
    return -1


# --- from the object to the action ------------------------------------------------------------------------------------


def _action_of(fields: dict[str, Any], coordinates: Coordinates) -> ParsedReply:
    name, given = fields["skill_name"], fields["arguments"]
    skill = _fold(name) if isinstance(name, str) else None
    if skill not in SKILLS:
        raise _Fault("malformed_action", "unknown_skill", _quoted(name))
    if not is_object(given):
        raise _Fault("malformed_action", "arguments_not_an_object", type(given).__name__)
    action = _BUILDERS[skill](given, coordinates)
    wanted = {argument.name for argument in SKILLS[skill]}
    if isinstance(action, InteractPixel) and action.intent == "drop":
        wanted = {"intent"}
    ignored = [key for key in fields if key not in _REPLY_KEYS]
    ignored += [f"arguments.{key}" for key in given if key not in wanted]
    return ParsedReply(
        action=action,
        thought=fields.get("thought"),
        cognitive_state=fields.get("cognitive_state"),
        ignored_keys=tuple(ignored),
    )


def _navigate(given: dict[str, Any], _: Coordinates) -> Navigate:
    mode, magnitude = SKILLS["navigate"]
    return Navigate(mode=cast(Any, _enum(mode, given)), magnitude=_number(magnitude, given))


def _look(given: dict[str, Any], _: Coordinates) -> Look:
    direction, magnitude = SKILLS["look"]
    return Look(direction=cast(Any, _enum(direction, given)), magnitude=_number(magnitude, given))


def _interact(given: dict[str, Any], coordinates: Coordinates) -> InteractPixel:
    intent_argument, x, y = SKILLS["interact_pixel"]
    word = _fold(_string(intent_argument, given))
    intent = cast(Intent, INTENT_ALIASES.get(word, word))
    if intent not in INTENTS:
        raise _Fault("malformed_action", "not_in_vocabulary", f"intent: {_quoted(word)}")
    if not INTENTS[intent].needs_pixel:
        return InteractPixel(intent=intent)
    return InteractPixel(
        intent=intent,
        x=_pixel(x, given, FRAME_WIDTH, coordinates),
        y=_pixel(y, given, FRAME_HEIGHT, coordinates),
    )


def _report(given: dict[str, Any], _: Coordinates) -> Report:
    status_argument, summary_argument = SKILLS["report"]
    raw = _string(status_argument, given)
    summary = _string(summary_argument, given)
    status = _fold(raw)
    if status in STATUSES:
        return Report(status=status, summary=summary)
    return Report(status="invalid", summary=summary, raw_status=raw)


_BUILDERS = {"navigate": _navigate, "look": _look, "interact_pixel": _interact, "report": _report}


def _value(argument: Argument, given: dict[str, Any]) -> Any:
    if argument.name not in given:
        raise _Fault("malformed_action", "missing_argument", argument.name)
    return given[argument.name]


def _string(argument: Argument, given: dict[str, Any]) -> str:
    value = _value(argument, given)
    if not isinstance(value, str):
        raise _ill_typed(argument, value)
    return value


def _enum(argument: Argument, given: dict[str, Any]) -> str:
    word = _fold(_string(argument, given))
    if word not in argument.values:
        raise _Fault("malformed_action", "not_in_vocabulary", f"{argument.name}: {_quoted(word)}")
    return word


def _number(argument: Argument, given: dict[str, Any]) -> float:
    value = _value(argument, given)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _ill_typed(argument, value)
    if not math.isfinite(value) or value <= 0:
        raise _Fault("malformed_action", "out_of_range", f"{argument.name}: {_quoted(value)}")
    return float(value)


def _pixel(argument: Argument, given: dict[str, Any], size: int, coordinates: Coordinates) -> int:
    value = _value(argument, given)
    if isinstance(value, bool) or not isinstance(value, int | float) or (math.isfinite(value) and value % 1):
        raise _ill_typed(argument, value)
    highest = size - 1 if coordinates == "pixel" else 1000
    if not 0 <= value <= highest:
        raise _Fault("malformed_action", "pixel_outside_frame", f"{argument.name}: {_quoted(value)}")
    whole = int(value)
    return whole if coordinates == "pixel" else min(size - 1, whole * size // 1000)


def _ill_typed(argument: Argument, value: Any) -> _Fault:
    return _Fault("malformed_action", "ill_typed", f"{argument.name}: {type(value).__name__}")


def looks_like_other_coordinates(invalid: InvalidAction) -> bool:
    """Whether an invalid action has fractions as coordinates, or a pixel outside the frame. The agent may then use
    another coordinate mode.
    """
    is_fraction = invalid.reason == "ill_typed" and invalid.detail in ("x: float", "y: float")
    return is_fraction or invalid.reason == "pixel_outside_frame"


def _fold(word: str) -> str:
    return word.strip().casefold()


def _quoted(value: Any) -> str:
    return ascii(value)[:80] if isinstance(value, str | int | float) else type(value).__name__


def truncate_for_record(reply: Reply, answer: str) -> Reply:
    """Return `reply` as a record stores it: whole, or with `cut` set if it is far longer than any valid answer.

    `answer` is the reply's text without reasoning. The agent's action was parsed from the whole reply. The stored part
    still parses to the same result, because the record also has the length of the whole answer, and the part includes
    the closing marker of any reasoning.
    """
    raw = reply.raw
    if len(raw) <= RECORDED_ANSWER_BYTES:
        return reply
    answer_bytes = len(answer.encode()) if reply.is_utf8 else len(raw)
    cut = reply.cut or ReplyCut(text_bytes=len(raw), answer_bytes=answer_bytes, sha256=hashlib.sha256(raw).hexdigest())
    if cut.answer_bytes > MAX_REPLY_BYTES:
        reasoning = reply.text[: len(reply.text) - len(answer)] if reply.is_utf8 else ""
        marker = next((marker for marker in CLOSING_MARKERS if reasoning.endswith(marker)), "")
        start = len(reasoning.removesuffix(marker).encode()) if marker else 0
        part = raw[start : start + RECORDED_ANSWER_BYTES]
    elif len(raw) <= RECORDED_REASONING_BYTES:
        return reply
    else:
        part = raw[-RECORDED_REASONING_BYTES:]
    text: str | bytes = part.decode("utf-8", "ignore") if reply.is_utf8 else part
    facts = reply.model_dump(exclude={"text", "raw_base64"})
    return Reply.model_validate({**facts, "text": text, "cut": cut, "reasoning": reply.reasoning})
