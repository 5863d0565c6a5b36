"""Hostile requests, byte by byte, which an ordinary client never sends and the server must survive.

`hostile_requests` yields the same requests for the same seed: first every odd header, body and address, then `count`
random requests that combine several of these.
"""

import contextlib
import itertools
import json
import logging
import random
import re
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import h11

from tests.support.http_edge_cases import (
    COOKIES,
    HOSTS,
    LENGTHS,
    METHODS,
    ODD_VALUES,
    ORIGINS,
    OTHERS,
    QUERIES,
    RANGES,
    RAW_BODIES,
    SEGMENTS,
    TYPES,
)
from tests.support.waiting import HANGS_AFTER_S

PATIENCE_S = HANGS_AFTER_S
SHORT_S = 0.05
"""Time (s) to wait for an answer to an unfinished request."""
TOKEN = "correct horse"


@dataclass(frozen=True)
class Route:
    """A route: its address with parameters in braces and, for POST, a valid body."""

    method: str
    pattern: str
    body: Any = None
    takes_query: bool = False

    @property
    def path(self) -> str:
        return self.pattern.replace("{", "").replace("}", "")


@dataclass(frozen=True)
class RawRequest:
    """The bytes of one request."""

    name: str
    data: bytes
    is_unfinished: bool = False
    """Whether the server may wait for more of it."""


@dataclass
class LoggedErrors:
    """The errors that a server logged."""

    lines: list[str] = field(default_factory=list)


def hostile_requests(
    routes: Sequence[Route], port: int, *, count: int, seed: int, token: str = ""
) -> Iterator[RawRequest]:
    """Yield odd headers and methods on the routes in turn, odd addresses and bodies on all, then `count` mixtures."""
    plain = {"Host": f"127.0.0.1:{port}", **({"Authorization": f"Bearer {token}"} if token else {})}
    for route in routes:
        yield shot(route, plain, name="plain")
        for path in odd_paths(route):
            yield shot(route, plain, path=path, name=f"path {path[:60]!r}")
        if route.method == "POST":
            for body in odd_bodies(route.body):
                yield shot(route, plain, body=body, name=f"body {body[:60]!r}")
            yield from _odd_lengths(route, plain)
    yield from _in_turn([route for route in routes if route.method == "GET"], plain)
    yield from _in_turn([route for route in routes if route.method == "POST"], plain)
    rng = random.Random(seed)
    for _ in range(count):
        yield _mixed(rng, rng.choice(routes), plain)
    yield from _no_http()


def _in_turn(routes: Sequence[Route], plain: dict[str, str]) -> Iterator[RawRequest]:
    """Yield each odd header and method once, on one route after the other."""
    if not routes:
        return
    turns = itertools.cycle(routes)
    for name, value in _header_oddities():
        headers = {key: each for key, each in plain.items() if key != name}
        yield shot(next(turns), {**headers, name: value}, name=f"{name}: {value[:60]!r}")
    for method in METHODS:
        yield shot(next(turns), plain, method=method, name=f"method {method[:10]}")


def _header_oddities() -> list[tuple[str, str]]:
    groups = (("Origin", ORIGINS), ("Host", HOSTS), ("Cookie", COOKIES), ("Content-Type", TYPES), ("Range", RANGES))
    return [*((name, value) for name, values in groups for value in values), *OTHERS]


def odd_paths(route: Route) -> Iterator[str]:
    """Yield a route's address with each of its parameters in turn replaced, and with odd queries."""
    for name in re.findall(r"{.*?}", route.pattern):
        for segment in SEGMENTS:
            before, _, after = route.pattern.partition(name)
            yield Route(route.method, before).path + segment + Route(route.method, after).path
    for query in QUERIES if route.takes_query else QUERIES[:2]:
        yield route.path + query
    yield from (
        "/" + route.path,
        route.path + "/",
        route.path + "//",
        route.path.upper(),
        "//[" + route.path,
        "/.." + route.path,
    )
    yield from ("http://[" + route.path, "*", "http://evil.example" + route.path, route.path.replace("/", "//"))


def odd_bodies(body: Any) -> Iterator[bytes]:
    """Yield bodies that are not JSON, and JSON bodies with one value replaced, left out or added."""
    yield from RAW_BODIES
    for changed in _changed(body):
        yield json.dumps(changed).encode()


def _changed(value: Any, depth: int = 0) -> Iterator[Any]:
    """Yield variants of `value` with one part replaced, left out or added, at any depth."""
    yield from ODD_VALUES if depth < 2 else ODD_VALUES[depth % 3 :: 3]
    if isinstance(value, dict):
        yield {**value, "unknown": float("nan")}
        yield {**value, "\ud800": "\ud800"}
        for name, inner in value.items():
            yield {key: each for key, each in value.items() if key != name}
            for changed in _changed(inner, depth + 1):
                yield {**value, name: changed}
    elif isinstance(value, list):
        for place, inner in enumerate(value):
            for changed in _changed(inner, depth + 1):
                yield [*value[:place], changed, *value[place + 1 :]]


def _odd_lengths(route: Route, plain: dict[str, str]) -> Iterator[RawRequest]:
    body = json.dumps(route.body).encode()
    for length in (*LENGTHS, str(len(body) + 10), str(len(body) - 1), str(300_000), str(256 * 1024)):
        headers = {**plain, "Content-Type": "application/json", "Content-Length": length}
        yield RawRequest(
            f"{route.path} length {length[:20]!r}", _encoded("POST", route.path, headers, body), is_unfinished=True
        )
    chunked = {**plain, "Content-Type": "application/json", "Transfer-Encoding": "chunked"}
    for data in (b"0\r\n\r\n", b"5\r\n{}\r\n", b"zz\r\n", b"2\r\n{}\r\n0\r\n\r\n", b"fffffffffffffffff\r\n{}"):
        yield RawRequest(
            f"{route.path} chunked {data!r}", _encoded("POST", route.path, chunked, data), is_unfinished=True
        )


def _mixed(rng: random.Random, route: Route, plain: dict[str, str]) -> RawRequest:
    headers = dict(plain)
    for name, value in rng.sample(_header_oddities(), rng.choice((0, 0, 1, 2))):
        headers[name] = value
    path = rng.choice(list(odd_paths(route))) if rng.random() < 0.5 else route.path
    method = rng.choice(METHODS) if rng.random() < 0.15 else route.method
    body = None
    if route.method == "POST" and rng.random() < 0.8:
        body = rng.choice(list(odd_bodies(route.body)))
        if rng.random() < 0.5:
            body = _scrambled(rng, body)
    return shot(route, headers, method=method, path=path, body=body, name=f"mixed {path[:60]!r} {(body or b'')[:60]!r}")


def _scrambled(rng: random.Random, body: bytes) -> bytes:
    data = bytearray(body[:2000])
    for _ in range(rng.randint(1, 5)):
        if data:
            data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def _no_http() -> Iterator[RawRequest]:
    for data in (
        b"",
        b"\x00\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET /\r\n\r\n",
        b"\x16\x03\x01\x02\x00",
        b"GET / HTTP/1.1\r\n\r\n",
    ):
        yield RawRequest(f"no HTTP {data!r}", data, is_unfinished=True)
    yield RawRequest(
        "very many headers",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + b"A: b\r\n" * 5000 + b"\r\n",
    )


def shot(
    route: Route,
    headers: dict[str, str],
    *,
    method: str | None = None,
    path: str | None = None,
    body: bytes | None = None,
    name: str,
) -> RawRequest:
    """Return a valid request to a route, except for the given parts."""
    method = method or route.method
    data = json.dumps(route.body).encode() if body is None and route.method == "POST" else body or b""
    sent = dict(headers)
    if data:
        sent = {"Content-Type": "application/json", **sent, "Content-Length": str(len(data))}
    is_unfinished = "Transfer-Encoding" in sent or sent.get("Expect") == "100-continue"
    return RawRequest(
        f"{method[:10]} {route.path}: {name}", _encoded(method, path or route.path, sent, data), is_unfinished
    )


def _encoded(method: str, path: str, headers: dict[str, str], body: bytes) -> bytes:
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items())]
    head = "\r\n".join([*lines, "Connection: close", "", ""])
    return head.encode("utf-8", "surrogatepass") + body


def fire(port: int, shot: RawRequest) -> int | None:
    """Send a request and return the status of the answer; None without an answer."""
    with socket.create_connection(("127.0.0.1", port), SHORT_S if shot.is_unfinished else PATIENCE_S) as connection:
        got = bytearray()
        with contextlib.suppress(ConnectionError):  # answered and closed before the whole request was read
            connection.sendall(shot.data)
        try:
            while chunk := connection.recv(1 << 16):
                got += chunk
        except ConnectionError:
            pass
        except TimeoutError:
            assert shot.is_unfinished, f"no answer within {PATIENCE_S:g} s: {shot.name}"
    words = bytes(got[:40]).split(b" ", 2)
    return int(words[1]) if len(words) > 1 and words[0].startswith(b"HTTP/") else None


@contextmanager
def errors_logged() -> Iterator[LoggedErrors]:
    """Collect the errors that servers and event loops log within the block."""
    told = LoggedErrors()

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if record.exc_info and isinstance(record.exc_info[1], h11.LocalProtocolError):
                return  # uvicorn has answered a request of broken chunks with 400 before the application could
            told.lines.append(self.format(record)[-300:])

    ear = Ear(logging.ERROR)
    loggers = [logging.getLogger(name) for name in ("uvicorn.error", "asyncio", "fastapi", "")]
    for logger in loggers:
        logger.addHandler(ear)
    try:
        yield told
    finally:
        for logger in loggers:
            logger.removeHandler(ear)
