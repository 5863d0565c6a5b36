"""Failure modes of a model server: each takes a connection and the right answer, and answers wrongly.

A mode is a function of a `BadAnswer`. It returns whether the connection may be used again, as with HTTP's keep-alive.
"""

import gzip
import json
import socket
import struct
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from email.utils import formatdate
from typing import Any


@dataclass(frozen=True)
class BadAnswer:
    """A request that is to be answered badly."""

    connection: socket.socket
    answer: dict[str, Any]
    """The chat completion that a faultless server would send."""
    patience_s: float
    """How long the client waits for a reply."""
    vanish: Callable[[float], None]
    """Stop listening for a number of seconds."""

    @property
    def body(self) -> bytes:
        """The body that a faultless server would send."""
        return json.dumps(self.answer).encode()

    def send(self, data: bytes) -> None:
        """Send bytes; a client that has disconnected is ignored."""
        self.connection.sendall(data)


Mode = Callable[[BadAnswer], bool]
JSON = "application/json"
GZIP = {"Content-Encoding": "gzip"}
CHUNKED = {"Transfer-Encoding": "chunked"}


def response(
    body: bytes,
    status: int = 200,
    kind: str = JSON,
    length: int | None = None,
    headers: Mapping[str, str] | None = None,
) -> bytes:
    """Return a response with its headers; `length` is their claim about the body."""
    head = [f"HTTP/1.1 {status} Told", f"Content-Type: {kind}"]
    head += [f"{name}: {value}" for name, value in (headers or {}).items()]
    head += [] if length == -1 else [f"Content-Length: {len(body) if length is None else length}"]
    return "\r\n".join([*head, "", ""]).encode() + body


def reset(connection: socket.socket) -> None:
    """Make the closing of a connection a reset."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def _status(status: int, retry_after: str | None = None) -> Mode:
    headers = None if retry_after is None else {"Retry-After": retry_after}

    def mode(call: BadAnswer) -> bool:
        error = {"error": {"message": "out of order", "type": "server_error"}}
        call.send(response(json.dumps(error).encode(), status, headers=headers))
        return True

    return mode


def _raw(make: Callable[[BadAnswer], bytes], *, goes_on: bool = False) -> Mode:
    """Return the mode that sends what `make` says, and then closes unless it `goes_on`."""

    def mode(call: BadAnswer) -> bool:
        call.send(make(call))
        return goes_on

    return mode


def _changed(change: Callable[[dict[str, Any]], Any]) -> Mode:
    """Return the mode that sends a completion changed by `change`, correct as HTTP."""

    def mode(call: BadAnswer) -> bool:
        answer = json.loads(call.body)
        changed = change(answer)
        call.send(response(json.dumps(answer if changed is None else changed).encode()))
        return True

    return mode


def _reset_before(call: BadAnswer) -> bool:
    reset(call.connection)
    return False


def _reset_mid_body(call: BadAnswer) -> bool:
    call.send(response(call.body)[:-20])
    time.sleep(0.02)
    reset(call.connection)
    return False


def _refused(call: BadAnswer) -> bool:
    call.vanish(0.05)
    reset(call.connection)
    return False


def _slow_body(call: BadAnswer) -> bool:
    data = response(call.body)
    size = len(data) // 8 + 1
    for start in range(0, len(data), size):
        call.send(data[start : start + size])
        time.sleep(0.02)
    return True


def _stall(part: float) -> Mode:
    def mode(call: BadAnswer) -> bool:
        data = response(call.body)
        call.send(data[: int(len(data) * part)])
        time.sleep(call.patience_s + 0.5)
        return False

    return mode


def _set(*place: str | int, value: Any) -> Callable[[dict[str, Any]], None]:
    """Return the function that sets one value, however deep, in a completion."""

    def change(answer: Any) -> None:
        for name in place[:-1]:
            answer = answer[name]
        answer[place[-1]] = value

    return change


MESSAGE = ("choices", 0, "message")
FLAWLESS = frozenset(
    {"slow_body", "keepalive_closed", "unknown_fields", "many_headers", "continue_first", "chunked_bytes"}
)
"""Modes that send the right answer in an unusual way."""
MODES: dict[str, Mode] = {
    "reset_before": _reset_before,
    "close_before": _raw(lambda call: b""),
    "refused": _refused,
    "close_in_status": _raw(lambda call: b"HTTP/1.1 20"),
    "close_in_headers": _raw(lambda call: response(call.body)[:30]),
    "close_mid_body": _raw(lambda call: response(call.body)[:-20]),
    "reset_mid_body": _reset_mid_body,
    "slow_body": _slow_body,
    "stall_before": _stall(0.0),
    "stall_in_headers": _stall(0.05),
    "stall_mid_body": _stall(0.8),
    "status_408": _status(408),
    "status_409": _status(409),
    "status_425": _status(425),
    "status_429": _status(429),
    "retry_after_seconds": _status(429, retry_after="1"),
    "retry_after_date": _status(429, retry_after=formatdate(time.time() + 1, usegmt=True)),
    "retry_after_past": _status(503, retry_after="Wed, 21 Oct 2015 07:28:00 GMT"),
    "retry_after_absurd": _status(429, retry_after="1e30"),
    "retry_after_negative": _status(429, retry_after="-5"),
    "retry_after_nan": _status(429, retry_after="nan"),
    "retry_after_words": _status(503, retry_after="soon"),
    "status_500": _status(500),
    "status_502": _status(502),
    "status_503": _status(503),
    "status_504": _status(504),
    "status_529": _status(529),
    "html_502": _raw(lambda call: response(b"<html>Bad gateway</html>", 502, "text/html"), goes_on=True),
    "html_200": _raw(lambda call: response(b"<html>Welcome</html>", 200, "text/html"), goes_on=True),
    "html_as_json": _raw(lambda call: response(b"<html>Welcome</html>"), goes_on=True),
    "empty_200": _raw(lambda call: response(b""), goes_on=True),
    "empty_500": _raw(lambda call: response(b"", 500), goes_on=True),
    "no_content_204": _raw(lambda call: response(b"", 204), goes_on=False),
    "truncated_json": _raw(lambda call: response(call.body[:-30]), goes_on=True),
    "length_too_small": _raw(lambda call: response(call.body, length=40)),
    "length_too_large": _raw(lambda call: response(call.body, length=len(call.body) + 100)),
    "length_twice": _raw(lambda call: response(call.body, headers={"Content-length": "7"})),
    "wrong_type": _raw(lambda call: response(b"out of order", kind="text/plain"), goes_on=True),
    "gzip_garbage": _raw(lambda call: response(b"\x1f\x8b garbage", headers=GZIP), goes_on=True),
    "gzip_truncated": _raw(lambda call: response(gzip.compress(call.body)[:-40], headers=GZIP)),
    "not_gzip": _raw(lambda call: response(call.body, headers=GZIP), goes_on=True),
    "chunked_garbage": _raw(lambda call: response(b"zz\r\n{}\r\n", length=-1, headers=CHUNKED)),
    "chunked_cut": _raw(lambda call: response(b"40\r\n{}\r\n", length=-1, headers=CHUNKED)),
    "http_09": _raw(lambda call: call.body),
    "no_http": _raw(lambda call: b"\x15\x03\x01\x00\x02\x02\x16"),
    "bad_status": _raw(lambda call: b"HTTP/1.1 abc Fine\r\n\r\n"),
    "redirect_loop": _raw(lambda call: response(b"", 307, headers={"Location": "/v1/chat/completions"}), goes_on=True),
    "large_headers": _raw(lambda call: response(call.body, headers={"X-Large": "x" * 300_000})),
    "many_headers": _raw(lambda call: response(call.body, headers={f"X-{n}": "y" for n in range(80)}), goes_on=True),
    "continue_first": _raw(lambda call: b"HTTP/1.1 100 Continue\r\n\r\n" + response(call.body), goes_on=True),
    "chunked_bytes": _raw(
        lambda call: response(
            b"".join(b"1\r\n%c\r\n" % byte for byte in call.body) + b"0\r\n\r\n", length=-1, headers=CHUNKED
        ),
        goes_on=True,
    ),
    "answered_twice": _raw(lambda call: response(b'{"error": "late"}', 500) + response(call.body)),
    "keepalive_closed": _raw(lambda call: response(call.body, headers={"Connection": "keep-alive"})),
    "unknown_fields": _changed(_set("choices", 0, "extra", value={"deep": [None]})),
    "error_200": _changed(lambda answer: {"error": {"message": "overloaded", "type": "server_error", "code": 503}}),
    "error_beside_choices": _changed(_set("error", value={"message": "overloaded", "code": 502})),
    "choices_empty": _changed(_set("choices", value=[])),
    "choices_null": _changed(_set("choices", value=None)),
    "choices_missing": _changed(lambda answer: {"id": answer["id"]}),
    "message_null": _changed(_set("choices", 0, "message", value=None)),
    "message_missing": _changed(_set("choices", 0, value={"index": 0})),
    "content_number": _changed(_set(*MESSAGE, "content", value=7)),
    "usage_null": _changed(_set("usage", value=None)),
    "usage_words": _changed(_set("usage", value={"prompt_tokens": "many"})),
    "body_null": _raw(lambda call: response(b"null"), goes_on=True),
    "body_list": _raw(lambda call: response(b"[]"), goes_on=True),
    "body_word": _raw(lambda call: response(b'"ok"'), goes_on=True),
    "nested_body": _raw(lambda call: response(b"[" * 100_000), goes_on=True),
    "invalid_utf8": _raw(lambda call: response(call.body.replace(b"skill_name", b"skill\xff\xfename")), goes_on=True),
    "nul_bytes": _raw(lambda call: response(b"\x00" * 500), goes_on=True),
}  # fmt: skip
