"""A real HTTP server on loopback that answers in four wire formats, whole or streamed, with scripted content.

`ModelMessage` is a model's message; `body_of` encodes it in a format. A responder may return bytes (`RawAnswer`).
"""

import json
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

STOP = {"chat": "stop", "responses": "completed", "anthropic": "end_turn", "google": "STOP"}
CUT = {"chat": "length", "responses": "max_output_tokens", "anthropic": "max_tokens", "google": "MAX_TOKENS"}
WIRES = tuple(STOP)
ENDPOINTS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "chat": ("openai-api/local/m", "/v1", {"max_retries": 0}),
    "responses": ("openai-api/local/m", "/v1", {"max_retries": 0, "responses_api": True}),
    "anthropic": ("anthropic/m", "", {"max_retries": 0}),
    "google": ("google/m", "", {}),
}
"""Format -> model, path of its base URL, and model arguments."""
STREAM = {"chat": "stream", "responses": "stream", "anthropic": "streaming", "google": "streaming"}
"""Format -> Inspect's model argument that requests a stream."""
PIECE = 7
"""Number of characters in a chunk of a stream."""


@dataclass(frozen=True)
class ModelMessage:
    """One message of a model."""

    parts: tuple[str, ...] = ()
    """The text, in one or more parts."""
    reasoning: str = ""
    """The reasoning, which the server sends separately from the text."""
    refusal: str | None = None
    is_cut: bool = False
    is_list: bool = False
    """Chat only: whether to send the content as a list even if it has only one part."""
    is_null: bool = False
    """Chat only: whether to send null for an empty text."""
    has_usage: bool = True
    reasoning_field: str = "reasoning_content"
    """Chat only: the field with the reasoning; `content` for a part of the content."""

    @property
    def text(self) -> str:
        """The text that must be judged and recorded."""
        return "".join(self.parts) or self.refusal or ""


@dataclass(frozen=True)
class RawAnswer:
    """An HTTP answer, sent unchanged."""

    data: bytes
    status: int = 200
    content_type: str = "application/json"
    left_out: int = 0
    """Number of bytes at the end that are announced but never sent."""


def wire_of(path: str) -> str:
    """Return the format of the API at a path."""
    path = path.partition("?")[0]
    if "generateContent" in path.replace("streamG", "g"):
        return "google"
    last = path.rpartition("/")[2]
    return {"completions": "chat", "messages": "anthropic"}.get(last, last)


def body_of(wire: str, said: ModelMessage, *, is_streamed: bool) -> RawAnswer:
    """Return the HTTP answer with the message `said`."""
    if is_streamed:
        events = {"chat": chat_events, "responses": responses_events, "anthropic": anthropic_events}.get(wire)
        lines = events(said) if events else [(None, document) for document in google_chunks(said)]
        text = "".join((f"event: {name}\n" if name else "") + f"data: {dump(data)}\n\n" for name, data in lines)
        return RawAnswer(
            (text + ("data: [DONE]\n\n" if wire == "chat" else "")).encode(), content_type="text/event-stream"
        )
    document = {"chat": chat, "responses": responses, "anthropic": anthropic, "google": google}[wire](said)
    return RawAnswer(dump(document).encode())


def dump(document: Any) -> str:
    """Return JSON, with escapes only for characters that UTF-8 cannot encode."""
    text = json.dumps(document, ensure_ascii=False)
    return "".join(f"\\u{ord(char):04x}" if "\ud800" <= char <= "\udfff" else char for char in text)


# --- OpenAI's chat completions ---


def chat(said: ModelMessage) -> dict[str, Any]:
    message: dict[str, Any] = {"role": "assistant", "content": chat_content(said)}
    if said.reasoning:
        message |= reasoning_of(said, said.reasoning)
    if said.refusal is not None:
        message["refusal"] = said.refusal
    choice = {"index": 0, "message": message, "finish_reason": (CUT if said.is_cut else STOP)["chat"]}
    head = {"id": "chatcmpl-1", "object": "chat.completion", "created": 1, "model": "loopback"}
    return {**head, "choices": [choice], "usage": chat_usage(said)}


def reasoning_of(said: ModelMessage, piece: str) -> dict[str, Any]:
    """Return the field of a message, or of a piece of one, that holds reasoning."""
    if said.reasoning_field == "content":
        texts = [{"type": "text", "text": part} for part in said.parts]
        return {"content": [{"type": "thinking", "thinking": [{"type": "text", "text": piece}]}, *texts]}
    if said.reasoning_field == "reasoning_details":
        return {"reasoning_details": [{"type": "reasoning.text", "text": piece, "index": 0}]}
    return {said.reasoning_field: piece}


def chat_content(said: ModelMessage) -> Any:
    if said.is_null and not said.parts:
        return None
    if said.is_list or len(said.parts) > 1:
        return [{"type": "text", "text": part} for part in said.parts]
    return "".join(said.parts)


def chat_usage(said: ModelMessage) -> Any:
    return {"prompt_tokens": 100, "completion_tokens": 10, "total_tokens": 110} if said.has_usage else None


def chat_events(said: ModelMessage) -> list[tuple[None, Any]]:
    head = {"id": "chatcmpl-1", "object": "chat.completion.chunk", "created": 1, "model": "loopback"}
    deltas: list[dict[str, Any]] = [{"role": "assistant", "content": ""}]
    alone = replace(said, parts=())
    deltas += [reasoning_of(alone, piece) for piece in pieces(said.reasoning)]
    deltas += [{"content": piece} for part in said.parts for piece in pieces(part)]
    deltas += [{"refusal": piece} for piece in pieces(said.refusal or "")]
    finish = (CUT if said.is_cut else STOP)["chat"]
    chunks = [{**head, "choices": [{"index": 0, "delta": delta, "finish_reason": None}]} for delta in deltas]
    chunks += [{**head, "choices": [{"index": 0, "delta": {}, "finish_reason": finish}]}]
    chunks += [{**head, "choices": [], "usage": chat_usage(said)}]
    return [(None, chunk) for chunk in chunks]


# --- OpenAI's responses ---


def responses(said: ModelMessage) -> dict[str, Any]:
    content: list[dict[str, Any]] = [{"type": "output_text", "text": part, "annotations": []} for part in said.parts]
    if said.refusal is not None:
        content.append({"type": "refusal", "refusal": said.refusal})
    output: list[dict[str, Any]] = []
    if said.reasoning:
        output.append({"type": "reasoning", "id": "r", "summary": [{"type": "summary_text", "text": said.reasoning}]})
    output.append({"type": "message", "id": "m", "role": "assistant", "status": "completed", "content": content})
    detail = {"reason": CUT["responses"]} if said.is_cut else None
    usage = {"input_tokens": 100, "output_tokens": 10, "total_tokens": 110}
    usage |= {"input_tokens_details": {"cached_tokens": 0}, "output_tokens_details": {"reasoning_tokens": 0}}
    head = {"id": "resp_1", "object": "response", "created_at": 1, "model": "loopback", "error": None}
    state = {"status": "incomplete" if said.is_cut else "completed", "incomplete_details": detail}
    tools = {"tools": [], "tool_choice": "auto", "parallel_tool_calls": False}
    return {**head, **state, "output": output, "usage": usage if said.has_usage else None, **tools}


def responses_events(said: ModelMessage) -> list[tuple[str, Any]]:
    whole = responses(said)
    begun = {**whole, "status": "in_progress", "output": [], "usage": None}
    events: list[dict[str, Any]] = [{"type": "response.created", "response": begun}]
    place = {"item_id": "m", "output_index": 0, "content_index": 0, "logprobs": []}
    events += [
        {"type": "response.output_text.delta", "delta": piece, **place} for part in said.parts for piece in pieces(part)
    ]
    events += [{"type": f"response.{whole['status']}", "response": whole}]
    return [(event["type"], {**event, "sequence_number": number}) for number, event in enumerate(events)]


# --- Anthropic's messages ---


def anthropic(said: ModelMessage) -> dict[str, Any]:
    content: list[dict[str, Any]] = []
    if said.reasoning:
        content.append({"type": "thinking", "thinking": said.reasoning, "signature": "s"})
    content += [{"type": "text", "text": part} for part in said.parts]
    stop = (CUT if said.is_cut else STOP)["anthropic"]
    head = {"id": "msg_1", "type": "message", "role": "assistant", "model": "loopback"}
    return {**head, "content": content, "stop_reason": stop, "stop_sequence": None, "usage": anthropic_usage()}


def anthropic_usage() -> dict[str, int]:
    return {"input_tokens": 90, "cache_creation_input_tokens": 0, "cache_read_input_tokens": 10, "output_tokens": 10}


def anthropic_events(said: ModelMessage) -> list[tuple[str, Any]]:
    whole = anthropic(said)
    begun = {**whole, "content": [], "stop_reason": None}
    events: list[dict[str, Any]] = [{"type": "message_start", "message": begun}, {"type": "ping"}]
    for index, block in enumerate(whole["content"]):
        name, delta = ("thinking", "thinking_delta") if "thinking" in block else ("text", "text_delta")
        empty = {**block, name: ""}
        events.append({"type": "content_block_start", "index": index, "content_block": empty})
        for piece in pieces(block[name]):
            found = {"type": delta, name: piece}
            events.append({"type": "content_block_delta", "index": index, "delta": found})
        events.append({"type": "content_block_stop", "index": index})
    end = {"stop_reason": whole["stop_reason"], "stop_sequence": None}
    events += [{"type": "message_delta", "delta": end, "usage": anthropic_usage()}, {"type": "message_stop"}]
    return [(event["type"], event) for event in events]


# --- Google's generateContent ---


def google(said: ModelMessage) -> dict[str, Any]:
    parts: list[dict[str, Any]] = [{"text": said.reasoning, "thought": True}] if said.reasoning else []
    parts += [{"text": part} for part in said.parts]
    return google_document(parts, (CUT if said.is_cut else STOP)["google"], said)


def google_document(parts: list[dict[str, Any]], finish: str | None, said: ModelMessage) -> dict[str, Any]:
    candidate: dict[str, Any] = {"content": {"role": "model", "parts": parts}, "index": 0}
    if finish is not None:
        candidate["finishReason"] = finish
    usage = {"promptTokenCount": 100, "candidatesTokenCount": 8, "thoughtsTokenCount": 2, "totalTokenCount": 110}
    return {
        "candidates": [candidate],
        "modelVersion": "loopback",
        **({"usageMetadata": usage} if said.has_usage else {}),
    }


def google_chunks(said: ModelMessage) -> list[dict[str, Any]]:
    documents = [google_document([{"text": piece, "thought": True}], None, said) for piece in pieces(said.reasoning)]
    documents += [google_document([{"text": piece}], None, said) for part in said.parts for piece in pieces(part)]
    return [*documents, google_document([], (CUT if said.is_cut else STOP)["google"], said)]


def pieces(text: str) -> list[str]:
    """Return a text split into at most 200 chunks."""
    size = max(PIECE, len(text) // 200 + 1)
    return [text[start : start + size] for start in range(0, len(text), size)]


# --- the server ---

WireResponder = Callable[[str, bytes], ModelMessage | RawAnswer]
"""What to answer to a request: (its format, its body)."""


@dataclass(frozen=True)
class Request:
    """A request that the server received."""

    path: str
    headers: dict[str, str]
    """The headers, with names in lower case."""
    data: bytes

    @property
    def body(self) -> dict[str, Any]:
        return json.loads(self.data)


class WireServer:
    """Server that answers with its brain, as a stream if the request asks for one."""

    def __init__(self, brain: WireResponder) -> None:
        server = self
        self.asked = 0
        self.requests: list[Request] = []
        self._lock = threading.Lock()

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self) -> None:
                data = self.rfile.read(int(self.headers["Content-Length"]))
                raw = RawAnswer(b'{"input_tokens": 5}') if self.path.endswith("/count_tokens") else self._answer(data)
                self.send_response(raw.status)
                self.send_header("Content-Type", raw.content_type)
                self.send_header("Content-Length", str(len(raw.data) + raw.left_out))
                self.end_headers()
                self.wfile.write(raw.data)
                self.close_connection = bool(raw.left_out)

            def _answer(self, data: bytes) -> RawAnswer:
                with server._lock:
                    server.asked += 1
                    headers = {name.lower(): value for name, value in self.headers.items()}
                    server.requests.append(Request(self.path, headers, data))
                    found = brain(wire_of(self.path), data)
                is_streamed = "streamGenerateContent" in self.path or bool(re.search(rb'"stream": ?true', data))
                return (
                    found
                    if isinstance(found, RawAnswer)
                    else body_of(wire_of(self.path), found, is_streamed=is_streamed)
                )

            def log_message(self, format: str, *args: Any) -> None:
                """Log nothing."""

        class Server(ThreadingHTTPServer):
            daemon_threads = True
            request_queue_size = 256

            def handle_error(self, request: Any, client_address: Any) -> None:
                """Ignore clients that disconnect."""

        self._http = Server(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._http.server_address[1]}"

    def __enter__(self) -> "WireServer":
        threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._http.shutdown()
        self._http.server_close()


class ScriptedModel:
    """Brain that gives each episode one message after another, and stores its messages.

    Episodes are distinguished by the number in brackets at the end of their instruction, from `tiny_pack`. A
    request that is sent again is answered as before.
    """

    _NUMBER = re.compile(rb"metres of it \((\d+)\)")

    def __init__(self, say: Callable[[int, int], ModelMessage]) -> None:
        """Take a function `say(episode, step)` that returns the message; steps count from 0."""
        self._say = say
        self.said: dict[int, list[ModelMessage]] = {}
        self._asked: dict[int, bytes] = {}

    def __call__(self, wire: str, data: bytes) -> ModelMessage:
        match = self._NUMBER.search(data)
        assert match is not None
        number = int(match[1])
        said = self.said.setdefault(number, [])
        if data != self._asked.get(number):
            said.append(self._say(number, len(said)))
            self._asked[number] = data
        return said[-1]
