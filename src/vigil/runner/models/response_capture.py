"""Capturing the bytes of a server's answers in the HTTP client of a model, before a library has read them.

Inspect does not always keep a provider's raw answer, and its own form of the answer differs. So hooks are added to the
clients that Inspect makes for OpenAI, Anthropic, Google and servers with their formats. The hooks note each request and
its answer. Several calls run in one event loop at the same time; a context variable says to which call a request
belongs.
"""

import contextlib
import time
from collections.abc import AsyncGenerator, Callable, Generator
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import httpx2
from inspect_ai._util.http_defaults_httpx2 import default_client_kwargs

from vigil.base.json_files import is_object
from vigil.runner.models.answers import Wire
from vigil.runner.models.redaction import without_login


@dataclass(slots=True)
class Exchange:
    """One HTTP request with the part of its answer that has arrived."""

    wire: Wire
    address: str = ""
    """Address of the request, without login and query."""
    status: int | None = None
    """HTTP status; None until the answer begins."""
    body: bytearray = field(default_factory=bytearray)
    """Decompressed body, as far as it has arrived."""
    started: float = field(default_factory=time.monotonic)
    """Time of the request by the monotonic clock, in seconds."""


_exchanges: ContextVar[list[Exchange] | None] = ContextVar("vigil_exchanges", default=None)
_KEY = "vigil_exchange"


@contextlib.contextmanager
def capture_exchanges(api: Any) -> Generator[list[Exchange], None, None]:
    """Yield a list to which the exchanges of one call of Inspect's model `api` are added, in order.

    The list stays empty when the provider's client cannot have hooks, or does not use one of the four formats. Requests
    that do not ask for a message, such as Anthropic's count of tokens, are left out.
    """
    _hook_client(getattr(getattr(api, "client", None), "_client", None))
    if type(api).__name__ == "GoogleGenAIAPI" and "model_client" not in vars(api):
        clients = _GoogleClients(api)
        api.model_client, api.aclose = clients.model_client, clients.aclose
    exchanges: list[Exchange] = []
    token = _exchanges.set(exchanges)
    try:
        yield exchanges
    finally:
        _exchanges.reset(token)


def _hook_client(client: Any) -> None:
    hooks = getattr(client, "event_hooks", None)
    if is_object(hooks) and _note_request not in hooks["request"]:
        hooks["request"].append(_note_request)
        hooks["response"].insert(0, _note_answer)


class _GoogleClients:
    """Maker of the Google clients that Inspect uses, one client for each call. Their HTTP client has hooks.

    By default, Google's library uses another HTTP library, which cannot have hooks. The clients share connections.
    """

    def __init__(self, api: Any) -> None:
        self._make, self._close = api.model_client, api.aclose
        self._settings = default_client_kwargs()

    def model_client(self, http_options: Any = None) -> Any:
        """Return a client. The method replaces Inspect's method `model_client`."""
        if http_options is not None and http_options.httpx_async_client is None:
            http_options.httpx_async_client = httpx2.AsyncClient(**self._settings)
            _hook_client(http_options.httpx_async_client)
        return self._make(http_options)

    async def aclose(self) -> None:
        """Close the shared connections, and everything that Inspect itself would close."""
        await httpx2.AsyncClient(**self._settings).aclose()
        await self._close()


def wire_of(path: str) -> Wire | None:
    """Return the format of answers to a request, found from the path of its address; None if it is unknown."""
    path = path.rstrip("/")
    if path.endswith("/chat/completions"):
        return "chat"
    if path.endswith("/responses") or path.rpartition("/")[0].endswith("/responses"):
        return "responses"
    if path.endswith(("/messages", "/invoke", ":rawPredict", ":streamRawPredict")):
        return "anthropic"
    return "google" if path.endswith((":generateContent", ":streamGenerateContent")) else None


async def _note_request(request: Any) -> None:
    exchanges, wire = _exchanges.get(), wire_of(request.url.path)
    if exchanges is not None and wire is not None:
        exchange = Exchange(wire, without_login(str(request.url)))
        exchanges.append(exchange)
        request.extensions[_KEY] = exchange


async def _note_answer(response: Any) -> None:
    exchange = response.request.extensions.get(_KEY)
    if isinstance(exchange, Exchange):
        exchange.status = response.status_code
        response.aiter_bytes = _copying(response.aiter_bytes, exchange)


_Read = Callable[[int | None], AsyncGenerator[bytes]]


def _copying(read: _Read, exchange: Exchange) -> Callable[..., AsyncGenerator[bytes]]:
    """Return a function that replaces `read`, which reads the decompressed bytes of a response.

    When the returned function is first used, it also copies the bytes to `exchange`.
    """
    is_read = False

    async def aiter_bytes(chunk_size: int | None = None) -> AsyncGenerator[bytes]:
        nonlocal is_read
        is_first, is_read = not is_read, True
        async with contextlib.aclosing(read(chunk_size)) as chunks:
            async for chunk in chunks:
                if is_first:
                    exchange.body += chunk
                yield chunk

    return aiter_bytes
