"""Answers of a model's server: the text of a reply in the wire formats of OpenAI, Anthropic and Google.

The text is read from the body of the HTTP answer itself, because libraries remove reasoning from it or replace text. If
a body does not have a whole reply, NoAnswer is raised: the infrastructure has failed, not the agent.

A message may come in several parts (a list of contents, blocks, the pieces of a stream). Their texts are joined in the
order in which they were sent, without a separator: a server may split a text anywhere, and a separator would be text
that was never sent.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

from vigil.base.json_files import is_array, is_object
from vigil.protocol.actions import Usage
from vigil.protocol.finish_reasons import stop_cause
from vigil.runner.models.provider_errors import error_message_in, error_status_in

Wire = Literal["chat", "responses", "anthropic", "google"]
"""Wire format: OpenAI's chat completions, OpenAI's responses, Anthropic's messages, or Google's generateContent."""


class NoAnswer(Exception):
    """Error: a body has no reply. `status` is the status in an error that came with HTTP 200; None if unknown."""

    def __init__(self, message: str, status: int | None = None) -> None:
        super().__init__(message)
        self.status = status


@dataclass(slots=True)
class ModelAnswer:
    """A reply as the server sent it, read from one body."""

    parts: list[str] = field(default_factory=list[str])
    """Texts of the message, in order."""
    refusals: list[str] = field(default_factory=list[str])
    """Texts of a refusal, in order."""
    reasoning: list[str] = field(default_factory=list[str])
    """Texts of the reasoning that was sent in separate fields, in order."""
    tool_call: str | None = None
    """Name of the first tool that the answer calls; None if it does not call a tool."""
    finish_reason: str | None = None
    usage: Usage | None = None
    model: str | None = None
    has_message: bool = False
    is_complete: bool = False
    """Whether the server said that the answer is complete."""

    @property
    def text(self) -> str:
        """Text of the message, or of the refusal when the message does not have a text.

        Two halves of one character (surrogates) that came in two pieces are joined.
        """
        text = "".join(self.parts) or "".join(self.refusals)
        if text.isascii() or not any("\ud800" <= char <= "\udfff" for char in text):
            return text
        return text.encode("utf-16", "surrogatepass").decode("utf-16", "surrogatepass")


def read_answer(wire: Wire, body: bytes) -> ModelAnswer:
    """Return the reply in a body. Raises NoAnswer.

    The body itself shows whether it is a stream of events, because servers often send a wrong content type.
    """
    answer = ModelAnswer()
    read = _READERS[wire]
    for part in _documents(body):
        if part.get("error") or part.get("object") == "error" or _failed_status(part):
            raise _error(part)
        try:
            read(answer, part)
        except (TypeError, KeyError, AttributeError, IndexError) as fault:
            raise NoAnswer(f"HTTP 200 with an answer in an unexpected form ({fault}): {_excerpt(body)}") from None
    if not answer.has_message:
        raise NoAnswer(f"HTTP 200 without a message: {_excerpt(body)}")
    if not answer.is_complete:
        raise NoAnswer("HTTP 200 with an incomplete answer.")
    return answer


def _documents(body: bytes) -> Iterator[dict[str, Any]]:
    """Yield the JSON objects of a body: the whole answer, or the events of a stream. Raises NoAnswer."""
    try:
        text = body.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise NoAnswer(f"HTTP 200 with an answer that is not UTF-8: {_excerpt(body)}") from None
    if text.lstrip().startswith(("data:", "event:", ":", "id:", "retry:")):
        yield from _events(text)
        return
    found = _parse_json(text)
    yield from [found] if is_object(found) else _dicts(found)


def _events(text: str) -> Iterator[dict[str, Any]]:
    """Yield the data of server-sent events as JSON objects; the event `[DONE]` becomes `{"done": true}`."""
    lines: list[str] = []
    for line in (*text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), ""):
        if line.startswith("data:"):
            lines.append(line[5:].removeprefix(" "))
        elif not line and lines:
            data, lines = "\n".join(lines), []
            if data.strip() == "[DONE]":
                yield {"done": True}
            elif data.strip():
                yield from _dicts([_parse_json(data)])


def _parse_json(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as fault:
        raise NoAnswer(f"HTTP 200 with an answer that is not JSON ({fault}): {text[:200]!r}") from None


def _dicts(found: Any) -> list[dict[str, Any]]:
    if not is_array(found) or not all(isinstance(one, dict) for one in found):
        raise NoAnswer(
            f"HTTP 200 with an answer that is neither a JSON object nor a list of JSON objects: {str(found)[:200]}"
        )
    return found


def _error(found: Any) -> NoAnswer:
    return NoAnswer(f"HTTP 200 with an error: {error_message_in(found)}", error_status_in(found))


def _failed_status(part: dict[str, Any]) -> bool:
    """Return whether a part reports a failure in MiniMax's form; such a part may also have a message."""
    status = part.get("base_resp")
    return is_object(status) and status.get("status_code") not in (None, 0)


def _excerpt(body: bytes) -> str:
    return repr(body[:200].decode("utf-8", "backslashreplace"))


# --- the four formats: each reads one document, which is the whole answer or an event of a stream ---------------------


def _chat(answer: ModelAnswer, part: dict[str, Any]) -> None:
    answer.model = _name(part.get("model")) or answer.model
    answer.is_complete = answer.is_complete or "done" in part
    answer.usage = _usage(part.get("usage"), "prompt_tokens", "completion_tokens") or answer.usage
    given: list[Any] = part.get("choices") or []
    choices = [choice for choice in given if not choice.get("index")]
    for choice in choices:
        if choice.get("error"):
            raise _error(choice)
        is_whole = "delta" not in choice
        message: Any = choice["message"] if is_whole else choice["delta"] or {}
        if not is_object(message):
            raise TypeError(f"the message must be an object, but is of type {type(message).__name__}")
        answer.has_message = True
        _add_content(answer, message.get("content"))
        _append_text(answer.refusals, message.get("refusal"))
        answer.reasoning.append(_reasoning_field(message))
        answer.tool_call = answer.tool_call or _tool_name(message)
        answer.finish_reason = _finish_reason(choice) or answer.finish_reason
        answer.is_complete = answer.is_complete or is_whole or answer.finish_reason is not None


def _add_content(answer: ModelAnswer, content: Any) -> None:
    """Add the `content` of a message to an answer: a text, or a list of parts (text, refusal, reasoning, tool call)."""
    if content is None or isinstance(content, str):
        _append_text(answer.parts, content)
        return
    parts: list[Any] = content if is_array(content) else [content]
    for part in parts:
        if isinstance(part, str):
            answer.parts.append(part)
            continue
        match part.get("type", "text"):
            case "text" | "output_text":
                _append_text(answer.parts, part["text"])
            case "refusal":
                _append_text(answer.refusals, part["refusal"])
            case "thinking" | "reasoning" | "reasoning_text" | "summary_text":
                answer.reasoning.append(_reasoning_of(part))
            case "tool_use" | "function_call":
                answer.tool_call = answer.tool_call or _name(part.get("name")) or "unnamed"
            case _:
                pass  # pictures and citations hold no text of the reply


def _reasoning_field(message: dict[str, Any]) -> str:
    """Return the reasoning in a separate field of a message. If two fields have reasoning, return only the first."""
    fields = (message.get("reasoning_content"), message.get("reasoning"))
    text = next((one for one in fields if isinstance(one, str) and one), None)
    if text is not None:
        return text
    details = message.get("reasoning_details")
    return "".join(_reasoning_of(one) for one in details if is_object(one)) if is_array(details) else ""


def _reasoning_of(part: dict[str, Any]) -> str:
    inner = part.get("thinking") or part.get("reasoning") or part.get("text") or part.get("summary") or ""
    return inner if isinstance(inner, str) else "".join(one.get("text") or "" for one in inner)


def _tool_name(message: dict[str, Any]) -> str | None:
    """Return the name of the tool that an OpenAI message calls, in its current or older form; None without a call."""
    calls = message.get("tool_calls")
    first = calls[0] if is_array(calls) and calls else None
    called = first.get("function") if is_object(first) else message.get("function_call")
    if is_object(called):
        return _name(called.get("name")) or "unnamed"
    return None if first is None else "unnamed"


def _finish_reason(choice: dict[str, Any]) -> str | None:
    """Return the finish reason of an answer. If a router adds the reason for which its provider failed, return that
    reason."""
    own = _reason_text(choice.get("finish_reason"))
    provider_fields = choice.get("provider_specific_fields")
    native = choice.get("native_finish_reason") or (
        is_object(provider_fields) and provider_fields.get("native_finish_reason")
    )
    return _reason_text(native) if stop_cause(_reason_text(native)) in ("filtered", "failed") else own


def _reason_text(found: Any) -> str | None:
    """Return a finish reason as a text; SGLang sends an object, whose `type` is the text."""
    if is_object(found):
        found = found.get("type")
    return None if found in (None, "", False) else str(found)[:200]


def _responses(answer: ModelAnswer, part: dict[str, Any]) -> None:
    kind = part.get("type")
    if kind == "error":
        raise _error(part)
    is_event = isinstance(kind, str)
    if is_event and kind not in ("response.completed", "response.incomplete", "response.failed"):
        return  # the last event has the whole response
    response = part["response"] if is_event else part
    if response.get("error"):
        raise _error(response)
    status, output = response.get("status"), response["output"]
    answer.model = _name(response.get("model"))
    details: Any = response.get("incomplete_details") or {}
    cut: Any = details.get("reason")
    if status not in (None, "completed", "incomplete"):
        raise NoAnswer(f"HTTP 200 with a response of the status {status!r}.")
    for item in output:
        if item["type"] == "message":
            _add_content(answer, item["content"])
        elif item["type"] == "reasoning":
            pieces: list[Any] = [*(item.get("content") or []), *(item.get("summary") or [])]
            answer.reasoning += map(_reasoning_of, pieces)
        elif item["type"] == "function_call":
            _add_content(answer, item)
    answer.has_message = bool(output) or cut is not None
    answer.finish_reason = cut or status
    answer.usage = _usage(response.get("usage"), "input_tokens", "output_tokens")
    answer.is_complete = True


def _anthropic(answer: ModelAnswer, part: dict[str, Any]) -> None:
    match part.get("type"):
        case "error":
            raise _error(part)
        case "message_start":
            answer.has_message = True
            answer.model = _name(part["message"].get("model"))
            answer.usage = _anthropic_usage(part["message"].get("usage"), answer.usage)
        case "content_block_start":
            _add_content(answer, [part["content_block"]])
        case "content_block_delta":
            delta = part["delta"]
            if delta["type"] == "text_delta":
                _append_text(answer.parts, delta["text"])
            elif delta["type"] == "thinking_delta":
                answer.reasoning.append(delta["thinking"])
        case "message_delta":
            answer.finish_reason = part["delta"].get("stop_reason") or answer.finish_reason
            answer.is_complete = answer.finish_reason is not None
            answer.usage = _anthropic_usage(part.get("usage"), answer.usage)
        case "message_stop":
            answer.is_complete = True
        case "message" | None:
            content = part["content"]
            _add_content(answer, content)
            answer.model = _name(part.get("model"))
            answer.finish_reason = part.get("stop_reason")
            answer.usage = _anthropic_usage(part.get("usage"), None)
            answer.has_message = answer.is_complete = bool(content) or answer.finish_reason is not None
        case _:
            pass  # pings, and the ends of blocks


def _anthropic_usage(usage: Any, before: Usage | None) -> Usage | None:
    """Return Anthropic's usage; a stream sends the input tokens first, in `before`, and the output tokens last."""
    if not is_object(usage):
        return before
    names = ("input_tokens", "cache_creation_input_tokens", "cache_read_input_tokens")
    return Usage(
        input_tokens=sum(_count(usage.get(name)) for name in names) or (before.input_tokens if before else 0),
        output_tokens=_count(usage.get("output_tokens")),
    )


def _google(answer: ModelAnswer, part: dict[str, Any]) -> None:
    answer.model = _name(part.get("modelVersion")) or answer.model
    feedback: Any = part.get("promptFeedback") or {}
    if feedback.get("blockReason"):
        answer.finish_reason, answer.has_message, answer.is_complete = "SAFETY", True, True
    candidates: list[Any] = part.get("candidates") or []
    for candidate in candidates:
        if candidate.get("index"):
            continue
        content: Any = candidate.get("content")
        pieces: list[Any] = (content.get("parts") if content else None) or []
        for piece in pieces:
            if piece.get("thought") is True:
                answer.reasoning.append(piece.get("text") or "")
            elif is_object(piece.get("functionCall")):
                answer.tool_call = answer.tool_call or _name(piece["functionCall"].get("name")) or "unnamed"
            else:
                _append_text(answer.parts, piece.get("text"))
        answer.finish_reason = candidate.get("finishReason") or answer.finish_reason
        answer.has_message = answer.has_message or content is not None or answer.finish_reason is not None
        answer.is_complete = answer.finish_reason is not None
    counts = part.get("usageMetadata")
    if is_object(counts):
        out = _count(counts.get("candidatesTokenCount")) + _count(counts.get("thoughtsTokenCount"))
        answer.usage = Usage(input_tokens=_count(counts.get("promptTokenCount")), output_tokens=out)


def _name(found: Any) -> str | None:
    """Return a name from an answer, cut to 200 characters; None if it is empty or not a text."""
    return found[:200] if isinstance(found, str) and found else None


def _append_text(texts: list[str], text: Any) -> None:
    if text is None:
        return
    if not isinstance(text, str):
        raise TypeError(f"a text must be a string, but is of type {type(text).__name__}")
    texts.append(text)


def _usage(usage: Any, sent: str, got: str) -> Usage | None:
    if not is_object(usage):
        return None
    return Usage(input_tokens=_count(usage.get(sent)), output_tokens=_count(usage.get(got)))


def _count(number: Any) -> int:
    return number if isinstance(number, int) and number >= 0 else 0


_READERS = {"chat": _chat, "responses": _responses, "anthropic": _anthropic, "google": _google}
