"""A real HTTP server on loopback that speaks chat completions with pictures, and misbehaves on demand.

As a program (`python -m tests.support.chat_server SECONDS`) it answers every request after that time, for benchmarks.
"""

import base64
import io
import json
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np
from PIL import Image

from vigil.runner.models.preflight import EXAMPLE_INSTRUCTION, QUESTION, draw_number

REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'
LOOK = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'


@dataclass(frozen=True)
class ChatRequest:
    """A request that the server received."""

    raw: bytes
    """The request line, headers and body."""
    body: dict[str, Any]

    @property
    def messages(self) -> list[dict[str, Any]]:
        return self.body["messages"]

    @property
    def texts(self) -> list[str]:
        """The text of each message."""
        return [text_of(message) for message in self.messages]

    @property
    def pictures(self) -> list[bytes]:
        """The bytes of all pictures in the request."""
        return [picture for message in self.messages for picture in pictures_of(message)]

    @property
    def turn(self) -> int:
        """The number of the request within its episode, from 1."""
        return (len(self.messages) - 2) // 2 + 1


@dataclass(frozen=True)
class ChatAnswer:
    """The server's reaction to a request."""

    text: str | None = None
    finish_reason: str = "stop"
    reasoning: str | None = None
    refusal: str | None = None
    status: int = 200
    error: dict[str, Any] | None = None
    headers: dict[str, str] = field(default_factory=dict)
    delay_s: float = 0.0
    breaks: bool = False
    """Whether to close the connection in the middle of the answer."""
    is_garbage: bool = False
    """Whether to send text that is not JSON."""
    model: str = "loopback"
    input_tokens: int = 100
    """The number of input tokens that the server reports."""


def failure(status: int, message: str = "out of order", **error: Any) -> ChatAnswer:
    return ChatAnswer(status=status, error={"message": message, "type": "server_error", **error})


ChatResponder = Callable[[ChatRequest], ChatAnswer]


class ChatServer:
    """Server that answers with its brain and stores all requests."""

    def __init__(self, brain: ChatResponder, *, can_see: bool = True) -> None:
        self.brain = brain
        self.can_see = can_see
        self.asked: list[ChatRequest] = []
        self.preflights = 0
        self.examples: list[ChatRequest] = []
        """The requests of the check before a run, about its example."""
        self.example = ChatAnswer(REPORT)
        self.raw: list[bytes] = []
        self._lock = threading.Lock()
        self._alive = self.most_alive = 0

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def start(self, port: int = 0) -> None:
        chat = self

        class Handler(_Handler):
            server_of_chat = chat

        self._http = _Server(("127.0.0.1", port), Handler)
        threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def stop(self) -> None:
        self._http.shutdown()
        self._http.server_close()

    def answer(self, asked: ChatRequest) -> ChatAnswer:
        with self._lock:
            self.raw.append(asked.raw)
            if asked.texts[-1] == QUESTION:
                self.preflights += 1
                return ChatAnswer(read_number(asked.pictures[-1]) if self.can_see else "I see no picture.")
            if EXAMPLE_INSTRUCTION in asked.texts[0]:
                self.examples.append(asked)
                return self.example
            self.asked.append(asked)
            self._alive += 1
            self.most_alive = max(self.most_alive, self._alive)
        try:
            answer = self.brain(asked)
            time.sleep(answer.delay_s)
            return answer
        finally:
            with self._lock:
                self._alive -= 1


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 256

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore clients that disconnect."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_of_chat: ChatServer

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        raw = f"{self.requestline}\n{self.headers}\n".encode() + body
        self._send(self.server_of_chat.answer(ChatRequest(raw, json.loads(body))))

    def _send(self, answer: ChatAnswer) -> None:
        data = b"<html>" if answer.is_garbage else json.dumps(_completion(answer)).encode()
        self.send_response(answer.status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        for name, value in answer.headers.items():
            self.send_header(name, value)
        self.end_headers()
        if answer.breaks:
            self.wfile.write(data[: len(data) // 2])
            self.close_connection = True
            return
        self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""


def _completion(answer: ChatAnswer) -> dict[str, Any]:
    if answer.error is not None:
        return {"error": answer.error}
    message: dict[str, Any] = {"role": "assistant", "content": answer.text}
    if answer.reasoning is not None:
        message["reasoning_content"] = answer.reasoning
    if answer.refusal is not None:
        message["refusal"] = answer.refusal
    return {
        "id": "chatcmpl-1",
        "object": "chat.completion",
        "created": 1,
        "model": answer.model,
        "choices": [{"index": 0, "message": message, "finish_reason": answer.finish_reason}],
        "usage": {
            "prompt_tokens": answer.input_tokens,
            "completion_tokens": 10,
            "total_tokens": answer.input_tokens + 10,
        },
    }


def text_of(message: dict[str, Any]) -> str:
    content = message["content"]
    if isinstance(content, str):
        return content
    return "".join(part["text"] for part in content if part["type"] == "text")


def pictures_of(message: dict[str, Any]) -> list[bytes]:
    if isinstance(message["content"], str):
        return []
    addresses = [part["image_url"]["url"] for part in message["content"] if part["type"] == "image_url"]
    return [base64.b64decode(address.partition(",")[2]) for address in addresses]


def read_number(picture: bytes) -> str:
    """Return the four digits in a picture, found by comparing each with the ten digits that could be drawn."""
    seen = np.asarray(Image.open(io.BytesIO(picture)).convert("L"), dtype=float)
    number = "1000"
    for place in range(4):
        tries = [number[:place] + digit + number[place + 1 :] for digit in "0123456789"]
        columns = slice(seen.shape[1] * place // 4, seen.shape[1] * (place + 1) // 4)
        number = min(tries, key=lambda text: np.abs(draw_number(text).mean(axis=2) - seen)[:, columns].sum())
    return number


@contextmanager
def serving(brain: ChatResponder, *, can_see: bool = True) -> Iterator[ChatServer]:
    """Run a server for the length of the block."""
    server = ChatServer(brain, can_see=can_see)
    server.start()
    try:
        yield server
    finally:
        server.stop()


if __name__ == "__main__":
    latency_s = float(sys.argv[1])
    turns = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    benchmark = ChatServer(lambda asked: ChatAnswer(REPORT if asked.turn >= turns else LOOK, delay_s=latency_s))
    benchmark.start()
    print(benchmark.url, flush=True)
    sys.stdin.read()
