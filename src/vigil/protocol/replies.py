"""Replies: parses an agent's raw text into an action, or the reason why it is not an action.

The grammar is strict, and invalid replies are not repaired. Under the reply policy `lenient` more texts count as
actions; the policy is part of the identity of a run. Words of a closed vocabulary (skill, mode, direction, intent,
status) are stripped and case-folded; only intents have aliases. No reply raises an exception, whatever its bytes.
Source: `protocol.md` section 2.3.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar, cast

from vigil.base.json_files import is_object
from vigil.base.json_text import JsonFault, decode
from vigil.protocol.actions import (
    INTENT_ALIASES,
    INTENTS,
    SKILLS,
    STATUSES,
    AnyAction,
    Argument,
    Coordinates,
    Intent,
    InteractPixel,
    InvalidAction,
    Look,
    Navigate,
    ParsedReply,
    Reply,
    ReplyFault,
    ReplyPolicy,
    Report,
    Stop,
    skills_of,
)
from vigil.protocol.claims import ARGUMENT as CLAIMS_ARGUMENT
from vigil.protocol.claims import with_claims
from vigil.protocol.finish_reasons import hit_token_limit
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import BASELINE, ITEMISED_REPORT, Profile
from vigil.protocol.reasoning import is_unclosed, split_reasoning

MAX_REPLY_BYTES = 64 * 1024
"""Maximum size of the answer in bytes: everything in the reply except the reasoning, including white space."""
MAX_LENIENT_TRIES = 64
_STANDARD = Profile()

_BRACE = re.compile(r"[{}]")
_FENCE = re.compile(r"```[A-Za-z0-9_+-]*[ \t]*\r?\n?(.*?)```", re.DOTALL)
_REPLY_KEYS = ("skill_name", "arguments", "thought", "cognitive_state")
_Read = TypeVar("_Read")


@dataclass(frozen=True, slots=True)
class _Form(Generic[_Read]):
    """The form of an answer, which is one JSON object: its required keys, and how its fields are read."""

    keys: tuple[str, ...]
    """Keys that the object must have."""
    build: Callable[[dict[str, Any]], _Read]
    """Function that reads the object's fields. Raises ReplyFault."""


@dataclass(frozen=True, slots=True)
class ReadReply:
    """A reply after reading: the answer without the reasoning before it, and the action that the answer states."""

    answer: str
    """Text of the reply without the reasoning before it."""
    parsed: ParsedReply | InvalidAction
    """The action in the answer, or the reason why the answer is not an action."""

    @property
    def action(self) -> AnyAction | None:
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
    """Return the answer in a reply, and the action that the answer states. Facts from the provider (a rejection, the
    finish reason) can make the reply invalid."""
    answer = split_reasoning(reply.text)[0]
    return ReadReply(answer, _meaning(reply, answer, _action_form(profile), profile.reply_policy))


def read_object(
    reply: Reply, keys: tuple[str, ...], build: Callable[[dict[str, Any]], _Read], policy: ReplyPolicy
) -> _Read | InvalidAction:
    """Return what `build` reads in the one JSON object of a reply, or why that object is missing or wrong.

    This is for questions that do not ask for an action; it is as strict as `read_reply`. `keys` are required.
    """
    return _meaning(reply, split_reasoning(reply.text)[0], _Form(keys, build), policy)


def _meaning(reply: Reply, answer: str, form: _Form[_Read], policy: ReplyPolicy) -> _Read | InvalidAction:
    if reply.provider_rejected:
        return InvalidAction(kind="protocol_failure", reason="provider_rejected")
    if reply.agent_ended:
        return InvalidAction(kind="protocol_failure", reason="agent_ended", detail=reply.agent_ended)
    if not reply.is_utf8:
        return InvalidAction(kind="protocol_failure", reason="not_utf8")
    if reply.cut is not None and reply.cut.answer_bytes > MAX_REPLY_BYTES:
        return _too_long(reply.cut.answer_bytes)
    parsed = _parse_answer(answer, form, policy)
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
    text: str | bytes, coordinates: Coordinates = "pixel", policy: ReplyPolicy = "strict", *, has_claims: bool = False
) -> ParsedReply | InvalidAction:
    """Return the action in a raw reply, or the reason why there is no action. Never raises an exception."""
    try:
        whole = text.decode("utf-8") if isinstance(text, bytes) else text
        whole.encode("utf-8")  # the reasoning too: a string may hold lone surrogates, which UTF-8 cannot encode
    except UnicodeError:
        return InvalidAction(kind="protocol_failure", reason="not_utf8")
    profile = Profile(name=ITEMISED_REPORT if has_claims else BASELINE, coordinates=coordinates)
    return _parse_answer(split_reasoning(whole)[0], _action_form(profile), policy)


def _action_form(profile: Profile) -> _Form[ParsedReply]:
    return _Form(("skill_name", "arguments"), partial(_action_of, profile=profile))


def _parse_answer(answer: str, form: _Form[_Read], policy: ReplyPolicy) -> _Read | InvalidAction:
    size, answer = len(answer.encode("utf-8")), answer.strip()
    if size > MAX_REPLY_BYTES:
        return _too_long(size)
    try:
        return form.build(_only_object(answer, form.keys))
    except ReplyFault as fault:
        loose = _parse_leniently(answer, form) if fault.invalid.kind == "protocol_failure" else None
        if loose is not None and policy == "lenient":
            return loose
        is_loose = loose is not None and not isinstance(loose, InvalidAction)
        return fault.invalid.model_copy(update={"would_parse_leniently": is_loose})


def _too_long(size: int) -> InvalidAction:
    detail = f"{size} bytes, more than {MAX_REPLY_BYTES}"
    return InvalidAction(kind="protocol_failure", reason="too_long", detail=detail)


# --- from the text to the object --------------------------------------------------------------------------------------


def _decode(text: str, start: int = 0) -> tuple[Any, int]:
    """Return the JSON value that begins at `start`, and where it ends. Raises ReplyFault."""
    try:
        return decode(text, start)
    except JsonFault as fault:
        reason = _not_json_reason(text) if fault.reason == "not_json" else fault.reason
        raise ReplyFault("protocol_failure", reason, fault.detail) from None


def _only_object(answer: str, keys: tuple[str, ...]) -> dict[str, Any]:
    value, end = _decode(answer)
    rest = answer[end:].lstrip()
    if rest:
        raise ReplyFault("protocol_failure", "several_objects" if rest.startswith("{") else "text_around_object")
    if not is_object(value):
        raise ReplyFault("protocol_failure", "not_an_object", type(value).__name__)
    for key in keys:
        if key not in value:
            raise ReplyFault("protocol_failure", "missing_key", key)
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


def _parse_leniently(answer: str, form: _Form[_Read]) -> _Read | InvalidAction | None:
    """Return what `form` reads in the JSON object in a code fence or in prose; None unless there is one such object."""
    fences = _FENCE.findall(answer)
    found = _objects_in(fences[0] if len(fences) == 1 else answer, form.keys)
    if len(found) != 1:
        return None
    try:
        return form.build(found[0])
    except ReplyFault as fault:
        return fault.invalid


def _objects_in(text: str, keys: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the outermost objects with all required keys; [] if they may be in a list or an unclosed object."""
    found: list[dict[str, Any]] = []
    if _is_list(text):
        return []
    start = text.find("{")
    for _ in range(MAX_LENIENT_TRIES):
        if start < 0:
            return found
        try:
            value, end = _decode(text, start)
        except ReplyFault:
            end = _past_brace(text, start)
            if end < 0:
                return []
        else:
            if set(keys) <= value.keys():
                found.append(value)
        start = text.find("{", end)
    return []


def _is_list(text: str) -> bool:
    """Return whether the text begins with a JSON list that contains objects."""
    text = text.strip()
    try:
        value, end = _decode(text)
    except ReplyFault:
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


def _action_of(fields: dict[str, Any], profile: Profile) -> ParsedReply:
    name, given = fields["skill_name"], fields["arguments"]
    skill = _fold(name) if isinstance(name, str) else None
    skills = skills_of(has_report=profile.row.has_report, has_pixels=profile.row.has_pixels)
    if skill not in skills:
        raise ReplyFault("malformed_action", "unknown_skill", _quoted(name))
    if not is_object(given):
        raise ReplyFault("malformed_action", "arguments_not_an_object", type(given).__name__)
    action = _BUILDERS[skill](given, profile.coordinates)
    wanted = {argument.name for argument in skills[skill]}
    if profile.has_claims and isinstance(action, Report):
        action, wanted = with_claims(action, given), {*wanted, CLAIMS_ARGUMENT}
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
    intent, (_, x, y) = _intent(given), SKILLS["interact_pixel"]
    if not INTENTS[intent].needs_pixel:
        return InteractPixel(intent=intent)
    return InteractPixel(
        intent=intent, x=_pixel(x, given, FRAME_WIDTH, coordinates), y=_pixel(y, given, FRAME_HEIGHT, coordinates)
    )


def _interact_named(given: dict[str, Any], _: Coordinates) -> InteractPixel:
    intent, name = _intent(given), skills_of(has_pixels=False)["interact_object"][1]
    return InteractPixel(intent=intent, object=_string(name, given) if INTENTS[intent].needs_pixel else None)


def _intent(given: dict[str, Any]) -> Intent:
    intent_argument = SKILLS["interact_pixel"][0]
    word = _fold(_string(intent_argument, given))
    intent = cast(Intent, INTENT_ALIASES.get(word, word))
    if intent not in INTENTS:
        raise ReplyFault("malformed_action", "not_in_vocabulary", f"intent: {_quoted(word)}")
    return intent


def _report(given: dict[str, Any], _: Coordinates) -> Report:
    status_argument, summary_argument = SKILLS["report"]
    raw = _string(status_argument, given)
    summary = _string(summary_argument, given)
    status = _fold(raw)
    if status in STATUSES:
        return Report(status=status, summary=summary)
    return Report(status="invalid", summary=summary, raw_status=raw)


_BUILDERS: dict[str, Callable[[dict[str, Any], Coordinates], AnyAction]] = {
    "navigate": _navigate,
    "look": _look,
    "interact_pixel": _interact,
    "interact_object": _interact_named,
    "report": _report,
    "stop": lambda _given, _coordinates: Stop(),
}


def _value(argument: Argument, given: dict[str, Any]) -> Any:
    if argument.name not in given:
        raise ReplyFault("malformed_action", "missing_argument", argument.name)
    return given[argument.name]


def _string(argument: Argument, given: dict[str, Any]) -> str:
    value = _value(argument, given)
    if not isinstance(value, str):
        raise _ill_typed(argument, value)
    return value


def _enum(argument: Argument, given: dict[str, Any]) -> str:
    word = _fold(_string(argument, given))
    if word not in argument.values:
        raise ReplyFault("malformed_action", "not_in_vocabulary", f"{argument.name}: {_quoted(word)}")
    return word


def _number(argument: Argument, given: dict[str, Any]) -> float:
    value = _value(argument, given)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _ill_typed(argument, value)
    if not math.isfinite(value) or value <= 0:
        raise ReplyFault("malformed_action", "out_of_range", f"{argument.name}: {_quoted(value)}")
    return float(value)


def _pixel(argument: Argument, given: dict[str, Any], size: int, coordinates: Coordinates) -> int:
    value = _value(argument, given)
    if isinstance(value, bool) or not isinstance(value, int | float) or (math.isfinite(value) and value % 1):
        raise _ill_typed(argument, value)
    highest = size - 1 if coordinates == "pixel" else 1000
    if not 0 <= value <= highest:
        raise ReplyFault("malformed_action", "pixel_outside_frame", f"{argument.name}: {_quoted(value)}")
    whole = int(value)
    return whole if coordinates == "pixel" else min(size - 1, whole * size // 1000)


def _ill_typed(argument: Argument, value: Any) -> ReplyFault:
    return ReplyFault("malformed_action", "ill_typed", f"{argument.name}: {type(value).__name__}")


def looks_like_other_coordinates(invalid: InvalidAction) -> bool:
    """Return whether an invalid action has fractions as coordinates, or a pixel outside the frame. The agent may then
    be using another coordinate mode."""
    is_fraction = invalid.reason == "ill_typed" and invalid.detail in ("x: float", "y: float")
    return is_fraction or invalid.reason == "pixel_outside_frame"


def _fold(word: str) -> str:
    return word.strip().casefold()


def _quoted(value: Any) -> str:
    return ascii(value)[:80] if isinstance(value, str | int | float) else type(value).__name__
