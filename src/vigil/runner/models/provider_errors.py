"""The messages in error answers, found in the JSON forms of the providers, and hints on what to do about some of them.

The message may be a string under `error`, in `error.message`, in a list around either of these, in `detail`, in
`message` next to `error: true`, in a provider's special status, or in JSON within a string.
"""

import json
import re
from collections.abc import Iterator
from itertools import islice
from typing import Any

from vigil.base.json_files import is_array, is_object

MAX_CHARS = 1000
_NESTING_FIELDS = ("error", "errors", "base_resp", "response", "metadata", "status", "body", "cause", "innererror")
"""Fields whose value may be an object that contains a message. Only `error` may also hold the message as a string."""
_MESSAGE_FIELDS = ("message", "msg", "error_message", "errormessage", "error_msg", "status_msg", "error_description")
_DETAIL_FIELDS = ("detail", "details", "raw", "reason", "title", "description")
"""Fields whose texts add details to a message or repeat the message."""
_CODE_FIELDS = ("code", "type", "error_type", "status_code")
_MAX_DEPTH = 8
_MAX_MESSAGES = 20


def error_message_of(body: bytes) -> str:
    """Return the message in the body of an error answer, or the whole body if its form is unknown."""
    text = body.decode("utf-8", "replace").strip()
    return error_message_in(_json_in(text) or text)


def error_message_in(found: Any) -> str:
    """Return the messages in an error's JSON, cut to `MAX_CHARS` characters, with the error's codes in parentheses."""
    sentences: list[str] = []
    for sentence in islice(_messages(found, _MAX_DEPTH), _MAX_MESSAGES):
        if sentence and not any(sentence in before for before in sentences):
            sentences = [before for before in sentences if before not in sentence] + [sentence]
    said = " - ".join(sentences) or _as_text(found)
    codes = [code for code in dict.fromkeys(islice(_codes(found), _MAX_MESSAGES)) if code not in said]
    return said[:MAX_CHARS] + (f" ({', '.join(codes)})" if codes and sentences else "")


def _as_text(found: Any) -> str:
    """Return a text for JSON in which no message was found."""
    try:
        return found if isinstance(found, str) else json.dumps(found, ensure_ascii=False)
    except RecursionError:
        return "an error of too many levels"


def error_status_in(found: Any) -> int | None:
    """Return the HTTP status in an error's JSON; None if the JSON does not have a status."""
    codes = (one.get(name) for one in _objects(found) for name in ("code", "status", "status_code", "http_status"))
    numbers = (int(code) for code in codes if isinstance(code, int | str) and str(code).isdecimal())
    return next((number for number in numbers if 400 <= number <= 599), None)


def _messages(found: Any, depth: int) -> Iterator[str]:
    """Yield the messages in a value, at most `depth` levels deep."""
    if depth == 0:
        return
    if isinstance(found, str):
        inner = _json_in(found)
        yield from [" ".join(found.split())] if inner is None else _messages(inner, depth - 1)
    elif is_array(found):
        for one in found:
            yield from _messages(one, depth - 1)
    elif is_object(found):
        fields = {str(name).casefold(): value for name, value in found.items()}
        for name in (*_MESSAGE_FIELDS, *_NESTING_FIELDS, *_DETAIL_FIELDS):
            value = fields.get(name)
            if name not in _NESTING_FIELDS or name == "error" or isinstance(value, dict | list):
                yield from _messages(value, depth - 1)


def _codes(found: Any) -> Iterator[str]:
    """Yield the codes of an error that are words, e.g. `context_length_exceeded`."""
    codes = (one.get(name) for one in _objects(found) for name in _CODE_FIELDS)
    return (code for code in codes if isinstance(code, str) and not code.isdecimal())


def _objects(found: Any, depth: int = _MAX_DEPTH) -> Iterator[dict[str, Any]]:
    """Yield an object and those in its nesting fields, or the objects of a list, at most `depth` levels deep."""
    if is_array(found) and depth:
        for one in found:
            yield from _objects(one, depth - 1)
    elif is_object(found) and depth:
        yield found
        for name in _NESTING_FIELDS:
            yield from _objects(found.get(name), depth - 1)


def _json_in(text: str) -> Any:
    """Return the object or list in a JSON text; None for any other text."""
    if not text.lstrip().startswith(("{", "[")):
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return found if is_object(found) or is_array(found) else None


FIND_COORDINATES = "`vigil calibrate --model NAME` finds the model's coordinates: give them with --coordinates."
HINTS: tuple[tuple[str, str], ...] = (
    (
        r"(images?|vision|multimodal)\b.{0,40}(not supported|unsupported|not allowed|only supported by certain)|"
        r"(not|n.t) (support|accept|take)s?\b.{0,40}(image|vision|multimodal)|not a multimodal|only supports? text|"
        r"support image input|image_url is only supported|unknown variant `image_url`|at most 0 image|mmproj|"
        r"should be 'text'|text.only (model|input)|content must be a string|content should be a valid string",
        "The model, or its server, does not accept images. Name a model with vision, or start the server with vision "
        "(llama.cpp: --mmproj FILE; vLLM and SGLang: a checkpoint with vision)",
    ),
    (
        r"only supports? stream|stream.{0,40}(must|should|has to|needs to) be (set to )?true|only.{0,20}streaming|"
        r"(only|just).{0,20}stream(ing)? (mode|output|response|call)|non-?stream.{0,60}(not|n.t|unsupported)|"
        r"set to false for non-?stream|仅支持流",
        "The server only streams: add --extra-body '{\"stream\": true}'",
    ),
    (
        r"system.?role|roles must alternate|only user.{0,20}assistant.{0,20}roles|unknown variant `system`|"
        r"(not|n.t) support.{0,20}['\"`]?system['\"`]?( message| role| prompt| with|\b)|"
        r"system (message|prompt|instruction)s?.{0,30}(not|n.t|unsupported)|developer instruction is not enabled",
        "The model's chat template does not have a system role: add --system-role user",
    ),
    (
        r"unexpected endpoint or method|no (such )?route|cannot post /",
        "The address may be incomplete: that of most servers is http://HOST:PORT/v1",
    ),
    (
        r"max_tokens.{0,80}max_completion_tokens",
        "Leave out --max-tokens and give --extra-body '{\"max_completion_tokens\": N}'",
    ),
)
"""Pairs of a pattern of error messages and a hint on what to do; the first pattern that matches counts."""


def hint_for(message: str) -> str | None:
    """Return a sentence without full stop that says what to do about an error message; None if that is not known."""
    return next((hint for words, hint in HINTS if re.search(words, message, re.IGNORECASE | re.DOTALL)), None)
